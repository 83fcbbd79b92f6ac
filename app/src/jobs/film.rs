//! Pictures of a clip into files, as the command line makes them.

use super::Control;
use super::open::named;
use super::save::put;
use sinew::asset::Asset;
use sinew::clip::Clip;
use sinew::frames::{Moment, Shot, ShotDesc, Stop, View, Worker, in_order_pairs};
use sinew::image::Rgba8;
use sinew::io::picture::{
    AtomicFile, Coding, Film, FilmWriter, Folder, Format, FrameEncoder, Output, Palette, PngLevel, Target,
    choose_dither, encode_png, encode_webp,
};
use sinew::io::sheet_json::{Style, to_json};
use sinew::render::{Renderer, Settings};
use sinew::sheet::{Canvas, Limits, Margins, Sheet, Sprite, Tag, durations, grid};
use sinew::time::{Range, Rate, frame_count, frame_time};
use std::path::Path;

/// What is drawn, and into what.
#[derive(Clone, Debug)]
pub struct Wish {
    /// The file, with `####` for a sequence.
    pub to: std::path::PathBuf,
    /// All frames in one picture, and a JSON file beside it.
    pub sheet: bool,
    /// Pixels across and down.
    pub size: [usize; 2],
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
    let settings = Settings { width: wish.size[0], height: wish.size[1], ..Settings::default() };
    settings.check().map_err(|e| fail(&e))?;
    let character = asset.character.clone().with_clips(clips).map_err(|e| fail(&e))?;
    let asset = Asset { character, ..asset.clone() };
    let desc = ShotDesc {
        clip: Some(wish.clip),
        view: wish.view,
        renderer: wish.renderer,
        settings,
        ..ShotDesc::default()
    };
    let shot = Shot::new(&asset, desc).map_err(|e| fail(&e))?;
    let single = matches!(target, Target::Still(_, f) if !f.is_film()) && !wish.sheet;
    let count =
        if single { 1 } else { frame_count(wish.range, wish.rate.fps(), MOST).map_err(|e| fail(&e))? };
    let time =
        |i: usize| if single { wish.at } else { frame_time(wish.range.start, i as i64 + 1, wish.rate) };
    let job = Job { wish, shot: &shot, target, count, time: &time, control };
    if wish.sheet {
        job.sheet()?;
    } else if job.target.is_film(count) {
        job.film()?;
    } else {
        job.stills()?;
    }
    Ok(format!("{count} frames → {}", job.target.name().display()))
}

struct Job<'a> {
    wish: &'a Wish,
    shot: &'a Shot<'a>,
    target: Target,
    count: usize,
    time: &'a (dyn Fn(usize) -> f64 + Sync),
    control: &'a Control,
}

impl Job<'_> {
    fn fail(&self, e: impl std::fmt::Display) -> Option<String> {
        Some(named(&self.wish.to, &e))
    }

    fn draw(&self, worker: &mut Worker, i: usize) -> Rgba8 {
        let mut picture = Rgba8::default();
        self.shot.draw(Moment::from((self.time)(i)), worker, &mut picture);
        picture
    }

    /// Draw in parallel, encode each frame beside the one before, and take the results in order.
    fn run<S, T: Send>(
        &self,
        state: impl Fn() -> S + Sync,
        encode: impl Fn(&mut S, Option<&Rgba8>, &Rgba8) -> T + Sync,
        mut take: impl FnMut(usize, T) -> Result<(), Option<String>>,
    ) -> Result<(), Option<String>> {
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
        let mut fault = None;
        let start = || (Worker::default(), state());
        let first = |s: &mut (Worker, S), i: usize| self.draw(&mut s.0, i);
        let second = |s: &mut (Worker, S), before: Option<&Rgba8>, now: &Rgba8| encode(&mut s.1, before, now);
        let done = in_order_pairs(self.count, threads, start, first, second, |i, result| {
            let taken = match self.control.goes_on((i + 1) as f32 / self.count as f32) {
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
        let film = Film::new(self.wish.size, self.count as u32, self.wish.rate);
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

    fn sheet(&self) -> Result<(), Option<String>> {
        let columns = (self.count as f64).sqrt().ceil() as usize;
        let layout = grid(self.count, self.wish.size, columns, Margins::default(), Limits::default());
        let layout = layout.map_err(|e| self.fail(e))?;
        let mut canvas = Canvas::new(&layout, [0_u8; 4]);
        self.run(
            || (),
            |(), _, p: &Rgba8| p.clone(),
            |i, p| {
                canvas.put(layout.places[i], p.data.as_chunks::<4>().0, 0);
                Ok(())
            },
        )?;
        let [width, height] = canvas.size;
        let picture = Rgba8 { width, height, data: canvas.pixels.into_flattened() };
        let bytes = encode_png(&picture, PngLevel::Balanced).map_err(|e| self.fail(e))?;
        put(&self.wish.to, &bytes).map_err(Some)?;
        put(&self.wish.to.with_extension("json"), self.table(layout.size, &layout.places).as_bytes())
            .map_err(Some)
    }

    fn table(&self, size: [usize; 2], places: &[sinew::sheet::Rect]) -> String {
        let name = &self.shot.desc().clip.map_or(String::new(), |c| format!("clip{c}"));
        let times = durations(self.count, self.wish.rate);
        let sprite = |(i, place): (usize, &sinew::sheet::Rect)| Sprite {
            name: format!("{name}/{:04}", i + 1),
            place: *place,
            trim: sinew::sheet::Rect::whole(self.wish.size),
            source: self.wish.size,
            pivot: [0.5, 1.0],
            duration_ms: times[i],
        };
        let sheet = Sheet {
            image: Path::new(&self.wish.to).file_name().unwrap_or_default().to_string_lossy().into_owned(),
            size,
            indexed: false,
            rate: self.wish.rate,
            sprites: places.iter().enumerate().map(sprite).collect(),
            tags: vec![Tag { name: name.clone(), frames: 0..self.count }],
            maps: vec![],
        };
        to_json(&sheet, Style::default())
    }
}
