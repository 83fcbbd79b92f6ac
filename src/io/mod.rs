//! Formats: bytes to assets and back. One file or folder a format; the core never knows where a rig came from.

#[cfg(feature = "io")]
pub mod bvh;
#[cfg(feature = "io")]
pub mod gltf;
#[cfg(feature = "io")]
mod json_color;
#[cfg(feature = "io")]
pub mod look_json;
#[cfg(all(feature = "io", feature = "pictures"))]
pub mod manifest;
#[cfg(feature = "io")]
pub mod notes;
#[cfg(feature = "io")]
pub mod obj;
#[cfg(feature = "io")]
pub mod pc2;
#[cfg(feature = "pictures")]
pub mod picture;
#[cfg(feature = "io")]
pub mod ply;
#[cfg(feature = "io")]
pub mod rig_json;
#[cfg(feature = "io")]
pub mod scene;
#[cfg(all(feature = "io", feature = "pictures"))]
pub mod sheet_json;
#[cfg(feature = "io")]
pub mod sinew_clip;
#[cfg(feature = "io")]
pub mod still;
#[cfg(feature = "io")]
pub mod stl;

use crate::asset::Asset;
use crate::time::Timeline;

/// Vertices times bones beyond which binding each part to its closest bone would take minutes.
#[cfg(feature = "io")]
const MAX_CLOSEST: usize = 1 << 26;

/// Something that an import dropped, repaired or did not understand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Where: `meshes[2].primitives[0]`, `bone "hand"`.
    pub place: String,
    /// What was found and what was made of it.
    pub message: String,
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.place.is_empty() {
            f.write_str(&self.message)
        } else {
            write!(f, "{}: {}", self.place, self.message)
        }
    }
}

/// What is to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Options {
    /// Decode textures; `false` leaves `Asset::textures` empty and materials without maps.
    pub textures: bool,
}

/// Where a mesh instance stood in a glTF file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PrimitiveSource {
    /// Index of the node.
    pub node: u32,
    /// Index of the mesh.
    pub mesh: u32,
    /// Index of the primitive in the mesh.
    pub primitive: u32,
}

/// A file as the engine sees it, and what the file was.
#[derive(Clone, Debug, Default)]
pub struct Import {
    /// What moves and how it looks.
    pub asset: Asset,
    /// `glTF`, `sinew rig`, `notes rig`, `BVH`, `notes scene`, or `sinew scene of a …`.
    pub format: String,
    /// What the file says made it.
    pub generator: String,
    /// glTF node of each bone, in the bones' order; empty for formats without nodes.
    pub nodes: Vec<u32>,
    /// Where each mesh instance stood, in the instances' order; empty for formats without nodes.
    pub primitives: Vec<PrimitiveSource>,
    /// Extensions that the file names, sorted.
    pub extensions: Vec<String>,
    /// What is around the character, or there instead of one, where the file is a scene.
    #[cfg(feature = "io")]
    pub setting: Option<scene::Setting>,
    /// Rate, ranges and markers, where a file of poses of ours has them.
    pub timeline: Timeline,
    /// Everything that was dropped or repaired.
    pub warnings: Vec<Warning>,
}

/// Why a file could not be read.
#[cfg(feature = "io")]
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file cannot be opened.
    #[error("{0}")]
    Read(#[from] std::io::Error),
    /// No format that is known.
    #[error("{0}")]
    Unknown(String),
    /// A glTF file.
    #[error(transparent)]
    Gltf(#[from] gltf::GltfError),
    /// A rig of ours.
    #[error(transparent)]
    Rig(#[from] rig_json::RigError),
    /// A motion capture.
    #[error(transparent)]
    Bvh(#[from] bvh::BvhError),
    /// A rig of the notes.
    #[error(transparent)]
    Notes(#[from] notes::NotesError),
    /// A scene.
    #[error(transparent)]
    Scene(#[from] scene::SceneError),
}

/// Read any file that the engine knows; the content decides, not the name.
///
/// # Errors
/// [`ImportError`]; the caller knows which file it named, the message says where in it.
#[cfg(feature = "io")]
pub fn import(path: &std::path::Path, options: &Options) -> Result<Import, ImportError> {
    import_while(path, options, &mut |_| ())
}

/// [`import`], with something to do while pictures are decoded: `meanwhile` is shown the import as soon as all but its materials and
/// textures is there, if they take long; else it is not called.
///
/// # Errors
/// Those of [`import`].
#[cfg(feature = "io")]
pub fn import_while(
    path: &std::path::Path,
    options: &Options,
    meanwhile: &mut dyn FnMut(&Import),
) -> Result<Import, ImportError> {
    read_import(path, options, true, meanwhile)
}

/// [`import_while`], `scenes` among them or not.
#[cfg(feature = "io")]
fn read_import(
    path: &std::path::Path,
    options: &Options,
    scenes: bool,
    meanwhile: &mut dyn FnMut(&Import),
) -> Result<Import, ImportError> {
    let bytes = read_file(path)?;
    let folder = path.parent().unwrap_or(std::path::Path::new(""));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    match probe(&bytes, &name) {
        Format::Bvh => {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            Ok(bvh::import_bytes(&bytes, &stem)?)
        }
        Format::Notes => Ok(notes::import_bytes(&bytes, folder, options)?),
        Format::Gltf => {
            let folder = if folder.as_os_str().is_empty() { std::path::Path::new(".") } else { folder };
            Ok(gltf::import_while(&bytes, Some(folder), options, meanwhile)?)
        }
        Format::Rig => Ok(rig_json::import(path, options)?),
        Format::NotesScene | Format::Scene if !scenes => {
            Err(ImportError::Unknown("this is a scene; expected a character: glTF or a rig".into()))
        }
        Format::NotesScene => {
            let scene = scene::notes::from_bytes(&bytes, folder)?;
            let setting = Some(scene::Setting::Notes(Box::new(scene)));
            Ok(Import { format: "notes scene".into(), setting, ..Import::default() })
        }
        Format::Scene => Ok(scene::ours::import(&bytes, folder, options)?),
        Format::Unknown(why) => Err(ImportError::Unknown(why)),
    }
}

/// Bytes of a decoded picture, four a pixel, or three where it has no alpha.
#[cfg(all(feature = "io", feature = "pictures"))]
fn codes(picture: image::DynamicImage) -> Vec<u8> {
    match picture.color().has_alpha() {
        true => picture.into_rgba8().into_raw(),
        false => picture.into_rgb8().into_raw(),
    }
}

/// All bytes of a plain file; a folder, a pipe or a device is refused, since it may never end.
///
/// # Errors
/// What the system says, or that it is no file.
#[cfg(feature = "io")]
pub fn read_file(path: &std::path::Path) -> std::io::Result<Vec<u8>> {
    let kind = std::fs::metadata(path)?;
    if kind.is_file() {
        return std::fs::read(path);
    }
    let what = if kind.is_dir() { "a folder" } else { "a pipe or a device" };
    Err(std::io::Error::other(format!("this is {what}; expected a file")))
}

/// A path beside a file; `None` for anything but a plain relative name.
#[cfg(feature = "io")]
fn beside(folder: &std::path::Path, name: &str) -> Option<std::path::PathBuf> {
    let mut parts = std::path::Path::new(name).components();
    let plain = !name.is_empty() && parts.all(|c| matches!(c, std::path::Component::Normal(_)));
    plain.then(|| folder.join(name))
}

/// All bytes of a plain file that lies below `root`, wherever links on the way may lead.
#[cfg(feature = "io")]
fn read_below(root: &std::path::Path, path: &std::path::Path) -> std::io::Result<Vec<u8>> {
    let (real, root) = (path.canonicalize()?, root.canonicalize()?);
    if real.starts_with(&root) {
        return read_file(&real);
    }
    let message = format!("it is a link to {}, outside of {}", real.display(), root.display());
    Err(std::io::Error::new(std::io::ErrorKind::PermissionDenied, message))
}

#[cfg(feature = "io")]
enum Format {
    Gltf,
    Bvh,
    Rig,
    Notes,
    NotesScene,
    Scene,
    Unknown(String),
}

/// Tell formats apart by their first bytes, then by the keys of their JSON object.
#[cfg(feature = "io")]
fn probe(bytes: &[u8], name: &str) -> Format {
    use serde::de::IgnoredAny;

    #[derive(serde::Deserialize)]
    struct Keys {
        sinew_rig: Option<IgnoredAny>,
        sinew_poses: Option<IgnoredAny>,
        asset: Option<IgnoredAny>,
        bones: Option<IgnoredAny>,
        model: Option<IgnoredAny>,
        sinew_scene: Option<IgnoredAny>,
        camera: Option<IgnoredAny>,
        objects: Option<IgnoredAny>,
    }

    if bytes.starts_with(b"glTF") || name.to_ascii_lowercase().ends_with(".gltf") {
        return Format::Gltf;
    }
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let start = text.trim_ascii_start();
    if start.get(..9).is_some_and(|w| w.eq_ignore_ascii_case(b"HIERARCHY")) {
        return Format::Bvh;
    }
    match serde_json::from_slice::<Keys>(text) {
        Ok(Keys { sinew_rig: Some(_), .. }) => Format::Rig,
        Ok(Keys { asset: Some(_), .. }) => Format::Gltf,
        Ok(Keys { bones: Some(_), model: Some(_), .. }) => Format::Notes,
        Ok(Keys { sinew_scene: Some(_), .. }) => Format::Scene,
        Ok(Keys { camera: Some(_), objects: Some(_), .. }) => Format::NotesScene,
        Ok(Keys { sinew_poses: Some(_), .. }) => Format::Unknown(
            "these are poses without a rig; name the rig, and these with --poses".into(),
        ),
        Ok(_) => Format::Unknown(
            "a JSON file without `asset` (glTF), `sinew_rig` or `sinew_scene` (rigs and scenes of ours), `bones` and `model` (a rig of the notes) or \
             `camera` and `objects` (a scene of the notes)"
                .into(),
        ),
        Err(e) if text.first().is_some_and(|&b| b == b'{' || b.is_ascii_whitespace()) => {
            Format::Unknown(format!("JSON that does not parse: {e}"))
        }
        Err(_) if bytes.is_empty() => Format::Unknown("the file is empty".into()),
        Err(_) => Format::Unknown(format!(
            "expected glTF (.gltf, .glb), a rig (.json) or a capture (.bvh), found bytes that begin with {:02x?}",
            &bytes[..bytes.len().min(8)]
        )),
    }
}
