//! What characters are built from: bones, solids, skins and motion.

pub mod bones;
pub mod face;
pub mod field;
pub mod gait;
pub mod loft;
pub mod motion;
pub mod parts;
pub mod skin;
pub mod surface;

use super::File;
use sinew::io::rig_json::{Clip, Color, Material, Mesh, Poses, Rig};

/// The two files of a character.
pub fn files(name: &str, title: &str, bones: &bones::Bones, look: Look, clips: Vec<Clip>) -> Vec<File> {
    let rig = Rig {
        sinew_rig: 1,
        name: title.into(),
        poses: None,
        bones: bones.list.clone(),
        materials: look.materials,
        meshes: look.meshes,
    };
    let poses = Poses { sinew_poses: 1, clips, ..Poses::default() };
    vec![
        File { path: format!("rigs/{name}.json"), bytes: rig.to_text().into_bytes() },
        File { path: format!("poses/{name}.json"), bytes: poses.to_text().into_bytes() },
    ]
}

/// Materials and meshes.
#[derive(Default)]
pub struct Look {
    pub materials: Vec<Material>,
    pub meshes: Vec<Mesh>,
}

impl Look {
    /// Add a material: colour, strength of the highlight and its exponent.
    pub fn material(&mut self, name: &str, color: u32, specular: f32, shininess: f32) -> &mut Material {
        self.materials.push(Material {
            name: name.into(),
            diffuse: Some(rgb(color)),
            specular: Some(Color(glam::Vec4::new(specular, specular, specular, 1.0))),
            shininess: Some(shininess),
            ..Default::default()
        });
        let last = self.materials.len() - 1;
        &mut self.materials[last]
    }
}

/// `0xrrggbb` in sRGB.
pub fn rgb(hex: u32) -> Color {
    Color::srgb8((hex >> 16) as u8, (hex >> 8) as u8, hex as u8)
}

/// Rounded to `digits` decimals: files stay small, and the last bit of a platform's sine leaves no trace in them.
pub fn round(x: f64, digits: i32) -> f64 {
    let k = 10_f64.powi(digits);
    // Adding zero turns −0 into 0.
    (x * k).round() / k + 0.0
}

/// A point, rounded to 0.1 mm.
pub fn point(p: glam::DVec3) -> [f32; 3] {
    p.to_array().map(|x| round(x, 4) as f32)
}
