//! Formats: bytes to assets and back. One file or folder a format; the core never knows where a rig came from.

#[cfg(feature = "io")]
pub mod gltf;
#[cfg(feature = "io")]
pub mod notes;
#[cfg(feature = "pictures")]
pub mod picture;
#[cfg(feature = "io")]
pub mod rig_json;

use crate::asset::Asset;

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
    /// `glTF`, `sinew rig`, `notes rig`.
    pub format: String,
    /// What the file says made it.
    pub generator: String,
    /// glTF node of each bone, in the bones' order; empty for formats without nodes.
    pub nodes: Vec<u32>,
    /// Where each mesh instance stood, in the instances' order; empty for formats without nodes.
    pub primitives: Vec<PrimitiveSource>,
    /// Extensions that the file names, sorted.
    pub extensions: Vec<String>,
    /// Everything that was dropped or repaired.
    pub warnings: Vec<Warning>,
}
