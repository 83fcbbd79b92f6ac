//! Scenes of the notes: one picture each, by rays.

use super::channels::Beside;
use super::film::Written;
use super::{Args, Plan, Task, renderer};
use crate::cli::{Failure, say::Say};
use glam::DVec3;
use sinew::frames::FrameStats;
use sinew::image::depth::Rounding;
use sinew::image::{Image, Rgba8};
use sinew::io::manifest::sha256;
use sinew::io::picture::{
    AtomicFile, ExrDepth, Folder, Format, Output, Target, encode_exr_layers, encode_png, encode_webp,
};
use sinew::render::Settings;
use sinew::render::channel::Channels;
use sinew::render::ray::{ShapeCast, ShapePicture, Tracer};
use sinew::scene::{Geometry, ShapeScene};
use std::io::Write;
use std::time::Instant;

/// Pixels of a picture where nothing says: 640 a row, and rows as the sensor has them.
pub fn usual_size(scene: &ShapeScene) -> [usize; 2] {
    let rows = 640.0 * scene.camera.height / scene.camera.width;
    [640, rows.round().clamp(1.0, 16384.0) as usize]
}

/// Draw a scene and write its picture.
pub fn draw(
    args: &Args,
    task: &Task,
    plan: &Plan,
    scene: &ShapeScene,
    say: &Say,
) -> Result<Written, Failure> {
    check(args, task, plan)?;
    let ray = args.renderer.of_notes()?;
    let [width, height] = plan.size;
    let settings = Settings { width, height, samples: 4, threads: args.output.threads() };
    let format = task.target.format();
    let number = plan.frames.first().map_or(1, |f| f.number);
    let path = task.target.path_of(number);
    let beside_files = args.channels.files(task.target, number);
    let folder = if matches!(task.target, Target::Sequence(..)) { Folder::Create } else { Folder::MustExist };
    if !args.output.force
        && let Some(there) = path.iter().chain(&beside_files).find(|p| p.exists())
    {
        return Err(Failure::Run(format!("{}: the file exists; --force overwrites it", there.display())));
    }

    let (start, bar) = (Instant::now(), say.picture_progress());
    let mut tracer = Tracer::default();
    let mut picture = ShapePicture::default();
    let mut watch = renderer::watch(args.renderer.budget, bar.clone());
    let outcome = tracer.draw_shapes(scene, &settings, &ray, &mut *watch, &mut picture);
    bar.finish_and_clear();
    let drawn = FrameStats { rays: outcome, ..FrameStats::default() };
    let mut written = Written { drawn, ..Written::default() };
    let seen = match args.channels.names().is_empty() {
        true => Channels::default(),
        false => {
            let mut cast = ShapeCast::default();
            tracer.cast_shapes(scene, &settings, ray.precision, &mut cast);
            channels(scene, &cast)
        }
    };
    written.drawn.times.draw = start.elapsed();

    let start = Instant::now();
    let beside = Beside::of_picture(&args.channels, &seen, names(scene), args.output.png);
    let failed = |e: sinew::io::picture::Error| Failure::Run(e.to_string());
    let bytes = match format {
        Format::Exr => encode_exr_layers(&light(&picture), ExrDepth::Float, &beside.layers(&seen)),
        Format::Webp => encode_webp(&codes(args, &picture)),
        _ => encode_png(&codes(args, &picture), args.output.png),
    };
    let bytes = bytes.map_err(failed)?;
    let files = beside.encode_all(format, &seen).map_err(failed)?;
    written.encode = start.elapsed();
    written.bytes = bytes.len() as u64;
    written.hashes.extend(args.batch.manifest.is_some().then(|| sha256(&bytes)));
    match &path {
        Some(path) => {
            for (name, bytes) in &files {
                written.bytes += bytes.len() as u64;
                AtomicFile::write(name.file(path), bytes, args.output.force, folder).map_err(failed)?;
            }
            AtomicFile::write(path, &bytes, args.output.force, folder).map_err(failed)?;
            say.note(&format!("wrote {}", path.display()));
        }
        None => {
            let mut out = Output::stdout(false);
            let done = out.write_all(&bytes).map_err(|e| Failure::Run(format!("standard output: {e}")));
            done.and_then(|()| out.commit().map_err(failed))?;
        }
    }
    Ok(written)
}

/// Refuse what such a scene has no use for.
fn check(args: &Args, task: &Task, plan: &Plan) -> Result<(), Failure> {
    let usage =
        |what: &str| Err(Failure::Usage(format!("{}: a scene of the notes {what}", task.input.display())));
    if args.sheet.is_one_picture() || args.sheet.pixels.is_on() {
        return usage("does not move: there is nothing to make a sheet or pixel art of");
    }
    if task.target.is_film(1) || plan.frames.len() > 1 {
        return usage("does not move: expected one picture, in a name that ends in .png, .webp or .exr");
    }
    if !args.camera.is_default() || args.camera.eye.is_some() || args.camera.turntable.is_some() {
        return usage("has its own camera; leave --camera, --eye and --turntable out");
    }
    if args.look.is_some() {
        return usage(
            "has its own light and materials; leave --light, --look, --background, --ground and --outline out",
        );
    }
    Ok(())
}

/// Codes as the notes have them, `⌊255·min(1, L)⌋` without gamma, unless a grade is asked for.
fn codes(args: &Args, picture: &ShapePicture) -> Rgba8 {
    let mut out = Rgba8 { width: picture.width, height: picture.height, data: Vec::new() };
    let grade = args.look.grade();
    if !grade.is_plain() {
        grade.develop(&light(picture), &mut out);
        return out;
    }
    let code = |c: f64| Rounding::Truncate.quantise(c, 255) as u8;
    out.data = picture.light.iter().flat_map(|l| [code(l.x), code(l.y), code(l.z), 255]).collect();
    out
}

fn light(picture: &ShapePicture) -> Image {
    let pixels = picture.light.iter().map(|l| l.as_vec3().extend(1.0).to_array()).collect();
    Image { width: picture.width, height: picture.height, pixels }
}

/// What was cast, in the terms of all pictures: distances along the view direction, normals in view space.
fn channels(scene: &ShapeScene, cast: &ShapeCast) -> Channels {
    let camera = &scene.camera;
    let [u, v, w] = camera.axes;
    let mut seen = Channels::default();
    seen.reset(cast.width, cast.height, &sinew::render::channel::Channel::ALL);
    seen.objects.clone_from(&cast.objects);
    for i in (0..seen.objects.len()).filter(|&i| cast.objects[i] > 0) {
        let [x, y] = [i % cast.width, i / cast.width].map(|n| n as f64 + 0.5);
        let right = camera.width * (x / cast.width as f64 - 0.5);
        let up = camera.height * (0.5 - y / cast.height as f64);
        let ray = u * right + v * up - w * camera.focal;
        let t = cast.distances[i] * camera.focal / ray.length();
        let n = cast.normals[i];
        let n = if n.dot(ray) > 0.0 { -n } else { n };
        seen.depth[i] = (t * camera.focal) as f32;
        seen.positions[i] = (camera.eye + ray * t).as_vec3();
        seen.normals[i] = DVec3::new(n.dot(u), n.dot(v), n.dot(w)).as_vec3();
    }
    seen
}

fn names(scene: &ShapeScene) -> Vec<String> {
    let kind = |g: &Geometry| match g {
        Geometry::Sphere { .. } => "sphere",
        Geometry::Plane { .. } => "plane",
        Geometry::Triangle(_) => "triangle",
    };
    let shapes = scene.shapes.iter().map(|s| kind(&s.geometry));
    shapes.chain(scene.soups.iter().map(|_| "soup")).map(String::from).collect()
}
