//! Our own rigs and poses: JSON that people read and write (`rigs/README.md` describes every field).
//!
//! A rig holds bones, meshes and materials, a file of poses holds clips. Both carry a version. A field that the format
//! does not have is an error that names it, because hand-written files have typos.

mod bones;
mod document;
mod error;
mod export;
mod layout;
mod meshes;
mod poses;
mod texture;

pub use super::json_color::Color;
pub use document::{Bind, Bone, Material, Mesh, Rig, Target, Weights};
pub use error::RigError;
pub use export::{Exported, export, export_poses};
pub use poses::{Clip, Interpolation, Poses, Tangents, Track};
pub use texture::MAX_TEXTURE_BYTES;

use crate::asset::Asset;
use crate::character::{Character, MeshId};
use crate::clip;
use crate::fk;
use crate::io::{Import, Options, read_below, read_file};
use crate::pose::Pose;
use crate::scene::{AlphaMode, Content, TextureRef};
use crate::time::Timeline;
use glam::Affine2;
use std::path::Path;

/// Fetches a file that a rig names, by its path relative to the rig, without `.` and needless `..`.
pub type Fetch<'a> = &'a dyn Fn(&str) -> std::io::Result<Vec<u8>>;

/// Read a rig, its textures and its poses.
///
/// Poses come from the files in the rig's `poses` list, else from `../poses/` and the rig's own file name, if there is
/// such a file. No path may leave the folder above the rig's, neither by `..` nor through a link. Pictures take at most
/// [`MAX_TEXTURE_BYTES`] together.
///
/// # Errors
/// [`RigError`]; the caller knows which file it named, [`RigError::In`] names another that the rig names.
pub fn import(path: &Path, options: &Options) -> Result<Import, RigError> {
    let read = |source| RigError::Read { file: path.display().to_string(), source };
    let bytes = read_file(path).map_err(read)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let home = folder.canonicalize().map_err(read)?;
    let above = home.parent().unwrap_or(&home);
    let fetch = |relative: &str| read_below(above, &home.join(relative));
    let mut rig = Rig::from_bytes(&bytes)?;
    if rig.poses.is_none()
        && let Some(name) = path.file_name().and_then(|n| n.to_str())
    {
        let beside = format!("../poses/{name}");
        rig.poses = folder.join(&beside).is_file().then(|| vec![beside]);
    }
    rig.to_import(options, &fetch)
}

/// Read a rig from memory; `fetch` supplies the textures and poses that it lists.
///
/// ```
/// use sinew::io::{Options, rig_json};
/// let rig = br##"{
///   "sinew_rig": 1,
///   "bones": [
///     {"name": "arm", "head": [0,0,0], "tail": [1,0,0]},
///     {"name": "hand", "parent": "arm", "head": [1,0,0], "tail": [1.2,0,0]}
///   ],
///   "meshes": [
///     {"name": "flag", "bind": {"rigid": "hand"}, "positions": [[0,0,0],[0.2,0,0],[0,0.2,0]], "triangles": [[0,1,2]]}
///   ]
/// }"##;
/// let import = rig_json::import_bytes(rig, &Options::default(), &|_| Err(std::io::ErrorKind::NotFound.into())).unwrap();
/// assert_eq!(import.asset.character.skeleton().len(), 2);
/// ```
///
/// # Errors
/// [`RigError`] names the place, what was expected and what was found.
pub fn import_bytes(bytes: &[u8], options: &Options, fetch: Fetch) -> Result<Import, RigError> {
    Rig::from_bytes(bytes)?.to_import(options, fetch)
}

/// The clips of a file of poses, for a character that has their bones and morph weights.
///
/// ```
/// use sinew::{character::Character, io::rig_json::poses_from_bytes};
/// use sinew::skeleton::{BoneDesc, Skeleton};
/// let (skeleton, _) = Skeleton::new(vec![BoneDesc::new("arm")]).unwrap();
/// let arm = Character::new(skeleton, vec![], vec![], vec![], vec![]).unwrap();
/// let text = br#"{"sinew_poses": 1, "clips": [{"name": "nod", "tracks": [
///     {"bone": "arn", "xzx_deg": [[0, 0,0,0], [1, 0,30,0]]}]}]}"#;
/// let error = poses_from_bytes(text, &arm).unwrap_err().to_string();
/// assert_eq!(error, "clip `nod`, track 0 of bone `arn`: bone `arn` is none of the 1 bones");
/// ```
///
/// # Errors
/// [`RigError`] names clip, track and bone.
pub fn poses_from_bytes(bytes: &[u8], character: &Character) -> Result<Vec<clip::Clip>, RigError> {
    Poses::from_bytes(bytes)?.to_clips(character)
}

impl Rig {
    /// The document in a file.
    ///
    /// # Errors
    /// [`RigError::Json`], [`RigError::Version`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RigError> {
        let rig: Self = serde_json::from_slice(bytes)?;
        match rig.sinew_rig {
            1 => Ok(rig),
            found => Err(RigError::Version { field: "sinew_rig", found }),
        }
    }

    /// The document as text: one bone, vertex or triangle a line.
    pub fn to_text(&self) -> String {
        layout::rig(self)
    }

    /// The asset that the document describes; `fetch` supplies its textures and poses.
    ///
    /// # Errors
    /// [`RigError`] names the place, what was expected and what was found.
    pub fn to_import(&self, options: &Options, fetch: Fetch) -> Result<Import, RigError> {
        let mut warnings = Vec::new();
        let skeleton = bones::skeleton(&self.bones)?;
        let mut posed = fk::Posed::default();
        fk::forward(&skeleton, &Pose::rest(&skeleton), &mut posed);

        // Materials and their pictures.
        unique_materials(&self.materials)?;
        let mut textures = texture::Textures::new(options.textures, fetch);
        let mut materials = Vec::with_capacity(self.materials.len());
        for m in &self.materials {
            let mut material = meshes::material(m)?;
            // On an opaque surface alpha means nothing, so it must not weigh colours.
            let content =
                if material.alpha == AlphaMode::Opaque { Content::ColorAndNumber } else { Content::Color };
            let map =
                m.texture.as_ref().map(|file| textures.load(file, content, &mut warnings)).transpose()?;
            let on = |texture| TextureRef { texture, uv_set: 0, transform: Affine2::IDENTITY };
            material.diffuse_map = map.flatten().map(on);
            materials.push(material);
        }

        // Meshes, each drawn once.
        let rest = meshes::Rest { skeleton: &skeleton, posed: &posed };
        let (mut all, mut instances, mut runs) = (Vec::new(), Vec::new(), meshes::Runs::default());
        for (i, m) in self.meshes.iter().enumerate() {
            let (mesh, mut instance) =
                meshes::mesh(MeshId(i as u32), m, &self.materials, &rest, &mut warnings)?;
            instance.first_weight = runs.first_weight(m)?;
            all.push(mesh);
            instances.push(instance);
        }
        let character = Character::new(skeleton, all, instances, runs.rest, Vec::new())?;
        let (clips, timeline) = self.fetch_poses(&character, fetch)?;
        let character = character.with_clips(clips)?;
        let asset = Asset { character, materials, textures: textures.list, ..Default::default() };
        Ok(Import { asset, format: "sinew rig".into(), timeline, warnings, ..Default::default() })
    }

    fn fetch_poses(
        &self,
        character: &Character,
        fetch: Fetch,
    ) -> Result<(Vec<clip::Clip>, Timeline), RigError> {
        let (mut clips, mut timeline) = (Vec::new(), Timeline::default());
        for file in self.poses.iter().flatten() {
            let path = inside_project(file)?;
            let read = |source| RigError::Read { file: file.clone(), source };
            let bytes = fetch(&path).map_err(read)?;
            let inside = |error| RigError::In { file: file.into(), error: Box::new(error) };
            let poses = Poses::from_bytes(&bytes).map_err(inside)?;
            clips.extend(poses.to_clips(character).map_err(inside)?);
            let own = poses.timeline().map_err(inside)?;
            timeline.rate = timeline.rate.or(own.rate);
            timeline.clips.extend(own.clips);
        }
        Ok((clips, timeline))
    }
}

impl Poses {
    /// The document as text: one key a line.
    pub fn to_text(&self) -> String {
        layout::poses(self)
    }
}

fn unique_materials(all: &[Material]) -> Result<(), RigError> {
    let mut names: Vec<&str> = all.iter().map(|m| m.name.as_str()).collect();
    names.sort_unstable();
    match names.windows(2).find(|w| w[0] == w[1]) {
        None => Ok(()),
        Some(w) => Err(RigError::Name {
            place: "materials".into(),
            what: "material",
            name: w[0].into(),
            why: "is there twice; names must be unique".into(),
        }),
    }
}

/// A relative path that stays inside the folder above the rig's own, without `.` and needless `..`: so one file has one
/// spelling.
fn inside_project(path: &str) -> Result<String, RigError> {
    let bad = |why| Err(RigError::Path { path: path.into(), why });
    if path.is_empty() || path.contains('\\') || path.contains(':') || path.contains('\0') {
        return bad("must be a relative path with forward slashes");
    }
    if path.starts_with('/') {
        return bad("must be relative to the rig");
    }
    let (mut up, mut names) = (0, Vec::new());
    for part in path.split('/') {
        match part {
            "" | "." => (),
            ".." if names.pop().is_none() => up += 1,
            ".." => (),
            name => names.push(name),
        }
        if up > 1 {
            return bad("leaves the folder above the rig's");
        }
    }
    Ok(format!("{}{}", ["", "../"][up], names.join("/")))
}

#[cfg(test)]
mod tests;
