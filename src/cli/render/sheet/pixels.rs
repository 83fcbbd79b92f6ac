//! Options of pixel art.

use super::super::film::Job;
use super::super::look::parse_background;
use super::super::time::Frame;
use super::draw;
use crate::cli::{Failure, say::Say};
use sinew::frames::Worker;
use sinew::image::{Rgba8, color::encode_srgb8};
use sinew::io::{
    self,
    picture::{Dither, Palette, PixelArt, PixelArtDesc},
};
use sinew::render::Settings;
use std::path::PathBuf;

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
    outline: Option<[u8; 3]>,
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
    pub fn art(&self, job: &Job, background: [f32; 4], say: &Say) -> Result<Option<PixelArt>, Failure> {
        if !self.pixel_art {
            return Ok(None);
        }
        let [r, g, b, alpha] = encode_srgb8(background);
        let desc = PixelArtDesc {
            colors: usize::from(self.colors),
            dither: self.palette_dither,
            outline: self.outline,
            background: (alpha == 255).then_some([r, g, b]),
            scale: self.scale(),
        };
        let palette = self.palette.as_ref().map(read).transpose()?;
        let mut samples = Vec::new();
        if palette.is_none() {
            let n = job.frames.len();
            let few = n.min(PALETTE_FRAMES);
            let spread: Vec<Frame> = (0..few).map(|k| job.frames[k * n / few]).collect();
            let one = |_: &mut (), w: &mut Worker, f: &Frame| {
                let mut out = Rgba8::default();
                job.shot.draw(f.moment, w, &mut out);
                out
            };
            draw::frames(
                job,
                &spread,
                say,
                || (),
                one,
                |_, picture| {
                    samples.push(picture);
                    Ok(())
                },
            )?;
        }
        Ok(Some(PixelArt::new(desc, &samples, palette)))
    }
}

fn read(path: &PathBuf) -> Result<Palette, Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", path.display()));
    let bytes = io::read_file(path).map_err(|e| bad(&e))?;
    Palette::from_file_bytes(&bytes).map_err(|e| bad(&e))
}

fn parse_dither(text: &str) -> Result<Dither, String> {
    let found = Dither::ALL.into_iter().find(|d| d.name() == text);
    found.ok_or_else(|| "expected none, ordered or floyd-steinberg".into())
}

fn parse_color(text: &str) -> Result<[u8; 3], String> {
    let [r, g, b, alpha] = encode_srgb8(parse_background(text)?);
    if alpha == 255 { Ok([r, g, b]) } else { Err("expected #rrggbb".into()) }
}
