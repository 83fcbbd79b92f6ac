//! A character as it stands at one moment: surfaces in world space, for formats that know no bones.

use crate::asset::Asset;
use crate::character::{Binding, Character, Scratch};
use crate::mesh::MaterialId;
use crate::pose::Pose;
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

/// The name of a surface's material that is unique in its asset.
pub(super) fn material_name(asset: &Asset, id: MaterialId) -> String {
    let name = asset.materials.get(id.0 as usize).map_or("", |m| m.name.as_str());
    let plain: String = name.chars().map(|c| if c.is_whitespace() || c == '#' { '_' } else { c }).collect();
    format!("{plain}_{}", id.0)
}
