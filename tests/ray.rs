//! Rays: against the rasterizer, against closed forms, and against themselves.

use glam::{DVec3, Vec3, Vec4};
use sinew::image::Image;
use sinew::math::simd::Isa;
use sinew::mesh::{Mesh, MeshData};
use sinew::render::ray::{Progress, RaySettings, Tracer, undisturbed};
use sinew::render::{Painter, Renderer, Settings, Window};
use sinew::scene::{Camera, Geometry, Light, LightKind, Material, Object, Projection, Scene, Shape, Style};
use std::ops::ControlFlow;

const SETTINGS: Settings = Settings { width: 96, height: 64, samples: 1, threads: 1 };

/// A box around the origin, seen from the inside.
fn room(side: f32) -> Mesh {
    let at = |k: usize| Vec3::from_array([0, 1, 2].map(|a| if k >> a & 1 == 1 { side } else { -side }));
    let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Mesh::new(MeshData { positions: (0..8).map(at).collect(), triangles, ..Default::default() }).unwrap()
}

fn object(mesh: &Mesh) -> Object<'_> {
    Object {
        mesh,
        positions: &mesh.positions,
        normals: &[],
        tangents: &[],
        labels: &[],
        material: 0,
        mirrored: false,
    }
}

fn camera(eye: Vec3, target: Vec3) -> Camera {
    Camera::look_at(eye, target, Vec3::Y, Projection::Perspective { fov_y: 1.1 }).unwrap()
}

fn scene<'a>(
    camera: Camera,
    objects: Vec<Object<'a>>,
    shapes: &'a [Shape],
    materials: &'a [Material],
) -> Scene<'a> {
    Scene {
        camera,
        ambient: Vec3::ONE,
        lights: vec![],
        style: Style::default(),
        background: [0.0, 0.0, 0.0, 1.0],
        objects,
        shapes,
        materials,
        textures: &[],
    }
}

fn matt(gray: f32) -> Material {
    Material {
        diffuse: Vec3::splat(gray).extend(1.0),
        specular: Vec3::ZERO,
        double_sided: true,
        ..Default::default()
    }
}

fn lamp(position: Vec3) -> Light {
    Light::new(LightKind::Point { position, falloff: None }, Vec3::ONE)
}

fn trace(scene: &Scene, ray: &RaySettings, threads: usize, isa: Isa) -> Image {
    let (mut out, settings) = (Image::default(), Settings { threads, ..SETTINGS });
    Tracer::with_isa(isa).draw_linear(scene, &settings, ray, None, &mut undisturbed, &mut out);
    out
}

#[test]
fn a_white_room_of_mirrors_has_no_seams_from_a_millimetre_to_ten_kilometres() {
    let material = [Material { mirror: Vec3::splat(0.5), ..matt(0.5) }];
    for side in [1e-3, 0.3, 1.0, 77.7, 1e4] {
        let mesh = room(side);
        let camera = camera(Vec3::new(0.31, 0.17, 0.23) * side, Vec3::new(-0.7, -0.5, -0.2) * side);
        let scene = scene(camera, vec![object(&mesh)], &[], &material);
        // ½ of the light at each of 1 + 20 walls.
        let ray = RaySettings { depth: 20, cutoff: 0.0, ..Default::default() };
        let picture = trace(&scene, &ray, 1, Isa::Best);
        let want = 1.0 - 0.5f32.powi(21);
        let off = picture.pixels.iter().filter(|p| p[..3].iter().any(|c| (c - want).abs() > 1e-6)).count();
        assert_eq!(off, 0, "{side} m");
    }
}

#[test]
fn nothing_shadows_itself_and_no_light_leaks_at_any_scale() {
    let material = [matt(0.8)];
    for side in [1e-3, 0.05, 1.0, 40.0, 1e4] {
        let mesh = room(side);
        let camera = camera(Vec3::new(0.31, 0.17, 0.23) * side, Vec3::new(-0.7, -0.9, -0.8) * side);
        let mut scene = scene(camera, vec![object(&mesh)], &[], &material);
        scene.ambient = Vec3::ZERO;
        scene.lights = vec![lamp(Vec3::new(0.1, 0.6, -0.3) * side)];
        let lit = trace(&scene, &RaySettings::default(), 1, Isa::Best);
        let free = trace(&scene, &RaySettings { shadows: false, ..Default::default() }, 1, Isa::Best);
        assert!(lit == free, "{side} m");
        assert!(lit.pixels.iter().all(|p| p[0] > 0.0), "{side} m");
        // And from beyond the wall nothing gets in.
        scene.lights = vec![lamp(Vec3::new(0.0, 1.001, 0.0) * side), lamp(Vec3::new(-3.0, 2.0, 9.0) * side)];
        let dark = trace(&scene, &RaySettings::default(), 1, Isa::Best);
        assert!(dark.pixels.iter().all(|p| p[0] == 0.0), "{side} m");
    }
}

/// A glass ball before a wall that is red above and green below, seen straight on.
fn ball(shapes: &mut Vec<Shape>, materials: &mut Vec<Material>) {
    let glass = Material { transmission: Vec3::ONE, ..matt(0.0) };
    let paint = |c: Vec4| Material { diffuse: c, unlit: true, ..matt(0.0) };
    *materials = vec![glass, paint(Vec4::new(1.0, 0.0, 0.0, 1.0)), paint(Vec4::new(0.0, 1.0, 0.0, 1.0))];
    let half = |up: f64| {
        Geometry::Triangle([
            DVec3::new(-90.0, 0.0, -4.0),
            DVec3::new(90.0, 0.0, -4.0),
            DVec3::new(0.0, 90.0 * up, -4.0),
        ])
    };
    let sphere = Geometry::Sphere { center: DVec3::ZERO, radius: 1.0 };
    let shape = |geometry, material| Shape { geometry, material };
    *shapes = vec![shape(sphere, 0), shape(half(1.0), 1), shape(half(-1.0), 2)];
}

#[test]
fn a_glass_ball_turns_what_is_behind_it_upside_down() {
    let (mut shapes, mut materials) = (vec![], vec![]);
    ball(&mut shapes, &mut materials);
    let scene = scene(camera(Vec3::Z * 4.0, Vec3::ZERO), vec![], &shapes, &materials);
    let picture = trace(&scene, &RaySettings::default(), 1, Isa::Best);
    let at = |x: usize, y: usize| picture.pixels[y * 96 + x];
    // The ball's silhouette has a radius of 64/2/tan(0.55)/√15 = 13.5 pixels.
    for dy in [2, 5, 8] {
        let (above, below) = (at(48, 31 - dy), at(48, 32 + dy));
        assert!(above[1] > 0.8 && above[0] < 0.1, "{dy}: {above:?}");
        assert!(below[0] > 0.8 && below[1] < 0.1, "{dy}: {below:?}");
    }
    assert!(at(48, 10) == [1.0, 0.0, 0.0, 1.0] && at(48, 55) == [0.0, 1.0, 0.0, 1.0]);
}

#[test]
fn a_mirror_shows_what_stands_before_it() {
    let paint = |c: Vec3| Material { diffuse: c.extend(1.0), unlit: true, ..matt(0.0) };
    let materials = [Material { mirror: Vec3::splat(0.5), ..matt(0.0) }, paint(Vec3::X)];
    let floor = Geometry::Plane { point: DVec3::ZERO, normal: DVec3::Y };
    let sphere = Geometry::Sphere { center: DVec3::Y, radius: 0.5 };
    let shapes = [Shape { geometry: floor, material: 0 }, Shape { geometry: sphere, material: 1 }];
    let scene = scene(camera(Vec3::new(0.0, 1.0, 4.0), Vec3::Y * 0.2), vec![], &shapes, &materials);
    let picture = trace(&scene, &RaySettings::default(), 1, Isa::Best);
    let place = |p: Vec3| {
        let c = scene.camera.clip_from_scene(1.5) * p.extend(1.0);
        let [x, y] = [0.5 + 0.5 * c.x / c.w, 0.5 - 0.5 * c.y / c.w];
        picture.pixels[(y * 64.0) as usize * 96 + (x * 96.0) as usize]
    };
    assert_eq!(place(Vec3::Y), [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(place(Vec3::NEG_Y), [0.5, 0.0, 0.0, 1.0]);
}

/// Everything at once: a ball of glass and a soft lamp in a room.
fn zoo<'a>(mesh: &'a Mesh, shapes: &'a [Shape], materials: &'a [Material]) -> Scene<'a> {
    let mut scene =
        scene(camera(Vec3::new(1.2, 0.7, 2.2), Vec3::Y * -0.5), vec![object(mesh)], shapes, materials);
    scene.ambient = Vec3::splat(0.1);
    scene.lights = vec![Light { radius: 0.5, ..lamp(Vec3::new(1.0, 2.0, 1.0)) }];
    scene
}

fn zoo_parts() -> (Mesh, [Shape; 2], [Material; 3]) {
    let shape =
        |at: DVec3, radius, material| Shape { geometry: Geometry::Sphere { center: at, radius }, material };
    let shapes = [shape(DVec3::new(0.6, -1.0, 0.0), 0.8, 1), shape(DVec3::new(-0.9, -1.6, 0.4), 0.6, 2)];
    let glass = Material { transmission: Vec3::splat(0.9), ..matt(0.0) };
    let metal = Material { mirror: Vec3::splat(0.6), specular: Vec3::splat(0.4), ..matt(0.2) };
    (room(2.5), shapes, [matt(0.7), glass, metal])
}

#[test]
fn neither_threads_nor_vectors_nor_windows_change_a_picture() {
    let (mesh, shapes, materials) = zoo_parts();
    let scene = zoo(&mesh, &shapes, &materials);
    let ray = RaySettings { samples: 24, error: Some(0.01), ..Default::default() };
    let one = trace(&scene, &ray, 1, Isa::Best);
    assert!(trace(&scene, &ray, 2, Isa::Best) == one);
    assert!(trace(&scene, &ray, 3, Isa::Portable) == one);
    let mut tracer = Tracer::default();
    let window = Window { x: 20, y: 11, width: 50, height: 40 };
    tracer.set_window(Some(window));
    let mut part = Image::default();
    tracer.draw_linear(&scene, &SETTINGS, &ray, None, &mut undisturbed, &mut part);
    for (i, p) in part.pixels.iter().enumerate() {
        assert_eq!(*p, one.pixels[(window.y + i / 50) * 96 + window.x + i % 50]);
    }
}

/// Root of the mean square difference.
fn distance(a: &Image, b: &Image) -> f64 {
    let square = |(p, q): (&[f32; 4], &[f32; 4])| (0..3).map(|c| f64::from(p[c] - q[c]).powi(2)).sum::<f64>();
    (a.pixels.iter().zip(&b.pixels).map(square).sum::<f64>() / a.pixels.len() as f64).sqrt()
}

#[test]
fn noise_falls_with_the_number_of_samples_and_adaptive_pictures_are_as_good_as_they_say() {
    let (mesh, shapes, materials) = zoo_parts();
    let scene = zoo(&mesh, &shapes, &materials);
    let draw = |samples: u32, seed: u32, error: Option<f64>| {
        let mut out = Image::default();
        let settings = Settings { width: 24, height: 16, ..SETTINGS };
        let ray = RaySettings { samples, seed, error, ..Default::default() };
        let outcome =
            Tracer::default().draw_linear(&scene, &settings, &ray, None, &mut undisturbed, &mut out);
        (out, outcome)
    };
    let (truth, full) = draw(4096, 77, None);
    let counts = [1u32, 2, 4, 6, 8];
    let points = counts.map(|k| {
        let n = 1 << k;
        let mean = (0..4).map(|seed| distance(&draw(n, seed, None).0, &truth)).sum::<f64>() / 4.0;
        (f64::from(k), mean.log2())
    });
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    assert!(slope < -0.45, "{slope} {points:?}");

    let (picture, adaptive) = draw(4096, 1, Some(0.01));
    assert!(adaptive.count.primary < full.count.primary / 10, "{adaptive:?}");
    let error = distance(&picture, &truth) / 3f64.sqrt();
    assert!(error < 0.01, "{error}");
}

#[test]
fn whoever_watches_can_stop_a_picture_after_any_pass() {
    let (mesh, shapes, materials) = zoo_parts();
    let scene = zoo(&mesh, &shapes, &materials);
    let mut calls = 0;
    let mut watch = |p: &Progress| {
        calls += 1;
        if p.samples >= 4 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut out = Image::default();
    let ray = RaySettings { samples: 64, ..Default::default() };
    let outcome = Tracer::default().draw_linear(&scene, &SETTINGS, &ray, None, &mut watch, &mut out);
    // Passes of 1, 1 and 2 samples on 3 × 2 tiles, and one tile of the next.
    assert_eq!((outcome.samples, calls), (4, 19));
    assert!(out.pixels.iter().all(|p| p[3] == 1.0));
}

#[test]
fn a_hybrid_picture_is_the_one_by_rays() {
    let (mesh, shapes, materials) = zoo_parts();
    let scene = zoo(&mesh, &shapes, &materials);
    let draw = |renderer: Renderer| {
        let mut out = Image::default();
        let mut painter = Painter::default();
        painter.renderer = renderer;
        painter.draw_linear(&scene, &SETTINGS, &mut out);
        out
    };
    let (pure, hybrid) =
        (draw(Renderer::Ray(RaySettings::default())), draw(Renderer::Hybrid(RaySettings::default())));
    let off = pure
        .pixels
        .iter()
        .zip(&hybrid.pixels)
        .filter(|(p, q)| (0..3).any(|c| (p[c] - q[c]).abs() > 1e-5))
        .count();
    // Along the edges of the room the rasterizer sees the wall next door.
    assert!(off < 20, "{off}");
}

#[cfg(all(feature = "io", feature = "pictures"))]
mod characters {
    use super::*;
    use sinew::frames::{Look, Shot, ShotDesc, View, Worker};
    use sinew::io::{self, Import, Options};
    use sinew::render::channel::{Channel, Channels};
    use std::path::PathBuf;

    /// What a renderer makes of one moment.
    fn draw(import: &Import, clip: Option<usize>, time: f64, renderer: Renderer) -> (Image, Channels) {
        let settings = Settings { width: 160, height: 120, ..SETTINGS };
        let view = View::Orbit { yaw: 0.5, pitch: 0.2, fov_y: 0.5 };
        let look = Look { background: [0.2, 0.3, 0.4, 1.0], ..Default::default() };
        let desc = ShotDesc { clip, view, look, settings, renderer, ..Default::default() };
        let shot = Shot::new(&import.asset, desc).unwrap();
        let (mut worker, mut picture, mut seen) = (Worker::default(), Image::default(), Channels::default());
        shot.draw_linear(time, &mut worker, &mut picture);
        shot.draw_channels(time, &mut worker, &Channel::ALL, &mut seen);
        (picture, seen)
    }

    #[test]
    fn every_character_looks_the_same_by_both_renderers() {
        let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("rigs");
        let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
        files.retain(|f| f.extension().is_some_and(|e| e == "json"));
        files.sort();
        assert!(files.len() >= 6);
        for file in &files {
            let import = io::import(file, &Options { textures: true }).unwrap();
            for (clip, time) in [(None, 0.0), (Some(0), 0.3), (Some(0), 0.9)] {
                let what = format!("{}, {clip:?}, {time} s", file.display());
                let rays = Renderer::Ray(RaySettings { shadows: false, ..Default::default() });
                let by = |renderer| draw(&import, clip, time, renderer);
                let raster = by(Renderer::Raster);
                compare(&what, &raster, &by(rays), 2);
                // Where both see the same triangles there are no exceptions.
                let seen = Renderer::Hybrid(RaySettings { shadows: false, ..Default::default() });
                compare(&what, &raster, &by(seen), 0);
            }
        }
    }

    /// Pixels around one.
    fn around(i: usize, w: usize) -> impl Iterator<Item = usize> {
        [0, w, 2 * w].into_iter().flat_map(move |row| (0..3).map(move |k| (i + row + k).wrapping_sub(w + 1)))
    }

    /// Off silhouettes, where a pixel's neighbours are something else or lie apart, pictures are the same to one code, depths to 1e-4.
    /// The rasterizer snaps corners to 1/256 pixel, so that beside an edge it may see the neighbour of the triangle that a ray meets, with
    /// another mip level: `most` pixels may.
    fn compare(what: &str, a: &(Image, Channels), b: &(Image, Channels), most: usize) {
        let apart = |c: &Channels, i: usize, j: usize| {
            let z = c.depth[i];
            j >= c.objects.len() || c.objects[j] != c.objects[i] || (c.depth[j] - z).abs() > 0.01 * z
        };
        let edge = |i: usize| around(i, a.1.width).any(|j| apart(&a.1, i, j));
        let (mut compared, mut slivers) = (0, 0);
        for i in (0..a.1.objects.len()).filter(|&i| !edge(i)) {
            compared += usize::from(a.1.objects[i] > 0);
            let (z, y) = (a.1.depth[i], b.1.depth[i]);
            assert_eq!(a.1.objects[i], b.1.objects[i], "{what}: object of pixel {i}");
            assert_eq!(a.1.labels[i], b.1.labels[i], "{what}: label of pixel {i}");
            assert!(z == y || (z - y).abs() < 1e-4 * z, "{what}: pixel {i} is {z} and {y} away");
            let (p, q) = (a.0.pixels[i], b.0.pixels[i]);
            slivers += usize::from((0..4).any(|c| (p[c] - q[c]).abs() > 1.0 / 255.0));
        }
        assert!(slivers <= most, "{what}: {slivers} pixels differ, expected {most} at most");
        assert!(compared > 300, "{what}: {compared} pixels");
    }
}
