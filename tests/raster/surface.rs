//! Varyings and textures.

use super::*;
use glam::Affine2;
use sinew::scene::{Content, Filter, TextureId, TextureRef, WrapMode};

fn textured(texture: Texture, uv_scale: f32, uv_shift: f32) -> Stage {
    let transform = Affine2::from_scale_angle_translation(Vec2::splat(uv_scale), 0.0, Vec2::splat(uv_shift));
    let map = TextureRef { texture: TextureId(0), uv_set: 0, transform };
    let m = Material { diffuse_map: Some(map), ..material(Vec4::ONE) };
    let mut stage = Stage::of(from_front(5.0, 2.0), Mesh::new(quad(1.0, 0.0)).unwrap(), m);
    stage.textures.push(texture);
    stage
}

fn noise(side: u32, seed: u64) -> Vec<u8> {
    let mut rng = Rng::new(seed);
    (0..side * side).flat_map(|_| [rng.next() as u8, rng.next() as u8, rng.next() as u8, 255]).collect()
}

fn texture(side: u32, bytes: Vec<u8>, wrap: WrapMode, filter: Filter) -> Texture {
    Texture::new(side, side, bytes, Content::Color, [wrap; 2], filter).unwrap()
}

#[test]
fn a_texture_drawn_at_its_size_comes_back() {
    for filter in [Filter::Nearest, Filter::Trilinear] {
        let bytes = noise(64, 1);
        let stage = textured(texture(64, bytes.clone(), WrapMode::Repeat, filter), 1.0, 0.0);
        assert!(stage.bytes(64, 1).0.data == bytes, "{filter:?}");
    }
}

#[test]
fn outside_it_repeats_mirrors_or_stays() {
    // Coordinates run over −1…2.
    let bytes = noise(16, 2);
    for (wrap, inside) in [
        (WrapMode::Repeat, (|i: i32| i.rem_euclid(16)) as fn(i32) -> i32),
        (WrapMode::Clamp, |i| i.clamp(0, 15)),
        (WrapMode::Mirror, |i| if (0..16).contains(&i) { i } else { 15 - i.rem_euclid(16) }),
    ] {
        for filter in [Filter::Nearest, Filter::Trilinear] {
            let stage = textured(texture(16, bytes.clone(), wrap, filter), 3.0, -1.0);
            let picture = stage.bytes(48, 1).0;
            for (k, pixel) in picture.data.chunks(4).enumerate() {
                let (x, y) = (inside((k % 48) as i32 - 16) as usize, inside((k / 48) as i32 - 16) as usize);
                assert_eq!(pixel, &bytes[4 * (16 * y + x)..][..4], "{wrap:?} {filter:?} {k}");
            }
        }
    }
}

#[test]
fn smaller_pictures_show_coarser_levels() {
    for filter in [Filter::Nearest, Filter::Trilinear] {
        let t = texture(64, noise(64, 3), WrapMode::Clamp, filter);
        for level in [1, 2, 3] {
            let stage = textured(t.clone(), 1.0, 0.0);
            assert!(stage.bytes(64 >> level, 1).0.data == t.levels()[level], "{filter:?} {level}");
        }
    }
    // Between levels, half of each: at √2 texels a pixel.
    let gray = |v: u8| [v, v, v, 255];
    let checker: Vec<u8> =
        (0..64 * 64).flat_map(|i| gray(if (i + i / 64) % 2 == 0 { 0 } else { 255 })).collect();
    let t =
        Texture::new(64, 64, checker, Content::Numbers, [WrapMode::Repeat; 2], Filter::Trilinear).unwrap();
    let stage = textured(t, 2f32.sqrt(), 0.0);
    let (picture, _) = stage.linear(64, 1);
    let mean = picture.pixels.iter().map(|p| p[0]).sum::<f32>() / 4096.0;
    let spread = picture.pixels.iter().map(|p| (p[0] - mean).abs()).fold(0.0, f32::max);
    assert!((mean - 0.5).abs() < 0.02 && spread < 0.26 && spread > 0.2, "{mean} {spread}");
}

#[test]
fn varyings_are_perspective_correct() {
    let mut data = quad(1.0, 0.0);
    data.colors = vec![
        Vec4::new(0.0, 0.0, 1.0, 1.0),
        Vec4::new(1.0, 0.0, 0.5, 1.0),
        Vec4::new(1.0, 1.0, 0.25, 1.0),
        Vec4::new(0.0, 1.0, 0.75, 1.0),
    ];
    let camera = perspective(Vec3::new(1.2, -1.5, 0.4), Vec3::ZERO, 0.6);
    let stage = Stage::of(camera, Mesh::new(data).unwrap(), material(Vec4::ONE));
    let (picture, stats) = stage.linear(100, 1);
    let scene_from_view = stage.camera.scene_from_view.as_daffine3();
    let f = 0.3f64.tan();
    for (k, p) in picture.pixels.iter().enumerate().filter(|(_, p)| p[3] == 1.0) {
        let at = |i: usize| (i as f64 + 0.5) / 50.0 - 1.0;
        let d = scene_from_view.matrix3 * glam::DVec3::new(at(k % 100) * f, -at(k / 100) * f, -1.0);
        let q = scene_from_view.translation - d * (scene_from_view.translation.z / d.z);
        // Red runs from 0 to 1 along x, green along y.
        assert!((p[0] as f64 - (0.5 + 0.5 * q.x)).abs() < 1e-3, "{p:?} {q}");
        assert!((p[1] as f64 - (0.5 + 0.5 * q.y)).abs() < 1e-3, "{p:?} {q}");
    }
    assert!(stats.samples > 3000, "{stats:?}");
}

#[test]
fn a_mask_leaves_what_reaches_the_cut_off() {
    let bytes: Vec<u8> =
        (0..64).flat_map(|i| [255, 255, 255, if (i % 8 + i / 8) % 2 == 0 { 127 } else { 128 }]).collect();
    let mut stage = textured(texture(8, bytes, WrapMode::Clamp, Filter::Nearest), 1.0, 0.0);
    stage.materials[0].alpha = AlphaMode::Mask(0.5);
    stage.materials.push(material(Vec4::new(0.25, 0.25, 0.25, 1.0)));
    stage.meshes.push((Mesh::new(quad(1.0, -1.0)).unwrap(), 1));
    for samples in [1, 4] {
        let (picture, stats) = stage.linear(32, samples);
        for (k, p) in picture.pixels.iter().enumerate() {
            let want = if (k % 32 / 4 + k / 128) % 2 == 0 { 0.25 } else { 1.0 };
            assert_eq!(*p, [want, want, want, 1.0], "{k}");
        }
        assert_eq!((stats.samples, stats.shaded), (1024 * samples as u64, 1024));
    }
    assert_eq!(stage.ids(32).0.objects.iter().filter(|o| **o == 1).count(), 512);
}

#[test]
fn a_normal_map_tilts_with_or_without_tangents() {
    // The map leans towards +u by 45°; with u to the right and light from the right at 45°, n·l = 1.
    let lean = (127.5f32 + 127.5 * 0.5f32.sqrt()).round() as u8;
    let map = Texture::new(
        1,
        1,
        vec![lean, 128, lean, 255],
        Content::Numbers,
        [WrapMode::Repeat; 2],
        Filter::Nearest,
    )
    .unwrap();
    let mut data = quad(1.0, 0.0);
    data.normals = vec![Vec3::Z; 4];
    let reference = TextureRef { texture: TextureId(0), uv_set: 0, transform: Affine2::IDENTITY };
    let m = Material {
        normal_map: Some(reference),
        diffuse: Vec4::ONE,
        specular: Vec3::ZERO,
        ..Default::default()
    };
    let direction = Vec3::new(-1.0, 0.0, -1.0).normalize();
    let mut stage = Stage::of(from_front(5.0, 2.0), Mesh::new(data.clone()).unwrap(), m);
    stage.textures.push(map);
    stage.lights = vec![Light::new(sinew::scene::LightKind::Directional { direction }, Vec3::ONE)];
    let without = stage.linear(4, 1).0.pixels[5][0];
    data.tangents = vec![Vec4::new(1.0, 0.0, 0.0, -1.0); 4];
    stage.meshes[0].0 = Mesh::new(data).unwrap();
    let with = stage.linear(4, 1).0.pixels[5][0];
    assert!((without - 1.0).abs() < 1e-3 && (with - 1.0).abs() < 1e-3, "{without} {with}");
    stage.materials[0].normal_scale = 0.0;
    assert!((stage.linear(4, 1).0.pixels[5][0] - 0.5f32.sqrt()).abs() < 1e-5);
}
