//! Triangle meshes, checked once at the door.

pub mod normals;
pub mod topology;

use glam::{Vec2, Vec3, Vec4};

/// A label that the renderer resolves to a material; a mesh does not know what it means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MaterialId(pub u32);

/// Differences that a blend shape adds at weight 1; each list is empty or has `V` entries.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct MorphTarget {
    /// For people; empty where the file says none.
    pub name: String,
    /// Added to positions, metres.
    pub positions: Vec<Vec3>,
    /// Added to normals before they are normalised again.
    pub normals: Vec<Vec3>,
    /// Added to the first three components of tangents.
    pub tangents: Vec<Vec3>,
}

/// `V` vertices and `F` triangles. Optional lists are empty or have `V` entries.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct MeshData {
    /// For people.
    pub name: String,
    /// `V` rest positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Unit tangents along +u; w is ±1, `bitangent = w · n × t`.
    pub tangents: Vec<Vec4>,
    /// Two sets of texture coordinates; (0,0) is the top left of the image, as in glTF.
    pub uvs: [Vec<Vec2>; 2],
    /// Linear RGBA factors, straight alpha.
    pub colors: Vec<Vec4>,
    /// `F` triangles, counter-clockwise in front.
    pub triangles: Vec<[u32; 3]>,
    /// Blend shapes.
    pub targets: Vec<MorphTarget>,
    /// How it looks.
    pub material: Option<MaterialId>,
}

/// A [`MeshData`] whose indices, lengths and numbers have been checked; read it by dereferencing.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Mesh(MeshData);

impl std::ops::Deref for Mesh {
    type Target = MeshData;
    fn deref(&self) -> &MeshData {
        &self.0
    }
}

/// What is wrong with mesh data.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A list that is neither empty nor as long as the positions.
    #[error("mesh `{mesh}`: {what} has {found} entries for {expected} positions")]
    Length {
        /// Name of the mesh.
        mesh: String,
        /// Which list.
        what: String,
        /// Its length.
        found: usize,
        /// `V`.
        expected: usize,
    },
    /// A triangle that names a vertex beyond the list.
    #[error("mesh `{mesh}`: triangle {triangle} uses vertex {vertex}, but there are {count}")]
    Index {
        /// Name of the mesh.
        mesh: String,
        /// Which triangle.
        triangle: usize,
        /// The vertex that it asks for.
        vertex: u32,
        /// `V`.
        count: usize,
    },
    /// NaN or infinity.
    #[error("mesh `{mesh}`: vertex {vertex} of its {what} is not finite")]
    NotFinite {
        /// Name of the mesh.
        mesh: String,
        /// Which list.
        what: String,
        /// Which entry.
        vertex: usize,
    },
}

impl Mesh {
    /// Check and freeze.
    ///
    /// ```
    /// use sinew::mesh::{Mesh, MeshData};
    /// use glam::Vec3;
    /// let data = MeshData {
    ///     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
    ///     triangles: vec![[0, 1, 3]],
    ///     ..Default::default()
    /// };
    /// assert!(Mesh::new(data).unwrap_err().to_string().contains("uses vertex 3, but there are 3"));
    /// ```
    ///
    /// # Errors
    /// [`MeshError`]: lists of unequal length, indices out of range, numbers that are not finite.
    pub fn new(data: MeshData) -> Result<Self, MeshError> {
        let v = data.positions.len();
        let mesh = || data.name.clone();
        let list = |what: &str, found: usize, first_bad: Option<usize>| {
            if found != 0 && found != v {
                return Err(MeshError::Length { mesh: mesh(), what: what.into(), found, expected: v });
            }
            match first_bad {
                Some(vertex) => Err(MeshError::NotFinite { mesh: mesh(), what: what.into(), vertex }),
                None => Ok(()),
            }
        };
        let bad3 = |l: &[Vec3]| l.iter().position(|x| !x.is_finite());
        let bad4 = |l: &[Vec4]| l.iter().position(|x| !x.is_finite());
        list("positions", v, bad3(&data.positions))?;
        list("normals", data.normals.len(), bad3(&data.normals))?;
        list("tangents", data.tangents.len(), bad4(&data.tangents))?;
        list("colours", data.colors.len(), bad4(&data.colors))?;
        for (k, uv) in data.uvs.iter().enumerate() {
            let bad = uv.iter().position(|x| !x.is_finite());
            list(&format!("texture coordinates {k}"), uv.len(), bad)?;
        }
        for (k, t) in data.targets.iter().enumerate() {
            list(&format!("morph target {k} positions"), t.positions.len(), bad3(&t.positions))?;
            list(&format!("morph target {k} normals"), t.normals.len(), bad3(&t.normals))?;
            list(&format!("morph target {k} tangents"), t.tangents.len(), bad3(&t.tangents))?;
        }
        for (triangle, t) in data.triangles.iter().enumerate() {
            if let Some(&vertex) = t.iter().find(|&&i| i as usize >= v) {
                return Err(MeshError::Index { mesh: mesh(), triangle, vertex, count: v });
            }
        }
        Ok(Self(data))
    }

    /// The data back, to be changed and checked again.
    pub fn into_data(self) -> MeshData {
        self.0
    }

    /// Positions at rest under morph weights that are all zero: corner of the box with the smallest coordinates, and with
    /// the largest. `None` without vertices.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(lo, hi), p| (lo.min(*p), hi.max(*p))))
    }
}
