//! A glTF file of any character: what our own rigs, captures and other formats become.
//!
//! Every bone is a node of its name, in the bones' order; meshes that one bone carries hang on its node, skinned ones on nodes of their own
//! behind the bones. Blinn-Phong becomes metallic-roughness, as near as [`look`] gets.

mod look;
mod mesh;

use super::error::{Result, value};
use super::keys::Places;
use super::rewrite::{NewClip, Rewritten};
use crate::asset::Asset;
use crate::character::{Binding, Character, Instance};
use crate::clip::{Clip, Target};
use crate::io::Warning;
use crate::skeleton::{BoneId, Skeleton};
use glam::{Affine3A, Quat, Vec3};
use mesh::Meshes;
pub(super) use mesh::influences;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// A file of the asset with these clips. `pictures` are the bytes of `asset.textures` as PNG, JPEG or WebP, in their order; without them
/// materials go without maps. `extras` are those of glTF's `asset`.
///
/// Importing the file gives the same character: its bones first, in their order, but for nodes that carry meshes. What the format cannot
/// hold is named in the warnings.
///
/// ```
/// use sinew::{asset::Asset, character::Character, io::gltf, skeleton::{BoneDesc, Skeleton}};
/// let (skeleton, _) = Skeleton::new(vec![BoneDesc::new("arm")]).unwrap();
/// let character = Character::new(skeleton, vec![], vec![], vec![], vec![]).unwrap();
/// let (file, warnings) = gltf::write(&Asset { character, ..Asset::default() }, &[], &[], Default::default()).unwrap();
/// assert!(file.json["nodes"][0]["name"] == "arm" && warnings.is_empty());
/// ```
///
/// # Errors
/// [`GltfError`](super::GltfError) where a clip holds angles or Catmull-Rom curves, which glTF has no place for.
pub fn write(
    asset: &Asset,
    pictures: &[Vec<u8>],
    clips: &[NewClip],
    extras: Map<String, Value>,
) -> Result<(Rewritten, Vec<Warning>)> {
    let mut about = json!({"version": "2.0", "generator": concat!("sinew ", env!("CARGO_PKG_VERSION"))});
    if !extras.is_empty() {
        about["extras"] = extras.into();
    }
    let mut out = Rewritten { json: Map::from_iter([("asset".to_owned(), about)]), ..Rewritten::default() };
    let mut warnings = vec![];
    look::write(&mut out, asset, pictures, &mut warnings);
    let nodes = nodes(&mut out, asset, &mut warnings)?;
    let moving: Vec<(Clip, Vec<bool>)> = clips.iter().map(|c| moving(&asset.character, c)).collect();
    let clips: Vec<NewClip> =
        moving.iter().map(|(clip, short)| NewClip { clip, short, replaces: None, carried: None }).collect();
    out.animate(&nodes, &clips, &[], &Value::Null)?;
    // Lists that are empty are against the specification.
    out.json.retain(|_, v| v.as_array().is_none_or(|a| !a.is_empty()));
    Ok((out, warnings))
}

/// The clip without tracks of bones that never move: their nodes have matrices.
fn moving(character: &Character, new: &NewClip) -> (Clip, Vec<bool>) {
    let still = |t: &Target| match t {
        Target::Translation(b) | Target::Rotation(b) | Target::Scale(b) | Target::Xzx(b) => {
            character.skeleton().fixed(*b).is_some()
        }
        Target::Weights { .. } => false,
    };
    let tracks = new.clip.tracks.iter().enumerate().filter(|(_, t)| !still(&t.target));
    let (tracks, short) = tracks.map(|(i, t)| (t.clone(), new.short.get(i) == Some(&true))).unzip();
    (Clip { name: new.clip.name.clone(), tracks }, short)
}

/// Instances that become one mesh: what carries them, and the run of their morph weights.
struct Group<'a> {
    instances: Vec<usize>,
    binding: &'a Binding,
}

/// Bones and meshes as nodes, in a scene.
fn nodes(out: &mut Rewritten, asset: &Asset, warnings: &mut Vec<Warning>) -> Result<Places> {
    let character = &asset.character;
    let skeleton = character.skeleton();
    let mut names = Names::default();
    let mut nodes: Vec<Value> =
        skeleton.ids().map(|b| node(skeleton, b, names.unique(skeleton.name(b)))).collect();
    let mut roots: Vec<usize> =
        skeleton.ids().filter(|b| skeleton.parent(*b).is_none()).map(BoneId::index).collect();
    let groups = groups(asset);
    if roots.len() > 1 && groups.iter().any(|g| spans(skeleton, g.binding)) {
        // The joints of a skin have a root in common.
        nodes.push(json!({"name": names.unique("root"), "children": roots}));
        roots = vec![nodes.len() - 1];
    }
    let mut meshes = Meshes::new(asset);
    let mut skins: Vec<(&[(BoneId, Affine3A)], usize)> = vec![];
    let mut carriers = vec![];
    for group in &groups {
        let first = &character.instances()[group.instances[0]];
        let Some(mesh) = meshes.write(out, &group.instances, warnings) else { continue };
        let name = out.json["meshes"][mesh]["name"].as_str().unwrap_or("mesh").to_owned();
        let carrier = match group.binding {
            Binding::Bone(b) if nodes[b.index()].get("mesh").is_none() => {
                nodes[b.index()]["mesh"] = mesh.into();
                b.index()
            }
            Binding::Bone(b) => {
                nodes.push(json!({"name": names.unique(&name), "mesh": mesh}));
                let last = nodes.len() - 1;
                adopt(&mut nodes[b.index()], last);
                last
            }
            Binding::Skin { palette, .. } => {
                let known = skins.iter().find(|s| s.0 == palette.as_slice()).map(|s| s.1);
                let skin = match known {
                    Some(skin) => skin,
                    None => {
                        skins.push((palette, skin(out, skeleton, palette)?));
                        skins[skins.len() - 1].1
                    }
                };
                nodes.push(json!({"name": names.unique(&name), "mesh": mesh, "skin": skin}));
                roots.push(nodes.len() - 1);
                nodes.len() - 1
            }
        };
        if !character.mesh(first).targets.is_empty() {
            carriers.push((first.first_weight, carrier as u32));
        }
    }
    out.json.insert("nodes".into(), nodes.into());
    if !roots.is_empty() {
        out.json.insert("scenes".into(), json!([{"nodes": roots}]));
        out.json.insert("scene".into(), 0.into());
    }
    Ok(Places { bones: skeleton.ids().map(|b| b.0).collect(), weights: carriers })
}

/// Instances in a row that the same thing carries and the same weights morph.
fn groups(asset: &Asset) -> Vec<Group<'_>> {
    let character = &asset.character;
    let alike = |a: &Instance, b: &Instance| {
        let carried = match (&a.binding, &b.binding) {
            (Binding::Bone(a), Binding::Bone(b)) => a == b,
            (Binding::Skin { palette: a, .. }, Binding::Skin { palette: b, .. }) => a == b,
            _ => false,
        };
        let targets = [a, b].map(|i| character.mesh(i).targets.len());
        carried && targets[0] == targets[1] && (targets[0] == 0 || a.first_weight == b.first_weight)
    };
    let mut out: Vec<Group> = vec![];
    for (i, instance) in character.instances().iter().enumerate() {
        let last = out.last_mut().filter(|g| alike(&character.instances()[g.instances[0]], instance));
        match last {
            Some(group) => group.instances.push(i),
            None => out.push(Group { instances: vec![i], binding: &instance.binding }),
        }
    }
    out
}

/// Whether a skin's bones have no root in common.
fn spans(skeleton: &Skeleton, binding: &Binding) -> bool {
    let Binding::Skin { palette, .. } = binding else { return false };
    let root = |mut b: BoneId| {
        while let Some(p) = skeleton.parent(b) {
            b = p;
        }
        b
    };
    palette.windows(2).any(|w| root(w[0].0) != root(w[1].0))
}

fn node(skeleton: &Skeleton, b: BoneId, name: String) -> Value {
    let mut node = json!({"name": name});
    let rest = skeleton.rest(b);
    match skeleton.fixed(b) {
        Some(m) => node["matrix"] = json!(columns(m)),
        None => {
            let mut put = |key: &str, usual: bool, v: &[f32]| {
                if !usual {
                    node[key] = json!(v);
                }
            };
            put("translation", rest.translation == Vec3::ZERO, &rest.translation.to_array());
            put("rotation", rest.rotation == Quat::IDENTITY, &rest.rotation.normalize().to_array());
            put("scale", rest.scale == Vec3::ONE, &rest.scale.to_array());
        }
    }
    let children: Vec<usize> =
        skeleton.subtree(b).skip(1).filter(|&c| skeleton.parent(BoneId(c as u32)) == Some(b)).collect();
    if !children.is_empty() {
        node["children"] = children.into();
    }
    node
}

pub(super) fn adopt(parent: &mut Value, child: usize) {
    match parent["children"].as_array_mut() {
        Some(list) => list.push(child.into()),
        None => parent["children"] = json!([child]),
    }
}

fn skin(out: &mut Rewritten, skeleton: &Skeleton, palette: &[(BoneId, Affine3A)]) -> Result<usize> {
    let mut seen = BTreeSet::new();
    if let Some((b, _)) = palette.iter().find(|(b, _)| !seen.insert(*b)) {
        let found = format!("bone `{}` twice", skeleton.name(*b));
        return Err(value("a skin", "each bone once in its palette", found));
    }
    let joints: Vec<u32> = palette.iter().map(|(b, _)| b.0).collect();
    let matrices: Vec<f32> = palette.iter().flat_map(|(_, m)| columns(m)).collect();
    let matrices = out.floats(&matrices, "MAT4", 16, false);
    Ok(out.push("skins", json!({"joints": joints, "inverseBindMatrices": matrices})))
}

/// Column by column, with the last row.
pub(super) fn columns(m: &Affine3A) -> [f32; 16] {
    let (a, t) = (m.matrix3, m.translation);
    let column = |c: glam::Vec3A, w: f32| [c.x, c.y, c.z, w];
    let all = [column(a.x_axis, 0.0), column(a.y_axis, 0.0), column(a.z_axis, 0.0), column(t, 1.0)];
    std::array::from_fn(|i| all[i / 4][i % 4])
}

/// Names that stand for one node each.
#[derive(Default)]
struct Names(BTreeMap<String, usize>);

impl Names {
    fn unique(&mut self, name: &str) -> String {
        let mut own = name.to_owned();
        while self.0.contains_key(&own) {
            let count = self.0.entry(name.to_owned()).or_default();
            *count += 1;
            own = format!("{name}.{count}");
        }
        self.0.insert(own.clone(), 0);
        own
    }
}
