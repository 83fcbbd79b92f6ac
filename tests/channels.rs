//! What pixels show beside colour: where a picture is covered, and what is known in closed form.

use glam::{DMat3, Vec2, Vec3};
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
    let uvs = [corners.map(|[x, y]| Vec2::new(x, y) * 3.0 + 7.0).to_vec(), vec![]];
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    Mesh::new(MeshData { positions, triangles, uvs, ..Default::default() }).unwrap()
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
        labels: &[3, 5, 7, 9],
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
                0 => {
                    assert!(seen.depth[i].is_infinite() && seen.normals[i] == Vec3::ZERO);
                    let rest = (seen.labels[i], seen.positions[i], seen.uvs[i]);
                    assert_eq!(rest, (0, Vec3::ZERO, Vec2::ZERO));
                }
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
fn positions_coordinates_and_labels_are_those_of_one_triangle() {
    let meshes = [square(0.5, Vec3::ZERO), square(0.0, Vec3::new(-1.5, 0.0, 3.0))];
    for samples in [1, 4] {
        let seen = draw(&meshes, samples, 1, Isa::default());
        let mut counts = [0; 10];
        for (i, &object) in seen.objects.iter().enumerate().filter(|o| *o.1 > 0) {
            let (turn, from) = if object == 1 { (0.5, Vec3::ZERO) } else { (0.0, Vec3::new(-1.5, 0.0, 3.0)) };
            let at = DMat3::from_rotation_y(-turn).as_mat3() * (seen.positions[i] - from);
            assert!(at.z.abs() < 1e-5 && at.abs().max_element() < 1.0 + 1e-5, "{at}");
            assert!((seen.uvs[i] - (at.truncate() * 3.0 + 7.0)).length() < 1e-4, "{at} {}", seen.uvs[i]);
            // Within half a pixel of where the ray through its middle goes.
            let place = |n: usize, size: f32| ((n as f32 + 0.5) / size - 0.5) * 4.0 * size / 83.0;
            let ray = Vec2::new(place(i % 101, 101.0), -place(i / 101, 83.0));
            assert!((seen.positions[i].truncate() - ray).abs().max_element() < 0.5 * 4.0 / 83.0);
            // The nearest corner in barycentric coordinates, of the triangles 0 1 2 and 0 2 3.
            let (u, v) = ((at.x + 1.0) / 2.0, (at.y + 1.0) / 2.0);
            let b = if u > v { [1.0 - u, u - v, v, 0.0] } else { [1.0 - v, 0.0, u, v - u] };
            let label = seen.labels[i] as usize;
            let of = b[(label - 3) / 2];
            assert!(b.iter().all(|x| *x <= of + 1e-5), "{label}: {b:?}");
            counts[label] += 1;
        }
        assert!([3, 5, 7, 9].iter().all(|l| counts[*l] > 300), "{counts:?}");
    }
}

#[test]
fn neither_threads_nor_vectors_change_a_channel() {
    let meshes = [square(0.7, Vec3::ZERO), square(-0.3, Vec3::new(0.4, 0.3, 0.2))];
    let one = draw(&meshes, 4, 1, Isa::default());
    assert!(draw(&meshes, 4, 2, Isa::default()) == one);
    assert!(draw(&meshes, 4, 1, Isa::Portable) == one);
}
