//! Options of light and background.

use crate::cli::Failure;
use sinew::asset::Asset;
use sinew::frames::Look;
use sinew::image::color::linear_from_srgb;

#[derive(clap::Args)]
#[command(next_help_heading = "Look")]
pub struct LookArgs {
    /// Colour behind the character: transparent or #rrggbb.
    #[arg(long, default_value = "#e8eaed", value_name = "COLOR", value_parser = parse_background)]
    background: [f32; 4],
}

impl LookArgs {
    pub fn look(&self, _asset: &Asset) -> Result<Look, Failure> {
        Ok(Look { background: self.background })
    }

    /// Whether pictures need an alpha channel.
    pub fn transparent(&self) -> bool {
        self.background[3] < 1.0
    }
}

/// `transparent` or `#rrggbb` as linear, premultiplied RGBA.
pub fn parse_background(text: &str) -> Result<[f32; 4], String> {
    if text == "transparent" {
        return Ok([0.0; 4]);
    }
    let hex = text.strip_prefix('#').filter(|h| h.len() == 6);
    let code = hex.and_then(|h| u32::from_str_radix(h, 16).ok());
    let code = code.ok_or("expected transparent or #rrggbb")?;
    let channel = |shift: u32| linear_from_srgb((code >> shift & 255) as f32 / 255.0);
    Ok([channel(16), channel(8), channel(0), 1.0])
}
