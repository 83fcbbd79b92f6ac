//! Options of light, surfaces, ground and grade.

use crate::cli::Failure;
use glam::Vec3;
use sinew::asset::Asset;
use sinew::frames::{GroundLook, Look, Shading, Shadows};
use sinew::image::color::linear_from_srgb;
use sinew::image::develop::Grade;
use sinew::image::dither::Dither;
use sinew::image::gamma::Transfer;
use sinew::image::tone::ToneMap;
use sinew::io;
use sinew::io::look_json::{self, LookFile};
use sinew::render::outline::Outline;
use sinew::scene::Lighting;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(next_help_heading = "Look")]
pub struct LookArgs {
    /// Behind the character: transparent, #rrggbb, or from top to bottom #rrggbb,#rrggbb; #e8eaed if not said.
    #[arg(long, value_name = "COLOR[,COLOR]", value_parser = parse_background)]
    background: Option<Background>,
    /// studio (key, fill and rim lights that go round with the camera), sun (one sun, fixed in the world), flat (no lamps: colours
    /// as they are), asset (the file's lamps), or a look file (.json) whose lamps are taken. Left out: the look's or the file's lamps, or a
    /// key and a fill light if there are none.
    #[arg(long, value_name = "studio|sun|flat|asset|FILE")]
    light: Option<String>,
    /// Lamps, background and changes of materials from a look file, which rigs/looks/README.md describes; other options go before it.
    #[arg(long, value_name = "FILE.json")]
    look: Option<PathBuf>,
    /// smooth, flat (facets), or toon[=STEPS]: so many tones, 2 to 16.
    #[arg(long, default_value = "smooth", value_name = "MODE", value_parser = parse_shading)]
    shading: Shading,
    /// Lines along contours: their width, 0.5 to 16 pixels, and colour.
    #[arg(long, num_args = 0..=1, default_missing_value = "1.5", value_name = "PX[,#rrggbb]", value_parser = parse_outline)]
    outline: Option<Outline>,
    /// A plane below the lowest point of the clip: seen by its shadows alone, or of a colour that fades with distance.
    #[arg(long, num_args = 0..=1, default_missing_value = "shadow", value_name = "shadow|#rrggbb", value_parser = parse_ground)]
    ground: Option<GroundLook>,
    /// none, contact (soft, below what is near the ground), or map (thrown by the key light, on the character too); contact where there is a
    /// ground. Contact brings a ground along. Rays throw all lamps' shadows, on shapes and character, unless it is none.
    #[arg(long, value_name = "MODE", value_parser = parse_shadow)]
    shadow: Option<Shadows>,
    /// Stops by which light is made brighter, or darker below 0; -16 to 16.
    #[arg(long, default_value = "0", value_name = "STOPS", allow_hyphen_values = true, value_parser = parse_exposure)]
    exposure: f32,
    /// What becomes of light that is too bright: clip, reinhard (keeps hues) or aces (like film).
    #[arg(long, default_value = "clip", value_name = "MODE", value_parser = parse_tone)]
    tone: ToneMap,
    /// How light is encoded: srgb, or a power as in 2.2.
    #[arg(long, default_value = "srgb", value_name = "GAMMA", value_parser = parse_gamma)]
    gamma: Transfer,
    /// How light between two of 256 codes is shown: none, ordered, noise or floyd-steinberg.
    #[arg(long, default_value = "none", value_name = "MODE", value_parser = parse_dither)]
    dither: Dither,
}

/// Linear, premultiplied colours of the top and the bottom.
#[derive(Clone, Copy, Debug)]
struct Background {
    top: [f32; 4],
    bottom: Option<[f32; 4]>,
}

impl LookArgs {
    /// Whether a background was asked for.
    pub fn has_background(&self) -> bool {
        self.background.is_some()
    }

    /// Whether anything is asked for but a grade.
    pub fn is_some(&self) -> bool {
        let files = self.look.is_some() || self.light.is_some() || self.background.is_some();
        files || self.ground.is_some() || self.outline.is_some() || self.shading != Shading::Smooth
    }

    /// Whether shadows were not refused.
    pub fn has_shadows(&self) -> bool {
        self.shadow != Some(Shadows::None)
    }

    /// How light becomes 8 bits.
    pub fn grade(&self) -> Grade {
        Grade { exposure_stops: self.exposure, tone: self.tone, transfer: self.gamma, dither: self.dither }
    }

    /// What the options or else the scene say, for an asset; `warn` is told what has no effect on it.
    pub fn look(
        &self,
        asset: &Asset,
        scene: Option<&LookFile>,
        warn: impl Fn(&str),
    ) -> Result<Look, Failure> {
        let file = self.look.as_ref().map(|p| read(p)).transpose()?.or(scene.cloned()).unwrap_or_default();
        for patch in &file.materials {
            if !asset.materials.iter().any(|m| patch.matches(&m.name)) {
                let names: Vec<&str> = asset.materials.iter().map(|m| m.name.as_str()).collect();
                warn(&format!(
                    "--look: no material is called `{}`; there are: {}",
                    patch.name,
                    names.join(", ")
                ));
            }
        }
        let background = self.background_of(&file);
        let implied = (self.shadow == Some(Shadows::Contact)).then(GroundLook::default);
        let ground = self.ground.or(implied);
        let usual = if ground.is_some() { Shadows::Contact } else { Shadows::None };
        Ok(Look {
            background: background.top,
            background_bottom: background.bottom,
            lighting: self.lighting(asset, file.lighting)?,
            shading: self.shading,
            outline: self.outline,
            ground,
            shadows: self.shadow.unwrap_or(usual),
            materials: file.materials,
            grade: self.grade(),
        })
    }

    fn lighting(&self, asset: &Asset, of_look: Option<Lighting>) -> Result<Option<Lighting>, Failure> {
        match self.light.as_deref() {
            None => Ok(of_look),
            Some("studio") => Ok(Some(Lighting::studio())),
            Some("sun") => Ok(Some(Lighting::sun())),
            Some("flat") => Ok(Some(Lighting::flat())),
            Some("asset") if asset.lights.is_empty() => {
                let message = "--light asset: the file has no lamps; studio, sun and flat bring their own";
                Err(Failure::Usage(message.into()))
            }
            Some("asset") => Ok(None),
            Some(name) => self.lamps_of(name),
        }
    }

    /// The lamps of a look file.
    fn lamps_of(&self, name: &str) -> Result<Option<Lighting>, Failure> {
        let path = Path::new(name);
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
            let message = format!("--light {name}: expected studio, sun, flat, asset or a look file (.json)");
            return Err(Failure::Usage(message));
        }
        let none =
            || Failure::Input(format!("{name}: the look has neither `light` nor `ambient` nor `lamps`"));
        read(path)?.lighting.ok_or_else(none).map(Some)
    }

    fn background_of(&self, file: &LookFile) -> Background {
        let of_file = file.background.map(|[top, b]| Background { top, bottom: (b != top).then_some(b) });
        self.background.or(of_file).unwrap_or(Background { top: Look::paper(), bottom: None })
    }
}

/// Whether pictures of a look need an alpha channel.
pub fn transparent(look: &Look) -> bool {
    look.background[3] < 1.0 || look.background_bottom.is_some_and(|c| c[3] < 1.0)
}

fn read(path: &Path) -> Result<LookFile, Failure> {
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", path.display()));
    let bytes = io::read_file(path).map_err(|e| bad(&e))?;
    look_json::from_bytes(&bytes).map_err(|e| bad(&e))
}

/// Linear RGBA of a code `0xrrggbb`.
fn opaque(code: u32) -> [f32; 4] {
    let channel = |shift: u32| linear_from_srgb((code >> shift & 255) as f32 / 255.0);
    [channel(16), channel(8), channel(0), 1.0]
}

/// `#rrggbb` as linear RGBA.
pub fn parse_color(text: &str) -> Option<[f32; 4]> {
    let hex =
        text.trim().strip_prefix('#').filter(|h| h.len() == 6 && h.bytes().all(|b| b.is_ascii_hexdigit()));
    hex.and_then(|h| u32::from_str_radix(h, 16).ok()).map(opaque)
}

fn parse_background(text: &str) -> Result<Background, String> {
    let color = |t: &str| if t.trim() == "transparent" { Some([0.0; 4]) } else { parse_color(t) };
    let found = match text.split_once(',') {
        Some((top, bottom)) => {
            color(top).zip(color(bottom)).map(|(top, b)| Background { top, bottom: Some(b) })
        }
        None => color(text).map(|top| Background { top, bottom: None }),
    };
    found.ok_or_else(|| "expected transparent, #rrggbb, or two of them with a comma, top and bottom".into())
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

fn parse_outline(text: &str) -> Result<Outline, String> {
    let (width, color) = text.split_once(',').map_or((text, None), |(w, c)| (w, Some(c)));
    let width = width.trim().parse::<f32>().ok().filter(|w| (0.5..=16.0).contains(w));
    let color = color.map_or(Some(opaque(0x1c1a22)), parse_color);
    let found = width.zip(color).map(|(width, color)| Outline { width, color });
    found.ok_or_else(|| "expected pixels from 0.5 to 16, and a colour if wanted, as in 2,#203040".into())
}

fn parse_ground(text: &str) -> Result<GroundLook, String> {
    if text == "shadow" {
        return Ok(GroundLook::default());
    }
    let color = parse_color(text).ok_or("expected shadow or #rrggbb")?;
    Ok(GroundLook { color: Some(Vec3::new(color[0], color[1], color[2])) })
}

fn parse_shadow(text: &str) -> Result<Shadows, String> {
    match text {
        "none" => Ok(Shadows::None),
        "contact" => Ok(Shadows::Contact),
        "map" => Ok(Shadows::Map),
        _ => Err("expected none, contact or map".into()),
    }
}

fn parse_exposure(text: &str) -> Result<f32, String> {
    let stops = text.parse::<f32>().ok().filter(|s| s.abs() <= 16.0);
    stops.ok_or_else(|| "expected stops from -16 to 16".into())
}

fn parse_tone(text: &str) -> Result<ToneMap, String> {
    let names = ToneMap::ALL.map(ToneMap::name).join(", ");
    ToneMap::from_name(text).ok_or_else(|| format!("expected one of {names}"))
}

fn parse_gamma(text: &str) -> Result<Transfer, String> {
    Transfer::from_name(text).ok_or_else(|| "expected srgb, or a power from 0.1 to 10 as in 2.2".into())
}

fn parse_dither(text: &str) -> Result<Dither, String> {
    let names = Dither::ALL.map(Dither::name).join(", ");
    Dither::from_name(text).ok_or_else(|| format!("expected one of {names}"))
}
