//! Blend shapes: rest vertices plus weighted differences.

use crate::mesh::Mesh;
use crate::skin::Rest;
use glam::{DVec3, Vec3, Vec4};

/// Morphed vertices; buffers are used again from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Morphed {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    tangents: Vec<Vec4>,
}

impl Morphed {
    /// `v = v₀ + Σ_k w_k Δ_k` for positions, normals and tangents; the mesh itself where no weight differs from 0.
    ///
    /// Directions are not normalised: the deformer does that once. Missing weights count as 0.
    pub fn apply<'a>(&'a mut self, mesh: &'a Mesh, weights: &[f32]) -> Rest<'a> {
        let active = || mesh.targets.iter().zip(weights).filter(|(_, w)| **w != 0.0);
        if active().next().is_none() {
            return Rest { positions: &mesh.positions, normals: &mesh.normals, tangents: &mesh.tangents };
        }
        self.positions.clone_from(&mesh.positions);
        self.normals.clone_from(&mesh.normals);
        self.tangents.clone_from(&mesh.tangents);
        for (target, &w) in active() {
            self.positions.iter_mut().zip(&target.positions).for_each(|(p, d)| *p += *d * w);
            self.normals.iter_mut().zip(&target.normals).for_each(|(n, d)| *n += *d * w);
            self.tangents.iter_mut().zip(&target.tangents).for_each(|(t, d)| *t += (*d * w).extend(0.0));
        }
        Rest { positions: &self.positions, normals: &self.normals, tangents: &self.tangents }
    }
}

/// `v = v₀ + Σ_k w_k Δ_k` for positions alone, in f64.
pub fn positions_f64(mesh: &Mesh, weights: &[f32]) -> Vec<DVec3> {
    let mut out: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
    for (target, &w) in mesh.targets.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
        out.iter_mut().zip(&target.positions).for_each(|(p, d)| *p += d.as_dvec3() * w as f64);
    }
    out
}
