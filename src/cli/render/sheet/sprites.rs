//! Sprite sheets: all frames of all directions, their places, and what is beside the picture.

use super::super::film::Job;
use super::super::time::Frame;
use super::{Painter, Pivot, SheetArgs, draw, maps};
use crate::cli::{Failure, say::Say};
use sinew::frames::{Moment, Worker};
use sinew::image::Rgba8;
use sinew::io::picture;
use sinew::io::sheet_json::to_json;
use sinew::sheet::{Assembler, Canvas, Direction, Frames, Placed, SheetDesc, SheetError, directions};
use std::hash::Hash;
use std::path::Path;

/// What is wanted of all frames together.
pub struct Plan<'a> {
    pub job: &'a Job<'a>,
    desc: SheetDesc,
    /// Where the character is seen from.
    sides: Vec<Direction>,
    /// Every frame from every side, side by side.
    pub frames: Vec<Frame>,
}

/// Where everything went, and the alpha of the whole sheet.
pub struct Drawn {
    pub placed: Placed,
    pub alpha: Vec<u8>,
}

pub fn write(
    args: &SheetArgs,
    desc: SheetDesc,
    job: &Job,
    clip: &str,
    path: &Path,
    say: &Say,
) -> Result<(), Failure> {
    let plan = plan(args, desc, job);
    let failed = |e: picture::Error| Failure::Run(e.to_string());
    let (drawn, bytes) = match &job.art {
        Some(art) => indexed(&plan, art, say)?,
        None => colored(&plan, say)?,
    };
    let mut files = vec![(path.to_owned(), bytes.map_err(failed)?)];
    let numbers: Vec<i64> = job.frames.iter().map(|f| f.number).collect();
    let (sides, pivots, numbers) = (&plan.sides[..], &pivots(args, &plan)[..], &numbers[..]);
    let frames = Frames { clip, sides, numbers, size: job.size(), rate: job.rate, pivots };
    let mut sheet = frames.describe(&drawn.placed, file_name(path));
    sheet.indexed = job.art.is_some();
    let (found, maps) = maps::draw(args, &plan, &drawn, path, say)?;
    sheet.maps = found;
    files.extend(maps);
    if let Some(style) = args.sheet_json.0 {
        files.push((path.with_extension("json"), to_json(&sheet, style).into_bytes()));
    }
    for (path, bytes) in &files {
        job.write(path, bytes)?;
    }
    let names: Vec<String> = files.iter().map(|f| f.0.display().to_string()).collect();
    let ([w, h], frames, places) = (sheet.size, plan.frames.len(), drawn.placed.layout.places.len());
    say.note(&format!("wrote {}: {w} × {h} pixels, {frames} frames in {places} places", names.join(", ")));
    Ok(())
}

fn plan<'a>(args: &SheetArgs, desc: SheetDesc, job: &'a Job) -> Plan<'a> {
    let sides = directions(usize::from(args.directions));
    let turned = |d: &Direction, f: &Frame| {
        let turn = f.moment.turn + d.turn;
        Frame { moment: Moment { turn, ..f.moment }, ..*f }
    };
    let frames = sides.iter().flat_map(|d| job.frames.iter().map(move |f| turned(d, f))).collect();
    Plan { job, desc, sides, frames }
}

type Bytes = Result<Vec<u8>, picture::Error>;

fn colored(plan: &Plan, say: &Say) -> Result<(Drawn, Bytes), Failure> {
    let one = |frame: Rgba8| frame.data.as_chunks::<4>().0.to_vec();
    let (canvas, placed) = lay_out(plan, [0u8; 4], one, |p| p[3] > 0, say)?;
    let alpha = canvas.pixels.iter().map(|p| p[3]).collect();
    Ok((Drawn { placed, alpha }, draw::encode(plan.job, canvas)))
}

fn indexed(plan: &Plan, art: &Painter, say: &Say) -> Result<(Drawn, Bytes), Failure> {
    let hole = art.palette().transparent();
    let one = |frame: Rgba8| art.map(&frame).indices;
    let (canvas, placed) = lay_out(plan, hole, one, |i| *i != hole, say)?;
    let alpha = canvas.pixels.iter().map(|&i| if i == hole { 0 } else { 255 }).collect();
    Ok((Drawn { placed, alpha }, draw::encode_indexed(plan.job, canvas, art)))
}

/// Draw all frames, `finish` each on its thread, and find them their places.
fn lay_out<P: Copy + Eq + Hash + Send>(
    plan: &Plan,
    fill: P,
    finish: impl Fn(Rgba8) -> Vec<P> + Sync,
    seen: impl Fn(&P) -> bool + Sync,
    say: &Say,
) -> Result<(Canvas<P>, Placed), Failure> {
    let (job, desc, size) = (plan.job, plan.desc, plan.job.size());
    let failed = |e: SheetError| Failure::Run(format!("--sheet: {e}"));
    let mut all = Assembler::new(desc, job.frames.len(), plan.sides.len(), size, fill).map_err(failed)?;
    let one = |w: &mut Worker, f: &Frame| desc.cut(finish(job.draw(f.moment, w)), size, &seen);
    draw::frames(job, &plan.frames, say, one, |_, (trim, pixels)| all.add(trim, pixels).map_err(failed))?;
    all.finish().map_err(failed)
}

/// Where the character stands in each frame.
fn pivots(args: &SheetArgs, plan: &Plan) -> Vec<[f64; 2]> {
    if let Pivot::At(at) = args.pivot {
        return vec![at; plan.frames.len()];
    }
    let (shot, mut worker) = (plan.job.shot, Worker::default());
    let ground = shot.ground_point();
    let mut find = |f: &Frame| shot.project(f.moment, ground, &mut worker).unwrap_or([0.5, 1.0]);
    plan.frames.iter().map(&mut find).collect()
}

/// The last part of a path, for what lies beside it.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
