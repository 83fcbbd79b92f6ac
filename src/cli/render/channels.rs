//! Channels beside a picture: files of their own beside PNG and WebP, layers within OpenEXR.

use crate::cli::Failure;
use glam::{DVec3, Vec2, Vec3};
use sinew::frames::{Extent, Shot, Worker};
use sinew::io::picture::{Data, Error, Format, PngLevel, Target, encode_data_png};
use sinew::render::channel::{Channel, Channels};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(next_help_heading = "Channels")]
pub struct ChannelArgs {
    /// What pixels show beside their colour, several between commas: id (objects), bone (that moves the surface most), depth, normal (view space),
    /// position (world), uv. A picture fox.png gets fox.normal.png and so on beside it; OpenEXR holds them as layers of the one file, in 32 bits
    /// (id.X, bone.X, depth.Z, normal.X, position.X, uv.U …). PNGs: id and bone have a palette, index 0 for nothing (beyond 255, 16-bit grey); depth
    /// is 16-bit grey, near white, black for nothing; normals are (n + 1)/2; position and uv have 16 bits, positions from 0 to 1 along the box around
    /// the whole clip. A text chunk in the file tells names and ranges.
    #[arg(long, value_name = "LIST", value_delimiter = ',', alias = "channel", value_parser = parse)]
    channels: Vec<Name>,
}

/// A channel by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Name(Channel);

const NAMES: [(&str, Channel); 6] = [
    ("id", Channel::Object),
    ("bone", Channel::Label),
    ("depth", Channel::Depth),
    ("normal", Channel::Normal),
    ("position", Channel::Position),
    ("uv", Channel::Uv),
];

impl Name {
    /// As in options, file names and layers.
    pub fn text(self) -> &'static str {
        NAMES.iter().find(|n| n.1 == self.0).map_or("", |n| n.0)
    }

    /// The file beside a picture.
    pub fn file(self, picture: &Path) -> PathBuf {
        picture.with_extension(format!("{}.png", self.text()))
    }
}

fn parse(text: &str) -> Result<Name, String> {
    let found = NAMES.iter().find(|n| n.0 == text.trim());
    found.map(|n| Name(n.1)).ok_or_else(|| {
        let names = NAMES.map(|n| n.0).join(", ");
        format!("expected one of {names}, or several of them between commas")
    })
}

impl ChannelArgs {
    /// The channels that are asked for, each once.
    pub fn names(&self) -> Vec<Name> {
        let mut names = self.channels.clone();
        names.sort();
        names.dedup();
        names
    }

    /// Files beside that of a frame.
    pub fn files(&self, target: &Target, frame: i64) -> Vec<PathBuf> {
        let path = target.path_of(frame).filter(|_| target.format() != Format::Exr);
        let file = |path: &PathBuf| self.names().into_iter().map(|n| n.file(path)).collect();
        path.as_ref().map(file).unwrap_or_default()
    }

    /// Refuse what has no place for channels.
    pub fn check(&self, target: &Target, alone: bool) -> Result<(), Failure> {
        let fits = matches!(target, Target::Still(..) | Target::Sequence(..)) && alone;
        if self.channels.is_empty() || fits {
            return Ok(());
        }
        let message = format!(
            "-o {}: channels stand beside single pictures; expected a .png, .webp or .exr, with #### in its name for several frames (sheets have \
             --maps)",
            target.name().display()
        );
        Err(Failure::Usage(message))
    }
}

/// What is written beside the pictures of a shot.
#[derive(Default)]
pub struct Beside {
    pub names: Vec<Name>,
    level: PngLevel,
    extent: Extent,
    objects: Vec<String>,
    bones: Vec<String>,
}

impl Beside {
    pub fn new(args: &ChannelArgs, shot: &Shot, bones: Vec<String>, level: PngLevel) -> Self {
        let names = args.names();
        let ranged = names.iter().any(|n| [Channel::Depth, Channel::Position].contains(&n.0));
        let extent = if ranged { shot.extent(&mut Worker::default()) } else { Extent::default() };
        Self { names, level, extent, objects: shot.object_names(), bones }
    }

    /// Of one picture whose ranges are its own.
    pub fn of_picture(args: &ChannelArgs, seen: &Channels, objects: Vec<String>, level: PngLevel) -> Self {
        let mut extent =
            Extent { bounds: [DVec3::INFINITY, DVec3::NEG_INFINITY], depth: [f32::INFINITY, 0.0] };
        for i in (0..seen.objects.len()).filter(|&i| seen.objects[i] > 0) {
            let ([low, high], [near, far]) = (&mut extent.bounds, &mut extent.depth);
            let p = seen.positions[i].as_dvec3();
            (*low, *high) = (low.min(p), high.max(p));
            (*near, *far) = (near.min(seen.depth[i]), far.max(seen.depth[i]));
        }
        Self { names: args.names(), level, extent, objects, bones: Vec::new() }
    }

    pub fn wanted(&self) -> Vec<Channel> {
        self.names.iter().map(|n| n.0).collect()
    }

    /// Layers of an OpenEXR file: zero, and for depth infinity, where nothing is.
    pub fn layers(&self, seen: &Channels) -> Vec<(String, Vec<f32>)> {
        let mut layers = Vec::new();
        for name in &self.names {
            let mut put = |part: &str, list: Vec<f32>| layers.push((format!("{}.{part}", name.text()), list));
            let number = |list: &[u32]| list.iter().map(|v| *v as f32).collect();
            match name.0 {
                Channel::Object => put("X", number(&seen.objects)),
                Channel::Label => put("X", number(&seen.labels)),
                Channel::Depth => put("Z", seen.depth.clone()),
                Channel::Uv => {
                    put("U", seen.uvs.iter().map(|c| c.x).collect());
                    put("V", seen.uvs.iter().map(|c| c.y).collect());
                }
                other => {
                    let list = if other == Channel::Normal { &seen.normals } else { &seen.positions };
                    for (c, part) in ["X", "Y", "Z"].into_iter().enumerate() {
                        put(part, list.iter().map(|v| v[c]).collect());
                    }
                }
            }
        }
        layers
    }

    /// Files beside a picture.
    pub fn files(&self, picture: &Path) -> Vec<PathBuf> {
        let apart = self.apart(picture.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")));
        apart.iter().map(|n| n.file(picture)).collect()
    }

    /// Channels with files of their own.
    fn apart(&self, exr: bool) -> &[Name] {
        if exr { &[] } else { &self.names }
    }

    /// Their bytes.
    pub fn encode_all(&self, format: Format, seen: &Channels) -> Result<Vec<(Name, Vec<u8>)>, Error> {
        let apart = self.apart(format == Format::Exr);
        apart.iter().map(|n| Ok((*n, self.encode(*n, seen)?))).collect()
    }

    /// A PNG file of a channel.
    fn encode(&self, name: Name, seen: &Channels) -> Result<Vec<u8>, Error> {
        let size = [seen.width, seen.height];
        let there = |i: usize| seen.objects[i] > 0;
        let each = 0..seen.objects.len();
        let png = |data: Data, note: &str| encode_data_png(size, data, self.level, note);
        let wide = |pixel: &dyn Fn(usize) -> Vec3, note: &str| {
            let code = |c: f32| (c.clamp(0.0, 1.0) * 65535.0).round() as u16;
            let pixels = each.clone().map(|i| match there(i) {
                true => [code(pixel(i).x), code(pixel(i).y), code(pixel(i).z), 65535],
                false => [0; 4],
            });
            png(Data::Rgba16(&pixels.collect::<Vec<_>>()), note)
        };
        let Extent { bounds: [low, high], depth: [near, far] } = self.extent;
        match name.0 {
            Channel::Object => numbers(size, &seen.objects, &self.objects, self.level),
            Channel::Label => numbers(size, &seen.labels, &self.bones, self.level),
            Channel::Depth => {
                let codes = seen.depth.iter().map(|d| depth_code(*d, [near, far]));
                let note = format!("depth: white is {near} m, 1 is {far} m, 0 is nothing");
                png(Data::Gray16(&codes.collect::<Vec<_>>()), &note)
            }
            Channel::Normal => {
                let pixel = |i: usize| match there(i) {
                    true => {
                        let [x, y, z] = normal_code(seen.normals[i]);
                        [x, y, z, 255]
                    }
                    false => [0; 4],
                };
                let note = "normal: (n + 1)/2 in view space, +x right, +y up, +z towards the viewer";
                png(Data::Rgba8(&each.clone().map(pixel).collect::<Vec<_>>()), note)
            }
            Channel::Uv => {
                // Coordinates repeat; 1 stays 1.
                let within = |x: f32| if (0.0..=1.0).contains(&x) { x } else { x - x.floor() };
                let pixel = |c: Vec2| Vec3::new(within(c.x), within(c.y), 0.0);
                wide(
                    &|i| pixel(seen.uvs[i]),
                    "uv: red is u, green is v from the texture's top, each modulo 1",
                )
            }
            _ => {
                let span = (high - low).max(DVec3::splat(1e-30));
                let pixel = |i: usize| ((seen.positions[i].as_dvec3() - low) / span).as_vec3();
                wide(&pixel, &format!("position: 0 is {low} m, 65535 is {high} m, world space"))
            }
        }
    }
}

/// Numbers from 1 as indices into a palette of distinct colours; beyond 255 of them as grey.
fn numbers(size: [usize; 2], list: &[u32], names: &[String], level: PngLevel) -> Result<Vec<u8>, Error> {
    let line = |(i, name): (usize, &String)| format!("{} {name}\n", i + 1);
    let note: String = names.iter().enumerate().map(line).collect();
    if names.len() > 255 {
        let codes: Vec<u16> = list.iter().map(|v| (*v).min(65535) as u16).collect();
        return encode_data_png(size, Data::Gray16(&codes), level, &note);
    }
    let mut colors = vec![[0; 3]];
    colors.extend((0..names.len()).map(distinct_color));
    let codes: Vec<u8> = list.iter().map(|v| *v as u8).collect();
    encode_data_png(size, Data::Index8(&codes, &colors), level, &note)
}

/// `(n + 1)/2` in 8 bits.
pub fn normal_code(n: Vec3) -> [u8; 3] {
    n.to_array().map(|c| ((c.clamp(-1.0, 1.0) + 1.0) * 127.5).round() as u8)
}

/// From 65535 for near to 1 for far; 0 is left to what shows nothing.
pub fn depth_code(d: f32, [near, far]: [f32; 2]) -> u16 {
    if d.is_finite() { ((far - d) / (far - near) * 65535.0).round().max(1.0) as u16 } else { 0 }
}

/// The `i`-th of colours that are far from one another: hues at steps of the golden ratio, in two lightnesses.
pub fn distinct_color(i: usize) -> [u8; 3] {
    let hue = (i as u32).wrapping_mul(0x9e37) % 0x10000 * 6;
    let (sector, f) = (hue >> 16, hue & 0xffff);
    let high = if i.is_multiple_of(2) { 235 } else { 170 };
    let low = high / 4;
    let up = low + (((high - low) * f) >> 16);
    let down = high - (((high - low) * f) >> 16);
    let [r, g, b] = match sector {
        0 => [high, up, low],
        1 => [down, high, low],
        2 => [low, high, up],
        3 => [low, down, high],
        4 => [up, low, high],
        _ => [high, low, down],
    };
    [r as u8, g as u8, b as u8]
}
