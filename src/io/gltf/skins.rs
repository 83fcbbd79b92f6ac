//! Skins: palettes of joints and inverse bind matrices, and the weights of vertices.

use super::accessor::Elements;
use super::attributes::Source;
use super::document::Document;
use super::error::{GltfError, Result, entry, value};
use super::nodes::{Nodes, bone};
use super::warnings::Warnings;
use crate::character::Binding;
use crate::skeleton::BoneId;
use crate::skin::Weights;
use ::gltf::json::accessor::Type;
use ::gltf::json::mesh::Semantic;
use glam::Affine3A;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

type Palette = Vec<(BoneId, Affine3A)>;

/// Palettes, each built once.
#[derive(Default)]
pub(super) struct Skins(BTreeMap<usize, Palette>);

impl Skins {
    /// Bind a primitive's vertices to a skin.
    pub fn bind(
        &mut self,
        doc: &Document,
        nodes: &Nodes,
        (node, skin): (usize, usize),
        influences: &Influences,
        count: usize,
        place: &str,
        w: &mut Warnings,
    ) -> Result<Binding> {
        let palette = match self.0.entry(skin) {
            Entry::Occupied(done) => done.into_mut(),
            Entry::Vacant(slot) => slot.insert(palette(doc, nodes, skin, &format!("nodes[{node}].skin"), w)?),
        };
        let Influences { per_vertex, joints, weights } = influences;
        if joints.len() != count * per_vertex {
            let expected = format!("joints and weights for {count} vertices");
            return Err(value(place, expected, (joints.len() / per_vertex).to_string()));
        }
        doc.charge(palette.len() as u64 * 64 + joints.len() as u64 * 6, place)?;

        // Vertices without weight follow their first joint, as in other players.
        let mut empty = 0;
        let mut weights = weights.clone();
        for (w, j) in weights.chunks_exact_mut(*per_vertex).zip(joints.chunks_exact(*per_vertex)) {
            if w.iter().all(|&w| w == 0.0) && (j[0] as usize) < palette.len() {
                empty += 1;
                w[0] = 1.0;
            }
        }
        let (weights, report) = Weights::new(*per_vertex, joints, &weights, palette.len(), 0)
            .map_err(|source| GltfError::Weights { place: place.into(), source })?;
        if empty + report.empty > 0 {
            let n = empty + report.empty;
            w.push(place, format!("{n} vertices have no weight; they follow their first joint"));
        }
        if report.scaled > 0 {
            let (n, sum) = (report.scaled, report.worst_sum);
            w.push(
                place,
                format!("weights of {n} vertices do not add up to 1 (off by up to {sum:.3}); scaled"),
            );
        }
        if report.negative > 0 {
            w.push(place, format!("{} weights are negative; set to 0", report.negative));
        }
        Ok(Binding::Skin { palette: palette.clone(), weights })
    }
}

/// Joints with their inverse bind matrices; identities where the skin has none.
fn palette(doc: &Document, nodes: &Nodes, skin: usize, place: &str, w: &mut Warnings) -> Result<Palette> {
    let json = entry(&doc.root.skins, skin, "skin", || place.into())?;
    let at = format!("skins[{skin}]");
    if json.joints.is_empty() {
        return Err(value(format!("{at}.joints"), "at least one joint", "none"));
    }
    let inverse = match json.inverse_bind_matrices {
        Some(i) => {
            let place = format!("{at}.inverseBindMatrices");
            let m = doc.floats(i.value(), &[Type::Mat4], &place)?;
            if m.len() < json.joints.len() {
                let expected = format!("{} matrices, one a joint", json.joints.len());
                return Err(value(place, expected, m.len().to_string()));
            }
            Some((m, place))
        }
        None => None,
    };
    let mut out = Vec::with_capacity(json.joints.len());
    for (k, joint) in json.joints.iter().enumerate() {
        let bone = bone(nodes, joint.value(), || format!("{at}.joints[{k}]"))?;
        let matrix = match &inverse {
            Some((m, place)) => affine(&m.values[16 * k..16 * k + 16], &format!("{place}[{k}]"), w)?,
            None => Affine3A::IDENTITY,
        };
        out.push((bone, matrix));
    }
    Ok(out)
}

fn affine(m: &[f32], place: &str, w: &mut Warnings) -> Result<Affine3A> {
    if let Some(k) = m.iter().position(|x| !x.is_finite()) {
        return Err(value(place, "finite numbers", format!("{} at element {k}", m[k])));
    }
    if m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || (m[15] - 1.0).abs() > 1e-5 {
        w.push(place, "its last row is not 0, 0, 0, 1; the row is ignored");
    }
    let columns = [m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10], m[12], m[13], m[14]];
    Ok(Affine3A::from_cols_array(&columns))
}

/// Joints and weights of a primitive's vertices.
pub(super) struct Influences {
    per_vertex: usize,
    joints: Vec<u32>,
    weights: Vec<f32>,
}

/// All sets of joints and weights, side by side; `None` without any.
pub(super) fn influences(doc: &Document, source: &Source, place: &str) -> Result<Option<Influences>> {
    let mut sets = Vec::new();
    for set in 0.. {
        let joints = source.integers(Semantic::Joints(set), &[Type::Vec4])?;
        let weights = source.floats(Semantic::Weights(set), &[Type::Vec4])?;
        let (Some(j), Some(w)) = (joints, weights) else { break };
        if j.len() != w.len() {
            let at = format!("{place}.attributes.WEIGHTS_{set}");
            return Err(value(at, format!("as many weights as joints ({})", j.len()), w.len().to_string()));
        }
        sets.push((j, w));
    }
    if sets.len() < 2 {
        let one = |(j, w): (Elements<u32>, Elements<f32>)| (j.values, w.values);
        let first = sets.pop().map(one);
        return Ok(first.map(|(joints, weights)| Influences { per_vertex: 4, joints, weights }));
    }
    let count = sets.iter().map(|s| s.0.len()).min().unwrap_or(0);
    doc.charge((count * sets.len()) as u64 * 32, place)?;
    let mut out = Influences { per_vertex: 4 * sets.len(), joints: Vec::new(), weights: Vec::new() };
    for v in 0..count {
        for (j, w) in &sets {
            out.joints.extend_from_slice(&j.values[4 * v..4 * v + 4]);
            out.weights.extend_from_slice(&w.values[4 * v..4 * v + 4]);
        }
    }
    Ok(Some(out))
}
