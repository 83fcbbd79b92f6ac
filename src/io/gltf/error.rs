//! Why a glTF file cannot be read: place, found, expected, and what to do.

use crate::character::CharacterError;
use crate::clip::CurveError;
use crate::mesh::MeshError;
use crate::skeleton::SkeletonError;
use crate::skin::WeightsError;

/// What makes a glTF file unreadable. Places are paths in its JSON, such as `meshes[2].primitives[0].attributes.POSITION`.
#[derive(Debug, thiserror::Error)]
pub enum GltfError {
    /// A file that cannot be opened or read.
    #[error("{place}: cannot read `{file}`: {source}")]
    Read {
        /// What refers to the file; `file` for the asset itself.
        place: String,
        /// The file as it was asked for.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// Bytes that are neither GLB nor JSON, or a GLB whose lengths do not hold.
    #[error("byte {offset}: expected {expected}, found {found}; the file is damaged or no glTF")]
    Container {
        /// Where in the file.
        offset: u64,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// JSON that cannot be parsed, or does not have glTF's shape.
    #[error("{place}: the JSON is no glTF 2.0: {source}")]
    Json {
        /// The entry that does not fit, or `JSON`.
        place: String,
        /// What the parser says.
        source: serde_json::Error,
    },
    /// Another generation of the format.
    #[error(
        "{place}: expected glTF 2.x, found `{found}`; convert the file first (for 1.0: `gltf-pipeline -i in -o out`)"
    )]
    Version {
        /// `asset.version` or `asset.minVersion`.
        place: &'static str,
        /// The version that the file asks for.
        found: String,
    },
    /// An extension without which the file would be misread.
    #[error("extensionsRequired: `{name}` is not supported; {hint}")]
    Extension {
        /// Its name.
        name: String,
        /// How to get rid of it.
        hint: &'static str,
    },
    /// An index beyond the list that it points into.
    #[error("{place}: {what} {index} does not exist; there are {count}")]
    Index {
        /// Where the index stands.
        place: String,
        /// What it points to.
        what: &'static str,
        /// The index.
        index: usize,
        /// Length of the list.
        count: usize,
    },
    /// A URI that is malformed or leads out of the asset's folder.
    #[error("{place}: the URI `{uri}` {why}")]
    Uri {
        /// Where it stands.
        place: String,
        /// The URI, shortened.
        uri: String,
        /// What is wrong and what would be right.
        why: String,
    },
    /// Data that reaches beyond the bytes that are there.
    #[error("{place}: needs bytes up to {needed}, but {of} has {found}")]
    Bytes {
        /// What reads them.
        place: String,
        /// Bytes needed.
        needed: u64,
        /// Where they should be.
        of: String,
        /// Bytes there.
        found: u64,
    },
    /// More data than the file can mean.
    #[error(
        "{place}: asks for {asked} bytes of data, more than the {limit} bytes allowed to a file of this size"
    )]
    TooLarge {
        /// What asks.
        place: String,
        /// Bytes, all told.
        asked: u64,
        /// The limit.
        limit: u64,
    },
    /// A value that the specification does not allow and that cannot be repaired.
    #[error("{place}: expected {expected}, found {found}")]
    Value {
        /// Where.
        place: String,
        /// What the specification asks for.
        expected: String,
        /// What is there.
        found: String,
    },
    /// Compressed data that do not decode.
    #[error(
        "{place}: the {codec} data do not decode: {why}; decode the file elsewhere first (`gltf-transform cp in.glb out.glb`)"
    )]
    Codec {
        /// What they belong to.
        place: String,
        /// Which compression.
        codec: &'static str,
        /// What the decoder says.
        why: String,
    },
    /// Nodes that are no tree.
    #[error("nodes: {0}")]
    Nodes(#[from] SkeletonError),
    /// Geometry that does not fit together.
    #[error("{place}: {source}")]
    Mesh {
        /// Which primitive.
        place: String,
        /// What is wrong.
        source: MeshError,
    },
    /// Skin weights that cannot be repaired.
    #[error("{place}: {source}")]
    Weights {
        /// Which primitive.
        place: String,
        /// What is wrong.
        source: WeightsError,
    },
    /// Keys that make no curve.
    #[error("{place}: {source}")]
    Keys {
        /// Which channel of which animation.
        place: String,
        /// What is wrong.
        source: CurveError,
    },
    /// Parts that do not belong together.
    #[error(transparent)]
    Character(#[from] CharacterError),
}

pub(super) type Result<T> = std::result::Result<T, GltfError>;

/// A [`GltfError::Value`].
pub(super) fn value(
    place: impl Into<String>,
    expected: impl Into<String>,
    found: impl Into<String>,
) -> GltfError {
    GltfError::Value { place: place.into(), expected: expected.into(), found: found.into() }
}

/// The entry of a list, or an error that names the place of the index.
pub(super) fn entry<'a, T>(
    list: &'a [T],
    index: usize,
    what: &'static str,
    place: impl FnOnce() -> String,
) -> Result<&'a T> {
    list.get(index).ok_or_else(|| GltfError::Index { place: place(), what, index, count: list.len() })
}
