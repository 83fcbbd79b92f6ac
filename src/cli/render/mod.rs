//! `sinew render`: what is to be drawn, from where, and into which files. One file a group of options.

mod batch;
mod camera;
mod film;
mod look;
mod output;
mod overlay;
mod sheet;
mod time;

use super::{Failure, load_posed, print, say, say::Say};
use film::Job;
use sinew::asset::Asset;
use sinew::frames::{Shot, ShotDesc};
use sinew::io::Options;
use sinew::io::picture::Target;
use sinew::render::Settings;
use sinew::time::Range;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sinew render rigs/pip.json -o walk.gif
  sinew render fox.glb -o fox.png --at 0.5 --size 1024
  sinew render fox.glb -o run.####.png --clip Run --fps 30 --background transparent
  sinew render fox.glb -o part.%04d.png --frames 1-48x2,60
  sinew render fox.glb -o side.apng --camera yaw=90,pitch=5,fov=20
  sinew render rigs/pip.json -o pip-sheet.png --sheet trimmed --directions 8 --camera yaw=0,pitch=30,fov=0 --size 128 --fps 12
  sinew render fox.glb -o fox-sheet.png --sheet grid --maps normal,depth,id --sheet-json aseprite --size 128
  sinew render fox.glb -o fox.gif --pixel-art --pixel-scale 4 --size 256 --colors 16 --outline
  sinew render fox.glb -o fox-contact.png --contact 6x4 --size 160
  sinew render fox.glb --list

Frames are numbered from 1; frame 1 shows 0 s, or the clip's first key if that is earlier. The camera orbits the character and stands where all of it is
seen over the whole clip, unless --camera names one of the asset's. An existing file is kept unless --force is given.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A glTF file (.gltf, .glb) or a rig (.json).
    input: PathBuf,
    /// Show the clips and cameras of the input and stop.
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    output: output::OutputArgs,
    #[command(flatten)]
    time: time::TimeArgs,
    #[command(flatten)]
    camera: camera::CameraArgs,
    #[command(flatten)]
    look: look::LookArgs,
    #[command(flatten)]
    overlay: overlay::OverlayArgs,
    #[command(flatten)]
    sheet: sheet::SheetArgs,
    #[command(flatten)]
    batch: batch::BatchArgs,
}

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    let usage = |e: &dyn std::fmt::Display| Failure::Usage(e.to_string());
    let target = args.output.target()?;
    let settings = args.sheet.settings(args.output.settings()?)?;
    let threads = args.output.threads();

    let options = Options { textures: target.is_some() };
    let import = load_posed(&args.input, args.time.poses.as_ref(), options, say)?;
    let asset = &import.asset;
    let Some(target) = target.filter(|_| !args.list) else { return list(asset) };
    keep_inputs(args, &target)?;
    let one_picture = args.sheet.is_one_picture();
    let clip = args.time.clip(&import)?;
    let range = clip.map_or(Range::default(), |c| asset.character.clips()[c].playback());
    let alone = matches!(target, Target::Still(_)) && !one_picture;
    let mut frames = args.time.frames(&args.input, range, alone)?;
    if !one_picture {
        target.check_frames(frames.len()).map_err(|e| usage(&e))?;
    }

    let character = &asset.character;
    if character.instances().iter().all(|i| character.mesh(i).triangles.is_empty()) {
        say.warn(&format!("{}: there are no triangles; the picture will be empty", args.input.display()));
    }

    // One picture is drawn by all threads, many by one thread each.
    let settings =
        Settings { threads: if frames.len() == 1 && !one_picture { threads } else { 1 }, ..settings };
    let mut look = args.look.look(asset)?;
    let background = if args.sheet.is_transparent() { [0.0; 4] } else { look.background };
    if args.sheet.clears_background() {
        look.background = [0.0; 4];
    }
    let desc = ShotDesc { clip, wrap: args.time.wrap, view: args.camera.view(asset)?, look, settings };
    let shot = Shot::new(asset, desc).map_err(|e| usage(&e))?;
    if let Some(moments) = args.sheet.contact_frames(&shot) {
        frames = moments;
    }
    let mut job = Job {
        shot: &shot,
        frames: &frames,
        rate: args.time.fps,
        transparent: args.look.transparent() || args.sheet.is_transparent(),
        target: &target,
        level: args.output.png,
        threads,
        force: args.output.force,
        art: None,
        scale: args.sheet.pixels.scale(),
    };
    let art = args.sheet.pixels.art(&job, background, say)?;
    job.art = art.as_ref();
    if one_picture {
        let name = clip.map_or("rest", |c| asset.character.clips()[c].name.as_str());
        return args.sheet.write(&job, name, art.as_ref(), say);
    }
    film::write(&job, say)
}

/// Refuse to write over what is being read, `--force` or not.
fn keep_inputs(args: &Args, target: &Target) -> Result<(), Failure> {
    let inputs = || [Some(&args.input), args.time.poses.as_ref()].into_iter().flatten();
    for output in args.sheet.companions(target).into_iter().chain([target.path_of(1)]) {
        let Ok(written) = output.canonicalize() else { continue };
        if let Some(input) = inputs().find(|i| i.canonicalize().is_ok_and(|i| i == written)) {
            let message =
                format!("-o {}: {} is the input; choose another name", output.display(), input.display());
            return Err(Failure::Usage(message));
        }
    }
    Ok(())
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
