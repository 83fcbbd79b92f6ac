//! Options of light and background.

use crate::cli::Failure;
use sinew::asset::Asset;
use sinew::frames::{Look, Shading};
use sinew::image::color::linear_from_srgb;
use sinew::scene::Lighting;

#[derive(clap::Args)]
#[command(next_help_heading = "Look")]
pub struct LookArgs {
    /// Colour behind the character: transparent or #rrggbb.
    #[arg(long, default_value = "#e8eaed", value_name = "COLOR", value_parser = parse_background)]
    background: [f32; 4],
    /// studio (key, fill and rim lights that go round with the camera), sun (one sun, fixed in the world), flat (no lamps: colours
    /// as they are), or asset (the file's lamps). Left out: the file's lamps, or a key and a fill light if it has none.
    #[arg(long, value_name = "LIGHT", value_parser = ["studio", "sun", "flat", "asset"])]
    light: Option<String>,
    /// smooth, flat (facets), or toon[=STEPS]: so many tones, 2 to 16.
    #[arg(long, default_value = "smooth", value_name = "MODE", value_parser = parse_shading)]
    shading: Shading,
}

impl LookArgs {
    pub fn look(&self, asset: &Asset) -> Result<Look, Failure> {
        Ok(Look {
            background: self.background,
            lighting: self.lighting(asset)?,
            shading: self.shading,
            ..Look::default()
        })
    }

    fn lighting(&self, asset: &Asset) -> Result<Option<Lighting>, Failure> {
        match self.light.as_deref() {
            Some("studio") => Ok(Some(Lighting::studio())),
            Some("sun") => Ok(Some(Lighting::sun())),
            Some("flat") => Ok(Some(Lighting::flat())),
            Some("asset") if asset.lights.is_empty() => {
                let message = "--light asset: the file has no lamps; studio, sun and flat bring their own";
                Err(Failure::Usage(message.into()))
            }
            _ => Ok(None),
        }
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

fn parse_shading(text: &str) -> Result<Shading, String> {
    let steps = |n: &str| n.parse().ok().filter(|n| (2..=16).contains(n)).map(Shading::Toon);
    match text {
        "smooth" => Some(Shading::Smooth),
        "flat" => Some(Shading::Facets),
        "toon" => Some(Shading::Toon(3)),
        _ => text.strip_prefix("toon=").and_then(steps),
    }
    .ok_or_else(|| "expected smooth, flat, toon or toon=2 to toon=16".into())
}
