//! The rig file as written: field by field what `rigs/README.md` describes, before anything is resolved.

use super::Color;
use serde::{Deserialize, Serialize};

/// A whole rig file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    /// Version of the format: 1.
    pub sinew_rig: u32,
    /// For people.
    #[serde(default)]
    pub name: String,
    /// Files of poses, relative to the rig; without the field `../poses/` and the rig's own file name, if that exists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<Vec<String>>,
    /// The skeleton, in any order.
    pub bones: Vec<Bone>,
    /// What meshes are made of.
    #[serde(default)]
    pub materials: Vec<Material>,
    /// What is drawn.
    #[serde(default)]
    pub meshes: Vec<Mesh>,
}

/// A bone: its rest by head and tail, or by a transform against its parent.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bone {
    /// Unique.
    pub name: String,
    /// Name of the parent; absent for a root.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent: Option<String>,
    /// Where the bone begins, in the rest space of the character, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub head: Option<[f32; 3]>,
    /// Where it ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tail: Option<[f32; 3]>,
    /// The axis of a positive bend (the bone's z), in rest space; made orthogonal to the bone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hinge: Option<[f32; 3]>,
    /// Instead of head and tail: origin in the parent's frame, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation: Option<[f32; 3]>,
    /// Rotation against the parent as a quaternion x, y, z, w.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<[f32; 4]>,
    /// The same as XZX angles in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub xzx_deg: Option<[f64; 3]>,
    /// Factors along the bone's axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<[f32; 3]>,
    /// Metres from origin to tip.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f32>,
    /// `bone_from_aim` as a quaternion, for bones that do not run along their +x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aim: Option<[f32; 4]>,
    /// `parent_from_bone` as three rows of four, for bones that are sheared and never move.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed: Option<[[f32; 4]; 3]>,
    /// Smallest XZX angles in degrees; `null` is free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_deg: Option<[Option<f64>; 3]>,
    /// Largest XZX angles in degrees; `null` is free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_deg: Option<[Option<f64>; 3]>,
}

/// Blinn-Phong coefficients; what is absent has the engine's default.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Unique.
    pub name: String,
    /// `k_d` and alpha.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diffuse: Option<Color>,
    /// `k_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub specular: Option<Color>,
    /// The exponent `p`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shininess: Option<f32>,
    /// Light of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub emissive: Option<Color>,
    /// A PNG file relative to the rig; multiplies `diffuse`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texture: Option<String>,
    /// Seen from behind too.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub double_sided: bool,
    /// `k_d` alone, no light needed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unlit: bool,
}

/// Triangles and what drives them.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// For people.
    #[serde(default)]
    pub name: String,
    /// Name of its material; absent for the default look.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// What drives it.
    pub bind: Bind,
    /// Without normals: edges sharper than this many degrees stay sharp; absent, all is smooth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crease_deg: Option<f64>,
    /// `V` positions, metres.
    pub positions: Vec<[f32; 3]>,
    /// `V` unit normals; computed where absent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub normals: Vec<[f32; 3]>,
    /// `V` texture coordinates, (0,0) the picture's top left.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uvs: Vec<[f32; 2]>,
    /// `V` colours that multiply the material's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub colors: Vec<Color>,
    /// Triangles, counter-clockwise in front.
    pub triangles: Vec<[u32; 3]>,
    /// Blend shapes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<Target>,
    /// Which run of morph weights moves the targets, counted from 0: the next one, if absent. Meshes of one run move together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub morph: Option<usize>,
    /// Morph weights at rest, one a target; absent: zero.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub weights: Vec<f32>,
}

/// What a blend shape adds at weight 1.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// For people.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// `V` differences of positions, metres, or none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub positions: Vec<[f32; 3]>,
    /// `V` differences of normals, or none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub normals: Vec<[f32; 3]>,
}

/// What drives a mesh.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bind {
    /// Fixed to a bone and given in its frame, +x along the bone.
    Rigid(String),
    /// Given in rest space; each connected part follows the bone that it is nearest to.
    #[default]
    Closest,
    /// Given in rest space; linear blend.
    Weights(Weights),
}

/// Influences of every vertex.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weights {
    /// Names; vertices refer to their places in this list.
    pub bones: Vec<String>,
    /// `bone_from_mesh` as three rows of four, a bone each; absent: what keeps the mesh in place at rest.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inverse_bind: Vec<[[f32; 4]; 3]>,
    /// For each vertex, pairs of a bone's place and its weight.
    pub vertices: Vec<Vec<(u32, f32)>>,
}
