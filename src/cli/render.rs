//! `sinew render`: what is to be drawn, and from where.

use super::film::{self, Job};
use super::{Failure, find_clip, load_posed, print, say, say::Say};
use sinew::asset::Asset;
use sinew::frames::{Shot, View};
use sinew::image::color::linear_from_srgb;
use sinew::io::Options;
use sinew::io::picture::{Format, PngLevel, Target};
use sinew::render::Settings;
use sinew::time::{FrameSet, Range, Rate, Wrap, frame_count, frame_time};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sinew render rigs/pip.json -o walk.gif
  sinew render fox.glb -o fox.png --at 0.5 --size 1024
  sinew render fox.glb -o run.####.png --clip Run --fps 30 --background transparent
  sinew render fox.glb -o part.%04d.png --frames 1-48x2,60
  sinew render fox.glb -o side.apng --camera yaw=90,pitch=5,fov=20
  sinew render fox.glb --list

Frames are numbered from 1; frame 1 shows 0 s, or the clip's first key if that is earlier. The camera orbits the character and stands where all of it is
seen over the whole clip, unless --camera names one of the asset's. An existing file is kept unless --force is given.";

/// Most frames of one film: eleven hours at 24 a second.
const MOST_FRAMES: usize = 1_000_000;

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A glTF file (.gltf, .glb) or a rig (.json).
    input: PathBuf,
    /// A picture (.png), a numbered sequence (out.####.png, out.%04d.png) or a film (.gif, .apng).
    #[arg(short, long, value_name = "OUT", required_unless_present = "list")]
    output: Option<PathBuf>,
    /// Show the clips and cameras of the input and stop.
    #[arg(long)]
    list: bool,
    /// Clip by name or index; the first by default.
    #[arg(long, value_name = "NAME|INDEX")]
    clip: Option<String>,
    /// The rest pose, untouched by any clip.
    #[arg(long, conflicts_with_all = ["clip", "poses"])]
    rest: bool,
    /// Clips from this file instead of the input's.
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// Draw this moment, in seconds.
    #[arg(long, value_name = "SECONDS", conflicts_with = "frames", allow_hyphen_values = true)]
    at: Option<f64>,
    /// Draw these frames only, as in 1-48x2,60.
    #[arg(long, value_name = "SET", allow_hyphen_values = true)]
    frames: Option<FrameSet>,
    /// Frames a second, as in 24, 29.97 or 30000/1001.
    #[arg(long, default_value = "24", value_name = "RATE")]
    fps: Rate,
    /// Pixels, as in 512 or 1920x1080.
    #[arg(long, default_value = "512", value_name = "WxH", value_parser = parse_size)]
    size: [usize; 2],
    /// What times outside the clip show: its ends (clamp), the clip again (loop), or there and back (ping-pong).
    #[arg(long, default_value = "clamp", value_name = "MODE", value_parser = parse_wrap)]
    wrap: Wrap,
    /// Colour behind the character: transparent or #rrggbb.
    #[arg(long, default_value = "#e8eaed", value_name = "COLOR", value_parser = parse_background)]
    background: [f32; 4],
    /// Orbit as yaw=30,pitch=15,fov=30 in degrees (each optional; fov=0 is parallel), or one of the asset's cameras by name or index.
    #[arg(long, default_value = "yaw=30,pitch=12,fov=30", value_name = "ORBIT|NAME|INDEX")]
    camera: String,
    /// Coverage samples a pixel, 1 or 4.
    #[arg(long, default_value = "4", value_parser = ["1", "4"])]
    samples: String,
    /// How hard to press PNG files: fast, balanced or best.
    #[arg(long, default_value = "fast", value_parser = parse_level)]
    png: PngLevel,
    /// Write an animated PNG even though the name ends in .png.
    #[arg(long)]
    apng: bool,
    /// Worker threads; 0 takes one a processor. The result does not depend on it.
    #[arg(long, default_value = "0", value_name = "N")]
    threads: usize,
    /// Overwrite existing files.
    #[arg(short, long)]
    force: bool,
}

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    let usage = |e: &dyn std::fmt::Display| Failure::Usage(e.to_string());
    let parse = |path| if args.apng { Target::parse_as(path, Format::Apng) } else { Target::parse(path) };
    let target = args.output.as_ref().map(parse).transpose().map_err(|e| usage(&e))?;
    if args.at.is_some_and(|t| !t.is_finite()) {
        return Err(Failure::Usage("--at: expected seconds".into()));
    }
    let processors = std::thread::available_parallelism().map_or(1, |n| n.get());
    let threads = if args.threads == 0 { processors } else { args.threads.min(256) };
    let settings = Settings {
        width: args.size[0],
        height: args.size[1],
        samples: if args.samples == "1" { 1 } else { 4 },
        threads: 1,
    };
    settings.check().map_err(|e| Failure::Usage(format!("--size: {e}")))?;

    let options = Options { textures: target.is_some() };
    let import = load_posed(&args.input, args.poses.as_ref(), options, say)?;
    let Some(target) = target.filter(|_| !args.list) else { return list(&import.asset) };
    keep_inputs(args, &target)?;
    let clip = if args.rest { None } else { find_clip(&import, args.clip.as_deref())? };
    let view = find_view(&import.asset, &args.camera)?;
    let moments = moments(args, &import.asset, clip, &target)?;
    target.check_frames(moments.len()).map_err(|e| usage(&e))?;

    let character = &import.asset.character;
    if character.instances().iter().all(|i| character.mesh(i).triangles.is_empty()) {
        say.warn(&format!("{}: there are no triangles; the picture will be empty", args.input.display()));
    }

    // One picture is drawn by all threads, many by one thread each.
    let alone = moments.len() == 1;
    let settings = Settings { threads: if alone { threads } else { 1 }, ..settings };
    let shot = Shot::new(&import.asset, clip, view, args.background, settings).map_err(|e| usage(&e))?;
    let shot = shot.wrapped(args.wrap);
    let transparent = args.background[3] < 1.0;
    let job = Job {
        shot: &shot,
        moments: &moments,
        rate: args.fps,
        size: args.size,
        transparent,
        target: &target,
        level: args.png,
        threads,
        force: args.force,
    };
    film::write(&job, say)
}

/// Refuse to write over what is being read, `--force` or not.
fn keep_inputs(args: &Args, target: &Target) -> Result<(), Failure> {
    let Some(Ok(output)) = target.path_of(1).map(|p| p.canonicalize()) else { return Ok(()) };
    for input in [Some(&args.input), args.poses.as_ref()].into_iter().flatten() {
        if input.canonicalize().is_ok_and(|i| i == output) {
            let message = format!("-o {}: this is the input; choose another name", input.display());
            return Err(Failure::Usage(message));
        }
    }
    Ok(())
}

/// Frame numbers and seconds to be drawn.
fn moments(
    args: &Args,
    asset: &Asset,
    clip: Option<usize>,
    target: &Target,
) -> Result<Vec<(i64, f64)>, Failure> {
    let range = clip.map_or(Range::default(), |c| asset.character.clips()[c].playback());
    if let Some(t) = args.at {
        return Ok(vec![(1, t)]);
    }
    let timed = |n: i64| (n, frame_time(range.start, n, args.fps));
    match (&args.frames, target) {
        (Some(set), _) => Ok(set.iter().map(timed).collect()),
        (None, target) if !target.takes_a_clip() => Ok(vec![timed(1)]),
        (None, _) => {
            let count = frame_count(range, args.fps.fps(), MOST_FRAMES);
            let count = count
                .map_err(|e| Failure::Run(format!("{}: {e} (--frames, --fps)", args.input.display())))?;
            Ok((1..=count as i64).map(timed).collect())
        }
    }
}

/// The orbit, or the asset's camera, that `--camera` names.
fn find_view(asset: &Asset, text: &str) -> Result<View, Failure> {
    let named = asset.cameras.iter().position(|c| c.name == text);
    let index = text.parse::<usize>().ok().filter(|&i| i < asset.cameras.len());
    if let Some(camera) = named.or(index) {
        return Ok(View::Mounted(camera));
    }
    let (mut yaw, mut pitch, mut fov) = (30.0_f32, 12.0_f32, 30.0_f32);
    for part in text.split(',') {
        let number = part.split_once('=').and_then(|(k, v)| Some((k.trim(), v.trim().parse::<f32>().ok()?)));
        match number.filter(|(_, v)| v.is_finite()) {
            Some(("yaw", v)) => yaw = v,
            Some(("pitch", v)) if v.abs() <= 90.0 => pitch = v,
            Some(("fov", v)) if (0.0..=160.0).contains(&v) => fov = v,
            _ => {
                let names: Vec<&str> = asset.cameras.iter().map(|c| c.name.as_str()).collect();
                return Err(Failure::Usage(format!(
                    "--camera {text}: expected yaw=DEG,pitch=−90…90,fov=0…160 or one of the asset's cameras ({})",
                    if names.is_empty() { "it has none".into() } else { names.join(", ") }
                )));
            }
        }
    }
    Ok(View::Orbit { yaw: yaw.to_radians(), pitch: pitch.to_radians(), fov_y: fov.to_radians() })
}

fn list(asset: &Asset) -> Result<(), Failure> {
    let mut text = String::new();
    for (i, c) in asset.character.clips().iter().enumerate() {
        text += &format!("clip {i}: {} ({:.3} s)\n", say::name(&c.name), c.playback().duration());
    }
    for (i, c) in asset.cameras.iter().enumerate() {
        text += &format!("camera {i}: {}\n", say::name(&c.name));
    }
    if text.is_empty() {
        text = "no clips and no cameras\n".into();
    }
    print(text.as_bytes())
}

fn parse_size(text: &str) -> Result<[usize; 2], String> {
    let side = |s: &str| s.trim().parse::<usize>().ok().filter(|n| (1..=16384).contains(n));
    let (w, h) = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
    match (side(w), side(h)) {
        (Some(w), Some(h)) => Ok([w, h]),
        _ => Err("expected pixels from 1 to 16384, as in 512 or 1920x1080".into()),
    }
}

fn parse_background(text: &str) -> Result<[f32; 4], String> {
    if text == "transparent" {
        return Ok([0.0; 4]);
    }
    let hex = text.strip_prefix('#').filter(|h| h.len() == 6);
    let code = hex.and_then(|h| u32::from_str_radix(h, 16).ok());
    let code = code.ok_or("expected transparent or #rrggbb")?;
    let channel = |shift: u32| linear_from_srgb((code >> shift & 255) as f32 / 255.0);
    Ok([channel(16), channel(8), channel(0), 1.0])
}

fn parse_wrap(text: &str) -> Result<Wrap, String> {
    match text {
        "clamp" => Ok(Wrap::Clamp),
        "loop" => Ok(Wrap::Loop),
        "ping-pong" => Ok(Wrap::PingPong),
        _ => Err("expected clamp, loop or ping-pong".into()),
    }
}

fn parse_level(text: &str) -> Result<PngLevel, String> {
    match text {
        "fast" => Ok(PngLevel::Fast),
        "balanced" => Ok(PngLevel::Balanced),
        "best" => Ok(PngLevel::Best),
        _ => Err("expected fast, balanced or best".into()),
    }
}
