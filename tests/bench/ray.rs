//! Boxes and rays, one thread: `cargo bench --bench ray [-- TRIANGLES]`. Build and refit in ms, rays in millions a second.
//!
//! The mesh and the camera are those of the bench `raster`; rays go in tiles of 4×4 pixels. Shadow rays go to a lamp, bounces are
//! spread by the cosine.

use glam::Vec3;
use sinew::render::accel::{Accel, Kind, PACKET, Placed, Ray, Surface, World};
use std::f32::consts::PI;
use std::hint::black_box;
use std::time::Instant;

/// A bumpy sphere of about `n` triangles; `phase` moves the bumps.
fn sphere(n: usize, phase: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let v = (n as f32 / 4.0).sqrt().round() as u32;
    let u = 2 * v;
    let at = |j: u32, i: u32| {
        let (theta, phi) = (PI * j as f32 / v as f32, 2.0 * PI * i as f32 / u as f32);
        let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        let bump = (7.0 * d.x + 1.0 + phase).sin() * (9.0 * d.y).sin() * (8.0 * d.z + 2.0).sin();
        d * (1.0 + 0.12 * bump)
    };
    let positions = (0..=v).flat_map(|j| (0..=u).map(move |i| at(j, i))).collect();
    let corners = (0..v).flat_map(|j| (0..u).map(move |i| j * (u + 1) + i));
    (positions, corners.flat_map(|a| [[a, a + 1, a + u + 1], [a + 1, a + u + 2, a + u + 1]]).collect())
}

/// Median ms of several runs.
fn time(runs: usize, mut work: impl FnMut()) -> f64 {
    let mut one = || {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64() * 1e3
    };
    let mut all: Vec<f64> = (0..runs).map(|_| one()).collect();
    all.sort_by(f64::total_cmp);
    all[runs / 2]
}

fn primary() -> Vec<Ray<f32>> {
    let (w, h, k) = (1920, 1080, 25f32.to_radians().tan());
    let tiles = (0..h / 4).flat_map(|y| (0..w / 4).map(move |x| (4 * x, 4 * y)));
    let pixels = tiles.flat_map(|(x, y)| (0..16).map(move |i| (x + i % 4, y + i / 4)));
    let ray = |(x, y): (usize, usize)| {
        let (x, y) = ((x as f32 + 0.5) / w as f32 * 2.0 - 1.0, 1.0 - (y as f32 + 0.5) / h as f32 * 2.0);
        let direction = [x * k * w as f32 / h as f32, y * k, -1.0];
        Ray { origin: [0.0, 0.0, 2.9], direction, t_min: 0.0, t_max: f32::INFINITY }
    };
    pixels.map(ray).collect()
}

/// From where rays hit: to a lamp, and anywhere.
fn secondary(world: &World, primary: &[Ray<f32>], p: &[Vec3], t: &[[u32; 3]]) -> [Vec<Ray<f32>>; 2] {
    let mut seed = 1u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1u64 << 24) as f32
    };
    let (mut shadow, mut bounce) = (Vec::new(), Vec::new());
    for r in primary {
        let Some(hit) = world.nearest(r, |_| true) else { continue };
        let [a, b, c] = t[hit.triangle as usize].map(|i| p[i as usize]);
        let d = Vec3::from(r.direction);
        let n = (b - a).cross(c - a).normalize();
        let n = if n.dot(d) > 0.0 { -n } else { n };
        let from = Vec3::from(r.origin) + d * hit.t + n * 1e-4;
        let ray = |d: Vec3, t_max| Ray { origin: from.into(), direction: d.into(), t_min: 0.0, t_max };
        let (u, phi) = (random(), 2.0 * PI * random());
        let (x, y) = n.any_orthonormal_pair();
        let d = (x * phi.cos() + y * phi.sin()) * u.sqrt() + n * (1.0 - u).sqrt();
        shadow.push(ray(Vec3::new(3.0, 5.0, 4.0) - from, 1.0));
        bounce.push(ray(d, f32::INFINITY));
    }
    [shadow, bounce]
}

fn main() {
    let asked: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let sizes = if asked.is_empty() { vec![10_000, 100_000, 1_000_000] } else { asked };
    println!("triangles  kind      build    refit  primary   shadow   packet   bounce");
    let primary = primary();
    for n in sizes {
        let ((p, t), (moved, _)) = (sphere(n, 0.0), sphere(n, 0.05));
        for kind in [Kind::Tree, Kind::Octree, Kind::Grid] {
            let build = time(3, || _ = black_box(Accel::new(kind, &p, &t, 1)));
            let mut accel = Accel::new(kind, &p, &t, 1);
            let mut odd = false;
            let refit = time(9, || {
                odd = !odd;
                accel.update(if odd { &moved } else { &p }, 1);
            });
            let world =
                World::new(kind, &[Surface { positions: &p, triangles: &t }], &[Placed::default()], 1);
            let [shadow, bounce] = secondary(&world, &primary, &p, &t);
            let rate = |rays: &[Ray<f32>], ms: f64| rays.len() as f64 / ms / 1e3;
            let nearest = |rays: &[Ray<f32>]| {
                rate(rays, time(3, || rays.iter().for_each(|r| _ = black_box(world.nearest(r, |_| true)))))
            };
            let (first, spread) = (nearest(&primary), nearest(&bounce));
            let single = time(3, || shadow.iter().for_each(|r| _ = black_box(world.blocked(r, |_| true))));
            let packets = shadow.chunks(PACKET);
            let packet =
                time(3, || packets.clone().for_each(|r| _ = black_box(world.blocked_packet(r, |_, _| true))));
            let (single, packet) = (rate(&shadow, single), rate(&shadow, packet));
            println!(
                "{n:9}  {:6} {build:8.1} {refit:8.3} {first:8.2} {single:8.2} {packet:8.2} {spread:8.2}",
                format!("{kind:?}")
            );
        }
    }
}
