//! Light and look: presets, tones, shadows, ground, grades and look files against closed forms.

use crate::raster::{Rng, Stage, from_front, material, mesh, perspective, quad};
use glam::{Vec3, Vec4};
use sinew::frames::{GroundLook, Look, Shading, Shadows, Shot, ShotDesc, View, Worker};
use sinew::image::develop::Grade;
use sinew::image::dither::Dither;
use sinew::image::{Image, Rgba8};
use sinew::io::{self, Import, Options, look_json};
use sinew::math::simd::Isa;
use sinew::mesh::{Mesh, MeshData};
use sinew::render::Settings;
use sinew::render::footprint::Footprint;
use sinew::render::outline::Outline;
use sinew::render::raster::Rasterizer;
use sinew::render::shadow::{ShadowDesc, ShadowMaker};
use sinew::scene::{Light, LightKind, Lighting, Material, MaterialPatch, Scene, ShadowMap, Style};
use std::collections::BTreeSet;

fn sun(direction: Vec3) -> Light {
    Light::new(LightKind::Directional { direction: direction.normalize() }, Vec3::ONE)
}

/// A ball of radius 1 around the origin with a ball's normals.
fn ball() -> Mesh {
    let (rows, columns) = (24u32, 48u32);
    let mut data = MeshData::default();
    for j in 0..=rows {
        for i in 0..=columns {
            let (a, b) = (j as f32 / rows as f32, 2.0 * i as f32 / columns as f32);
            let ((sa, ca), (sb, cb)) =
                ((a * std::f32::consts::PI).sin_cos(), (b * std::f32::consts::PI).sin_cos());
            data.positions.push(Vec3::new(sa * sb, ca, sa * cb));
        }
    }
    data.normals = data.positions.iter().map(|p| p.normalize()).collect();
    for j in 0..rows {
        for i in 0..columns {
            let k = j * (columns + 1) + i;
            let below = k + columns + 1;
            data.triangles.extend([[k, below, k + 1], [k + 1, below, below + 1]]);
        }
    }
    Mesh::new(data).unwrap()
}

fn matt(gray: f32) -> Material {
    Material {
        diffuse: Vec3::splat(gray).extend(1.0),
        specular: Vec3::ZERO,
        double_sided: true,
        ..Default::default()
    }
}

fn linear(scene: &Scene, size: usize, isa: Isa) -> Image {
    let settings = Settings { width: size, height: size, samples: 1, threads: 1 };
    let mut out = Image::default();
    Rasterizer::with_isa(isa).draw_linear(scene, &settings, &mut out);
    out
}

fn map_of(scene: &Scene, direction: Vec3, bounds: [Vec3; 2], size: usize) -> ShadowMap {
    let desc = ShadowDesc { direction, bounds, margin: 0.2, size, radius: 0.5, bias: 1e-3, threads: 1 };
    let mut map = ShadowMap::default();
    ShadowMaker::default().draw(scene, &desc, &mut map);
    map
}

#[test]
fn a_ball_has_exactly_as_many_tones_as_asked_for() {
    let mut stage = Stage::of(perspective(Vec3::Z * 5.0, Vec3::ZERO, 0.5), ball(), matt(0.5));
    stage.lights = vec![sun(Vec3::new(-1.0, -1.0, -1.0)), Light { color: Vec3::splat(0.3), ..sun(Vec3::X) }];
    for steps in 2..=6 {
        let scene = Scene { style: Style { toon: Some(steps), ..Style::default() }, ..stage.scene() };
        let picture = linear(&scene, 200, Isa::Best);
        let shown = picture.pixels.iter().filter(|p| p[3] > 0.0);
        let tones: BTreeSet<i64> = shown.map(|p| (p[0] as f64 * 1e5).round() as i64).collect();
        let want = |k: u32| 0.5 * (0.25 + 0.75 * k as f64 / (steps - 1) as f64);
        let want: BTreeSet<i64> = (0..steps).map(|k| (want(k) * 1e5).round() as i64).collect();
        assert_eq!(tones, want, "{steps}");
    }
}

#[test]
fn ambient_light_goes_from_above_to_below_with_the_normal() {
    let mut stage = Stage::of(from_front(5.0, 2.2), ball(), matt(1.0));
    stage.ambient = Vec3::new(0.2, 0.4, 0.8);
    let below = Vec3::new(0.6, 0.2, 0.0);
    let scene = Scene { style: Style { below: Some(below), ..Style::default() }, ..stage.scene() };
    let size = 201;
    let picture = linear(&scene, size, Isa::Best);
    for y in (30..170).step_by(10) {
        let up = (100.0 - y as f32) * 2.2 / size as f32;
        let want = below.lerp(stage.ambient, 0.5 + 0.5 * up);
        let p = picture.pixels[y * size + 100];
        // Facets of the ball lie a little below its surface.
        assert!((Vec3::new(p[0], p[1], p[2]) - want).abs().max_element() < 2e-3, "{y}: {p:?} {want}");
    }
}

/// A square of side 1, one metre before a plane of side 6, a sun from the upper left.
fn eclipse() -> (Stage, Vec3) {
    let direction = Vec3::new(1.0, -0.5, -1.0).normalize();
    let mut stage = Stage::of(from_front(9.0, 6.0), Mesh::new(quad(3.0, 0.0)).unwrap(), matt(1.0));
    stage.meshes.push((Mesh::new(quad(0.5, 1.0)).unwrap(), 0));
    stage.lights = vec![sun(direction)];
    (stage, direction)
}

#[test]
fn a_square_before_a_plane_throws_its_shadow_where_geometry_says() {
    let (stage, direction) = eclipse();
    let bounds = [Vec3::new(-3.0, -3.0, 0.0), Vec3::new(3.0, 3.0, 1.0)];
    let map = map_of(&stage.scene(), direction, bounds, 512);
    let scene = Scene { style: Style { shadow: Some(&map), ..Style::default() }, ..stage.scene() };
    let size = 300;
    let picture = linear(&scene, size, Isa::Best);
    let pixel = 6.0 / size as f32;

    // Along the plane a texel is longer by the light's slant; half a pixel is how far the centre may be off.
    let slack = map.texel / direction.z.abs() + 0.5 * pixel;
    let lit = -direction.z;
    let (mut dark, mut sure) = (0, 0);
    for (i, p) in picture.pixels.iter().enumerate() {
        let (x, y) = ((i % size) as f32 + 0.5, (i / size) as f32 + 0.5);
        let at = Vec3::new(x * pixel - 3.0, 3.0 - y * pixel, 0.0);
        if at.x.abs().max(at.y.abs()) < 0.5 + pixel {
            // The square itself lies in the light.
            continue;
        }
        // The square's shadow is moved by what light travels aside on the way.
        let off = (at.x - 1.0).abs().max((at.y + 0.5).abs()) - 0.5;
        if off.abs() > slack {
            sure += 1;
            dark += usize::from(off < 0.0);
            let want = if off < 0.0 { 0.0 } else { lit };
            assert!((p[0] - want).abs() < 1e-5, "{at}: {} {want}", p[0]);
        }
    }
    assert!(dark > 1200 && sure > 80_000, "{dark} {sure}");
    // The square is lit by itself.
    let middle = picture.pixels[150 * size + 150][0];
    assert!((middle - lit).abs() < 1e-5, "{middle}");
}

#[test]
fn a_ball_does_not_shadow_the_side_that_is_in_the_light() {
    let mut rng = Rng::new(8);
    for radius in [0.5, 1.5, 2.5] {
        let from = Vec3::new(rng.span(-1.0, 1.0), rng.span(0.1, 1.0), rng.span(0.2, 1.0));
        let mut stage = Stage::of(from_front(5.0, 2.2), ball(), matt(1.0));
        stage.lights = vec![sun(-from)];
        let plain = linear(&stage.scene(), 300, Isa::Best);
        let mut map = map_of(&stage.scene(), -from.normalize(), [-Vec3::ONE, Vec3::ONE], 512);
        map.radius = radius;
        map.bias = 0.01;
        let scene = Scene { style: Style { shadow: Some(&map), ..Style::default() }, ..stage.scene() };
        let shadowed = linear(&scene, 300, Isa::Best);
        for (a, b) in plain.pixels.iter().zip(&shadowed.pixels) {
            assert!(a[0] < 0.25 || (a[0] - b[0]).abs() < 1e-5, "radius {radius}: {} became {}", a[0], b[0]);
        }
    }
}

#[test]
fn contact_shadows_are_dark_below_and_vanish_with_height() {
    let plate = |height: f32| {
        let p = [(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)];
        let positions = p.iter().map(|&(x, z)| Vec3::new(x, height, z)).collect();
        let stage = Stage::of(from_front(5.0, 2.0), mesh(positions, vec![[0, 1, 2], [0, 2, 3]]), matt(1.0));
        let bounds = [Vec3::new(-0.6, 0.0, -0.6), Vec3::new(0.6, 1.0, 0.6)];
        let mut map = map_of(&stage.scene(), Vec3::Y, bounds, 128);
        let ground = map.texel_from_scene.transform_point3(Vec3::ZERO).z;
        map.depth.iter_mut().for_each(|z| *z -= ground);
        let mut f = Footprint::default();
        f.contact(&map, &[[0.5, 0.1, 0.8]]);
        f
    };
    let below = |h: f32| plate(h).at(Vec3::ZERO);
    let mut last = 1.0;
    for k in 0..5 {
        // Under the middle of a large plate the blur changes nothing.
        let (height, found) = (0.1 * k as f32, below(0.1 * k as f32));
        let want = 0.8 * (1.0 - height / 0.5).powi(2);
        assert!((found - want).abs() < 2e-3 && found < last, "{height}: {found} {want}");
        last = found;
    }
    assert_eq!(below(0.51), 0.0);
    // Soft at the edge, and nothing beyond the blur.
    let f = plate(0.0);
    let edge = f.at(Vec3::X * 0.3);
    assert!((0.3..0.5).contains(&edge), "{edge}");
    assert_eq!(f.at(Vec3::X * 0.45), 0.0);
}

#[test]
fn the_ground_is_shadowed_where_the_light_is_stopped() {
    let (stage, _) = eclipse();
    // The same, seen as ground: the square stands upright at z = 1, the sun shines down on y = −1.
    let direction = Vec3::new(0.0, -1.0, 1.0).normalize();
    let scene = Scene { objects: stage.scene().objects[1..].to_vec(), ..stage.scene() };
    let bounds = [Vec3::new(-0.5, -0.5, 1.0), Vec3::new(0.5, 0.5, 1.0)];
    let map = map_of(&scene, direction, bounds, 256);
    let mut f = Footprint::default();
    f.cast(&map, -1.0, 0.0);
    // A point at height y above the ground falls as far away as it stands high: the square's edges to z = 1.5 and 2.5.
    for (z, want) in [(1.45, 0.0), (1.55, 1.0), (2.0, 1.0), (2.45, 1.0), (2.55, 0.0)] {
        assert_eq!(f.at(Vec3::new(0.2, -1.0, z)), want, "{z}");
    }
    // A wide lamp blurs the far edge more than the near one.
    f.cast(&map, -1.0, 0.1);
    let width = |a: f32, b: f32| {
        let steps = (0..200).map(|i| f.at(Vec3::new(0.0, -1.0, a + (b - a) * i as f32 / 200.0)));
        steps.filter(|d| (0.1..0.9).contains(d)).count()
    };
    assert!(width(2.2, 2.8) > width(1.2, 1.8), "{} {}", width(2.2, 2.8), width(1.2, 1.8));
}

/// A flag of one known colour.
fn flag() -> Import {
    let rig = br##"{
      "sinew_rig": 1,
      "bones": [{"name": "pole", "head": [0,0,0], "tail": [0,1,0]}],
      "materials": [{"name": "cloth", "diffuse": "#c86432", "specular": "#ffffff", "double_sided": true}],
      "meshes": [{"name": "flag", "material": "cloth", "bind": "closest",
        "positions": [[-1,0,0],[1,0,0],[1,2,0.5],[-1,2,0.5]], "triangles": [[0,1,2],[0,2,3]]}]
    }"##;
    let none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    io::rig_json::import_bytes(rig, &Options::default(), &none).unwrap()
}

fn bytes(import: &Import, look: Look, size: usize, threads: usize) -> Rgba8 {
    let settings = Settings { width: size, height: size, samples: 4, threads };
    let view = View::Orbit { yaw: 0.4, pitch: 0.4, fov_y: 0.6 };
    let shot = Shot::new(&import.asset, ShotDesc { look, settings, view, ..Default::default() }).unwrap();
    let mut out = Rgba8::default();
    shot.draw(0.0, &mut Worker::default(), &mut out);
    out
}

#[test]
fn flat_light_shows_colours_as_they_are() {
    let look = Look { lighting: Some(Lighting::flat()), ..Look::default() };
    let picture = bytes(&flag(), look.clone(), 64, 1);
    let solid: Vec<&[u8]> = picture.data.chunks(4).filter(|p| p[3] == 255).collect();
    assert!(solid.len() > 500 && solid.iter().all(|p| p[..3] == [0xc8, 0x64, 0x32]), "{:?}", solid[0]);

    // A patch by name changes it.
    let patch = MaterialPatch { name: "cl?th*".into(), diffuse: Some(Vec3::Y), ..Default::default() };
    let picture = bytes(&flag(), Look { materials: vec![patch], ..look }, 64, 1);
    assert!(picture.data.chunks(4).all(|p| p[3] < 255 || p[..3] == [0, 255, 0]));
}

#[test]
fn on_nothing_the_ground_is_black_where_it_is_dark_and_else_not_there() {
    for shadows in [Shadows::None, Shadows::Contact, Shadows::Map] {
        let plain = bytes(&flag(), Look::default(), 128, 1);
        let look = Look { ground: Some(GroundLook::default()), shadows, ..Look::default() };
        // The flag would be shadowed too.
        let lighting = Some(Lighting { lamps: vec![Lighting::studio().lamps[0]], ..Lighting::flat() });
        let picture = bytes(&flag(), Look { lighting, ..look }, 128, 1);
        let mut dark = 0;
        for (i, (a, b)) in plain.data.chunks(4).zip(picture.data.chunks(4)).enumerate() {
            if a[3] == 0 {
                assert_eq!(b[..3], [0; 3], "{shadows:?}, pixel {i}");
                dark += usize::from(b[3] > 20);
            } else {
                assert!(b[3] >= a[3], "{shadows:?}, pixel {i}");
            }
        }
        assert_eq!(dark > 100, shadows != Shadows::None, "{shadows:?}: {dark}");
        assert_eq!(picture.data[..4], [0; 4], "{shadows:?}");
    }
}

#[test]
fn a_coloured_ground_fades_and_has_no_edge() {
    let ground = Some(GroundLook { color: Some(Vec3::new(1.0, 0.0, 0.0)) });
    let look = Look { ground, background: [0.0, 0.0, 1.0, 1.0], ..Look::default() };
    let picture = bytes(&flag(), look, 256, 1);
    let red = |x: usize, y: usize| picture.data[4 * (y * 256 + x)] as i32;
    // The lower corner is ground, and up the left edge no step is larger than a slope's.
    assert!(red(0, 255) > 200, "{}", red(0, 255));
    let steps = (1..256).map(|y| (red(0, y) - red(0, y - 1)).abs());
    assert!(steps.max().unwrap() <= 24);
}

/// Everything at once.
fn rich() -> Look {
    Look {
        background: [0.1, 0.2, 0.5, 1.0],
        background_bottom: Some([0.8, 0.7, 0.6, 1.0]),
        lighting: Some(Lighting::studio()),
        shading: Shading::Toon(3),
        outline: Some(Outline { width: 2.0, color: [0.0, 0.0, 0.0, 0.8] }),
        ground: Some(GroundLook { color: Some(Vec3::splat(0.4)) }),
        shadows: Shadows::Map,
        grade: Grade { exposure_stops: 0.3, dither: Dither::FloydSteinberg, ..Grade::default() },
        ..Look::default()
    }
}

#[test]
fn threads_and_used_workers_do_not_change_a_byte() {
    let one = bytes(&flag(), rich(), 200, 1);
    assert!([2, 3].iter().all(|&n| bytes(&flag(), rich(), 200, n) == one));
    let import = flag();
    let settings = Settings { width: 200, height: 200, ..Settings::default() };
    let view = View::Orbit { yaw: 0.4, pitch: 0.4, fov_y: 0.6 };
    let desc = |look| ShotDesc { look, settings, view, ..Default::default() };
    let (rich, plain) = (desc(rich()), desc(Look { ground: Some(GroundLook::default()), ..Look::default() }));
    let mut worker = Worker::default();
    let mut draw = |d: &ShotDesc| {
        let mut out = Rgba8::default();
        Shot::new(&import.asset, d.clone()).unwrap().draw(0.0, &mut worker, &mut out);
        out
    };
    let first = [draw(&plain), draw(&rich)];
    assert_eq!(first[1], one);
    assert_eq!(draw(&plain), first[0]);
}

#[test]
fn both_builds_of_the_kernels_draw_the_same_styles() {
    let (mut stage, direction) = eclipse();
    stage.ambient = Vec3::splat(0.2);
    stage.meshes.push((ball(), 1));
    stage.materials.push(Material { specular: Vec3::splat(0.5), ..matt(0.6) });
    let map = map_of(&stage.scene(), direction, [Vec3::splat(-3.0), Vec3::splat(3.0)], 128);
    for toon in [None, Some(4)] {
        let style = Style { below: Some(Vec3::splat(0.1)), toon, shadow: Some(&map), sky: None };
        let scene = Scene { style, ..stage.scene() };
        assert!(linear(&scene, 150, Isa::Best) == linear(&scene, 150, Isa::Portable), "{toon:?}");
    }
}

#[test]
fn dithering_makes_bands_of_a_gradient_vanish() {
    // 24 codes over 384 rows: bands of 16 rows.
    let signal = |c: f32| sinew::image::color::linear_from_srgb(c / 255.0);
    let gray = |c: f32| [signal(c), signal(c), signal(c), 1.0];
    let none = MaterialPatch { name: "*".into(), alpha: Some(0.0), ..Default::default() };
    let worst = |dither: Dither| {
        let look = Look {
            background: gray(60.0),
            background_bottom: Some(gray(84.0)),
            materials: vec![none.clone()],
            grade: Grade { dither, ..Grade::default() },
            ..Look::default()
        };
        let picture = bytes(&flag(), look, 384, 1);
        // How far the mean of 8 by 8 pixels, as light, is from the gradient's, in codes.
        let mut worst = 0.0_f32;
        for y in (0..384).step_by(8) {
            for x in (0..384).step_by(8) {
                let pixels = (0..64).map(|k| picture.data[4 * ((y + k / 8) * 384 + x + k % 8)] as f32);
                let mean = pixels.sum::<f32>() / 64.0;
                worst = worst.max((mean - (60.0 + (y as f32 + 4.0) / 16.0)).abs());
            }
        }
        worst
    };
    let (plain, ordered, diffused) =
        (worst(Dither::None), worst(Dither::Ordered), worst(Dither::FloydSteinberg));
    assert!(plain > 0.2, "{plain}");
    assert!(ordered < 0.05 && diffused < 0.12, "{plain} {ordered} {diffused}");
}

#[test]
fn mistakes_in_look_files_are_named() {
    let cases = [
        ("{}", "missing field `sinew_look`"),
        (r#"{"sinew_look": 2}"#, "`sinew_look` is 2; this version reads 1"),
        (r#"{"sinew_look": 1, "lamp": []}"#, "unknown field `lamp`"),
        (r#"{"sinew_look": 1, "lamps": [{"kind": "area"}]}"#, "unknown variant `area`"),
        (r#"{"sinew_look": 1, "lamps": [{"kind": "point", "power": 3}]}"#, "unknown field `power`"),
        (r#"{"sinew_look": 1, "lamps": [{"kind": "point"}]}"#, "lamps[0]: `position` is missing"),
        (
            r#"{"sinew_look": 1, "lamps": [{"kind": "directional", "from": [0,0,0]}]}"#,
            "lamps[0]: `from` has no length",
        ),
        (
            r#"{"sinew_look": 1, "lamps": [{"kind": "directional", "from": [0,1,0], "range": 2}]}"#,
            "a directional lamp has no `range`",
        ),
        (
            r#"{"sinew_look": 1, "lamps": [{"kind": "directional", "from": [0,1,0], "intensity": -1}]}"#,
            "`intensity` must be a number from 0 to 1000000, found -1",
        ),
        (r##"{"sinew_look": 1, "ambient": "#12345"}"##, "expected a colour"),
        (r##"{"sinew_look": 1, "ambient": "#12345680"}"##, "ambient: light has no alpha"),
        (r#"{"sinew_look": 1, "light": "sun", "lamps": []}"#, "light: a preset has its own"),
        (r#"{"sinew_look": 1, "background": "red"}"#, "expected \"transparent\", a colour"),
        (
            r##"{"sinew_look": 1, "materials": [{"name": "a", "diffuse": "#11223380", "alpha": 1}]}"##,
            "materials[0] `a`: alpha is given twice",
        ),
        (r#"{"sinew_look": 1, "materials": [{"name": "a", "shininess": 1e9}]}"#, "`shininess` must be"),
    ];
    for (text, want) in cases {
        let message = look_json::from_bytes(text.as_bytes()).expect_err(text).to_string();
        assert!(message.contains(want), "{text}\n{message}\nexpected: {want}");
    }
}

#[test]
fn shipped_looks_load_and_broken_ones_do_not_panic() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/looks");
    let mut rng = Rng::new(3);
    let files = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let files: Vec<_> = files.filter(|p| p.extension().is_some_and(|e| e == "json")).collect();
    assert!(!files.is_empty());
    for file in files {
        let text = std::fs::read(&file).unwrap();
        let look = look_json::from_bytes(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        assert!(look.lighting.is_some());
        for _ in 0..300 {
            let mut broken = text.clone();
            let at = (rng.span(0.0, text.len() as f32) as usize).min(text.len() - 1);
            broken[at] = rng.span(0.0, 255.0) as u8;
            let _ = look_json::from_bytes(&broken);
            let _ = look_json::from_bytes(&text[..at]);
        }
    }
}

#[test]
fn unlit_surfaces_know_no_tones_and_no_shadows() {
    let stage = Stage::of(from_front(5.0, 2.0), Mesh::new(quad(1.0, 0.0)).unwrap(), material(Vec4::ONE));
    let style = Style { below: Some(Vec3::ZERO), toon: Some(2), shadow: None, sky: None };
    let picture = linear(&Scene { style, ..stage.scene() }, 8, Isa::Best);
    assert!(picture.pixels.iter().all(|p| *p == [1.0; 4]));
}
