//! Milliseconds of processor time a picture of a Blinn-Phong sphere, one thread: `cargo bench --bench raster`, or one row of it,
//! `cargo bench --bench raster -- TRIANGLES WIDTH SAMPLES [ROUNDS]`.

use glam::Vec3;
use nix::time::{ClockId, clock_gettime};
use sinew::image::Rgba8;
use sinew::mesh::{Mesh, MeshData};
use sinew::render::{Settings, raster::Rasterizer};
use sinew::scene::{Camera, Light, LightKind, Material, Object, Projection, Scene, Style};
use std::f32::consts::PI;

/// A bumpy sphere of about `n` triangles, with a sphere's normals.
fn sphere(n: usize) -> Mesh {
    let v = (n as f32 / 4.0).sqrt().round() as u32;
    let u = 2 * v;
    let mut data = MeshData::default();
    for j in 0..=v {
        for i in 0..=u {
            let (theta, phi) = (PI * j as f32 / v as f32, 2.0 * PI * i as f32 / u as f32);
            let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let bump = (7.0 * d.x + 1.0).sin() * (9.0 * d.y).sin() * (8.0 * d.z + 2.0).sin();
            data.positions.push(d * (1.0 + 0.12 * bump));
            data.normals.push(d);
        }
    }
    for a in (0..v).flat_map(|j| (0..u).map(move |i| j * (u + 1) + i)) {
        data.triangles.extend([[a, a + 1, a + u + 1], [a + 1, a + u + 2, a + u + 1]]);
    }
    Mesh::new(data).expect("a sphere is a mesh")
}

/// Processor milliseconds of this thread.
fn cpu() -> f64 {
    let t = clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).expect("the system counts");
    t.tv_sec() as f64 * 1e3 + t.tv_nsec() as f64 * 1e-6
}

fn main() {
    let only: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let wanted = |k: usize, x: usize| only.get(k).is_none_or(|&o| o == x);
    let rounds = only.get(3).copied().unwrap_or(25);
    let material = [Material {
        diffuse: Vec3::new(0.8, 0.5, 0.3).extend(1.0),
        specular: Vec3::splat(0.5),
        ..Default::default()
    }];
    let projection = Projection::Perspective { fov_y: 50f32.to_radians() };
    let mut rasterizer = Rasterizer::default();
    println!("triangles    picture  samples  median     least");
    for n in [10_000, 100_000, 1_000_000].into_iter().filter(|&n| wanted(0, n)) {
        let mesh = sphere(n);
        let camera = Camera::look_at(Vec3::Z * 2.9, Vec3::ZERO, Vec3::Y, projection).expect("it looks ahead");
        let object = Object {
            mesh: &mesh,
            positions: &mesh.positions,
            normals: &mesh.normals,
            tangents: &[],
            material: 0,
            mirrored: false,
            labels: &[],
        };
        let light =
            Light::new(LightKind::Point { position: Vec3::new(3.0, 5.0, 4.0), falloff: None }, Vec3::ONE);
        let scene = Scene {
            camera,
            ambient: Vec3::splat(0.05),
            lights: vec![light],
            style: Style::default(),
            background: [0.0; 4],
            objects: vec![object],
            shapes: &[],
            materials: &material,
            textures: &[],
        };
        for (width, height) in [(512, 512), (1920, 1080)].into_iter().filter(|s| wanted(1, s.0)) {
            for samples in [1, 4].into_iter().filter(|&s| wanted(2, usize::from(s))) {
                let settings = Settings { width, height, samples, threads: 1 };
                let mut picture = Rgba8::default();
                rasterizer.draw(&scene, &settings, &mut picture);
                let mut times: Vec<f64> = (0..rounds)
                    .map(|_| {
                        let start = cpu();
                        rasterizer.draw(&scene, &settings, &mut picture);
                        cpu() - start
                    })
                    .collect();
                times.sort_by(f64::total_cmp);
                println!(
                    "{n:9}  {width:4}×{height:<4}  {samples:7}  {:6.2}  {:8.2}",
                    times[rounds / 2],
                    times[0]
                );
            }
        }
    }
}
