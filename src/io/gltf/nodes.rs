//! Every node is a bone: the tree, rest transforms, names, and which way a bone points.

use super::document::Document;
use super::error::{GltfError, Result, entry, value};
use super::warnings::Warnings;
use crate::math::{Trs, rotation};
use crate::skeleton::{BoneDesc, BoneId, Skeleton};
use ::gltf::json::scene::Node;
use glam::{Affine3A, DMat3, DQuat, DVec3, Quat, Vec3};
use std::collections::HashSet;

/// Nodes as bones.
pub(super) struct Nodes {
    /// The tree; every node of the file is in it.
    pub skeleton: Skeleton,
    /// The bone that a node became.
    pub bone_of: Vec<BoneId>,
    /// The node that a bone was.
    pub node_of: Vec<u32>,
    /// Nodes of the scene, in the order of the file.
    pub in_scene: Vec<usize>,
}

/// Build the skeleton from all nodes. `animated[node]`: an animation moves its translation, rotation or scale.
pub(super) fn build(doc: &Document, animated: &[bool], w: &mut Warnings) -> Result<Nodes> {
    let nodes = &doc.root.nodes;
    let parents = parents(doc)?;
    let joints = joints(doc);
    let mut descs = Vec::with_capacity(nodes.len());
    let mut taken = HashSet::new();
    for (i, node) in nodes.iter().enumerate() {
        let (rest, fixed) = transform(node, i, animated[i], w)?;
        let name = name(node, i, &mut taken, w);
        descs.push(BoneDesc { parent: parents[i], rest, fixed, ..BoneDesc::new(name) });
    }
    let in_scene = reachable(doc)?;
    let (plain, bone_of) = Skeleton::new(descs.clone())?;
    let mut node_of = vec![0; nodes.len()];
    bone_of.iter().enumerate().for_each(|(node, b)| node_of[b.index()] = node as u32);

    // Aims follow from the children, so they come last, parents first.
    point(&mut descs, &plain, &node_of, doc, &joints);
    let (skeleton, bone_of) = Skeleton::new(descs)?;
    Ok(Nodes { skeleton, bone_of, node_of, in_scene })
}

fn children(node: &Node) -> impl Iterator<Item = usize> + '_ {
    node.children.iter().flatten().map(|c| c.value())
}

fn parents(doc: &Document) -> Result<Vec<Option<usize>>> {
    let nodes = &doc.root.nodes;
    let mut parents = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for (k, child) in children(node).enumerate() {
            let place = || format!("nodes[{i}].children[{k}]");
            entry(nodes, child, "node", place)?;
            if let Some(first) = parents[child].replace(i) {
                let found = format!("node {child}, which is already a child of node {first}");
                return Err(value(place(), "a node without another parent", found));
            }
        }
    }
    Ok(parents)
}

/// Nodes of the default scene, else of the first, else all, in the order of the file.
fn reachable(doc: &Document) -> Result<Vec<usize>> {
    let root = &doc.root;
    let scene = match root.scene {
        Some(s) => Some(entry(&root.scenes, s.value(), "scene", || "scene".into())?),
        None => root.scenes.first(),
    };
    let Some(scene) = scene else { return Ok((0..root.nodes.len()).collect()) };
    let mut seen = vec![false; root.nodes.len()];
    let mut stack: Vec<usize> = Vec::new();
    for (k, n) in scene.nodes.iter().enumerate() {
        entry(&root.nodes, n.value(), "node", || format!("scenes[…].nodes[{k}]"))?;
        stack.push(n.value());
    }
    while let Some(n) = stack.pop() {
        if !std::mem::replace(&mut seen[n], true) {
            stack.extend(children(&root.nodes[n]));
        }
    }
    Ok((0..seen.len()).filter(|&i| seen[i]).collect())
}

fn joints(doc: &Document) -> Vec<bool> {
    let mut joints = vec![false; doc.root.nodes.len()];
    for j in doc.root.skins.iter().flat_map(|s| &s.joints) {
        if let Some(flag) = joints.get_mut(j.value()) {
            *flag = true;
        }
    }
    joints
}

/// A name that no other bone has: the first to come keeps it.
fn name(node: &Node, i: usize, taken: &mut HashSet<String>, w: &mut Warnings) -> String {
    let own = node.name.clone().filter(|n| !n.is_empty());
    let mut name = own.clone().unwrap_or_else(|| format!("node_{i}"));
    while !taken.insert(name.clone()) {
        name = format!("{name}_{i}");
    }
    if own.is_some_and(|o| o != name) {
        w.push(format!("nodes[{i}].name"), "another node has the same name; its index was added");
    }
    name
}

fn transform(node: &Node, i: usize, animated: bool, w: &mut Warnings) -> Result<(Trs, Option<Affine3A>)> {
    let finite = |v: &[f32], field: &str| match v.iter().all(|x| x.is_finite()) {
        true => Ok(()),
        false => Err(value(format!("nodes[{i}].{field}"), "finite numbers of 32 bits", format!("{v:?}"))),
    };
    if let Some(m) = &node.matrix {
        finite(m, "matrix")?;
        return Ok(matrix(m, i, animated, w));
    }
    let mut rest = Trs::IDENTITY;
    if let Some(t) = node.translation {
        finite(&t, "translation")?;
        rest.translation = t.into();
    }
    if let Some(s) = node.scale {
        finite(&s, "scale")?;
        rest.scale = s.into();
    }
    if let Some(q) = node.rotation {
        finite(&q.0, "rotation")?;
        let q = Quat::from_array(q.0);
        if (q.length() - 1.0).abs() > 1e-3 {
            w.push(format!("nodes[{i}].rotation"), "is no unit quaternion; normalised");
        }
        rest.rotation = rotation::unit(q);
    }
    Ok((rest, None))
}

/// A matrix as translation, rotation and scale where these reproduce it to 1e-6; else as it is.
fn matrix(m: &[f32; 16], i: usize, animated: bool, w: &mut Warnings) -> (Trs, Option<Affine3A>) {
    let place = || format!("nodes[{i}].matrix");
    if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
        w.push(place(), "its last row is not 0, 0, 0, 1; the row is ignored");
    }
    let column = |c: usize| DVec3::new(m[4 * c] as f64, m[4 * c + 1] as f64, m[4 * c + 2] as f64);
    let linear = DMat3::from_cols(column(0), column(1), column(2));
    let mut scale = DVec3::new(linear.x_axis.length(), linear.y_axis.length(), linear.z_axis.length());
    if linear.determinant() < 0.0 {
        scale.x = -scale.x;
    }
    let axes = DMat3::from_cols(linear.x_axis / scale.x, linear.y_axis / scale.y, linear.z_axis / scale.z);
    let turn = match axes.is_finite() {
        true => DQuat::from_mat3(&axes).normalize(),
        false => DQuat::IDENTITY,
    };
    let rest = Trs {
        translation: column(3).as_vec3(),
        rotation: if turn.is_finite() { turn.as_quat() } else { Quat::IDENTITY },
        scale: scale.as_vec3(),
    };

    // Compare in f64 what the three parts make with what the file says.
    let again = DMat3::from_quat(rest.rotation.as_dquat().normalize()) * DMat3::from_diagonal(scale);
    let size = linear.to_cols_array().iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    let error = (again - linear).to_cols_array().iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    if error <= 1e-6 * size {
        return (rest, None);
    }
    if animated {
        w.push(
            place(),
            "is sheared or flattened but animated; only translation, rotation and scale were kept",
        );
        return (rest, None);
    }
    let fixed = Affine3A::from_cols_array(&[
        m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10], m[12], m[13], m[14],
    ]);
    (rest, Some(fixed))
}

/// Point each bone from its origin to the mean of its children, joints before others. A leaf goes on as its parent does.
fn point(descs: &mut [BoneDesc], tree: &Skeleton, node_of: &[u32], doc: &Document, joints: &[bool]) {
    let origin = |d: &BoneDesc| d.fixed.map_or(d.rest.translation, |m| m.translation.into());
    for &node in node_of {
        let i = node as usize;
        let all: Vec<usize> = children(&doc.root.nodes[i]).collect();
        let only: Vec<usize> = all.iter().copied().filter(|&c| joints[c]).collect();
        let towards = if only.is_empty() { all } else { only };
        let sum = towards.iter().fold(DVec3::ZERO, |s, &c| s + origin(&descs[c]).as_dvec3());
        let mean = (sum / towards.len().max(1) as f64).as_vec3();
        let tip = match mean.length() > 1e-9 {
            true => mean,
            false => inherited(descs, i),
        };
        // Scales divide a tip down a chain of leaves; one that became infinite has no meaning.
        let tip = if tip.length().is_finite() { tip } else { Vec3::ZERO };
        descs[i].length = tip.length();
        if let Some(direction) = tip.try_normalize() {
            descs[i].aim = rotation::unit(Quat::from_rotation_arc(Vec3::X, direction));
        }
    }
    debug_assert_eq!(tree.len(), descs.len());
}

/// The parent's tip vector, seen from the bone.
fn inherited(descs: &[BoneDesc], i: usize) -> Vec3 {
    let Some(parent) = descs[i].parent else { return Vec3::ZERO };
    let p = &descs[parent];
    let tip = p.aim * Vec3::new(p.length, 0.0, 0.0);
    let scale = descs[i].rest.scale.abs().max_element();
    let turned = descs[i].rest.rotation.conjugate() * tip;
    if scale > 1e-9 { turned / scale } else { turned }
}

/// The bone of a node.
pub(super) fn bone(nodes: &Nodes, node: usize, place: impl FnOnce() -> String) -> Result<BoneId> {
    let count = nodes.bone_of.len();
    nodes.bone_of.get(node).copied().ok_or_else(|| GltfError::Index {
        place: place(),
        what: "node",
        index: node,
        count,
    })
}
