//! What colour it is.

use super::*;
use glam::{Affine2, DVec3};
use sinew::scene::{Content, Filter, LightKind, TextureId, TextureRef, WrapMode};
use std::f32::consts::PI;

fn point(position: Vec3, falloff: Option<f32>) -> Light {
    Light::new(LightKind::Point { position, falloff }, Vec3::ONE)
}

/// A lit square seen from two metres; the middle pixel of three shows the origin.
fn plate(lights: Vec<Light>) -> Stage {
    let plate = Material {
        diffuse: Vec4::new(0.5, 0.25, 0.125, 1.0),
        specular: Vec3::splat(0.5),
        shininess: 8.0,
        ..Default::default()
    };
    let camera = perspective(Vec3::Z * 2.0, Vec3::ZERO, 0.3);
    let mut stage = Stage::of(camera, Mesh::new(quad(1.0, 0.0)).unwrap(), plate);
    (stage.ambient, stage.lights) = (Vec3::splat(0.1), lights);
    stage
}

fn middle(stage: &Stage) -> [f32; 4] {
    let (picture, stats) = stage.linear(3, 1);
    assert_eq!((stats.samples, stats.shaded), (9, 9));
    picture.pixels[4]
}

fn near(found: [f32; 4], want: [f64; 4]) {
    for c in 0..4 {
        assert!((found[c] as f64 - want[c]).abs() < 2e-6, "{found:?} {want:?}");
    }
}

#[test]
fn a_lit_plane_has_the_values_of_the_formula() {
    // Light from 45°: n·l = cos 45°, n·h = cos 22.5°.
    let (diffuse, specular) = (0.5f64.sqrt(), 0.5 * 22.5f64.to_radians().cos().powi(8));
    let want = |gain: f64| {
        let c = |k: f64| 0.1 * k + gain * (k * diffuse + specular);
        [c(0.5), c(0.25), c(0.125), 1.0]
    };
    near(middle(&plate(vec![point(Vec3::new(1.0, 0.0, 1.0), None)])), want(1.0));
    let direction = Vec3::new(-1.0, 0.0, -1.0).normalize();
    let sun = Light::new(LightKind::Directional { direction }, Vec3::ONE);
    near(middle(&plate(vec![sun])), want(1.0));
    near(middle(&plate(vec![sun, sun])), {
        let (one, none) = (want(1.0), want(0.0));
        [0, 1, 2, 3].map(|c| if c == 3 { 1.0 } else { 2.0 * one[c] - none[c] })
    });

    // 1/d² at d² = 2, faded out towards a range of 2 m: 1 − (2/4)² = 3/4.
    near(middle(&plate(vec![point(Vec3::new(1.0, 0.0, 1.0), Some(2.0))])), want(0.5 * 0.75));

    // A spot whose axis is 45° off: half of the way from outer to inner, squared.
    let cos = 0.5f32.sqrt();
    let kind = LightKind::Spot {
        position: Vec3::new(1.0, 0.0, 1.0),
        direction: Vec3::NEG_Z,
        falloff: None,
        cos_inner: cos + 0.1,
        cos_outer: cos - 0.1,
    };
    near(middle(&plate(vec![Light::new(kind, Vec3::ONE)])), want(0.25));
}

#[test]
fn light_from_behind_makes_no_highlight() {
    near(middle(&plate(vec![point(Vec3::new(0.0, 0.0, -1.0), None)])), [0.05, 0.025, 0.0125, 1.0]);
}

#[test]
fn the_back_of_a_double_sided_surface_is_lit_from_its_own_side() {
    let mut stage = plate(vec![point(Vec3::new(1.0, 0.0, 1.0), None)]);
    let front = middle(&stage);
    stage.materials[0].double_sided = true;
    assert_eq!(middle(&stage), front);
    let mut data = quad(1.0, 0.0);
    data.triangles = vec![[0, 2, 1], [0, 3, 2]];
    data.normals = vec![Vec3::NEG_Z; 4];
    stage.meshes[0].0 = Mesh::new(data).unwrap();
    assert_eq!(middle(&stage), front);
}

#[test]
fn a_plate_with_a_spheres_normals_shades_like_the_sphere() {
    const CELLS: usize = 48;
    let mut data = MeshData::default();
    let at = |i: usize| i as f32 / CELLS as f32 * 1.2 - 0.6;
    for j in 0..=CELLS {
        for i in 0..=CELLS {
            let (x, y) = (at(i), at(j));
            data.positions.push(Vec3::new(x, y, 0.0));
            data.normals.push(Vec3::new(x, y, (1.0 - x * x - y * y).sqrt()));
        }
    }
    for a in (0..CELLS).flat_map(|j| (0..CELLS).map(move |i| (j * (CELLS + 1) + i) as u32)) {
        let b = a + CELLS as u32 + 1;
        data.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    let direction = -DVec3::new(0.5, 0.7, 0.6).normalize();
    let mut stage = Stage::of(from_front(5.0, 1.2), Mesh::new(data).unwrap(), Material::default());
    stage.materials[0].specular = Vec3::splat(0.5);
    stage.lights = vec![Light::new(LightKind::Directional { direction: direction.as_vec3() }, Vec3::ONE)];
    let (picture, _) = stage.linear(200, 1);
    for (k, p) in picture.pixels.iter().enumerate() {
        let at = |i: usize| (i as f64 + 0.5) / 200.0 * 1.2 - 0.6;
        let (x, y) = (at(k % 200), -at(k / 200));
        let n = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
        let (n_l, n_h) = (n.dot(-direction), n.dot((DVec3::Z - direction).normalize()));
        let want = if n_l > 0.0 { 0.8f32 as f64 * n_l + 0.5 * n_h.max(0.0).powi(32) } else { 0.0 };
        assert!((p[0] as f64 - want).abs() < 1.0 / 255.0, "{x} {y}: {p:?} {want}");
    }
}

#[test]
fn emission_and_faces_without_normals() {
    let mut stage = plate(vec![]);
    stage.materials[0].emissive = Vec3::new(0.0, 2.0, 0.0);
    near(middle(&stage), [0.05, 2.025, 0.0125, 1.0]);
}

#[test]
fn what_blends_goes_over_what_lies_behind_in_linear_light() {
    // Red behind, half of green before it, a quarter of blue before that; listed in the wrong order.
    let mut stage = Stage::of(
        from_front(5.0, 2.0),
        Mesh::new(quad(1.0, 0.0)).unwrap(),
        material(Vec4::new(1.0, 0.0, 0.0, 1.0)),
    );
    stage.materials.push(blending(Vec3::Z, 0.25));
    stage.materials.push(blending(Vec3::Y, 0.5));
    stage.meshes.push((Mesh::new(quad(1.0, 2.0)).unwrap(), 1));
    stage.meshes.push((Mesh::new(quad(1.0, 1.0)).unwrap(), 2));
    stage.meshes.push((Mesh::new(quad(1.0, -1.0)).unwrap(), 2));
    for samples in [1, 4] {
        let (picture, stats) = stage.linear(16, samples);
        assert!(picture.pixels.iter().all(|p| *p == [0.375, 0.375, 0.25, 1.0]), "{:?}", picture.pixels[0]);
        // At 4 samples both triangles of what blends are shaded where they meet, the opaque ones as one surface. What lies
        // behind is not shaded at all.
        assert_eq!(stats.shaded, 256 + 2 * if samples == 1 { 256 } else { 256 + 16 });
    }
    // Over nothing, alpha stays: premultiplied in linear light, straight in bytes.
    stage.meshes = vec![stage.meshes[2].clone()];
    assert!(stage.linear(16, 4).0.pixels.iter().all(|p| *p == [0.0, 0.5, 0.0, 0.5]));
    assert_eq!(stage.bytes(16, 4).0.data[..4], [0, 255, 0, 128]);
}

#[test]
fn transparent_neighbours_leave_no_seam() {
    let mut rng = Rng::new(4);
    for _ in 0..20 {
        let mut data = quad(1.0, 0.0);
        data.positions.push(Vec3::new(rng.span(-0.9, 0.9), rng.span(-0.9, 0.9), 0.0));
        data.uvs[0].clear();
        data.triangles = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        let stage = Stage::of(from_front(5.0, 2.0), Mesh::new(data).unwrap(), blending(Vec3::ONE, 0.5));
        assert!(stage.linear(32, 4).0.pixels.iter().all(|p| *p == [0.5; 4]));
    }
}

/// A bumpy ball of about `n` triangles, whole or cut into one object a triangle.
fn ball(n: usize, cut: bool) -> Stage {
    let v = (n as f32 / 4.0).sqrt() as u32;
    let row = 2 * v + 1;
    let mut data = MeshData::default();
    for k in 0..(v + 1) * row {
        let pi = std::f32::consts::PI;
        let ((s, c), (sp, cp)) =
            ((pi * (k / row) as f32 / v as f32).sin_cos(), (pi * (k % row) as f32 / v as f32).sin_cos());
        let d = Vec3::new(s * cp, c, s * sp);
        data.positions.push(d * (1.0 + 0.1 * (7.0 * d.x).sin() * (9.0 * d.y).sin()));
        data.normals.push(d);
    }
    for a in (0..v).flat_map(|j| (0..2 * v).map(move |i| j * row + i)) {
        data.triangles.extend([[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]);
    }
    let alone = |t: &[u32; 3]| MeshData {
        positions: t.map(|v| data.positions[v as usize]).to_vec(),
        normals: t.map(|v| data.normals[v as usize]).to_vec(),
        triangles: vec![[0, 1, 2]],
        ..Default::default()
    };
    let parts = if cut { data.triangles.iter().map(alone).collect() } else { vec![data.clone()] };
    let mut stage = plate(vec![point(Vec3::new(2.0, 3.0, 4.0), None)]);
    stage.camera = perspective(Vec3::Z * 4.0, Vec3::ZERO, 0.6);
    stage.meshes = parts.into_iter().map(|d| (Mesh::new(d).unwrap(), 0)).collect();
    stage
}

#[test]
fn a_pixel_of_one_surface_is_shaded_once_and_looks_as_if_every_triangle_were() {
    // From triangles of some pixels to several in one; objects never join, so the cut ball shades every triangle.
    for (n, size, least) in [(600, 96, 59.0), (2400, 96, 56.5), (9600, 64, 50.5)] {
        let (once, each) = (ball(n, false).bytes(size, 4), ball(n, true).bytes(size, 4));
        assert_eq!(once.1.samples, each.1.samples);
        let alpha = |p: &Rgba8| p.data.chunks(4).map(|p| p[3]).collect::<Vec<_>>();
        assert_eq!(alpha(&once.0), alpha(&each.0), "what is covered stays exact");

        // A little more than one evaluation a pixel is left, for outlines.
        let pixels = once.0.data.chunks(4).filter(|p| p[3] > 0).count() as f64;
        let (few, many) = (once.1.shaded as f64 / pixels, each.1.shaded as f64 / pixels);
        assert!(few < 1.02 && many > 1.25, "{n}: {few} {many}");

        let off: Vec<f64> =
            once.0.data.iter().zip(&each.0.data).map(|(a, b)| a.abs_diff(*b) as f64).collect();
        let mean = off.iter().map(|d| d * d).sum::<f64>() / (3.0 * pixels);
        let psnr = 10.0 * (255.0 * 255.0 / mean).log10();
        let most = off.iter().fold(0.0, |a: f64, b| a.max(*b));
        assert!(psnr > least && most <= 9.0, "{n}: {psnr} dB, {most} codes");
    }
}

#[test]
fn creases_and_flat_faces_keep_a_colour_for_each_side() {
    // A ridge seen from above, its sides with normals of their own; half of the middle column shows either.
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let ridge = |normals: bool| MeshData {
        positions: vec![
            p(-2.0, -2.0, -1.0),
            p(0.05, -2.0, 0.0),
            p(0.05, 2.0, 0.0),
            p(-2.0, 2.0, -1.0),
            p(0.05, -2.0, 0.0),
            p(2.0, -2.0, -1.0),
            p(2.0, 2.0, -1.0),
            p(0.05, 2.0, 0.0),
        ],
        normals: if normals {
            [p(-0.6, 0.0, 0.8), p(0.6, 0.0, 0.8)].into_iter().flat_map(|n| [n; 4]).collect()
        } else {
            vec![]
        },
        triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
        ..Default::default()
    };
    for normals in [true, false] {
        let sun = Light::new(
            LightKind::Directional { direction: Vec3::new(1.0, 0.0, -1.0).normalize() },
            Vec3::ONE,
        );
        let mut stage = plate(vec![sun]);
        stage.materials[0].specular = Vec3::ZERO;
        stage.camera = from_front(5.0, 2.0);
        stage.meshes[0].0 = Mesh::new(ridge(normals)).unwrap();
        let (picture, _) = stage.linear(9, 4);
        let row: Vec<f32> = (0..9).map(|x| picture.pixels[4 * 9 + x][0]).collect();
        let share = (row[4] - row[5]) / (row[3] - row[5]);
        assert!(
            row[3] > row[5] + 0.1 && [0.25, 0.5, 0.75].iter().any(|s| (share - s).abs() < 1e-3),
            "{row:?}"
        );
    }
}

/// A bumpy sphere of triangles of all sizes, with coordinates.
fn lump(colors: bool) -> Mesh {
    let mut data = MeshData::default();
    for (j, i) in (0..=40).flat_map(|j| (0..=60).map(move |i| (j, i))) {
        let (theta, phi) = ((j as f32 / 40.0).powi(2) * PI, i as f32 / 30.0 * PI);
        let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        data.positions.push(d * (1.0 + 0.1 * (5.0 * d.x + 9.0 * d.y).sin()));
        data.normals.push(d);
        data.uvs[0].push(Vec2::new(i as f32 * 0.05 - 1.0, j as f32 * 0.03));
        data.colors.extend(colors.then_some(Vec4::ONE));
    }
    for (j, i) in (0..40).flat_map(|j| (0..60).map(move |i| (j, i))) {
        let a = j * 61 + i;
        data.triangles.extend([[a, a + 1, a + 61], [a + 1, a + 62, a + 61]]);
    }
    Mesh::new(data).unwrap()
}

#[test]
fn clay_has_a_kernel_of_its_own_and_looks_like_everything_else() {
    let mut rng = Rng::new(11);
    let bytes =
        (0..64 * 64).flat_map(|_| [rng.next() as u8, rng.next() as u8, rng.next() as u8, 255]).collect();
    let texture =
        Texture::new(64, 64, bytes, Content::Color, [WrapMode::Repeat; 2], Filter::Trilinear).unwrap();
    let transform = Affine2::from_scale_angle_translation(Vec2::splat(0.7), 0.4, Vec2::splat(0.2));
    let map = TextureRef { texture: TextureId(0), uv_set: 0, transform };
    let plain =
        Material { diffuse: Vec4::new(0.8, 0.5, 0.3, 1.0), specular: Vec3::splat(0.5), ..Default::default() };
    let ortho = from_front(3.0, 1.4);
    let close = perspective(Vec3::new(0.3, 0.2, 1.3), Vec3::new(0.2, 0.0, 0.0), 1.2);
    for (camera, double_sided, diffuse_map) in
        [ortho, close].iter().flat_map(|&c| [(c, false, None), (c, true, Some(map)), (c, false, Some(map))])
    {
        // White at every vertex changes nothing, but leads past that kernel.
        let stage = |colors: bool| {
            let m = Material { double_sided, diffuse_map, emissive: Vec3::X * 0.1, ..plain.clone() };
            let mut stage = Stage::of(camera, lump(colors), m);
            stage.textures.push(texture.clone());
            stage.ambient = Vec3::splat(0.1);
            let lamp = LightKind::Point { position: Vec3::new(2.0, 3.0, 4.0), falloff: Some(20.0) };
            stage.lights = vec![Light::new(lamp, Vec3::ONE * 20.0)];
            stage
        };
        for samples in [1, 4] {
            let (own, stats) = stage(false).bytes(300, samples);
            let (general, same) = stage(true).bytes(300, samples);
            assert_eq!(stats, same);
            let off = own.data.iter().zip(&general.data).map(|(a, b)| a.abs_diff(*b));
            let (mut differ, mut worst) = (0, 0);
            off.for_each(|d| (differ, worst) = (differ + usize::from(d > 0), worst.max(d)));
            assert!(worst <= 1 && differ < 360, "{differ} bytes of 360,000 differ, by {worst} at most");
        }
    }
}
