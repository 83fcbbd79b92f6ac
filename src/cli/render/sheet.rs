//! Options of sheets: many frames in one picture.

mod contact;
mod draw;
mod maps;
mod pixels;
mod sprites;

pub use pixels::{Painter, PixelArgs};

use super::film::Job;
use super::time::Frame;
use crate::cli::{Failure, say::Say};
use sinew::asset::Asset;
use sinew::frames::{Shot, ShotDesc, View};
use sinew::io::picture::{Format, Target};
use sinew::io::sheet_json::Style;
use sinew::render::Settings;
use sinew::sheet::{Kind, SheetDesc};
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(next_help_heading = "Sheets")]
pub struct SheetArgs {
    /// All frames in one picture on a transparent ground, with a JSON file beside it: in a grid (a direction a row), or trimmed to what is
    /// visible and packed, equal frames once.
    #[arg(long, value_name = "grid|trimmed", value_parser = parse_kind)]
    sheet: Option<Kind>,
    /// Draw the character from N sides at equal steps, 1 to 64: first as --camera stands (yaw=0 unless it is given), then on counter-clockwise
    /// as seen from above. Frames are named clip/direction/number. South is towards the viewer, so eight sides are s, sw, w, nw, n, ne, e, se.
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u8).range(1..=64))]
    directions: u8,
    /// Columns of a grid; by default the frames of a direction, or about a square if there is one direction.
    #[arg(long, value_name = "N", requires = "sheet", value_parser = clap::value_parser!(u16).range(1..))]
    columns: Option<u16>,
    /// Clear pixels between frames and along the edges; 1 where frames are trimmed, 0 in a grid.
    #[arg(long, value_name = "PX", requires = "sheet", value_parser = clap::value_parser!(u16).range(..=256))]
    padding: Option<u16>,
    /// Repeat each frame's edge pixels so many times beyond it, against seams under filtering.
    #[arg(long, value_name = "PX", requires = "sheet", default_value = "0", value_parser = clap::value_parser!(u16).range(..=256))]
    extrude: u16,
    /// Make both sides of a trimmed sheet powers of two.
    #[arg(long, requires = "sheet")]
    power_of_two: bool,
    /// Convention of the JSON file: texturepacker (an object of frames; Phaser, PixiJS), texturepacker-array (a list), aseprite (durations and tags) or
    /// none.
    #[arg(long, value_name = "STYLE", default_value = "texturepacker", value_parser = parse_style)]
    sheet_json: JsonStyle,
    /// What a game puts where the character stands, as fractions of the frame from its top left; auto is the point of the ground that the
    /// character turns around.
    #[arg(long, value_name = "X,Y|auto", default_value = "auto", value_parser = parse_pivot)]
    pivot: Pivot,
    /// Pictures of the sheet's layout for lighting: normal (view space, +x right, +y up, +z to the viewer), depth (16 bits, near is white) and id
    /// (palette index = object). They are named sheet.normal.png and so on.
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "sheet", value_parser = parse_map)]
    maps: Vec<MapName>,
    /// So many columns and rows of moments, spread evenly over the clip, in one picture; the last is the clip's end unless the clip loops.
    #[arg(long, value_name = "CxR", conflicts_with_all = ["sheet", "at", "frames"], value_parser = contact::parse)]
    contact: Option<[usize; 2]>,
    #[command(flatten)]
    pub pixels: PixelArgs,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Pivot {
    Auto,
    At([f64; 2]),
}

/// A map that is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum MapName {
    Normal,
    Depth,
    Id,
}

/// A style, or no file.
#[derive(Clone, Copy, Debug)]
struct JsonStyle(Option<Style>);

impl SheetArgs {
    /// Whether all frames go into one picture.
    pub fn is_one_picture(&self) -> bool {
        self.sheet.is_some() || self.contact.is_some()
    }

    /// Of how many pictures of the shot the output consists, if a film would have `frames`.
    pub fn pictures(&self, frames: usize) -> usize {
        match (self.sheet, self.contact) {
            (_, Some([columns, rows])) => columns * rows,
            (Some(_), None) => frames * usize::from(self.directions),
            (None, None) => frames,
        }
    }

    /// The camera; directions start in front of the character unless somebody `placed` it elsewhere.
    pub fn view(&self, view: View, nobody_placed: bool) -> View {
        match view {
            View::Orbit { pitch, fov_y, .. } if nobody_placed && self.directions > 1 => {
                View::Orbit { yaw: 0.0, pitch, fov_y }
            }
            view => view,
        }
    }

    /// A shot as it is drawn for a sheet or for pixel art: before nothing, whatever stands behind it later, and with a framing
    /// that holds all directions.
    pub fn desc(&self, mut desc: ShotDesc, asset: &Asset) -> ShotDesc {
        if self.sheet.is_some() || self.pixels.is_on() {
            (desc.look.background, desc.look.background_bottom) = ([0.0; 4], None);
        }
        desc.from_sides(asset, self.directions.into())
    }

    /// Whether the result is transparent whatever the background is.
    pub fn is_transparent(&self) -> bool {
        self.sheet.is_some()
    }

    /// Settings that frames are drawn with.
    pub fn settings(&self, settings: Settings) -> Result<Settings, Failure> {
        if self.directions > 1 && self.sheet.is_none() {
            let message =
                "--directions is for sprite sheets: expected --sheet grid or --sheet trimmed with it";
            return Err(Failure::Usage(message.into()));
        }
        if self.power_of_two && self.sheet == Some(Kind::Grid) {
            let message = "--power-of-two is for trimmed sheets: expected --sheet trimmed with it";
            return Err(Failure::Usage(message.into()));
        }
        self.pixels.settings(settings)
    }

    /// The moments of a contact sheet, if that is what is asked for.
    pub fn contact_frames(&self, shot: &Shot) -> Option<Vec<Frame>> {
        self.contact.map(|cells| contact::frames(cells, shot))
    }

    /// Files that are written beside the picture.
    pub fn companions(&self, target: &Target) -> Vec<PathBuf> {
        let Some(picture) = target.path_of(1) else { return Vec::new() };
        let json = self.sheet.and(self.sheet_json.0).map(|_| picture.with_extension("json"));
        let map = |m: &MapName| picture.with_extension(format!("{}.png", m.name()));
        json.into_iter().chain(self.maps().iter().map(map)).collect()
    }

    /// Draw and write the sheet.
    pub fn write(&self, job: &Job, clip: &str, say: &Say) -> Result<(), Failure> {
        let Target::Still(path, Format::Png | Format::Webp) = job.target else {
            let message = format!(
                "-o {}: a sheet is one picture; expected a name such as sheet.png or sheet.webp",
                job.target.name().display()
            );
            return Err(Failure::Usage(message));
        };
        if !job.force
            && let Some(there) = self.companions(job.target).iter().chain([path]).find(|p| p.exists())
        {
            let message = format!("{}: the file exists; --force overwrites it", there.display());
            return Err(Failure::Run(message));
        }
        match (self.sheet, self.contact) {
            (Some(kind), _) => sprites::write(self, self.sheet_desc(kind), job, clip, path, say),
            (None, Some(cells)) => contact::write(cells, job, path, say),
            (None, None) => Ok(()),
        }
    }

    fn sheet_desc(&self, kind: Kind) -> SheetDesc {
        SheetDesc {
            kind,
            columns: self.columns.map(usize::from),
            padding: self.padding.map(usize::from),
            extrude: self.extrude.into(),
            power_of_two: self.power_of_two,
        }
    }

    /// The maps, each once, in a fixed order.
    fn maps(&self) -> Vec<MapName> {
        let mut maps = self.maps.clone();
        maps.sort();
        maps.dedup();
        maps
    }
}

impl MapName {
    fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Id => "id",
        }
    }
}

fn parse_kind(text: &str) -> Result<Kind, String> {
    match text {
        "grid" => Ok(Kind::Grid),
        "trimmed" => Ok(Kind::Trimmed),
        _ => Err("expected grid or trimmed".into()),
    }
}

fn parse_style(text: &str) -> Result<JsonStyle, String> {
    match text {
        "texturepacker" => Ok(JsonStyle(Some(Style::TexturePacker))),
        "texturepacker-array" => Ok(JsonStyle(Some(Style::TexturePackerArray))),
        "aseprite" => Ok(JsonStyle(Some(Style::Aseprite))),
        "none" => Ok(JsonStyle(None)),
        _ => Err("expected texturepacker, texturepacker-array, aseprite or none".into()),
    }
}

fn parse_pivot(text: &str) -> Result<Pivot, String> {
    if text == "auto" {
        return Ok(Pivot::Auto);
    }
    let number = |s: &str| s.trim().parse::<f64>().ok().filter(|x| x.abs() <= 100.0);
    let pair = text.split_once(',').and_then(|(x, y)| Some([number(x)?, number(y)?]));
    pair.map(Pivot::At).ok_or_else(|| "expected auto, or fractions of the frame such as 0.5,1".into())
}

fn parse_map(text: &str) -> Result<MapName, String> {
    match text {
        "normal" => Ok(MapName::Normal),
        "depth" => Ok(MapName::Depth),
        "id" => Ok(MapName::Id),
        _ => Err("expected normal, depth or id, or several of them between commas".into()),
    }
}
