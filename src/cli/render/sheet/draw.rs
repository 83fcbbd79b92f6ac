//! Frames drawn in parallel and received in order.

use super::super::film::Job;
use super::super::time::Frame;
use super::Painter;
use crate::cli::{Failure, say::Say};
use sinew::frames::{Stop, Worker, in_order};
use sinew::image::Rgba8;
use sinew::io::picture::{self, Format, Indexed, encode_indexed_png, encode_png, encode_webp};
use sinew::sheet::Canvas;

/// Do `one` with every frame on the job's threads, and hand the results on in order.
pub fn frames<T: Send>(
    job: &Job,
    frames: &[Frame],
    say: &Say,
    one: impl Fn(&mut Worker, &Frame) -> T + Sync,
    mut receive: impl FnMut(usize, T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let bar = say.progress(frames.len());
    let mut fault = None;
    let work = |worker: &mut Worker, i: usize| one(worker, &frames[i]);
    let done = in_order(frames.len(), job.threads, Worker::default, work, |i, result| {
        bar.inc(1);
        receive(i, result).map_err(|e| {
            fault = Some(e);
            Stop
        })
    });
    bar.finish_and_clear();
    match (done, fault) {
        (Ok(()), _) => Ok(()),
        (_, Some(e)) => Err(e),
        (Err(Stop), None) => Err(Failure::Run("drawing stopped".into())),
    }
}

/// The file of a sheet.
pub fn encode(job: &Job, canvas: Canvas<[u8; 4]>) -> Result<Vec<u8>, picture::Error> {
    let [width, height] = canvas.size;
    let picture = Rgba8 { width, height, data: canvas.pixels.into_flattened() };
    match job.target.format() {
        Format::Webp => encode_webp(&picture),
        _ => encode_png(&picture, job.level),
    }
}

/// The file of a sheet in a palette's colours; PNG keeps the palette.
pub fn encode_indexed(job: &Job, canvas: Canvas<u8>, art: &Painter) -> Result<Vec<u8>, picture::Error> {
    let picture = Indexed { size: canvas.size, indices: canvas.pixels };
    match job.target.format() {
        Format::Webp => encode_webp(&picture.to_rgba8(art.palette())),
        _ => encode_indexed_png(&picture, art.palette(), job.level),
    }
}
