//! Options of pixel art.

use super::super::film::Job;
use super::super::look;
use super::super::time::Frame;
use super::draw;
use crate::cli::{Failure, say::Say};
use sinew::frames::Worker;
use sinew::image::{Rgba8, color::encode_srgb8};
use sinew::io::{
    self,
    picture::{self, Dither, Indexed, Mapper, Palette, PixelArt, PixelArtDesc, PngLevel, encode_indexed_png},
};
use sinew::render::Settings;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Frames that a palette is made from.
const PALETTE_FRAMES: usize = 64;

#[derive(clap::Args)]
#[command(next_help_heading = "Pixel art")]
pub struct PixelArgs {
    /// Few colours, no partial coverage, one sample a pixel. PNG files have a palette, the same one in all frames.
    #[arg(long, conflicts_with = "samples")]
    pixel_art: bool,
    /// Draw at 1/K of --size and make each pixel K wide and high.
    #[arg(long, value_name = "K", default_value = "1", requires = "pixel_art", value_parser = clap::value_parser!(u8).range(1..=64))]
    pixel_scale: u8,
    /// Colours over the whole clip, 2 to 255, chosen to suit it; outline and background are among them.
    #[arg(long, value_name = "N", default_value = "32", requires = "pixel_art", value_parser = clap::value_parser!(u8).range(2..))]
    colors: u8,
    /// The colours of this file instead: .hex (rrggbb a line), .gpl (GIMP) or a .png.
    #[arg(long, value_name = "FILE", requires = "pixel_art", conflicts_with = "colors")]
    palette: Option<PathBuf>,
    /// Mix colours between those of the palette: none, ordered (still where the picture is still) or floyd-steinberg.
    #[arg(long, value_name = "DITHER", default_value = "ordered", requires = "pixel_art", value_parser = parse_dither)]
    palette_dither: Dither,
    /// A line of one pixel around the character, as #rrggbb; black unless a colour is given.
    #[arg(long, value_name = "COLOR", num_args = 0..=1, default_missing_value = "#000000", requires = "pixel_art", value_parser = parse_color)]
    pixel_outline: Option<[u8; 3]>,
}

/// Paints frames on any thread; what a thread has looked up serves the next one.
pub struct Painter {
    art: PixelArt,
    mappers: Mutex<Vec<Mapper>>,
}

impl Painter {
    pub fn palette(&self) -> &Palette {
        self.art.palette()
    }

    pub fn is_outlined(&self) -> bool {
        self.art.is_outlined()
    }

    /// A drawn frame as indices into the palette.
    pub fn map(&self, drawn: &Rgba8) -> Indexed {
        let idle = || self.mappers.lock().unwrap_or_else(PoisonError::into_inner);
        let mut mapper = idle().pop().unwrap_or_else(|| self.art.mapper());
        let indexed = self.art.finish(&mut mapper, drawn);
        idle().push(mapper);
        indexed
    }

    /// A drawn frame in the palette's colours.
    pub fn paint(&self, drawn: &Rgba8) -> Rgba8 {
        self.map(drawn).to_rgba8(self.palette())
    }

    /// A painted frame as a PNG with the palette.
    pub fn encode_png(&self, painted: &Rgba8, level: PngLevel) -> Result<Vec<u8>, picture::Error> {
        encode_indexed_png(&Indexed::of_rgba8(painted, self.palette()), self.palette(), level)
    }
}

impl PixelArgs {
    pub fn is_on(&self) -> bool {
        self.pixel_art
    }

    /// Pixels of the result for each one drawn.
    pub fn scale(&self) -> usize {
        usize::from(self.pixel_scale)
    }

    /// Settings that frames are drawn with.
    pub fn settings(&self, settings: Settings) -> Result<Settings, Failure> {
        if !self.pixel_art {
            return Ok(settings);
        }
        let (k, Settings { width, height, .. }) = (self.scale(), settings);
        if width % k != 0 || height % k != 0 {
            let message = format!(
                "--pixel-scale {k}: the size {width}x{height} is no multiple of it; expected for example {}x{}",
                width.next_multiple_of(k),
                height.next_multiple_of(k)
            );
            return Err(Failure::Usage(message));
        }
        Ok(Settings { width: width / k, height: height / k, samples: 1, ..settings })
    }

    /// What frames become, if pixel art is asked for: `background` is linear and premultiplied, and nothing if transparent.
    pub fn art(&self, job: &Job, background: [f32; 4], say: &Say) -> Result<Option<Painter>, Failure> {
        if !self.pixel_art {
            return Ok(None);
        }
        let [r, g, b, alpha] = encode_srgb8(background);
        let desc = PixelArtDesc {
            colors: usize::from(self.colors),
            dither: self.palette_dither,
            outline: self.pixel_outline,
            background: (alpha == 255).then_some([r, g, b]),
            scale: self.scale(),
        };
        let palette = self.palette.as_deref().map(read).transpose()?;
        let mut samples = Vec::new();
        if palette.is_none() {
            let n = job.whole.len();
            let few = n.min(PALETTE_FRAMES);
            let spread: Vec<Frame> = (0..few).map(|k| job.whole[k * n / few]).collect();
            let one = |w: &mut Worker, f: &Frame| {
                let mut out = Rgba8::default();
                job.shot.draw(f.moment, w, &mut out);
                out
            };
            draw::frames(job, &spread, say, one, |_, picture| {
                samples.push(picture);
                Ok(())
            })?;
        }
        Ok(Some(Painter { art: PixelArt::new(desc, &samples, palette), mappers: Mutex::default() }))
    }
}

fn read(path: &Path) -> Result<Palette, Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", path.display()));
    let bytes = io::read_file(path).map_err(|e| bad(&e))?;
    Palette::from_file_bytes(&bytes).map_err(|e| bad(&e))
}

fn parse_dither(text: &str) -> Result<Dither, String> {
    let found = Dither::ALL.into_iter().find(|d| d.name() == text);
    found.ok_or_else(|| "expected none, ordered or floyd-steinberg".into())
}

fn parse_color(text: &str) -> Result<[u8; 3], String> {
    let [r, g, b, alpha] = encode_srgb8(look::parse_color(text).ok_or("expected #rrggbb")?);
    if alpha == 255 { Ok([r, g, b]) } else { Err("expected #rrggbb".into()) }
}
