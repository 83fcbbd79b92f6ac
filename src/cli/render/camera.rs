//! Options of the camera: where it stands, how it projects, what it holds, and whether it walks around.

use super::bone::find_bone;
use crate::cli::Failure;
use glam::DVec3;
use sinew::asset::Asset;
use sinew::frames::{FramingDesc, Pivot, Turns, View};
use sinew::io::scene::ours::{self, SceneFile};
use sinew::render::Window;

/// Height of the film that `focal` speaks of, millimetres: still photography's 36 × 24.
const FILM: f32 = 24.0;

/// `atan(1/√2)`: all three axes look equally long.
const ISOMETRIC_DEG: f32 = 35.264_39;

#[derive(clap::Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// One of the asset's cameras by name or index, or parts of an orbit joined by commas: front, back, left, right, top,
    /// bottom, three-quarter, isometric (yaw 45, pitch 35.26, parallel), dimetric (2:1 for pixels: yaw 45, pitch 30, parallel);
    /// yaw=, pitch=, roll= in degrees; fov=DEG (0 is parallel), focal=MM (on film 24 mm high), ortho.
    #[arg(
        long,
        default_value = "yaw=30,pitch=12,fov=30",
        value_name = "ORBIT|NAME|INDEX",
        allow_hyphen_values = true
    )]
    camera: String,
    /// Stand here, in world metres; --camera then gives fov, focal, ortho or roll alone.
    #[arg(long, value_name = "X,Y,Z", requires = "look_at", allow_hyphen_values = true, value_parser = parse_point)]
    pub eye: Option<DVec3>,
    /// Look here, in world metres.
    #[arg(long, value_name = "X,Y,Z", requires = "eye", allow_hyphen_values = true, value_parser = parse_point)]
    look_at: Option<DVec3>,
    /// Which way is up for --look-at.
    #[arg(long, value_name = "X,Y,Z", default_value = "0,1,0", allow_hyphen_values = true, value_parser = parse_point)]
    up: DVec3,
    /// Move with this bone, so that it stays where it is in the picture.
    #[arg(long, value_name = "BONE")]
    follow: Option<String>,
    /// Place the camera once for the whole clip, or anew for each frame.
    #[arg(long, value_name = "WHAT", default_value = "clip", value_parser = ["clip", "frame"])]
    framing: String,
    /// Share of the picture that stays free at each side.
    #[arg(long, value_name = "SHARE", default_value = "0.04", value_parser = parse_margin)]
    margin: f32,
    /// Larger by this factor, about the picture's middle.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = parse_zoom)]
    zoom: f32,
    /// Draw only this part of the picture: the very pixels that the whole of --size has there.
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_crop)]
    crop: Option<Window>,
    /// Walk once around the character in so many seconds, while the clip plays, or holding still with --rest or --at.
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, default_missing_value = "4", value_parser = parse_lap, conflicts_with = "follow")]
    pub turntable: Option<f64>,
}

/// What `--camera` says of an orbit.
#[derive(Default)]
struct Orbit {
    yaw: Option<f32>,
    pitch: Option<f32>,
    roll: Option<f32>,
    fov: Option<f32>,
}

impl CameraArgs {
    /// Which camera films: the scene's, unless options name one.
    pub fn view(&self, asset: &Asset, scene: Option<&SceneFile>) -> Result<View, Failure> {
        if let Some(view) = scene.and_then(|s| s.camera).filter(|_| self.is_default() && self.eye.is_none()) {
            return Ok(match view {
                ours::View::LookAt { eye, target, up, fov_y } => View::LookAt { eye, target, up, fov_y },
                ours::View::Orbit { yaw, pitch, fov_y } => View::Orbit { yaw, pitch, fov_y },
            });
        }
        if let Some(camera) = self.mounted(asset) {
            return match (&self.follow, self.eye) {
                (None, None) => Ok(View::Mounted(camera)),
                (Some(_), _) => Err(self.usage("it moves with its own bone; --follow has nothing to do")),
                (_, Some(_)) => Err(self.usage("it stands where the file says; --eye has nothing to do")),
            };
        }
        let o = self.orbit(asset)?;
        let fov_y = o.fov.unwrap_or(30.0).to_radians();
        if let (Some(eye), Some(target)) = (self.eye, self.look_at) {
            if o.yaw.or(o.pitch).is_some() && !self.is_default() {
                return Err(
                    self.usage("--eye and --look-at say where the camera stands; leave yaw and pitch out")
                );
            }
            return Ok(View::LookAt { eye, target, up: self.up.as_vec3(), fov_y });
        }
        let (yaw, pitch) = (o.yaw.unwrap_or(30.0).to_radians(), o.pitch.unwrap_or(12.0).to_radians());
        Ok(View::Orbit { yaw, pitch, fov_y })
    }

    /// How the camera holds the character.
    pub fn framing(&self, asset: &Asset) -> Result<FramingDesc, Failure> {
        let roll = match self.mounted(asset) {
            Some(_) => 0.0,
            None => self.orbit(asset)?.roll.unwrap_or(0.0).to_radians(),
        };
        let find = |name: &String| find_bone(asset.character.skeleton(), "--follow", name);
        let around = self.turntable.is_some();
        Ok(FramingDesc {
            each_frame: self.framing == "frame",
            margin: self.margin,
            zoom: self.zoom,
            roll,
            follow: self.follow.as_ref().map(find).transpose()?,
            turns: if around { Turns::All } else { Turns::None },
            pivot: if around { Pivot::Middle } else { Pivot::Origin },
        })
    }

    /// The part that is drawn of a picture of these sides.
    pub fn crop(&self, [width, height]: [usize; 2]) -> Result<Option<Window>, Failure> {
        match self.crop {
            Some(c) if c.within(width, height) != c => Err(Failure::Usage(format!(
                "--crop {},{},{},{}: this reaches out of the picture of {width}x{height} pixels",
                c.x, c.y, c.width, c.height
            ))),
            crop => Ok(crop),
        }
    }

    /// Whether nobody said where the camera stands.
    pub fn is_default(&self) -> bool {
        self.camera == "yaw=30,pitch=12,fov=30"
    }

    /// The asset's camera that is named.
    fn mounted(&self, asset: &Asset) -> Option<usize> {
        let named = asset.cameras.iter().position(|c| c.name == self.camera);
        let index = self.camera.parse::<usize>().ok().filter(|&i| i < asset.cameras.len());
        named.or(index)
    }

    fn usage(&self, why: &str) -> Failure {
        Failure::Usage(format!("--camera {}: {why}", self.camera))
    }

    fn orbit(&self, asset: &Asset) -> Result<Orbit, Failure> {
        let mut orbit = Orbit::default();
        for part in self.camera.split(',') {
            if orbit.take(part.trim()).is_none() {
                let names: Vec<&str> = asset.cameras.iter().map(|c| c.name.as_str()).collect();
                return Err(self.usage(&format!(
                    "`{}` is not understood: expected yaw=DEG, pitch=−90…90, roll=DEG, fov=0…160, focal=MM, ortho, front, back, left, \
                     right, top, bottom, three-quarter, isometric, dimetric, or one of the asset's cameras ({})",
                    part.trim(),
                    if names.is_empty() { "it has none".into() } else { names.join(", ") }
                )));
            }
        }
        Ok(orbit)
    }
}

impl Orbit {
    /// Take in one part; `None` if it means nothing.
    fn take(&mut self, part: &str) -> Option<()> {
        let from = |yaw, pitch| Self { yaw: Some(yaw), pitch: Some(pitch), ..Self::default() };
        let preset = match part {
            "front" => from(0.0, 0.0),
            "back" => from(180.0, 0.0),
            "left" => from(90.0, 0.0),
            "right" => from(-90.0, 0.0),
            "top" => from(0.0, 90.0),
            "bottom" => from(0.0, -90.0),
            "three-quarter" => from(45.0, 15.0),
            "isometric" => Self { fov: Some(0.0), ..from(45.0, ISOMETRIC_DEG) },
            "dimetric" => Self { fov: Some(0.0), ..from(45.0, 30.0) },
            "ortho" => Self { fov: Some(0.0), ..Self::default() },
            _ => Self::number(part)?,
        };
        self.yaw = preset.yaw.or(self.yaw);
        self.pitch = preset.pitch.or(self.pitch);
        self.roll = preset.roll.or(self.roll);
        self.fov = preset.fov.or(self.fov);
        Some(())
    }

    /// `key=number`.
    fn number(part: &str) -> Option<Self> {
        let (key, value) = part.split_once('=')?;
        let v = value.trim().parse::<f32>().ok().filter(|v| v.is_finite())?;
        let mut o = Self::default();
        match key.trim() {
            "yaw" => o.yaw = Some(v),
            "roll" => o.roll = Some(v),
            "pitch" if v.abs() <= 90.0 => o.pitch = Some(v),
            "fov" if (0.0..=160.0).contains(&v) => o.fov = Some(v),
            "focal" if v > 2.0 => o.fov = Some(2.0 * (0.5 * FILM / v).atan().to_degrees()),
            _ => return None,
        }
        Some(o)
    }
}

fn parse_point(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|n| n.trim().parse().ok()).collect();
    match *numbers {
        [x, y, z] if text.split(',').count() == 3 && [x, y, z].iter().all(|v| v.is_finite()) => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err("expected three numbers, as in 0,1.5,3".into()),
    }
}

fn parse_crop(text: &str) -> Result<Window, String> {
    let numbers: Option<Vec<usize>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Window { x, y, width, height }),
        _ => Err("expected pixels from the left and the top, width and height, as in 100,50,320,200".into()),
    }
}

fn parse_margin(text: &str) -> Result<f32, String> {
    let number = text.parse::<f32>().ok().filter(|m| (0.0..=FramingDesc::MAX_MARGIN).contains(m));
    number.ok_or_else(|| format!("expected a share of the picture from 0 to {}", FramingDesc::MAX_MARGIN))
}

fn parse_zoom(text: &str) -> Result<f32, String> {
    let number = text.parse::<f32>().ok().filter(|z| (1e-3..=1e3).contains(z));
    number.ok_or_else(|| "expected a factor from 0.001 to 1000".into())
}

fn parse_lap(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|s| *s > 0.0 && s.is_finite());
    number.ok_or_else(|| "expected the seconds of one turn".into())
}
