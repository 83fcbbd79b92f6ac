//! Pictures of a clip into files, as the command line makes them.

use super::Control;
use super::open::named;
use super::save::put;
use sinew::asset::Asset;
use sinew::clip::Clip;
use sinew::frames::{Look, Moment, Shot, ShotDesc, Stop, View, Worker, in_order_pairs};
use sinew::image::Rgba8;
use sinew::io::picture::{
    AtomicFile, Coding, Film, FilmWriter, Folder, Format, FrameEncoder, Output, Palette, PngLevel, Target,
    choose_dither, encode_png, encode_webp,
};
use sinew::io::sheet_json::{Style, to_json};
use sinew::render::{Renderer, Settings};
use sinew::sheet::{Assembler, Direction, Frames, SheetDesc, directions};
use sinew::time::{Range, Rate, frame_count, frame_time};

/// What is drawn, and into what.
#[derive(Clone, Debug)]
pub struct Wish {
    /// The file, with `####` for a sequence.
    pub to: std::path::PathBuf,
    /// All frames in one picture.
    pub sheet: Option<SheetWish>,
    /// Pixels across and down, samples of the rasterizer.
    pub settings: Settings,
    /// Nothing behind the character.
    pub transparent: bool,
    /// From where.
    pub view: View,
    /// Raster or rays.
    pub renderer: Renderer,
    /// Frames a second.
    pub rate: Rate,
    /// Which clip.
    pub clip: usize,
    /// What a still shows, seconds; its clip otherwise.
    pub at: f64,
    /// The moments of a film.
    pub range: Range,
}

/// How frames become one picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetWish {
    /// How they lie.
    pub desc: SheetDesc,
    /// Sides that the character is seen from.
    pub sides: u8,
    /// The file beside the picture.
    pub json: Option<Style>,
}

/// Frames that a film may have.
const MOST: usize = 100_000;
/// Frames that a palette is made from.
const SAMPLES: usize = 16;

/// Draw and write; returns what was written.
///
/// # Errors
/// A message; or nothing to say, where it was cancelled.
pub fn write(
    wish: &Wish,
    asset: &Asset,
    clips: Vec<Clip>,
    control: &Control,
) -> Result<String, Option<String>> {
    let fail = |e: &dyn std::fmt::Display| Some(named(&wish.to, e));
    let target = Target::parse(&wish.to).map_err(|e| fail(&e))?;
    wish.settings.check().map_err(|e| fail(&e))?;
    let character = asset.character.clone().with_clips(clips).map_err(|e| fail(&e))?;
    let asset = Asset { character, ..asset.clone() };
    let clear = wish.transparent || wish.sheet.is_some();
    let single = matches!(target, Target::Still(_, f) if !f.is_film()) && wish.sheet.is_none();
    let desc = ShotDesc {
        clip: Some(wish.clip),
        view: wish.view,
        renderer: wish.renderer,
        settings: Settings { threads: if single { threads() } else { 1 }, ..wish.settings },
        look: Look { background: if clear { [0.0; 4] } else { Look::paper() }, ..Look::default() },
        ..ShotDesc::default()
    };
    let sides = wish.sheet.map_or(1, |s| s.sides);
    let shot = Shot::new(&asset, desc.from_sides(&asset, sides.into())).map_err(|e| fail(&e))?;
    let count =
        if single { 1 } else { frame_count(wish.range, wish.rate.fps(), MOST).map_err(|e| fail(&e))? };
    let time =
        |i: usize| if single { wish.at } else { frame_time(wish.range.start, i as i64 + 1, wish.rate) };
    let name = &asset.character.clips()[wish.clip].name;
    let job = Job { wish, shot: &shot, target, count, sides: directions(sides.into()), time: &time, control };
    if let Some(sheet) = wish.sheet {
        job.sheet(sheet, name)?;
    } else if job.target.is_film(count) {
        job.film()?;
    } else {
        job.stills()?;
    }
    let from = if sides > 1 { format!(" from {sides} sides") } else { String::new() };
    let frames = if single { "1 picture".into() } else { format!("{count} frames") };
    Ok(format!("{frames}{from} → {}", job.target.name().display()))
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}

struct Job<'a> {
    wish: &'a Wish,
    shot: &'a Shot<'a>,
    target: Target,
    count: usize,
    /// A sheet has so many frames of each.
    sides: Vec<Direction>,
    time: &'a (dyn Fn(usize) -> f64 + Sync),
    control: &'a Control,
}

impl Job<'_> {
    fn fail(&self, e: impl std::fmt::Display) -> Option<String> {
        Some(named(&self.wish.to, &e))
    }

    /// The moment of a frame, side by side.
    fn moment(&self, i: usize) -> Moment {
        Moment { time: (self.time)(i % self.count), turn: self.sides[i / self.count].turn }
    }

    fn draw(&self, worker: &mut Worker, i: usize) -> Rgba8 {
        let mut picture = Rgba8::default();
        self.shot.draw(self.moment(i), worker, &mut picture);
        picture
    }

    /// Draw in parallel, encode each frame beside the one before, and take the results in order.
    fn run<S, T: Send>(
        &self,
        state: impl Fn() -> S + Sync,
        encode: impl Fn(&mut S, Option<&Rgba8>, &Rgba8) -> T + Sync,
        mut take: impl FnMut(usize, T) -> Result<(), Option<String>>,
    ) -> Result<(), Option<String>> {
        let (mut fault, all) = (None, self.count * self.sides.len());
        let start = || (Worker::default(), state());
        let first = |s: &mut (Worker, S), i: usize| self.draw(&mut s.0, i);
        let second = |s: &mut (Worker, S), before: Option<&Rgba8>, now: &Rgba8| encode(&mut s.1, before, now);
        let done = in_order_pairs(all, threads(), start, first, second, |i, result| {
            let taken = match self.control.goes_on((i + 1) as f32 / all as f32) {
                true => take(i, result),
                false => Err(None),
            };
            taken.map_err(|e| {
                fault = Some(e);
                Stop
            })
        });
        done.map_err(|Stop| fault.flatten())
    }

    fn stills(&self) -> Result<(), Option<String>> {
        let format = self.target.format();
        let folder =
            if matches!(self.target, Target::Sequence(..)) { Folder::Create } else { Folder::MustExist };
        let encode = |(): &mut (), _: Option<&Rgba8>, p: &Rgba8| match format {
            Format::Webp => encode_webp(p),
            _ => encode_png(p, PngLevel::default()),
        };
        if format == Format::Exr {
            return Err(self.fail("OpenEXR is written by the command line; expected .png or .webp"));
        }
        self.run(
            || (),
            encode,
            |i, bytes| {
                let path = self.target.path_of(i as i64 + 1).unwrap_or_else(|| self.wish.to.clone());
                let bytes = bytes.map_err(|e| self.fail(e))?;
                AtomicFile::write(&path, &bytes, true, folder).map_err(|e| self.fail(e))
            },
        )
    }

    fn film(&self) -> Result<(), Option<String>> {
        let (size, frames) = (self.shot.size(), self.count as u32);
        let film = Film { transparent: self.wish.transparent, ..Film::new(size, frames, self.wish.rate) };
        let coding = match self.target.format() {
            Format::Gif => {
                let few = self.count.min(SAMPLES);
                let mut worker = Worker::default();
                let samples: Vec<Rgba8> =
                    (0..few).map(|k| self.draw(&mut worker, k * self.count / few)).collect();
                let palette = Palette::from_frames(&samples, 256, &film);
                let (dither, _) = choose_dither(&samples, &palette, &film);
                Coding::Gif(palette, dither)
            }
            Format::Webp => Coding::Webp,
            Format::Y4m => Coding::Y4m,
            _ => Coding::Apng(PngLevel::default()),
        };
        let mut out = Output::file(&self.wish.to, true, Folder::MustExist).map_err(|e| self.fail(e))?;
        let mut writer = FilmWriter::new(&mut out, film, &coding).map_err(|e| self.fail(e))?;
        let encode = |e: &mut FrameEncoder, before: Option<&Rgba8>, now: &Rgba8| e.encode(before, now);
        self.run(
            || FrameEncoder::new(film, &coding),
            encode,
            |_, frame| {
                let frame = frame.map_err(|e| self.fail(e))?;
                writer.write(frame).map_err(|e| self.fail(e))
            },
        )?;
        writer.finish().map_err(|e| self.fail(e))?;
        out.commit().map_err(|e| self.fail(e))
    }

    fn sheet(&self, wish: SheetWish, clip: &str) -> Result<(), Option<String>> {
        let (size, desc) = (self.shot.size(), wish.desc);
        let mut all =
            Assembler::new(desc, self.count, self.sides.len(), size, [0_u8; 4]).map_err(|e| self.fail(e))?;
        let cut = |p: &Rgba8| desc.cut(p.data.as_chunks::<4>().0.to_vec(), size, |p: &[u8; 4]| p[3] > 0);
        self.run(
            || (),
            |(), _, p| cut(p),
            |_, (trim, pixels)| all.add(trim, pixels).map_err(|e| self.fail(e)),
        )?;
        let (canvas, placed) = all.finish().map_err(|e| self.fail(e))?;
        let [width, height] = canvas.size;
        let picture = Rgba8 { width, height, data: canvas.pixels.into_flattened() };
        let bytes = match self.target.format() {
            Format::Webp => encode_webp(&picture),
            _ => encode_png(&picture, PngLevel::default()),
        };
        put(&self.wish.to, &bytes.map_err(|e| self.fail(e))?).map_err(Some)?;
        let Some(style) = wish.json else { return Ok(()) };

        // Where the character stands, for games.
        let (mut worker, ground) = (Worker::default(), self.shot.ground_point());
        let mut stands = |i| self.shot.project(self.moment(i), ground, &mut worker).unwrap_or([0.5, 1.0]);
        let pivots: Vec<[f64; 2]> = (0..self.count * self.sides.len()).map(&mut stands).collect();
        let numbers: Vec<i64> = (1..=self.count as i64).collect();
        let frames = Frames {
            clip,
            sides: &self.sides,
            numbers: &numbers,
            size,
            rate: self.wish.rate,
            pivots: &pivots,
        };
        let image = self.wish.to.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let text = to_json(&frames.describe(&placed, image), style);
        put(&self.wish.to.with_extension("json"), text.as_bytes()).map_err(Some)
    }
}
