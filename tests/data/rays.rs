//! The notes' reference pictures of chapters 2 and 3: exact in every pixel in `f64`, and all but so in `f32`.

use super::images::load;
use glam::DVec3;
use sinew::io::scene::notes;
use sinew::render::Settings;
use sinew::render::ray::{Precision, RaySettings, ShapeCast, ShapePicture, Tracer, undisturbed};
use sinew::scene::ShapeScene;
use std::path::Path;

const SETTINGS: Settings = Settings { width: 640, height: 360, samples: 1, threads: 1 };

/// Colours of the first objects.
const COLORS: [[u8; 3]; 5] = [[228, 26, 28], [55, 126, 184], [77, 175, 74], [152, 78, 163], [255, 127, 0]];

fn scene(data: &Path, file: &str) -> Result<ShapeScene, String> {
    let file = data.join("notes").join(file).with_extension("json");
    let bytes = std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
    notes::from_bytes(&bytes, file.parent().expect("a folder")).map_err(|e| e.to_string())
}

fn codes(v: DVec3) -> [u8; 3] {
    v.to_array().map(|x| (255.0 * x.clamp(0.0, 1.0)) as u8)
}

/// No difference in `f64`; in `f32` in one pixel of a thousand at most, and by one code.
fn check(data: &Path, name: &str, precision: Precision, found: &[[u8; 3]]) -> Result<(), String> {
    let want = load(&data.join("notes").join(name).with_extension("png"))?;
    assert_eq!(want.data.len(), 4 * found.len());
    let (mut differ, mut most) = (0, 0);
    for (w, f) in want.data.chunks(4).zip(found) {
        let off = (0..3).map(|c| w[c].abs_diff(f[c])).max().unwrap_or(0);
        (differ, most) = (differ + usize::from(off > 0), most.max(off));
    }
    let fine = match precision {
        Precision::F64 => differ == 0,
        Precision::F32 => differ * 1000 <= found.len() && most <= 1,
    };
    if fine { Ok(()) } else { Err(format!("{name}, {precision:?}: {differ} pixels differ, by up to {most}")) }
}

pub fn cast_rays_meet_what_they_do_in_the_notes(data: &Path) -> Result<(), String> {
    let all: [(&str, &[&str]); 3] = [
        ("sphere-and-plane", &["id", "normal", "depth"]),
        ("sphere-packing", &["id", "normal", "depth"]),
        ("triangle", &["id"]),
    ];
    for precision in [Precision::F64, Precision::F32] {
        for (name, kinds) in all {
            let scene = scene(data, &format!("ray-casting/{name}"))?;
            let mut seen = ShapeCast::default();
            Tracer::default().cast_shapes(&scene, &SETTINGS, precision, &mut seen);
            let pixel = |i: usize, kind: &str| match (seen.objects[i] as usize, kind) {
                (0, _) => [0; 3],
                (object, "id") => COLORS[object - 1],
                (_, "normal") => codes(seen.normals[i] * 0.5 + 0.5),
                _ => codes(DVec3::splat(1.0 / seen.distances[i])),
            };
            for kind in kinds {
                let found: Vec<[u8; 3]> = (0..seen.objects.len()).map(|i| pixel(i, kind)).collect();
                check(data, &format!("ray-casting/reference/{name}-{kind}"), precision, &found)?;
            }
        }
    }
    Ok(())
}

pub fn traced_rays_bring_the_light_of_the_notes(data: &Path) -> Result<(), String> {
    let full = scene(data, "ray-tracing/sphere-and-plane")?;
    let packing = scene(data, "ray-tracing/sphere-packing")?;
    let without = |specular: bool| {
        let mut s = full.clone();
        for m in &mut s.materials {
            m.mirror = DVec3::ZERO;
            m.specular = if specular { m.specular } else { DVec3::ZERO };
        }
        s
    };
    let dark = ShapeScene { lights: vec![], ..without(false) };
    let all = [
        ("ambient", &dark, 0, false),
        ("ambient-diffuse", &without(false), 0, false),
        ("ambient-diffuse-specular", &without(true), 0, false),
        ("ambient-diffuse-specular-shadows", &without(true), 0, true),
        ("sphere-and-plane", &full, 5, true),
        ("sphere-packing", &packing, 10, true),
    ];
    for precision in [Precision::F64, Precision::F32] {
        for (name, scene, depth, shadows) in all {
            let ray = RaySettings { depth, shadows, precision, cutoff: 0.0, ..Default::default() };
            let mut picture = ShapePicture::default();
            Tracer::default().draw_shapes(scene, &SETTINGS, &ray, &mut undisturbed, &mut picture);
            let found: Vec<[u8; 3]> = picture.light.iter().map(|l| codes(*l)).collect();
            check(data, &format!("ray-tracing/reference/{name}"), precision, &found)?;
        }
    }
    Ok(())
}
