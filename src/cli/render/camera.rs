//! Options of the camera.

use crate::cli::Failure;
use sinew::asset::Asset;
use sinew::frames::View;

#[derive(clap::Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// Orbit as yaw=30,pitch=15,fov=30 in degrees (each optional; fov=0 is parallel), or one of the asset's cameras by name or index.
    #[arg(long, default_value = "yaw=30,pitch=12,fov=30", value_name = "ORBIT|NAME|INDEX")]
    camera: String,
}

impl CameraArgs {
    /// The orbit, or the asset's camera, that `--camera` names.
    pub fn view(&self, asset: &Asset) -> Result<View, Failure> {
        let text = &self.camera;
        let named = asset.cameras.iter().position(|c| c.name == *text);
        let index = text.parse::<usize>().ok().filter(|&i| i < asset.cameras.len());
        if let Some(camera) = named.or(index) {
            return Ok(View::Mounted(camera));
        }
        let (mut yaw, mut pitch, mut fov) = (30.0_f32, 12.0_f32, 30.0_f32);
        for part in text.split(',') {
            let number =
                part.split_once('=').and_then(|(k, v)| Some((k.trim(), v.trim().parse::<f32>().ok()?)));
            match number.filter(|(_, v)| v.is_finite()) {
                Some(("yaw", v)) => yaw = v,
                Some(("pitch", v)) if v.abs() <= 90.0 => pitch = v,
                Some(("fov", v)) if (0.0..=160.0).contains(&v) => fov = v,
                _ => {
                    let names: Vec<&str> = asset.cameras.iter().map(|c| c.name.as_str()).collect();
                    return Err(Failure::Usage(format!(
                        "--camera {text}: expected yaw=DEG,pitch=−90…90,fov=0…160 or one of the asset's cameras ({})",
                        if names.is_empty() { "it has none".into() } else { names.join(", ") }
                    )));
                }
            }
        }
        Ok(View::Orbit { yaw: yaw.to_radians(), pitch: pitch.to_radians(), fov_y: fov.to_radians() })
    }
}
