//! Sprite sheets: all frames of all directions, their places, and what is beside the picture.

use super::super::film::Job;
use super::super::time::Frame;
use super::{Kind, Painter, Pivot, SheetArgs, draw, maps};
use crate::cli::{Failure, say::Say};
use sinew::frames::{Moment, Worker};
use sinew::image::Rgba8;
use sinew::io::picture;
use sinew::io::sheet_json::to_json;
use sinew::sheet::{
    Canvas, Direction, Distinct, Layout, Limits, Margins, Packing, Rect, Sheet, SheetError, Sprite, Tag,
    directions, durations, grid, pack, visible,
};
use std::hash::Hash;
use std::path::Path;

/// What is wanted of all frames together.
pub struct Plan<'a> {
    pub job: &'a Job<'a>,
    pub kind: Kind,
    /// Every frame from every side, side by side.
    pub frames: Vec<Frame>,
    pub columns: usize,
    pub margins: Margins,
    pub power_of_two: bool,
}

/// Where everything went.
pub struct Placed {
    pub layout: Layout,
    /// Of each frame: the number of its place, and which part of it is there.
    pub cuts: Vec<(usize, Rect)>,
    /// Alpha of the whole sheet.
    pub alpha: Vec<u8>,
}

pub fn write(
    args: &SheetArgs,
    kind: Kind,
    job: &Job,
    clip: &str,
    path: &Path,
    say: &Say,
) -> Result<(), Failure> {
    let sides = directions(usize::from(args.directions));
    let plan = plan(args, kind, job, &sides);
    let failed = |e: picture::Error| Failure::Run(e.to_string());
    let (placed, bytes) = match &job.art {
        Some(art) => indexed(&plan, art, say)?,
        None => colored(&plan, say)?,
    };
    let mut files = vec![(path.to_owned(), bytes.map_err(failed)?)];
    let mut sheet = describe(args, &plan, &placed, clip, &sides, path);
    sheet.indexed = job.art.is_some();
    let (found, drawn) = maps::draw(args, &plan, &placed, path, say)?;
    sheet.maps = found;
    files.extend(drawn);
    if let Some(style) = args.sheet_json.0 {
        files.push((path.with_extension("json"), to_json(&sheet, style).into_bytes()));
    }
    for (path, bytes) in &files {
        job.write(path, bytes)?;
    }
    let names: Vec<String> = files.iter().map(|f| f.0.display().to_string()).collect();
    let ([w, h], frames, places) = (placed.layout.size, plan.frames.len(), placed.layout.places.len());
    say.note(&format!("wrote {}: {w} × {h} pixels, {frames} frames in {places} places", names.join(", ")));
    Ok(())
}

fn plan<'a>(args: &SheetArgs, kind: Kind, job: &'a Job, sides: &[Direction]) -> Plan<'a> {
    let turned = |d: &Direction, f: &Frame| {
        let turn = f.moment.turn + d.turn;
        Frame { moment: Moment { turn, ..f.moment }, ..*f }
    };
    let frames: Vec<Frame> =
        sides.iter().flat_map(|d| job.frames.iter().map(move |f| turned(d, f))).collect();
    let padding = usize::from(args.padding.unwrap_or(if kind == Kind::Trimmed { 1 } else { 0 }));
    let margins = Margins { between: padding, around: padding, extrude: args.extrude.into() };
    // One direction alone makes about a square, so that the strip of a long clip is no strip.
    let [w, h] = job.size().map(|s| s as f64);
    let square = (frames.len() as f64 * h / w.max(1.0)).sqrt().ceil().max(1.0) as usize;
    let columns = match args.columns {
        Some(n) => n.into(),
        None if sides.len() > 1 => job.frames.len(),
        None => square,
    };
    Plan { job, kind, frames, columns, margins, power_of_two: args.power_of_two }
}

type Bytes = Result<Vec<u8>, picture::Error>;

fn colored(plan: &Plan, say: &Say) -> Result<(Placed, Bytes), Failure> {
    let one = |frame: Rgba8| frame.data.as_chunks::<4>().0.to_vec();
    let (canvas, layout, cuts) = lay_out(plan, [0u8; 4], one, |p| p[3] > 0, say)?;
    let alpha = canvas.pixels.iter().map(|p| p[3]).collect();
    Ok((Placed { layout, cuts, alpha }, draw::encode(plan.job, canvas)))
}

fn indexed(plan: &Plan, art: &Painter, say: &Say) -> Result<(Placed, Bytes), Failure> {
    let hole = art.palette().transparent();
    let one = |frame: Rgba8| art.map(&frame).indices;
    let (canvas, layout, cuts) = lay_out(plan, hole, one, |i| *i != hole, say)?;
    let alpha = canvas.pixels.iter().map(|&i| if i == hole { 0 } else { 255 }).collect();
    Ok((Placed { layout, cuts, alpha }, draw::encode_indexed(plan.job, canvas, art)))
}

type LaidOut<P> = (Canvas<P>, Layout, Vec<(usize, Rect)>);

/// Draw all frames, `finish` each on its thread, and find them their places.
fn lay_out<P: Copy + Eq + Hash + Send>(
    plan: &Plan,
    fill: P,
    finish: impl Fn(Rgba8) -> Vec<P> + Sync,
    seen: impl Fn(&P) -> bool + Sync,
    say: &Say,
) -> Result<LaidOut<P>, Failure> {
    let (job, size, limits) = (plan.job, plan.job.size(), Limits::default());
    let failed = |e: SheetError| Failure::Run(format!("--sheet: {e}"));
    let drawn = |w: &mut Worker, f: &Frame| {
        let out = job.draw(f.moment, w);
        finish(out)
    };
    let whole = Rect::whole(size);
    if plan.kind == Kind::Grid {
        let layout = grid(plan.frames.len(), size, plan.columns, plan.margins, limits).map_err(failed)?;
        let mut canvas = Canvas::new(&layout, fill);
        draw::frames(job, &plan.frames, say, drawn, |i, pixels| {
            canvas.put(layout.places[i], &pixels, plan.margins.extrude);
            Ok(())
        })?;
        let cuts = (0..plan.frames.len()).map(|i| (i, whole)).collect();
        return Ok((canvas, layout, cuts));
    }
    let (mut distinct, mut cuts) = (Distinct::new(), Vec::with_capacity(plan.frames.len()));
    let trimmed = |w: &mut Worker, f: &Frame| {
        let pixels = drawn(w, f);
        let trim = visible(&pixels, size[0], &seen);
        (trim, trim.cut(&pixels, size[0]))
    };
    draw::frames(job, &plan.frames, say, trimmed, |i, (trim, pixels)| {
        cuts.push((distinct.add(trim.size(), pixels), trim));
        let found = distinct.area();
        if found > limits.pixels {
            return Err(failed(SheetError::TooFull { frames: i + 1, found, limits }));
        }
        Ok(())
    })?;
    let packing = Packing { margins: plan.margins, power_of_two: plan.power_of_two, limits };
    let layout = pack(&distinct.sizes(), packing).map_err(failed)?;
    let mut canvas = Canvas::new(&layout, fill);
    for (i, place) in layout.places.iter().enumerate() {
        canvas.put(*place, distinct.pixels(i), plan.margins.extrude);
    }
    Ok((canvas, layout, cuts))
}

/// The sheet in words.
fn describe(
    args: &SheetArgs,
    plan: &Plan,
    placed: &Placed,
    clip: &str,
    sides: &[Direction],
    path: &Path,
) -> Sheet {
    let (job, n) = (plan.job, plan.job.frames.len());
    let times = durations(n, job.rate);
    let pivots = pivots(args, plan);
    // Numbers that sort as they follow one another.
    let digits = job.frames.iter().map(|f| f.number.to_string().len()).max().unwrap_or(1).max(4);
    let tag = |d: &Direction| if d.name.is_empty() { clip.to_owned() } else { format!("{clip}/{}", d.name) };
    let sprite = |i: usize| {
        let (place, trim) = placed.cuts[i];
        Sprite {
            name: format!("{}/{:0digits$}", tag(&sides[i / n]), plan.frames[i].number),
            place: placed.layout.places[place],
            trim,
            source: job.size(),
            pivot: pivots[i],
            duration_ms: times[i % n],
        }
    };
    Sheet {
        image: file_name(path),
        size: placed.layout.size,
        indexed: false,
        rate: job.rate,
        sprites: (0..plan.frames.len()).map(sprite).collect(),
        tags: sides
            .iter()
            .enumerate()
            .map(|(k, d)| Tag { name: tag(d), frames: k * n..(k + 1) * n })
            .collect(),
        maps: Vec::new(),
    }
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
