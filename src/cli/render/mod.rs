//! `sinew render`: what is to be drawn, from where, and into which files. One file a group of options.

mod batch;
mod bone;
mod camera;
mod channels;
mod film;
mod look;
mod output;
mod overlay;
mod renderer;
mod shapes;
mod sheet;
mod stats;
mod time;

use super::{Failure, print, say, say::Say};
use channels::Beside;
use film::{Job, Written};
use sinew::asset::Asset;
use sinew::frames::{Foresight, Look, Props, Shot, ShotDesc};
use sinew::image::Rgba8;
use sinew::io::Import;
use sinew::io::picture::{Format, Target};
use sinew::io::scene::{Setting, ours::SceneFile};
use sinew::render::{Renderer, Settings};
use sinew::time::Range;
use stats::Totals;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;
use time::Frame;

const EXAMPLES: &str = "\
Examples:
  sinew render rigs/pip.json -o walk.gif
  sinew render fox.glb -o fox.png --at 0.5 --size 1024
  sinew render fox.glb -o run.####.png --clip Run --fps 30 --background transparent
  sinew render fox.glb -o part.%04d.png --frames 1-48x2,60
  sinew render fox.glb -o side.apng --camera yaw=90,pitch=5,fov=20
  sinew render rigs/pip.json -o pip-sheet.png --sheet trimmed --directions 8 --camera pitch=30,yaw=0,ortho --size 128 --fps 12
  sinew render fox.glb -o fox-sheet.png --sheet grid --maps normal,depth,id --sheet-json aseprite --size 128
  sinew render fox.glb -o fox.gif --pixel-art --pixel-scale 4 --size 256 --colors 16 --pixel-outline
  sinew render fox.glb -o fox-contact.png --contact 6x4 --size 160
  sinew render fox.glb -o icon.png --camera isometric --background transparent
  sinew render rigs/fox.json -o round.gif --turntable
  sinew render *.glb --all-clips -o thumbs/{name}-{clip}.webp
  sinew render fox.glb -o farm.####.png --shard 2/4 --manifest part2.json
  sinew render fox.glb --list

Frames are numbered from 1; frame 1 shows 0 s, or the clip's first key if that is earlier. The camera orbits the character and stands where all of it is
seen over the whole clip, unless --camera names one of the asset's. An existing file is kept unless --force is given.";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// glTF files (.gltf, .glb), rigs or scenes (.json).
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
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
    renderer: renderer::RendererArgs,
    #[command(flatten)]
    channels: channels::ChannelArgs,
    #[command(flatten)]
    sheet: sheet::SheetArgs,
    #[command(flatten)]
    batch: batch::BatchArgs,
}

pub fn run(args: &Args, say: &Say) -> Result<(), Failure> {
    // A temporary must not outlive Ctrl-C or a request to terminate; the handler runs on a thread of its own.
    let _ = ctrlc::set_handler(|| {
        sinew::io::picture::cleanup_temporaries();
        std::process::exit(130);
    });
    batch::run(args, say)
}

/// What was made ready while pictures were decoded.
#[derive(Default)]
struct Ready {
    foresight: Option<Foresight>,
    /// The first picture's memory, which takes longer to come by than to fill.
    picture: Mutex<Rgba8>,
}

/// One output: an asset, one of its clips or rest, and where the pictures go.
struct Task<'a> {
    input: &'a Path,
    import: &'a Import,
    ready: &'a Ready,
    clip: Option<usize>,
    target: &'a Target,
}

/// The scene of ours that an input is.
fn scene(import: &Import) -> Option<&SceneFile> {
    match &import.setting {
        Some(Setting::Ours(scene)) => Some(scene),
        _ => None,
    }
}

fn props(scene: &SceneFile) -> Props {
    Props { shapes: scene.shapes.clone(), materials: scene.materials.clone() }
}

/// Pixels of a picture where no option says.
fn usual_size(import: &Import) -> Option<[usize; 2]> {
    match &import.setting {
        Some(Setting::Ours(scene)) => scene.size,
        Some(Setting::Notes(scene)) => Some(shapes::usual_size(scene)),
        None => None,
    }
}

/// Which pictures an output consists of.
struct Plan {
    frames: Vec<Frame>,
    /// Those and the ones that are another share's or there already.
    whole: Vec<Frame>,
    size: [usize; 2],
}

fn plan(args: &Args, task: &Task) -> Result<Plan, Failure> {
    let clips = task.import.asset.character.clips();
    let range = task.clip.map_or(Range::default(), |c| clips[c].playback());
    let one_picture = args.sheet.is_one_picture();
    let alone = !task.target.takes_a_clip() && !one_picture;
    let at = scene(task.import).and_then(|s| s.at);
    let frames = args.time.frames(task.input, range, alone.then_some(at), args.camera.turntable)?;
    let single = !one_picture && !args.sheet.pixels.is_on() && !task.target.is_film(frames.len());
    args.channels.check(task.target, single)?;
    if !one_picture {
        task.target.check_frames(frames.len()).map_err(|e| Failure::Usage(e.to_string()))?;
    }
    let settings = args.output.settings(usual_size(task.import), args.renderer.coverage())?;
    let whole = [settings.width, settings.height];
    Ok(Plan {
        whole: frames.clone(),
        frames,
        size: args.camera.crop(whole)?.map_or(whole, |c| [c.width, c.height]),
    })
}

/// Draw the frames of a plan and write them.
fn draw(args: &Args, task: &Task, plan: &Plan, totals: &mut Totals, say: &Say) -> Result<Written, Failure> {
    if let Some(Setting::Notes(scene)) = &task.import.setting {
        let written = shapes::draw(args, task, plan, scene, say)?;
        say_samples(args, &written, plan.size[0] * plan.size[1], say);
        totals.add(&written, 1);
        return Ok(written);
    }
    let (asset, scene) = (&task.import.asset, scene(task.import));
    let character = &asset.character;
    let overlays = args.overlay.overlays(asset, args.time.fps)?;
    let bare = character.instances().iter().all(|i| character.mesh(i).triangles.is_empty());
    let props = scene.map(props).unwrap_or_default();
    if bare && overlays.is_empty() && props.shapes.is_empty() {
        say.warn(&format!(
            "{}: there are no triangles; the picture will be empty (--bones draws the skeleton)",
            task.input.display()
        ));
    }

    if character.clips().is_empty() && task.target.takes_a_clip() && plan.frames.len() == 1 {
        say.note(&no_clip(task));
    }

    let range = task.clip.map_or(Range::default(), |c| character.clips()[c].playback());
    let seam = args.camera.turntable.and_then(|lap| args.time.seam(range, lap));
    if let Some(note) = seam.filter(|_| plan.frames.len() > 1) {
        say.note(&note);
    }
    let frozen = |f: &&Frame| args.time.is_frozen(range, f.moment.time, args.camera.turntable);
    let frozen = plan.frames.iter().filter(frozen).count();
    if frozen > 1 {
        say.note(&format!("{frozen} frames lie outside the clip and show its end; --wrap loop goes on"));
    }

    // One picture is drawn by all threads, many by one thread each.
    let threads = args.output.threads();
    let one_picture = args.sheet.is_one_picture();
    let alone = plan.frames.len() == 1 && !one_picture;
    let settings =
        args.sheet.settings(args.output.settings(usual_size(task.import), args.renderer.coverage())?)?;
    let mut settings = Settings { threads: if alone { threads } else { 1 }, ..settings };
    let look = args.look.look(asset, scene.map(|s| &s.look), |m| say.warn(m))?;
    let renderer =
        args.renderer.renderer(&look, &props, scene, args.sheet.pixels.is_on(), args.look.has_shadows())?;
    if renderer == Renderer::Raster && !props.shapes.is_empty() {
        say.warn(&format!(
            "the rasterizer leaves {} shapes out; --renderer ray draws them",
            props.shapes.len()
        ));
    }
    if renderer.rays().is_some_and(|r| r.samples <= 1) {
        // Channels look where the picture does.
        settings.samples = 1;
    }
    let desc = ShotDesc {
        renderer,
        clip: task.clip,
        wrap: args.time.wrap(args.camera.turntable),
        view: args.sheet.view(args.camera.view(asset, scene)?, args.camera.is_default()),
        framing: args.camera.framing(asset)?,
        look,
        props,
        overlays,
        crop: args.camera.crop([settings.width, settings.height])?,
        settings,
    };
    say_what_is_left_out(args, task.target, &desc.look, say);
    let background = if args.sheet.is_transparent() { [0.0; 4] } else { desc.look.background };
    let transparent = look::transparent(&desc.look) || args.sheet.is_transparent();
    let start = Instant::now();
    let desc = args.sheet.desc(desc, asset);
    let of_file = args.camera.is_default() && scene.is_some_and(|s| s.camera.is_some());
    let shot = Shot::foreseen(asset, desc, task.ready.foresight.as_ref()).map_err(|e| match of_file {
        true => Failure::Input(format!("{}: camera: {e}", task.input.display())),
        false => Failure::Usage(e.to_string()),
    })?;
    totals.framing += start.elapsed();
    let moments = args.sheet.contact_frames(&shot);
    let bones = character.skeleton();
    let bones = bones.ids().map(|b| bones.name(b).to_string()).collect();
    let beside = Beside::new(&args.channels, &shot, bones, args.output.png);
    let mut job = Job {
        shot: &shot,
        frames: moments.as_ref().unwrap_or(&plan.frames),
        whole: moments.as_ref().unwrap_or(&plan.whole),
        rate: args.time.fps,
        transparent,
        target: task.target,
        level: args.output.png,
        threads,
        // What is complete was skipped; a sheet or a frame of which a part is there already is drawn again as a whole.
        force: args.output.force || args.batch.skip_existing,
        hash: args.batch.manifest.is_some(),
        beside,
        budget: args.renderer.budget,
        bar: if alone { say.picture_progress() } else { indicatif::ProgressBar::hidden() },
        art: None,
        cost: Default::default(),
        memory: &task.ready.picture,
        scale: args.sheet.pixels.scale(),
    };
    let frames = job.frames.len();
    job.art = args.sheet.pixels.art(&job, background, say)?;
    let written = if one_picture {
        let name = task.clip.map_or("rest", |c| character.clips()[c].name.as_str());
        args.sheet.write(&job, name, say)?;
        job.cost.into_inner().unwrap_or_else(|e| e.into_inner())
    } else {
        let written = film::write(&job, say);
        job.bar.finish_and_clear();
        written?
    };
    say_samples(args, &written, frames * shot.size()[0] * shot.size()[1], say);
    totals.add(&written, frames);
    Ok(written)
}

/// Why a film has one picture.
fn no_clip(task: &Task) -> String {
    let input = task.input.display();
    let mut text = format!("{input}: there is no clip, so there is one picture, of its rest pose");
    if task.import.setting.is_none() && task.input.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"))
    {
        text += "; a rig's clips come from the files of its `poses`, or from ../poses/ and its own name";
    }
    text
}

/// Say how many samples pictures got that time ended.
fn say_samples(args: &Args, written: &Written, pixels: usize, say: &Say) {
    let ended = args.renderer.ends_early() || say.verbose;
    if let Some(samples) = renderer::reached(&written.drawn.rays, pixels).filter(|_| ended) {
        say.note(&samples);
    }
    // One sample a pixel is the least that is a picture.
    let (took, asked) = (written.drawn.times.draw, args.renderer.budget);
    if let Some(asked) = asked.filter(|&a| took > a.mul_f64(1.5) && written.drawn.rays.samples <= 1) {
        say.warn(&format!(
            "--budget {asked:?}: one sample a pixel took {took:.1?}; a smaller --size takes less"
        ));
    }
}

/// Options that the format has no place for are not dropped in silence.
fn say_what_is_left_out(args: &Args, target: &Target, look: &Look, say: &Say) {
    if target.format() == Format::Exr && !look.grade.is_plain() {
        say.warn(
            "OpenEXR holds linear light: --exposure, --tone, --gamma and --dither are left to its reader",
        );
    }
    if target.format() == Format::Y4m && look::transparent(look) {
        say.warn("Y4M holds no alpha: the film is laid over white");
    }
    if args.sheet.is_transparent() && args.look.has_background() {
        say.warn("a sheet is transparent: --background is left out");
    }
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
