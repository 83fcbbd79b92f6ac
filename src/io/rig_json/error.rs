//! What can be wrong with a rig or a file of poses.

use crate::character::CharacterError;
use crate::clip::CurveError;
use crate::mesh::MeshError;
use crate::skeleton::SkeletonError;
use crate::skin::WeightsError;
use std::path::PathBuf;

/// Why a rig or its poses cannot be read, or cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// Which file the error inside is about.
    #[error("{}: {error}", file.display())]
    In {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        error: Box<RigError>,
    },
    /// The file cannot be read.
    #[error("cannot read `{file}`: {source}")]
    Read {
        /// As the rig names it.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// No JSON, or fields that the format does not have.
    #[error("line {line}, column {column}: {message}")]
    Json {
        /// Counted from 1.
        line: usize,
        /// Counted from 1.
        column: usize,
        /// What was expected and what was found.
        message: String,
    },
    /// A version of the format that this reader does not know.
    #[error("`{field}` is {found}; this version reads 1")]
    Version {
        /// `sinew_rig` or `sinew_poses`.
        field: &'static str,
        /// The version that the file has.
        found: u32,
    },
    /// A name that stands for nothing, or for more than one thing.
    #[error("{place}: {what} `{name}` {why}")]
    Name {
        /// Who uses the name.
        place: String,
        /// Bone or material.
        what: &'static str,
        /// The name.
        name: String,
        /// Missing or not unique, and what there is instead.
        why: String,
    },
    /// Fields that contradict each other, or numbers that make no sense.
    #[error("{place}: {why}")]
    Value {
        /// Bone, mesh, material, clip or track.
        place: String,
        /// What was expected and what was found.
        why: String,
    },
    /// A path that leaves the project, or is no path.
    #[error("path `{path}` {why}")]
    Path {
        /// As the rig gives it.
        path: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A picture that cannot be decoded.
    #[error("texture `{file}`: {message}")]
    Texture {
        /// As the rig names it.
        file: String,
        /// What the decoder says.
        message: String,
    },
    /// Bones that make no tree.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// Lists of a mesh that do not fit.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Weights that cannot be repaired.
    #[error("mesh `{mesh}`: {source}")]
    Weights {
        /// Name of the mesh.
        mesh: String,
        /// What is wrong.
        source: WeightsError,
    },
    /// Keys that make no curve.
    #[error("{place}: {source}")]
    Curve {
        /// Clip and track.
        place: String,
        /// What is wrong.
        source: CurveError,
    },
    /// Parts that do not belong together.
    #[error(transparent)]
    Character(#[from] CharacterError),
}

impl RigError {
    /// Contradicting fields or senseless numbers at `place`.
    pub(super) fn value(place: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Value { place: place.into(), why: why.into() }
    }
}

impl From<serde_json::Error> for RigError {
    fn from(e: serde_json::Error) -> Self {
        // serde_json ends its message with the place, which has fields of its own here.
        let text = e.to_string();
        let message = text.rsplit_once(" at line ").map_or(text.as_str(), |(m, _)| m).to_string();
        Self::Json { line: e.line(), column: e.column(), message }
    }
}
