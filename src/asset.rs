//! An asset: a character with its look. What importers return and frames draw.
//!
//! `character` stays free of materials so that a game can take the motion alone; the two meet here.

use crate::character::Character;
use crate::scene::{Light, Material, Projection, Texture};
use crate::skeleton::BoneId;

/// A camera that rides on a bone, looking along the bone's −z with +y up.
#[derive(Clone, Debug, PartialEq)]
pub struct MountedCamera {
    /// For people and the command line.
    pub name: String,
    /// The bone it rides on.
    pub bone: BoneId,
    /// Perspective or parallel.
    pub projection: Projection,
    /// Nearest visible distance, metres.
    pub near: f32,
}

/// A lamp that rides on a bone, shining along the bone's −z from its origin; positions in `light` are in the bone's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct MountedLight {
    /// The bone it rides on.
    pub bone: BoneId,
    /// The lamp, in the bone's frame.
    pub light: Light,
}

/// A character with its look.
#[derive(Clone, Debug, Default)]
pub struct Asset {
    /// What moves.
    pub character: Character,
    /// What meshes' `MaterialId`s mean.
    pub materials: Vec<Material>,
    /// What materials' `TextureId`s mean; empty if the import left pictures out.
    pub textures: Vec<Texture>,
    /// Cameras of the file.
    pub cameras: Vec<MountedCamera>,
    /// Lamps of the file.
    pub lights: Vec<MountedLight>,
}
