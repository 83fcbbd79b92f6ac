//! Scenes: what stands around and instead of characters. The notes' files, and a format of ours.

pub mod notes;
pub mod ours;

use super::look_json::LookError;
use super::stl::StlError;
use crate::scene::ShapeScene;
use glam::DVec3;
use std::path::PathBuf;

/// A scene that was read.
#[derive(Clone, Debug, PartialEq)]
pub enum Setting {
    /// Of the notes, with everything in it.
    Notes(Box<ShapeScene>),
    /// Of ours: what is around the character, which is the import's asset.
    Ours(Box<ours::SceneFile>),
}

/// Why a scene cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// JSON or fields that make no sense.
    #[error(transparent)]
    Document(#[from] LookError),
    /// A version of the format that this reader does not know.
    #[error("`sinew_scene` is {found}; this version reads 1")]
    Version {
        /// The version that the file has.
        found: u32,
    },
    /// A file that cannot be opened.
    #[error("{place}: {path}: {source}")]
    Read {
        /// Which entry names it.
        place: String,
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file of triangles.
    #[error("{place}: {path}: {source}")]
    Stl {
        /// Which entry names it.
        place: String,
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        source: StlError,
    },
    /// The character.
    #[error("character: {path}: {source}")]
    Character {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        source: Box<super::ImportError>,
    },
}

impl SceneError {
    fn value(place: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Document(LookError::value(place, why))
    }
}

/// A place.
fn point(place: &str, field: &str, v: [f64; 3]) -> Result<DVec3, SceneError> {
    let v = DVec3::from_array(v);
    if v.abs().max_element() <= 1e9 {
        return Ok(v);
    }
    Err(SceneError::value(place, format!("`{field}` must be numbers up to 1e9, found {v}")))
}

/// A direction.
fn vector(place: &str, field: &str, v: [f64; 3]) -> Result<DVec3, SceneError> {
    let v = point(place, field, v)?;
    if v.length() > 1e-12 {
        return Ok(v);
    }
    Err(SceneError::value(place, format!("`{field}` has no length, so no direction: found {v}")))
}

/// A colour or coefficients.
fn share(place: &str, field: &str, v: [f64; 3]) -> Result<DVec3, SceneError> {
    let v = DVec3::from_array(v);
    if v.min_element() >= 0.0 && v.max_element() <= 1e6 {
        return Ok(v);
    }
    Err(SceneError::value(place, format!("`{field}` must be numbers from 0 to 1e6, found {v}")))
}
