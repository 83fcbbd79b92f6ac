//! Pictures of a sheet's layout that say more than its colour does: normals, depth, objects.

use super::super::channels::{depth_code, distinct_color, normal_code};
use super::super::time::Frame;
use super::sprites::{Drawn, Plan, file_name};
use super::{MapName, Painter, SheetArgs, draw};
use crate::cli::{Failure, say::Say};
use sinew::frames::Worker;
use sinew::io::picture::{self, Data, encode_data_png};
use sinew::render::channel::{Channel, Channels};
use sinew::sheet::{Canvas, Layout, Map, MapKind, Placed, Rect};
use std::path::{Path, PathBuf};

/// Objects that an 8-bit index can number.
const MOST_OBJECTS: usize = 255;

/// A normal towards the viewer: where something is that has none of its own.
const FLAT: [u8; 3] = [128, 128, 255];

/// Maps of the whole sheet, as far as they are wanted.
struct Canvases {
    objects: Canvas<u32>,
    depth: Option<Canvas<f32>>,
    normals: Option<Canvas<[u8; 3]>>,
}

type Files = Vec<(PathBuf, Vec<u8>)>;

/// Draw the maps that are asked for: what they are, and their files.
pub fn draw(
    args: &SheetArgs,
    plan: &Plan,
    drawn: &Drawn,
    path: &Path,
    say: &Say,
) -> Result<(Vec<Map>, Files), Failure> {
    let wanted = args.maps();
    if wanted.is_empty() {
        return Ok(Default::default());
    }
    let names = plan.job.shot.object_names();
    if wanted.contains(&MapName::Id) && names.len() > MOST_OBJECTS {
        let n = names.len();
        return Err(Failure::Run(format!("--maps id: {n} objects; expected at most {MOST_OBJECTS}")));
    }
    let canvases = fill(args, plan, &drawn.placed, &wanted, say)?;
    let (mut maps, mut files) = (Vec::new(), Vec::new());
    for name in wanted {
        let file = path.with_extension(format!("{}.png", name.name()));
        let (kind, bytes) = match name {
            MapName::Normal => normals(&canvases, drawn, plan),
            MapName::Depth => depth(&canvases, drawn, plan),
            MapName::Id => objects(&canvases, drawn, plan, &names),
        };
        let bytes = bytes.map_err(|e: picture::Error| Failure::Run(e.to_string()))?;
        maps.push(Map { image: file_name(&file), kind });
        files.push((file, bytes));
    }
    Ok((maps, files))
}

/// Draw the first frame of each place again, and put what its pixels show there.
fn fill(
    args: &SheetArgs,
    plan: &Plan,
    placed: &Placed,
    wanted: &[MapName],
    say: &Say,
) -> Result<Canvases, Failure> {
    let Layout { places, .. } = &placed.layout;
    let first = |place: usize| placed.cuts.iter().position(|c| c.0 == place).unwrap_or_default();
    let chosen: Vec<usize> = (0..places.len()).map(first).collect();
    let frames: Vec<Frame> = chosen.iter().map(|&i| plan.frames[i]).collect();
    let has = |name: MapName| wanted.contains(&name);
    let mut channels = vec![Channel::Object];
    channels.extend(has(MapName::Depth).then_some(Channel::Depth));
    channels.extend(has(MapName::Normal).then_some(Channel::Normal));
    let mut to = Canvases {
        objects: Canvas::new(&placed.layout, 0),
        depth: has(MapName::Depth).then(|| Canvas::new(&placed.layout, f32::INFINITY)),
        normals: has(MapName::Normal).then(|| Canvas::new(&placed.layout, FLAT)),
    };
    let (scale, outlined) = (args.pixels.scale(), plan.job.art.as_ref().is_some_and(Painter::is_outlined));
    let one = |w: &mut Worker, f: &Frame| {
        let mut out = Channels::default();
        plan.job.count(plan.job.shot.draw_channels(f.moment, w, &channels, &mut out));
        if outlined {
            grow(&mut out);
        }
        out
    };
    draw::frames(plan.job, &frames, say, one, |i, seen| {
        let (place, trim, extrude) = (places[i], placed.cuts[chosen[i]].1, placed.extrude);
        let at = |trim: Rect| indices(trim, seen.width, scale);
        to.objects.put(place, &at(trim).map(|k| seen.objects[k]).collect::<Vec<_>>(), extrude);
        if let Some(depth) = &mut to.depth {
            depth.put(place, &at(trim).map(|k| seen.depth[k]).collect::<Vec<_>>(), extrude);
        }
        if let Some(normals) = &mut to.normals {
            let code = |k: usize| if seen.objects[k] > 0 { normal_code(seen.normals[k]) } else { FLAT };
            normals.put(place, &at(trim).map(code).collect::<Vec<_>>(), extrude);
        }
        Ok(())
    })?;
    Ok(to)
}

/// Where the pixels of a part of an enlarged frame are in the frame as it was drawn.
fn indices(trim: Rect, width: usize, scale: usize) -> impl Iterator<Item = usize> {
    (trim.y..trim.y + trim.h)
        .flat_map(move |y| (trim.x..trim.x + trim.w).map(move |x| y / scale * width + x / scale))
}

/// Let an outline show what the pixel beside it shows.
fn grow(seen: &mut Channels) {
    let (before, w, h) = (seen.clone(), seen.width, seen.height);
    for at in (0..w * h).filter(|&at| before.objects[at] == 0) {
        let (x, y) = (at % w, at / w);
        let beside = [
            (y > 0).then(|| at - w),
            (x > 0).then(|| at - 1),
            (x + 1 < w).then(|| at + 1),
            (y + 1 < h).then(|| at + w),
        ];
        if let Some(from) = beside.into_iter().flatten().find(|&k| before.objects[k] > 0) {
            seen.copy_pixel(at, &before, from);
        }
    }
}

type Made = (MapKind, Result<Vec<u8>, picture::Error>);

fn normals(from: &Canvases, drawn: &Drawn, plan: &Plan) -> Made {
    let normals = from.normals.iter().flat_map(|c| &c.pixels);
    let pixel = |([x, y, z], a): (&[u8; 3], &u8)| [*x, *y, *z, *a];
    let pixels: Vec<[u8; 4]> = normals.zip(&drawn.alpha).map(pixel).collect();
    (MapKind::Normal, encode_data_png(drawn.placed.layout.size, Data::Rgba8(&pixels), plan.job.level, ""))
}

fn depth(from: &Canvases, drawn: &Drawn, plan: &Plan) -> Made {
    let depth = || from.depth.iter().flat_map(|c| &c.pixels);
    let there = || depth().zip(&drawn.alpha).filter(|(d, a)| d.is_finite() && **a > 0).map(|p| *p.0);
    let near = there().reduce(f32::min).unwrap_or(0.0);
    let far = there().reduce(f32::max).unwrap_or(1.0);
    // A flat picture still needs a range.
    let far = if far > near { far } else { near + near.abs().max(1.0) * 1e-3 };
    let code = |(d, a): (&f32, &u8)| {
        if *a == 0 { 0 } else { depth_code(*d, [near, far]) }
    };
    let pixels: Vec<u16> = depth().zip(&drawn.alpha).map(code).collect();
    let bytes = encode_data_png(drawn.placed.layout.size, Data::Gray16(&pixels), plan.job.level, "");
    (MapKind::Depth { near, far }, bytes)
}

fn objects(from: &Canvases, drawn: &Drawn, plan: &Plan, names: &[String]) -> Made {
    let objects: Vec<(String, [u8; 3])> =
        names.iter().enumerate().map(|(i, n)| (n.clone(), distinct_color(i))).collect();
    let mut colors = vec![[0; 3]];
    colors.extend(objects.iter().map(|o| o.1));
    let code = |(o, a): (&u32, &u8)| if *a > 0 { *o as u8 } else { 0 };
    let indices: Vec<u8> = from.objects.pixels.iter().zip(&drawn.alpha).map(code).collect();
    let bytes =
        encode_data_png(drawn.placed.layout.size, Data::Index8(&indices, &colors), plan.job.level, "");
    (MapKind::Object { objects }, bytes)
}
