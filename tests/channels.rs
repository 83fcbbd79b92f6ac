//! Objects, distances and normals: where a picture is covered, and what is known in closed form.

use glam::{DMat3, Vec3};
use sinew::math::simd::Isa;
use sinew::mesh::{Mesh, MeshData};
use sinew::render::Settings;
use sinew::render::channel::{Channel, Channels};
use sinew::render::raster::Rasterizer;
use sinew::scene::{Camera, Material, Object, Projection, Scene};

/// A square of side 2 whose normal is +z, turned by `turn` about +y and moved.
fn square(turn: f64, at: Vec3) -> Mesh {
    let m = DMat3::from_rotation_y(turn).as_mat3();
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let positions = corners.map(|[x, y]| m * Vec3::new(x, y, 0.0) + at).to_vec();
    Mesh::new(MeshData { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Default::default() }).unwrap()
}

fn draw(meshes: &[Mesh], samples: u8, threads: usize, isa: Isa) -> Channels {
    let projection = Projection::Orthographic { height: 4.0 };
    let camera = Camera::look_at(Vec3::Z * 10.0, Vec3::ZERO, Vec3::Y, projection).unwrap();
    let object = |mesh| Object {
        mesh,
        positions: &mesh.positions,
        normals: &[],
        tangents: &[],
        material: 0,
        mirrored: false,
        labels: &[],
    };
    let scene = Scene {
        camera,
        ambient: Vec3::ONE,
        lights: vec![],
        style: Default::default(),
        background: [0.0; 4],
        objects: meshes.iter().map(object).collect(),
        shapes: &[],
        materials: &[Material::default()],
        textures: &[],
    };
    let settings = Settings { width: 101, height: 83, samples, threads };
    let mut out = Channels::default();
    Rasterizer::with_isa(isa).draw_channels(&scene, &settings, &Channel::ALL, &mut out);
    out
}

#[test]
fn squares_have_the_normals_and_distances_that_they_must() {
    // One turned to the right, and before its left half one that faces the viewer.
    let turn = 0.5f64;
    let meshes = [square(turn, Vec3::ZERO), square(0.0, Vec3::new(-1.5, 0.0, 3.0))];
    for samples in [1, 4] {
        let seen = draw(&meshes, samples, 1, Isa::default());
        let slanted = Vec3::new(turn.sin() as f32, 0.0, turn.cos() as f32);
        let mut counts = [0; 3];
        for (i, &object) in seen.objects.iter().enumerate() {
            counts[object as usize] += 1;
            let x = ((i % 101) as f32 + 0.5 - 50.5) * 4.0 / 83.0;
            match object {
                0 => assert!(seen.depth[i].is_infinite() && seen.normals[i] == Vec3::ZERO),
                1 => {
                    // z = −x tan(turn) on the slanted square; at an edge the nearest sample is taken.
                    let want = 10.0 + x * (turn.tan() as f32);
                    assert!((seen.depth[i] - want).abs() < 0.02, "{} {want}", seen.depth[i]);
                    assert!((seen.normals[i] - slanted).length() < 1e-4, "{}", seen.normals[i]);
                }
                _ => {
                    assert!((seen.depth[i] - 7.0).abs() < 1e-3, "{}", seen.depth[i]);
                    assert!((seen.normals[i] - Vec3::Z).length() < 1e-5, "{}", seen.normals[i]);
                }
            }
        }
        assert!(counts.iter().all(|c| *c > 500), "{counts:?}");
    }
}

#[test]
fn neither_threads_nor_vectors_change_a_channel() {
    let meshes = [square(0.7, Vec3::ZERO), square(-0.3, Vec3::new(0.4, 0.3, 0.2))];
    let one = draw(&meshes, 4, 1, Isa::default());
    assert!(draw(&meshes, 4, 2, Isa::default()) == one);
    assert!(draw(&meshes, 4, 1, Isa::Portable) == one);
}
