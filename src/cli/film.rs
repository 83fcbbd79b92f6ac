//! Frames into files: drawn and encoded by workers, written in order.

use super::{Failure, say::Say};
use sinew::frames::{FrameStats, Shot, Stop, Worker, in_order_pairs};
use sinew::image::Rgba8;
use sinew::io::picture::{
    self, AtomicFile, Coding, Film, FilmWriter, Folder, Format, FrameEncoder, Output, Palette, PngLevel,
    Target, choose_dither, encode_png, encode_webp,
};
use sinew::time::Rate;
use std::io::Write;
use std::time::Instant;

/// Frames that a palette is made from.
const PALETTE_FRAMES: usize = 16;

/// What is to be written.
pub struct Job<'a> {
    pub shot: &'a Shot<'a>,
    /// Frame numbers and seconds.
    pub moments: &'a [(i64, f64)],
    pub rate: Rate,
    pub size: [usize; 2],
    pub transparent: bool,
    pub target: &'a Target,
    pub level: PngLevel,
    pub threads: usize,
    pub force: bool,
}

pub fn write(job: &Job, say: &Say) -> Result<(), Failure> {
    // A temporary must not outlive Ctrl-C or a request to terminate; the handler runs on a thread of its own.
    let _ = ctrlc::set_handler(|| {
        picture::cleanup_temporaries();
        std::process::exit(130);
    });
    refuse_existing(job)?;
    let start = Instant::now();
    let drawn = if job.target.is_film(job.moments.len()) { film(job, say) } else { stills(job, say) };
    let total = match drawn {
        // A reader that has seen enough (`| head`) is no failure.
        Err(Fault::Write(e)) if e.is_closed_pipe() => return Ok(()),
        Err(Fault::Write(e)) => return Err(Failure::Run(e.to_string())),
        Err(Fault::Stopped) => return Err(Failure::Run("drawing stopped".into())),
        Ok(total) => total,
    };
    let n = job.moments.len();
    let seconds = start.elapsed().as_secs_f64();
    say.detail(&format!(
        "{n} frames in {seconds:.3} s ({:.2} ms each), a frame: {} bones, {} vertices; {:?}",
        1e3 * seconds / n as f64,
        total.bones,
        total.vertices,
        total.raster
    ));
    say.note(&match [0, n - 1].map(|i| job.target.path_of(job.moments[i].0)) {
        [None, _] => return Ok(()),
        [Some(first), Some(last)] if first != last => {
            format!("wrote {n} frames, {} … {}", first.display(), last.display())
        }
        [Some(path), _] => format!("wrote {}", path.display()),
    });
    Ok(())
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
    for (number, _) in job.moments {
        let Some(path) = job.target.path_of(*number) else { continue };
        if path.exists() {
            let message = format!("{}: the file exists; --force overwrites it", path.display());
            return Err(Failure::Run(message));
        }
    }
    Ok(())
}

/// Draw moments in parallel, encode each beside the one before on a worker, and hand the results on in order.
fn draw<S, T: Send>(
    job: &Job,
    moments: &[(i64, f64)],
    state: impl Fn() -> S + Sync,
    encode: impl Fn(&mut S, Option<&Rgba8>, &Rgba8) -> T + Sync,
    mut receive: impl FnMut(usize, T) -> Result<(), picture::Error>,
) -> Result<FrameStats, Fault> {
    let mut fault = None;
    let mut last = FrameStats::default();
    let start = || (Worker::default(), state());
    let first = |(worker, _): &mut (Worker, S), i: usize| {
        let mut out = Rgba8::default();
        let stats = job.shot.draw(moments[i].1, worker, &mut out);
        (out, stats)
    };
    let second =
        |(_, s): &mut (Worker, S), before: Option<&(Rgba8, FrameStats)>, now: &(Rgba8, FrameStats)| {
            (encode(s, before.map(|b| &b.0), &now.0), now.1)
        };
    let done = in_order_pairs(moments.len(), job.threads, start, first, second, |i, (result, stats)| {
        last = stats;
        receive(i, result).map_err(|e| {
            fault = Some(e);
            Stop
        })
    });
    match (done, fault) {
        (Ok(()), _) => Ok(last),
        (_, Some(e)) => Err(Fault::Write(e)),
        (Err(Stop), None) => Err(Fault::Stopped),
    }
}

/// A picture a frame, each into a file of its own or one after the other to standard output.
fn stills(job: &Job, say: &Say) -> Result<FrameStats, Fault> {
    let folder = if matches!(job.target, Target::Sequence(..)) { Folder::Create } else { Folder::MustExist };
    let bar = say.progress(job.moments.len());
    let encode = |picture: &Rgba8| match job.target.format() {
        Format::Webp => encode_webp(picture),
        _ => encode_png(picture, job.level),
    };
    let stats = draw(
        job,
        job.moments,
        || (),
        |(), _, picture| encode(picture),
        |i, bytes| {
            match job.target.path_of(job.moments[i].0) {
                Some(path) => AtomicFile::write(path, &bytes?, job.force, folder)?,
                None => {
                    let mut out = Output::stdout(false);
                    out.write_all(&bytes?).map_err(|source| picture::Error::Stdout { source })?;
                    out.commit()?;
                }
            }
            bar.inc(1);
            Ok(())
        },
    );
    bar.finish_and_clear();
    stats
}

/// All frames into one file.
fn film(job: &Job, say: &Say) -> Result<FrameStats, Fault> {
    let film =
        Film { transparent: job.transparent, ..Film::new(job.size, job.moments.len() as u32, job.rate) };
    let format = job.target.format();
    // WebP goes back to its head, which a pipe cannot.
    let mut out = match job.target.path_of(0) {
        Some(path) => Output::file(path, job.force, Folder::MustExist)?,
        None => Output::stdout(format == Format::Webp),
    };
    let coding = match format {
        Format::Gif => gif_coding(job, &film, say)?,
        Format::Webp => Coding::Webp,
        Format::Y4m => Coding::Y4m,
        _ => Coding::Apng(job.level),
    };
    let mut writer = FilmWriter::new(&mut out, film, &coding)?;
    let bar = say.progress(job.moments.len());
    let stats = draw(
        job,
        job.moments,
        || FrameEncoder::new(film, &coding),
        |encoder, before, now| encoder.encode(before, now),
        |_, frame| {
            bar.inc(1);
            writer.write(frame?)
        },
    )?;
    bar.finish_and_clear();
    let report = writer.finish()?;
    if report.dropped > 0 {
        let dropped = report.dropped;
        say.note(&format!(
            "{dropped} frames were too short for GIF; the film's length is right without them"
        ));
    }
    out.commit()?;
    Ok(stats)
}

/// The palette and the dithering of a GIF: a few frames, spread over the film, decide.
fn gif_coding(job: &Job, film: &Film, say: &Say) -> Result<Coding, Fault> {
    let n = job.moments.len();
    let few = n.min(PALETTE_FRAMES);
    let spread: Vec<(i64, f64)> = (0..few).map(|k| job.moments[k * n / few]).collect();
    let mut samples = Vec::with_capacity(few);
    draw(
        job,
        &spread,
        || (),
        |(), _, picture| picture.clone(),
        |_, picture| {
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
