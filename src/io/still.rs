//! A character as it stands at one moment: surfaces in world space, for formats that know no bones.

use crate::asset::Asset;
use crate::character::{Binding, Character, Instance, MeshId, Scratch};
use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use crate::mesh::{MaterialId, Mesh, MeshData, MorphTarget};
use crate::pose::Pose;
use crate::skeleton::{BoneDesc, Skeleton};
use crate::skin::Deformed;
use glam::{DVec3, Vec2, Vec3};
use std::collections::BTreeMap;

/// One mesh instance of a [`Still`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// For people.
    pub name: String,
    /// How it looks.
    pub material: Option<MaterialId>,
    /// For each of `V` vertices, which of the points it is.
    pub point: Vec<u32>,
    /// Unit normals; empty or `V` of them.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, (0,0) at the top left; empty or `V` of them.
    pub uvs: Vec<Vec2>,
    /// Triangles of vertices, counter-clockwise in front.
    pub triangles: Vec<[u32; 3]>,
}

/// Surfaces that stand still, metres in world space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Still {
    /// Vertices that move as one are one point, so that what was closed before it was cut for its texture is closed here.
    pub points: Vec<Vec3>,
    /// In the order of the character's instances.
    pub surfaces: Vec<Surface>,
}

impl Still {
    /// Triangles of points, those without an area left out.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.surfaces
            .iter()
            .flat_map(|s| s.triangles.iter().map(|t| t.map(|v| s.point[v as usize])))
            .filter(area)
    }

    /// A normal for each point: the mean of its vertices' normals; none where no surface has any.
    pub fn normals(&self) -> Vec<Vec3> {
        let mut out = vec![Vec3::ZERO; self.points.len()];
        for s in &self.surfaces {
            s.point.iter().zip(&s.normals).for_each(|(p, n)| out[*p as usize] += *n);
        }
        let some = out.iter().any(|n| *n != Vec3::ZERO);
        out.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        if some { out } else { vec![] }
    }
}

/// Three different points.
pub(super) fn area(t: &[u32; 3]) -> bool {
    t[0] != t[1] && t[1] != t[2] && t[2] != t[0]
}

/// Which vertices of a character are one point in every pose.
pub struct Stance<'a> {
    character: &'a Character,
    /// The point of each vertex of each instance.
    point: Vec<Vec<u32>>,
    /// The instance and the vertex that say where each point is.
    first: Vec<(usize, usize)>,
}

impl<'a> Stance<'a> {
    /// Vertices of instances with equal `groups` are one point if they rest at one place and follow the same bones, weights and morph
    /// targets; instances beyond the list stand for themselves.
    pub fn new(character: &'a Character, groups: &[u32]) -> Self {
        let mut out = Self { character, point: vec![], first: vec![] };
        let mut known: BTreeMap<Vec<u32>, u32> = BTreeMap::new();
        for (i, instance) in character.instances().iter().enumerate() {
            let mesh = character.mesh(instance);
            let group = groups.get(i).map_or([1, i as u32], |g| [0, *g]);
            let point = |v: usize| {
                let mut key = group.to_vec();
                let mut put = |p: Vec3| key.extend((p + Vec3::ZERO).to_array().map(f32::to_bits));
                put(mesh.positions[v]);
                mesh.targets.iter().filter_map(|t| t.positions.get(v)).for_each(|p| put(*p));
                match &instance.binding {
                    Binding::Bone(b) => key.push(b.0),
                    Binding::Skin { palette, weights } => {
                        let mut of: Vec<[u32; 2]> = weights
                            .of(v)
                            .filter(|w| w.1 > 0.0)
                            .map(|(b, w)| [palette[b].0.0, w.to_bits()])
                            .collect();
                        of.sort();
                        key.extend(of.iter().flatten());
                    }
                }
                let next = out.first.len() as u32;
                *known.entry(key).or_insert_with(|| {
                    out.first.push((i, v));
                    next
                })
            };
            let points = (0..mesh.positions.len()).map(point).collect();
            out.point.push(points);
        }
        out
    }

    /// How it stands in a pose.
    pub fn at(&self, pose: &Pose) -> Still {
        let c = self.character;
        let posed = c.posed(pose);
        let center = c.center(&posed);
        let (mut scratch, mut out) =
            (Scratch::default(), Still { points: vec![Vec3::ZERO; self.first.len()], ..Still::default() });
        let mut at = self.first.iter().enumerate().peekable();
        for (i, instance) in c.instances().iter().enumerate() {
            let (mesh, mut d) = (c.mesh(instance), Deformed::default());
            c.deform(i, pose, &posed, center, &mut scratch, &mut d);
            while let Some((p, first)) = at.next_if(|f| f.1.0 == i) {
                out.points[p] = (center + d.positions[first.1].as_dvec3()).as_vec3();
            }
            let turned = |t: &[u32; 3]| if d.mirrored { [t[0], t[2], t[1]] } else { *t };
            out.surfaces.push(Surface {
                name: mesh.name.clone(),
                material: mesh.material,
                point: self.point[i].clone(),
                triangles: mesh.triangles.iter().map(turned).collect(),
                normals: d.normals,
                uvs: mesh.uvs[0].clone(),
            });
        }
        out
    }

    /// Where the points are in a pose, in f64.
    pub fn points(&self, pose: &Pose) -> Vec<DVec3> {
        let c = self.character;
        let posed = c.posed(pose);
        let center = c.center(&posed);
        let (mut scratch, mut positions) = (Scratch::default(), vec![]);
        let mut out = Vec::with_capacity(self.first.len());
        let mut at = self.first.iter().peekable();
        for i in 0..c.instances().len() {
            c.positions(i, pose, &posed, center, &mut scratch, &mut positions);
            while let Some(first) = at.next_if(|f| f.0 == i) {
                out.push(center + positions[first.1].as_dvec3());
            }
        }
        out
    }
}

/// A character that stands as `character` does in the first of these poses, and whose one clip runs through them all, `fps` to the second: each further
/// pose is a morph target whose weight rises from the frame before it and falls towards the one after. Between frames vertices so move on
/// straight lines.
///
/// # Panics
/// If there is no pose, or one is of another character.
pub fn frozen(character: &Character, poses: &[Pose], fps: f64, name: &str) -> Character {
    let targets = poses.len() - 1;
    let mut meshes = vec![];
    let mut deformed: Vec<Vec<(Deformed, DVec3)>> = vec![];
    let mut scratch = Scratch::default();
    for pose in poses {
        let posed = character.posed(pose);
        let center = character.center(&posed);
        let each = (0..character.instances().len()).map(|i| {
            let mut d = Deformed::default();
            character.deform(i, pose, &posed, center, &mut scratch, &mut d);
            (d, center)
        });
        deformed.push(each.collect());
    }
    for (i, instance) in character.instances().iter().enumerate() {
        let (first, center) = &deformed[0][i];
        let mut data = MeshData::clone(character.mesh(instance));
        let world = |(d, center): &(Deformed, DVec3)| -> Vec<DVec3> {
            d.positions.iter().map(|p| *center + p.as_dvec3()).collect()
        };
        let base = world(&(first.clone(), *center));
        data.positions = base.iter().map(|p| p.as_vec3()).collect();
        (data.normals, data.tangents) = (first.normals.clone(), first.tangents.clone());
        if first.mirrored {
            data.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let target = |d: &Vec<(Deformed, DVec3)>| {
            let moved = world(&d[i])
                .iter()
                .zip(&data.positions)
                .map(|(p, b)| (*p - b.as_dvec3()).as_vec3())
                .collect();
            let turned = d[i].0.normals.iter().zip(&first.normals).map(|(n, b)| *n - *b).collect();
            MorphTarget { positions: moved, normals: turned, ..MorphTarget::default() }
        };
        data.targets = deformed[1..].iter().map(target).collect();
        meshes.push(Mesh::new(data).expect("a mesh that was one before"));
    }
    let (skeleton, bones) = Skeleton::new(vec![BoneDesc::new(name)]).expect("one bone");
    let instance =
        |i: usize| Instance { mesh: MeshId(i as u32), binding: Binding::Bone(bones[0]), first_weight: 0 };
    let instances = (0..meshes.len()).map(instance).collect();
    let mut clips = vec![];
    if targets > 0 {
        let times = (0..=targets).map(|k| k as f64 / fps).collect();
        let values =
            (0..=targets).flat_map(|k| (0..targets).map(move |t| if t + 1 == k { 1.0 } else { 0.0 }));
        let curve =
            Curve::new(times, values.collect(), targets, Interpolation::Linear).expect("frames in order");
        clips.push(Clip {
            name: name.into(),
            tracks: vec![Track { target: Target::Weights { first: 0 }, curve }],
        });
    }
    Character::new(skeleton, meshes, instances, vec![0.0; targets], clips)
        .expect("parts that were made for each other")
}

/// The name of a surface's material that is unique in its asset.
pub(super) fn material_name(asset: &Asset, id: MaterialId) -> String {
    let name = asset.materials.get(id.0 as usize).map_or("", |m| m.name.as_str());
    let plain: String = name.chars().map(|c| if c.is_whitespace() || c == '#' { '_' } else { c }).collect();
    format!("{plain}_{}", id.0)
}
