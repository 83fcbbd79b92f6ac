//! The same bytes everywhere, and no scene too strange.

use super::*;
use sinew::math::simd::Isa;
use sinew::scene::{Content, Filter, LightKind, TextureId, TextureRef, WrapMode};

/// Everything at once: opaque, masked and transparent triangles of all sizes, textured, lit, cut by the near plane.
fn jumble(seed: u64) -> Stage {
    let mut rng = Rng::new(seed);
    let mut stage = Stage::of(
        perspective(Vec3::new(0.0, 0.5, 1.5), Vec3::ZERO, 1.0),
        Mesh::default(),
        Material::default(),
    );
    stage.meshes.clear();
    let bytes = (0..32 * 32 * 4).map(|_| rng.next() as u8).collect();
    stage.textures.push(
        Texture::new(32, 32, bytes, Content::Color, [WrapMode::Repeat, WrapMode::Mirror], Filter::Trilinear)
            .unwrap(),
    );
    let map = TextureRef { texture: TextureId(0), uv_set: 0, transform: glam::Affine2::IDENTITY };
    let base = Material {
        diffuse_map: Some(map),
        normal_map: Some(map),
        specular_map: Some(map),
        double_sided: true,
        ..Default::default()
    };
    stage.materials = vec![
        base.clone(),
        Material { alpha: AlphaMode::Mask(0.4), ..base.clone() },
        Material { alpha: AlphaMode::Blend, ..base },
        Material { diffuse_map: Some(map), ..Default::default() },
        Material { double_sided: true, shininess: 7.5, ..Default::default() },
    ];
    for (k, size) in [2.0, 0.5, 0.1, 0.02].iter().cycle().take(20).enumerate() {
        let mut data = MeshData::default();
        for t in 0..60 {
            let center = rng.point(1.2);
            data.positions.extend((0..3).map(|_| center + rng.point(*size)));
            data.uvs[0].extend((0..3).map(|_| Vec2::new(rng.span(-2.0, 2.0), rng.span(-2.0, 2.0))));
            data.normals.extend((0..3).map(|_| rng.point(1.0).normalize()));
            data.triangles.push([3 * t, 3 * t + 1, 3 * t + 2]);
        }
        stage.meshes.push((Mesh::new(data).unwrap(), k % 5));
    }
    stage.ambient = Vec3::splat(0.2);
    stage.lights = vec![
        Light::new(LightKind::Point { position: Vec3::ONE * 2.0, falloff: Some(9.0) }, Vec3::splat(8.0)),
        Light::new(LightKind::Directional { direction: Vec3::NEG_Y }, Vec3::X),
    ];
    stage
}

#[test]
fn threads_builds_and_old_buffers_do_not_show() {
    for seed in 0..2 {
        let stage = jumble(seed);
        let mut used = Rasterizer::default();
        for samples in [4, 1] {
            let settings = |threads| Settings { width: 203, height: 149, samples, threads };
            let (mut want, mut found) = (Rgba8::default(), Rgba8::default());
            let stats = Rasterizer::default().draw(&stage.scene(), &settings(1), &mut want);
            assert!(stats.drawn > 400 && stats.clipped > 3, "{stats:?}");
            for threads in [1, 2, 5] {
                for isa in [Isa::Best, Isa::Avx2, Isa::Portable] {
                    let again =
                        Rasterizer::with_isa(isa).draw(&stage.scene(), &settings(threads), &mut found);
                    assert!(want == found, "{threads} threads, {isa:?}");
                    assert_eq!(again, stats);
                }
            }
            used.draw(&stage.scene(), &settings(2), &mut found);
            assert!(want == found, "buffers of the last picture show");

            // The fast path to bytes gives what the slow one gives.
            let mut linear = Image::default();
            used.draw_linear(&stage.scene(), &settings(1), &mut linear);
            assert!(linear.to_rgba8() == want);
        }
    }
}

#[test]
fn what_moves_leaves_nothing_behind() {
    let mut rng = Rng::new(11);
    for (size, count) in [(0.9, 6), (0.35, 40), (0.1, 200)] {
        let corners: Vec<Vec3> = (0..count)
            .flat_map(|_| {
                let center = rng.point(1.0);
                [0; 3].map(|_| center + rng.point(size))
            })
            .collect();
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let camera = perspective(Vec3::Z * 3.0, Vec3::ZERO, 1.0);
        let double_sided = Material { double_sided: true, ..material(Vec4::ONE) };
        let stage = Stage::of(camera, mesh(corners.clone(), triangles), double_sided);
        for (samples, isa) in [(1, Isa::Best), (4, Isa::Best), (4, Isa::Portable)] {
            let mut used = Rasterizer::with_isa(isa);
            for step in 0..40 {
                let turn = glam::Quat::from_rotation_y(0.15 * step as f32);
                let moved: Vec<Vec3> = corners.iter().map(|&p| turn * p).collect();
                let mut scene = stage.scene();
                scene.objects[0].positions = &moved;
                let settings = Settings { width: 100, height: 70, samples, threads: 1 };
                let (mut want, mut found) = (Rgba8::default(), Rgba8::default());
                let stats = Rasterizer::with_isa(isa).draw(&scene, &settings, &mut want);
                assert_eq!(
                    used.draw(&scene, &settings, &mut found),
                    stats,
                    "{size} {samples} {isa:?} {step}"
                );
                assert!(want == found, "{size} {samples} {isa:?} {step}");
            }
        }
    }
}

#[test]
fn coordinates_of_any_kind_are_survived() {
    let mut rng = Rng::new(5);
    let strange = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        -f32::MAX,
        1e30,
        -1e20,
        1e9,
        f32::MIN_POSITIVE,
        0.0,
        0.5,
        -0.5,
        1.5,
    ];
    let n = 600;
    let rest = mesh(vec![Vec3::ZERO; n], (0..n as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
    for projection in [Projection::Perspective { fov_y: 1.0 }, Projection::Orthographic { height: 2.0 }] {
        let positions: Vec<Vec3> = (0..n)
            .map(|_| {
                let mut pick = || {
                    if rng.next().is_multiple_of(3) {
                        strange[rng.next() as usize % strange.len()]
                    } else {
                        rng.span(-2.0, 2.0)
                    }
                };
                Vec3::new(pick(), pick(), pick())
            })
            .collect();
        let camera = Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, projection).unwrap();
        let stage = Stage::of(camera, rest.clone(), material(Vec4::ONE));
        let mut scene = stage.scene();
        scene.objects[0].positions = &positions;
        for samples in [1, 4] {
            let settings = Settings { width: 70, height: 70, samples, threads: 1 };
            let stats = Rasterizer::default().draw(&scene, &settings, &mut Rgba8::default());
            assert!(stats.skipped > 10 && stats.drawn > 10, "{stats:?}");
            assert_eq!(stats.skipped + stats.culled + stats.missed + stats.drawn, stats.triangles);
        }
    }
}

#[test]
fn pictures_of_any_shape() {
    let stage = jumble(3);
    let mut r = Rasterizer::default();
    let mut out = Rgba8::default();
    for (width, height) in
        [(0, 0), (0, 7), (7, 0), (1, 1), (1, 200), (200, 1), (65, 63), (64, 64), (16384, 1)]
    {
        r.draw(&stage.scene(), &Settings { width, height, samples: 4, threads: 2 }, &mut out);
        assert_eq!((out.width, out.height, out.data.len()), (width, height, 4 * width * height));
    }
    let large = Settings { width: 16385, height: 1, samples: 4, threads: 1 };
    assert_eq!(
        large.check().unwrap_err().to_string(),
        "a picture of 16385×1 pixels is too large: at most 16384 along each side"
    );
    assert!(Settings { samples: 2, ..Settings::default() }.check().is_err());
}

#[test]
fn empty_and_flat_things_draw_nothing() {
    let mut stage = Stage::of(from_front(5.0, 2.0), Mesh::default(), material(Vec4::ONE));
    assert_eq!(stage.bytes(9, 4).1, Stats::default());
    stage.meshes[0].0 = mesh(vec![Vec3::ZERO, Vec3::X, Vec3::X * 0.5], vec![[0, 1, 2], [0, 0, 0], [1, 1, 2]]);
    assert_eq!(stage.bytes(9, 4).1, Stats { triangles: 3, vertices: 3, culled: 3, ..Default::default() });
    stage.background = [0.25, 0.5, 0.75, 1.0];
    assert!(stage.linear(9, 4).0.pixels.iter().all(|p| *p == stage.background));
}

#[test]
fn lists_that_do_not_fit_are_left_out() {
    let stage = Stage::of(from_front(5.0, 2.0), Mesh::new(quad(1.0, 0.0)).unwrap(), material(Vec4::ONE));
    let mut scene = stage.scene();
    scene.objects[0].positions = &stage.meshes[0].0.positions[..3];
    scene.objects.push(stage.scene().objects[0]);
    scene.objects[1].material = 99;
    let settings = Settings { width: 8, height: 8, samples: 1, threads: 1 };
    let stats = Rasterizer::default().draw(&scene, &settings, &mut Rgba8::default());
    assert_eq!((stats.triangles, stats.skipped, stats.drawn, stats.vertices), (4, 2, 2, 4));
}

#[test]
fn small_triangles_are_counted_exactly() {
    // Eight triangles of a quarter pixel around the centres of two pixels, and eight that hold no centre.
    let mut positions = vec![];
    for k in 0..8 {
        let x = [0.5, 2.5][k % 2] - 4.0;
        for (dx, dy) in [(-0.2, -0.2), (0.3, -0.2), (-0.2, 0.3)] {
            positions.push(Vec3::new(x + dx, 0.5 + dy, k as f32 * 0.1));
        }
    }
    for k in 0..8 {
        for (dx, dy) in [(0.0, 0.0), (0.3, 0.0), (0.0, 0.3)] {
            positions.push(Vec3::new(k as f32 - 4.0 + 0.6 + dx, 1.6 + dy, 0.0));
        }
    }
    let all = mesh(positions, (0..16).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
    let stage = Stage::of(from_front(5.0, 8.0), all, material(Vec4::ONE));
    let want = Stats {
        triangles: 16,
        vertices: 48,
        missed: 8,
        drawn: 8,
        samples: 2,
        shaded: 2,
        ..Default::default()
    };
    assert_eq!(stage.linear(8, 1).1, want);
    let ids = stage.ids(8).0;
    assert_eq!((ids.triangles[3 * 8], ids.triangles[3 * 8 + 2]), (6, 7), "the nearest of each pile");
}

#[test]
fn layers_drawn_from_back_to_front_and_parts_of_clipped_triangles_are_shaded_once() {
    // So many layers win everywhere in turn that where the first ones won is forgotten meanwhile.
    let mut stage = Stage::of(from_front(5.0, 2.0), Mesh::default(), Material::default());
    (stage.meshes, stage.materials) = (vec![], vec![]);
    for k in 0..200 {
        stage.meshes.push((Mesh::new(quad(1.0, 0.001 * k as f32)).unwrap(), k));
        stage.materials.push(material(Vec4::new(0.0, f32::from(u8::from(k == 199)), 0.5, 1.0)));
    }
    for samples in [1, 4] {
        let (picture, stats) = stage.bytes(128, samples);
        assert!(picture.data.chunks(4).all(|p| p == &picture.data[..4] && p[1] == 255));
        assert_eq!((stats.samples, stats.shaded), (u64::from(samples) * 128 * 128, 128 * 128));
    }

    // A floor that runs behind the eye is cut into parts.
    let positions = [[-9.0, -1.0, 4.0], [9.0, -1.0, 4.0], [0.0, -1.0, -30.0]].map(Vec3::from_array).to_vec();
    let camera = perspective(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, 1.4);
    let floor = Stage::of(camera, mesh(positions, vec![[0, 1, 2]]), material(Vec4::ONE));
    for samples in [1, 4] {
        let (picture, stats) = floor.bytes(150, samples);
        let seen = || picture.data.chunks(4).filter(|p| p[3] > 0);
        // 64, 128, 191 and 255 are one to four of four samples.
        let covered: u64 = seen().map(|p| (u64::from(p[3]) + 1) / 64 * u64::from(samples) / 4).sum();
        assert!(stats.clipped == 1 && seen().count() > 5000);
        assert_eq!((stats.samples, stats.shaded), (covered, seen().count() as u64), "{samples} samples");
    }
}
