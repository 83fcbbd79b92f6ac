//! What became of vertices, on the bones that they had before.

use crate::character::{Binding, Character, Instance, MeshId};
use crate::io::Import;
use crate::mesh::{Mesh, MeshData};
use crate::skeleton::BoneId;
use glam::Affine3A;
use std::collections::BTreeMap;

/// The character of `import` with the vertices of `other`, whose file was made of the same one by
/// [`Rewritten::quantize`](crate::io::gltf::Rewritten::quantize): bones, clips and the order of instances stay, so that one pose moves both.
/// None where one file shows what the other does not.
pub fn vertices_of(import: &Import, other: &Import) -> Option<Character> {
    let (c, from) = (&import.asset.character, &other.asset.character);
    let bone_of: BTreeMap<u32, BoneId> =
        import.nodes.iter().zip(c.skeleton().ids()).map(|(n, b)| (*n, b)).collect();
    let node = |b: BoneId| other.nodes[b.index()];
    // The node that carried a mesh before, if that was another.
    let carrier = |node_now: u32| -> Option<u32> {
        let now = from.skeleton().ids().find(|b| node(*b) == node_now)?;
        from.skeleton().parent(now).map(node)
    };
    let mut found: BTreeMap<(u32, u32, u32), usize> = BTreeMap::new();
    for (i, p) in other.primitives.iter().enumerate() {
        let known = (p.node as usize) < import.nodes.len();
        let node = if known { p.node } else { carrier(p.node)? };
        found.insert((node, p.mesh, p.primitive), i);
    }
    let (mut meshes, mut instances) = (vec![], vec![]);
    for (p, old) in import.primitives.iter().zip(c.instances()) {
        let new = &from.instances()[*found.get(&(p.node, p.mesh, p.primitive))?];
        let mut mesh = from.mesh(new).clone();
        let binding = match &new.binding {
            Binding::Bone(b) => {
                let own = bone_of.get(&node(*b));
                if own.is_none() {
                    mesh = moved(&mesh, &from.skeleton().rest(*b).to_affine())?;
                }
                Binding::Bone(*own.or_else(|| bone_of.get(&p.node))?)
            }
            Binding::Skin { palette, weights } => {
                let place = |(b, m): &(BoneId, Affine3A)| Some((*bone_of.get(&node(*b))?, *m));
                Binding::Skin {
                    palette: palette.iter().map(place).collect::<Option<_>>()?,
                    weights: weights.clone(),
                }
            }
        };
        meshes.push(mesh);
        instances.push(Instance {
            mesh: MeshId(instances.len() as u32),
            binding,
            first_weight: old.first_weight,
        });
    }
    let rest = c.rest_pose().weights;
    Character::new(c.skeleton().clone(), meshes, instances, rest, c.clips().to_vec()).ok()
}

/// A mesh in another frame: positions alone, which is all that is measured.
fn moved(mesh: &Mesh, m: &Affine3A) -> Option<Mesh> {
    let mut data: MeshData = (**mesh).clone();
    data.positions.iter_mut().for_each(|p| *p = m.transform_point3(*p));
    for d in data.targets.iter_mut().flat_map(|t| &mut t.positions) {
        *d = m.transform_vector3(*d);
    }
    Mesh::new(data).ok()
}
