//! Frames into files: drawn and encoded by workers, written in order.

use super::channels::Beside;
use super::renderer;
use super::sheet::Painter;
use super::time::Frame;
use crate::cli::{Failure, say::Say};
use sinew::frames::{FrameStats, Moment, Shot, Stop, Worker, in_order, in_order_pairs};
use sinew::image::{Image, Rgba8};
use sinew::io::manifest::sha256;
use sinew::io::picture::{
    self, AtomicFile, Coding, Dither, ExrDepth, Film, FilmWriter, Folder, Format, FrameEncoder, Output,
    Palette, PngLevel, Target, choose_dither, encode_exr_layers, encode_png, encode_webp,
};
use sinew::render::channel::Channels;
use sinew::time::Rate;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Frames that a palette is made from.
const PALETTE_FRAMES: usize = 16;

/// What is to be written.
pub struct Job<'a> {
    pub shot: &'a Shot<'a>,
    pub frames: &'a [Frame],
    /// Those and the ones that are another share's or there already: what all have in common follows from them.
    pub whole: &'a [Frame],
    pub rate: Rate,
    pub transparent: bool,
    pub target: &'a Target,
    pub level: PngLevel,
    pub threads: usize,
    pub force: bool,
    /// Compute hashes.
    pub hash: bool,
    /// What is written beside each picture.
    pub beside: Beside,
    /// How long rays may draw a picture.
    pub budget: Option<Duration>,
    /// Shows how far one picture is.
    pub bar: indicatif::ProgressBar,
    /// Frames become pixel art; they are drawn before nothing then.
    pub art: Option<Painter>,
    /// Pixels of a finished frame for each one that is drawn, across and down.
    pub scale: usize,
    /// What a sheet cost so far.
    pub cost: Mutex<Written>,
    /// Memory for the first picture.
    pub memory: &'a Mutex<Rgba8>,
}

impl Job<'_> {
    /// Let a worker's next picture take its time and show how far it is.
    fn follow(&self, worker: &mut Worker) {
        let rays = self.shot.desc().renderer.rays();
        worker.painter.watch = rays.map(|_| renderer::watch(self.budget, self.bar.clone()));
    }

    /// Draw a moment of a sheet, and count what it cost.
    pub fn draw(&self, moment: Moment, worker: &mut Worker) -> Rgba8 {
        let mut picture = Rgba8::default();
        self.follow(worker);
        let stats = self.shot.draw(moment, worker, &mut picture);
        self.count(stats);
        picture
    }

    /// Count what drawing a part of a sheet cost.
    pub fn count(&self, stats: FrameStats) {
        self.cost.lock().unwrap_or_else(|e| e.into_inner()).drawn += stats;
    }

    /// Write a file of a sheet.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        let start = Instant::now();
        let done = AtomicFile::write(path, bytes, self.force, Folder::MustExist);
        let mut cost = self.cost.lock().unwrap_or_else(|e| e.into_inner());
        cost.bytes += bytes.len() as u64;
        cost.write += start.elapsed();
        done.map_err(|e| Failure::Run(e.to_string()))
    }

    /// A picture to draw into: what was made ready, once.
    fn picture(&self) -> Rgba8 {
        std::mem::take(&mut self.memory.lock().unwrap_or_else(|e| e.into_inner()))
    }

    /// Pixels of a finished frame.
    pub fn size(&self) -> [usize; 2] {
        self.shot.size().map(|side| side * self.scale)
    }
}

/// What was written, and what it cost.
#[derive(Default)]
pub struct Written {
    /// A hash a frame, if they were asked for: of its file or, in a film, of its pixels.
    pub hashes: Vec<String>,
    /// Sums over all frames.
    pub drawn: FrameStats,
    /// Bytes of pictures, as they left the encoder.
    pub bytes: u64,
    /// Time of encoding, all threads together.
    pub encode: Duration,
    /// Time of writing.
    pub write: Duration,
}

pub fn write(job: &Job, say: &Say) -> Result<Written, Failure> {
    refuse_existing(job)?;
    let film = job.target.is_film(job.frames.len());
    let drawn = match job.target.format() {
        _ if film => write_film(job, say),
        Format::Exr if job.art.is_some() => {
            let message = "--pixel-art: OpenEXR has no palette; expected a name that ends in .png, .webp, .gif or .apng";
            return Err(Failure::Usage(message.into()));
        }
        Format::Exr => {
            let layers = |seen: &Channels| job.beside.layers(seen);
            stills(job, say, Image::default, shoot_linear, |p, seen| {
                encode_exr_layers(p, ExrDepth::Float, &layers(seen))
            })
        }
        Format::Webp => stills(job, say, || job.picture(), shoot, |p, _| encode_webp(p)),
        _ => match &job.art {
            Some(art) => stills(job, say, || job.picture(), shoot, |p, _| art.encode_png(p, job.level)),
            None => stills(job, say, || job.picture(), shoot, |p, _| encode_png(p, job.level)),
        },
    };
    let written = match drawn {
        // A reader that has seen enough (`| head`) is no failure.
        Err(Fault::Write(e)) if e.is_closed_pipe() => return Ok(Written::default()),
        Err(Fault::Write(e)) => return Err(Failure::Run(e.to_string())),
        Err(Fault::Stopped) => return Err(Failure::Run("drawing stopped".into())),
        Ok(written) => written,
    };
    let n = job.frames.len();
    say.note(&match [0, n - 1].map(|i| job.target.path_of(job.frames[i].number)) {
        [None, _] => return Ok(written),
        [Some(first), Some(last)] if first != last => {
            format!("wrote {n} frames, {} … {}", first.display(), last.display())
        }
        [Some(path), _] => format!("wrote {}", path.display()),
    });
    Ok(written)
}

/// Why frames were not written.
enum Fault {
    Write(picture::Error),
    Stopped,
}

impl From<picture::Error> for Fault {
    fn from(e: picture::Error) -> Self {
        Self::Write(e)
    }
}

/// Say so before anything is drawn.
fn refuse_existing(job: &Job) -> Result<(), Failure> {
    if job.force {
        return Ok(());
    }
    for frame in job.frames {
        let Some(path) = job.target.path_of(frame.number) else { continue };
        let beside = job.beside.files(&path);
        if let Some(path) = [path].iter().chain(&beside).find(|p| p.exists()) {
            let message = format!("{}: the file exists; --force overwrites it", path.display());
            return Err(Failure::Run(message));
        }
    }
    Ok(())
}

/// Draws one moment.
type Shoot<P> = fn(&Job, Moment, &mut Worker, &mut P) -> FrameStats;

/// As it is shown: painted, where there is pixel art.
fn shoot(job: &Job, moment: Moment, worker: &mut Worker, out: &mut Rgba8) -> FrameStats {
    job.follow(worker);
    let stats = job.shot.draw(moment, worker, out);
    if let Some(art) = &job.art {
        *out = art.paint(out);
    }
    stats
}

fn shoot_linear(job: &Job, moment: Moment, worker: &mut Worker, out: &mut Image) -> FrameStats {
    job.follow(worker);
    job.shot.draw_linear(moment, worker, out)
}

/// Draw moments in parallel, encode each beside the one before on a worker, and hand the results on in order.
fn draw<S, T: Send>(
    job: &Job,
    frames: &[Frame],
    state: impl Fn() -> S + Sync,
    encode: impl Fn(&mut S, Option<&Rgba8>, &Rgba8) -> T + Sync,
    mut receive: impl FnMut(&mut Written, usize, T) -> Result<(), picture::Error>,
) -> Result<Written, Fault> {
    let mut fault = None;
    let mut written = Written::default();
    let start = || (Worker::default(), state());
    let first = |(worker, _): &mut (Worker, S), i: usize| {
        let mut picture = Rgba8::default();
        let stats = shoot(job, frames[i].moment, worker, &mut picture);
        (picture, stats)
    };
    let second =
        |(_, s): &mut (Worker, S), before: Option<&(Rgba8, FrameStats)>, now: &(Rgba8, FrameStats)| {
            let start = Instant::now();
            let encoded = encode(s, before.map(|b| &b.0), &now.0);
            (encoded, now.1, start.elapsed())
        };
    let done =
        in_order_pairs(frames.len(), job.threads, start, first, second, |i, (result, stats, encode)| {
            let start = Instant::now();
            written.drawn += stats;
            written.encode += encode;
            let done = receive(&mut written, i, result);
            written.write += start.elapsed();
            done.map_err(|e| {
                fault = Some(e);
                Stop
            })
        });
    ended(done, fault, written)
}

/// What became of a still.
#[derive(Default)]
struct Still {
    stats: FrameStats,
    hash: Option<String>,
    /// As it left the encoder; kept only for a pipe, which takes frames in order.
    bytes: Vec<u8>,
    size: usize,
    encode: Duration,
    write: Duration,
}

/// A picture a frame, each into a file of its own or one after the other to standard output.
///
/// Workers write the files, each as soon as it is encoded, and draw into one picture again and again: new memory for every
/// picture costs more than encoding it.
fn stills<P>(
    job: &Job,
    say: &Say,
    memory: impl Fn() -> P + Sync,
    shoot: Shoot<P>,
    encode: impl Fn(&P, &Channels) -> Result<Vec<u8>, picture::Error> + Sync,
) -> Result<Written, Fault> {
    let wanted = job.beside.wanted();
    let folder = if matches!(job.target, Target::Sequence(..)) { Folder::Create } else { Folder::MustExist };
    let bar = say.progress(job.frames.len());
    let still = |(worker, picture, seen): &mut (Worker, P, Channels), i: usize| {
        let mut stats = shoot(job, job.frames[i].moment, worker, picture);
        if !wanted.is_empty() {
            stats += job.shot.draw_channels(job.frames[i].moment, worker, &wanted, seen);
        }
        let start = Instant::now();
        let bytes = encode(picture, seen)?;
        let beside = job.beside.encode_all(job.target.format(), seen)?;
        let hash = job.hash.then(|| sha256(&bytes));
        let size = bytes.len() + beside.iter().map(|b| b.1.len()).sum::<usize>();
        let mut still = Still { stats, hash, size, encode: start.elapsed(), ..Still::default() };
        let start = Instant::now();
        match job.target.path_of(job.frames[i].number) {
            Some(path) => {
                for (name, bytes) in &beside {
                    AtomicFile::write(name.file(&path), bytes, job.force, folder)?;
                }
                AtomicFile::write(path, &bytes, job.force, folder)?;
            }
            None => still.bytes = bytes,
        }
        still.write = start.elapsed();
        Ok(still)
    };
    let (mut written, mut fault) = (Written::default(), None);
    let state = || (Worker::default(), memory(), Channels::default());
    let done =
        in_order(job.frames.len(), job.threads, state, still, |_, result: Result<Still, picture::Error>| {
            let received = result.and_then(|s| written.add(s));
            bar.inc(1);
            received.map_err(|e| {
                fault = Some(e);
                Stop
            })
        });
    bar.finish_and_clear();
    ended(done, fault, written)
}

/// What a run of workers came to.
fn ended(done: Result<(), Stop>, fault: Option<picture::Error>, written: Written) -> Result<Written, Fault> {
    match (done, fault) {
        (Ok(()), _) => Ok(written),
        (_, Some(e)) => Err(Fault::Write(e)),
        (Err(Stop), None) => Err(Fault::Stopped),
    }
}

impl Written {
    /// Count a still, and send it to the pipe if it waits for that.
    fn add(&mut self, still: Still) -> Result<(), picture::Error> {
        let start = Instant::now();
        if !still.bytes.is_empty() {
            let mut out = Output::stdout(false);
            out.write_all(&still.bytes).map_err(|source| picture::Error::Stdout { source })?;
            out.commit()?;
        }
        self.hashes.extend(still.hash);
        self.drawn += still.stats;
        self.bytes += still.size as u64;
        self.encode += still.encode;
        self.write += still.write + start.elapsed();
        Ok(())
    }
}

/// All frames into one file.
fn write_film(job: &Job, say: &Say) -> Result<Written, Fault> {
    let film =
        Film { transparent: job.transparent, ..Film::new(job.size(), job.frames.len() as u32, job.rate) };
    let format = job.target.format();
    // WebP goes back to its head, which a pipe cannot.
    let mut out = match job.target.path_of(0) {
        Some(path) => Output::file(path, job.force, Folder::MustExist)?,
        None => Output::stdout(format == Format::Webp),
    };
    let coding = match format {
        Format::Gif => match &job.art {
            Some(art) => Coding::Gif(art.palette().clone(), Dither::None),
            None => gif_coding(job, &film, say)?,
        },
        Format::Webp => Coding::Webp,
        Format::Y4m => Coding::Y4m,
        _ => Coding::Apng(job.level),
    };
    let mut writer = FilmWriter::new(&mut out, film, &coding)?;
    let bar = say.progress(job.frames.len());
    let encode = |encoder: &mut FrameEncoder, before: Option<&Rgba8>, now: &Rgba8| {
        let hash = job.hash.then(|| sha256(&now.data));
        encoder.encode(before, now).map(|frame| (hash, frame))
    };
    let state = || FrameEncoder::new(film, &coding);
    let mut written = draw(job, job.frames, state, encode, |written, _, result| {
        let (hash, frame) = result?;
        written.hashes.extend(hash);
        bar.inc(1);
        writer.write(frame)
    })?;
    bar.finish_and_clear();
    let report = writer.finish()?;
    if report.dropped > 0 {
        let dropped = report.dropped;
        say.note(&format!(
            "{dropped} frames were too short for GIF; the film's length is right without them"
        ));
    }
    written.bytes = std::io::Seek::stream_position(&mut out).unwrap_or(0);
    out.commit()?;
    Ok(written)
}

/// The palette and the dithering of a GIF: a few frames, spread over the film, decide.
fn gif_coding(job: &Job, film: &Film, say: &Say) -> Result<Coding, Fault> {
    let n = job.frames.len();
    let few = n.min(PALETTE_FRAMES);
    let spread: Vec<Frame> = (0..few).map(|k| job.frames[k * n / few]).collect();
    let mut samples = Vec::with_capacity(few);
    let keep = |(): &mut (), _: Option<&Rgba8>, picture: &Rgba8| picture.clone();
    draw(
        job,
        &spread,
        || (),
        keep,
        |_, _, picture| {
            samples.push(picture);
            Ok(())
        },
    )?;
    let palette = Palette::from_frames(&samples, 256, film);
    let (dither, scores) = choose_dither(&samples, &palette, film);
    for s in scores {
        let chosen = if s.dither == dither { ", chosen" } else { "" };
        let name = s.dither.name();
        say.detail(&format!("dithering {name}: error {:.3}, flicker {:.3}{chosen}", s.error, s.flicker));
    }
    Ok(Coding::Gif(palette, dither))
}
