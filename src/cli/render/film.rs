//! Frames into files: drawn and encoded by workers, written in order.

use super::time::Frame;
use crate::cli::{Failure, say::Say};
use sinew::frames::{FrameStats, Shot, Stop, Worker, in_order};
use sinew::image::Rgba8;
use sinew::io::picture::{
    self, ApngWriter, AtomicFile, Dither, Film, Folder, Format, GifWriter, Mapper, Palette, PixelArt,
    PngLevel, Target, choose_dither, encode_indexed_png, encode_png,
};
use sinew::time::Rate;
use std::path::Path;
use std::time::Instant;

/// Frames that a palette is made from.
const PALETTE_FRAMES: usize = 16;

/// What is to be written.
pub struct Job<'a> {
    pub shot: &'a Shot<'a>,
    pub frames: &'a [Frame],
    pub rate: Rate,
    pub transparent: bool,
    pub target: &'a Target,
    pub level: PngLevel,
    pub threads: usize,
    pub force: bool,
    /// Compute hashes.
    pub hash: bool,
    /// Frames become pixel art; they are drawn before nothing then.
    pub art: Option<&'a PixelArt>,
    /// Pixels of a finished frame for each one that is drawn, across and down.
    pub scale: usize,
}

impl Job<'_> {
    /// Pixels of a finished frame.
    pub fn size(&self) -> [usize; 2] {
        let settings = &self.shot.desc().settings;
        [settings.width * self.scale, settings.height * self.scale]
    }

    fn mapper(&self) -> Option<Mapper> {
        self.art.map(PixelArt::mapper)
    }

    /// A frame as it is shown.
    fn finish(&self, mapper: &mut Option<Mapper>, picture: Rgba8) -> Rgba8 {
        match (self.art, mapper) {
            (Some(art), Some(mapper)) => art.finish(mapper, &picture).to_rgba8(art.palette()),
            _ => picture,
        }
    }
}

/// What was written.
#[derive(Default)]
pub struct Written {
    /// A hash a frame, if they were asked for: of its file or, in a film, of its pixels.
    pub hashes: Vec<String>,
    /// What the last frame cost.
    pub stats: FrameStats,
}

pub fn write(job: &Job, say: &Say) -> Result<Written, Failure> {
    // A temporary must not outlive Ctrl-C or a request to terminate; the handler runs on a thread of its own.
    let _ = ctrlc::set_handler(|| {
        picture::cleanup_temporaries();
        std::process::exit(130);
    });
    refuse_existing(job)?;
    let start = Instant::now();
    let stats = match job.target {
        Target::Still(_) | Target::Sequence(_) => stills(job, say)?,
        Target::Film(path, Format::Apng) => apng(job, path, say)?,
        Target::Film(path, _) => gif(job, path, say)?,
    };
    let written = Written { stats, hashes: vec![] };
    let n = job.frames.len();
    let seconds = start.elapsed().as_secs_f64();
    say.detail(&format!(
        "{n} frames in {seconds:.3} s ({:.2} ms each), a frame: {} bones, {} vertices; {:?}",
        1e3 * seconds / n as f64,
        written.stats.bones,
        written.stats.vertices,
        written.stats.raster
    ));
    say.note(&match job.target {
        Target::Sequence(_) if n > 1 => {
            let path = |i: usize| job.target.path_of(job.frames[i].number).display().to_string();
            format!("wrote {n} frames, {} … {}", path(0), path(n - 1))
        }
        _ => format!("wrote {}", job.target.path_of(job.frames[0].number).display()),
    });
    Ok(written)
}

fn failed(e: picture::Error) -> Failure {
    Failure::Run(e.to_string())
}

/// Say so before anything is drawn.
fn refuse_existing(job: &Job) -> Result<(), Failure> {
    if job.force {
        return Ok(());
    }
    for frame in job.frames {
        let path = job.target.path_of(frame.number);
        if path.exists() {
            let message = format!("{}: the file exists; --force overwrites it", path.display());
            return Err(Failure::Run(message));
        }
    }
    Ok(())
}

/// Draw all moments in parallel, finish each on its worker, and hand the results on in order.
fn draw<S, T: Send>(
    job: &Job,
    frames: &[Frame],
    state: impl Fn() -> S + Sync,
    finish: impl Fn(&mut S, Rgba8) -> T + Sync,
    mut receive: impl FnMut(usize, T) -> Result<(), picture::Error>,
) -> Result<FrameStats, Failure> {
    let mut fault = None;
    let mut last = FrameStats::default();
    let start = || (Worker::default(), state());
    let one = |(worker, s): &mut (Worker, S), i: usize| {
        let mut out = Rgba8::default();
        let stats = job.shot.draw(frames[i].moment, worker, &mut out);
        (stats, finish(s, out))
    };
    let done = in_order(frames.len(), job.threads, start, one, |i, (stats, result)| {
        last = stats;
        receive(i, result).map_err(|e| {
            fault = Some(e);
            Stop
        })
    });
    match (done, fault) {
        (Ok(()), _) => Ok(last),
        (_, Some(e)) => Err(failed(e)),
        (Err(Stop), None) => Err(Failure::Run("drawing stopped".into())),
    }
}

fn stills(job: &Job, say: &Say) -> Result<FrameStats, Failure> {
    let folder = if matches!(job.target, Target::Sequence(_)) { Folder::Create } else { Folder::MustExist };
    let bar = say.progress(job.frames.len());
    let stats = draw(
        job,
        job.frames,
        || job.mapper(),
        |mapper, picture| match (job.art, mapper) {
            (Some(art), Some(m)) => encode_indexed_png(&art.finish(m, &picture), art.palette(), job.level),
            _ => encode_png(&picture, job.level),
        },
        |i, png| {
            let path = job.target.path_of(job.frames[i].number);
            AtomicFile::write(path, &png?, job.force, folder)?;
            bar.inc(1);
            Ok(())
        },
    );
    bar.finish_and_clear();
    stats
}

fn film(job: &Job) -> Film {
    Film {
        size: job.size(),
        frames: job.frames.len() as u32,
        rate: job.rate,
        plays: 0,
        transparent: job.transparent,
        matte: [255; 3],
    }
}

fn apng(job: &Job, path: &Path, say: &Say) -> Result<FrameStats, Failure> {
    let mut file = AtomicFile::create(path, job.force, Folder::MustExist).map_err(failed)?;
    let mut writer = ApngWriter::new(&mut file, film(job), job.level).map_err(failed)?;
    let bar = say.progress(job.frames.len());
    let stats = draw(
        job,
        job.frames,
        || job.mapper(),
        |mapper, picture| job.finish(mapper, picture),
        |_, picture| {
            bar.inc(1);
            writer.write(&picture)
        },
    )?;
    bar.finish_and_clear();
    writer.finish().map_err(failed)?;
    file.commit().map_err(failed)?;
    Ok(stats)
}

fn gif(job: &Job, path: &Path, say: &Say) -> Result<FrameStats, Failure> {
    let film = film(job);
    let mut file = AtomicFile::create(path, job.force, Folder::MustExist).map_err(failed)?;

    let (palette, dither) = match job.art {
        Some(art) => (art.palette().clone(), Dither::None),
        None => film_palette(job, &film, say)?,
    };
    let mut writer = GifWriter::new(&mut file, film, &palette, dither).map_err(failed)?;
    let bar = say.progress(job.frames.len());
    let stats = draw(
        job,
        job.frames,
        || job.mapper().unwrap_or_else(|| Mapper::new(&palette, &film)),
        |mapper, picture| match job.art {
            Some(art) => art.finish(mapper, &picture),
            None => mapper.map(&picture, dither),
        },
        |_, indexed| {
            bar.inc(1);
            writer.write_indexed(indexed)
        },
    )?;
    bar.finish_and_clear();
    let (_, report) = writer.finish().map_err(failed)?;
    if report.dropped > 0 {
        say.note(&format!(
            "{} frames were too short for GIF; the film's length is right without them",
            report.dropped
        ));
    }
    file.commit().map_err(failed)?;
    Ok(stats)
}

/// The colours and the dithering that suit a film best.
fn film_palette(job: &Job, film: &Film, say: &Say) -> Result<(Palette, Dither), Failure> {
    // A few frames, spread over the film, decide on its colours and its dithering.
    let n = job.frames.len();
    let few = n.min(PALETTE_FRAMES);
    let spread: Vec<Frame> = (0..few).map(|k| job.frames[k * n / few]).collect();
    let mut samples = Vec::with_capacity(few);
    draw(
        job,
        &spread,
        || (),
        |(), picture| picture,
        |_, picture| {
            samples.push(picture);
            Ok(())
        },
    )?;
    let palette = Palette::from_frames(&samples, 256, film);
    let (dither, scores) = choose_dither(&samples, &palette, film);
    drop(samples);
    for s in scores {
        let chosen = if s.dither == dither { ", chosen" } else { "" };
        let name = s.dither.name();
        say.detail(&format!("dithering {name}: error {:.3}, flicker {:.3}{chosen}", s.error, s.flicker));
    }

    Ok((palette, dither))
}
