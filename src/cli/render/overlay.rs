//! Options of what is drawn with the character.

use super::bone::find_bone;
use crate::cli::Failure;
use sinew::asset::Asset;
use sinew::frames::{BonesDesc, Onion, Overlays, PathDesc};
use sinew::image::color::linear_from_srgb;
use sinew::skeleton::BoneId;
use sinew::time::Rate;

#[derive(clap::Args)]
#[command(next_help_heading = "Overlays")]
pub struct OverlayArgs {
    /// Ghosts of so many moments before and after, STEP frames apart (2 by default), as in 3 or 4,3; or BEFORE+AFTER, as in 4+0,3.
    #[arg(long, value_name = "N[,STEP]", value_parser = parse_onion)]
    onion: Option<[u32; 3]>,
    /// Colours of the past and of the future, for ghosts and paths.
    #[arg(long, value_name = "PAST,FUTURE", default_value = "#317ded,#ff7819", value_parser = parse_colors)]
    onion_colors: [[f32; 3]; 2],
    /// How far ghosts take their colour, 0 to 1.
    #[arg(long, value_name = "SHARE", default_value = "0.75", value_parser = parse_share)]
    onion_tint: f32,
    /// Draw the way that a bone's tip takes over the whole clip, with a dot for each frame; may be repeated.
    #[arg(long, value_name = "BONE")]
    path: Vec<String>,
    /// Draw paths of the bones' heads, not of their tips.
    #[arg(long, requires = "path")]
    path_heads: bool,
    /// Width of paths, in pixels.
    #[arg(long, value_name = "PIXELS", default_value = "2.5", value_parser = parse_width)]
    path_width: f32,
    /// Draw the bones over the character; those that are named stand out, as in --bones=Head,Spine.
    #[arg(long, value_name = "NAMES", num_args = 0..=1, default_missing_value = "", require_equals = true)]
    bones: Option<String>,
    /// Draw the bones and the character over them, so opaque, as in --xray=0.2: 0.35 if not said, 0 for the bones alone.
    #[arg(long, value_name = "OPACITY", num_args = 0..=1, default_missing_value = "0.35", require_equals = true, value_parser = parse_share)]
    xray: Option<f32>,
}

impl OverlayArgs {
    /// What is drawn with the character, where frames come at `rate`.
    pub fn overlays(&self, asset: &Asset, rate: Rate) -> Result<Overlays, Failure> {
        let skeleton = asset.character.skeleton();
        let frame = 1.0 / rate.fps();
        let path = |name: &String| {
            let bone = find_bone(skeleton, "--path", name)?;
            Ok(PathDesc { bone, head: self.path_heads, step: frame, width_px: self.path_width })
        };
        let names = self.bones.iter().flat_map(|n| n.split(',')).filter(|n| !n.is_empty());
        let selected: Result<Vec<BoneId>, Failure> =
            names.map(|n| find_bone(skeleton, "--bones", n)).collect();
        Ok(Overlays {
            onion: self.onion.map(|[before, after, step]| Onion {
                before,
                after,
                step: f64::from(step) * frame,
                opacity: 0.55,
                tint: self.onion_tint,
            }),
            paths: self.path.iter().map(path).collect::<Result<_, Failure>>()?,
            bones: match self.bones.is_some() || self.xray.is_some() {
                true => Some(BonesDesc { selected: selected? }),
                false => None,
            },
            xray: self.xray,
            colors: self.onion_colors,
        })
    }
}

/// Ghosts before, ghosts after, frames from one to the next.
fn parse_onion(text: &str) -> Result<[u32; 3], String> {
    let (count, step) = text.split_once(',').unwrap_or((text, "2"));
    let (before, after) = count.split_once('+').unwrap_or((count, count));
    let number = |t: &str, most: u32| t.trim().parse::<u32>().ok().filter(|n| *n <= most);
    match (number(before, Onion::MOST), number(after, Onion::MOST), number(step, 100_000)) {
        (Some(before), Some(after), Some(step)) if step > 0 => Ok([before, after, step]),
        _ => Err(format!("expected up to {} ghosts and frames from one to the next, as in 3,2", Onion::MOST)),
    }
}

fn parse_colors(text: &str) -> Result<[[f32; 3]; 2], String> {
    let colors: Option<Vec<[f32; 3]>> = text.split(',').map(|c| parse_color(c.trim())).collect();
    match colors.as_deref() {
        Some(&[past, future]) => Ok([past, future]),
        _ => Err("expected two colours, as in #317ded,#ff7819".into()),
    }
}

/// `#rrggbb` in linear light.
fn parse_color(text: &str) -> Option<[f32; 3]> {
    let hex = text.strip_prefix('#').filter(|h| h.len() == 6 && h.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let code = u32::from_str_radix(hex, 16).ok()?;
    Some([16, 8, 0].map(|shift| linear_from_srgb((code >> shift & 255) as f32 / 255.0)))
}

fn parse_share(text: &str) -> Result<f32, String> {
    let number = text.parse::<f32>().ok().filter(|v| (0.0..=1.0).contains(v));
    number.ok_or_else(|| "expected a share from 0 to 1".into())
}

fn parse_width(text: &str) -> Result<f32, String> {
    let number = text.parse::<f32>().ok().filter(|v| *v > 0.0 && *v <= 100.0);
    number.ok_or_else(|| "expected pixels, above 0 and up to 100".into())
}
