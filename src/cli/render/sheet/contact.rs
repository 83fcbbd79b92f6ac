//! Contact sheets: moments of a clip side by side, to be seen at a glance.

use super::super::film::Job;
use super::super::time::Frame;
use super::draw;
use crate::cli::{Failure, say::Say};
use sinew::frames::{Shot, Worker};
use sinew::io::picture;
use sinew::sheet::{Canvas, Limits, Margins, Rect, grid};
use std::path::Path;

/// The most columns and rows.
const MOST: usize = 100;

/// Height of a cell over the width of the gaps, if that is more than two pixels.
const THIN: usize = 128;

/// `6x4` as columns and rows.
pub fn parse(text: &str) -> Result<[usize; 2], String> {
    let side = |s: &str| s.trim().parse::<usize>().ok().filter(|n| (1..=MOST).contains(n));
    let cells = text.split_once(['x', 'X', '×']).and_then(|(c, r)| Some([side(c)?, side(r)?]));
    cells.ok_or_else(|| format!("expected columns and rows from 1 to {MOST}, as in 6x4"))
}

/// Moments at equal steps: the clip's start first and its end last, or one step before the end if the clip loops.
pub fn frames([columns, rows]: [usize; 2], shot: &Shot) -> Vec<Frame> {
    let count = columns * rows;
    let steps = if shot.loops(&mut Worker::default()) { count } else { count.max(2) - 1 };
    let range = shot.range();
    let time = |k: usize| range.start + range.duration() * (k as f64 / steps as f64);
    (0..count).map(|k| Frame { number: k as i64 + 1, moment: time(k).into() }).collect()
}

pub fn write([columns, rows]: [usize; 2], job: &Job, path: &Path, say: &Say) -> Result<(), Failure> {
    let size = job.size();
    let gap = (size[1] / THIN).max(2);
    let margins = Margins { between: gap, around: gap, extrude: 0 };
    let layout = grid(columns * rows, size, columns, margins, Limits::default());
    let layout = layout.map_err(|e| Failure::Run(format!("--contact {columns}x{rows}: {e}")))?;
    // White between coloured cells, nothing between transparent ones.
    let fill = if job.transparent { [0; 4] } else { [255; 4] };
    let bytes = match &job.art {
        Some(art) => {
            let mut canvas = Canvas::new(&layout, art.palette().transparent());
            let one = |w: &mut Worker, f: &Frame| {
                let out = job.draw(f.moment, w);
                art.map(&out).indices
            };
            draw::frames(job, job.frames, say, one, put(&mut canvas, &layout.places))?;
            draw::encode_indexed(job, canvas, art)
        }
        None => {
            let mut canvas = Canvas::new(&layout, fill);
            let one = |w: &mut Worker, f: &Frame| {
                let out = job.draw(f.moment, w);
                out.data.as_chunks::<4>().0.to_vec()
            };
            draw::frames(job, job.frames, say, one, put(&mut canvas, &layout.places))?;
            draw::encode(job, canvas)
        }
    };
    let failed = |e: picture::Error| Failure::Run(e.to_string());
    job.write(path, &bytes.map_err(failed)?)?;
    let [w, h] = layout.size;
    say.note(&format!("wrote {}: {columns} × {rows} moments, {w} × {h} pixels", path.display()));
    Ok(())
}

/// Puts each frame's pixels into its cell.
fn put<P: Copy>(canvas: &mut Canvas<P>, places: &[Rect]) -> impl FnMut(usize, Vec<P>) -> Result<(), Failure> {
    |i, pixels| {
        canvas.put(places[i], &pixels, 0);
        Ok(())
    }
}
