//! Meshes and materials of a rig file.

use super::bones::{affine, find, widen};
use super::document::{self, Bind};
use super::error::RigError;
use crate::character::{Binding, Instance, MeshId};
use crate::fk::Posed;
use crate::io::MAX_CLOSEST;
use crate::io::Warning;
use crate::mesh::normals::{self, Weighting};
use crate::mesh::{MaterialId, Mesh, MeshData, MorphTarget};
use crate::scene::{AlphaMode, Material};
use crate::skeleton::{BoneId, Skeleton};
use crate::skin::{Weights, bind_closest};
use glam::{Affine3A, Vec2, Vec3};
use std::collections::BTreeMap;

/// What meshes are bound to: the skeleton, and its bones at rest.
pub struct Rest<'a> {
    pub skeleton: &'a Skeleton,
    pub posed: &'a Posed,
}

/// Influences a vertex beyond which a file is a mistake.
const MAX_INFLUENCES: usize = 32;

/// Runs of morph weights, in the order in which meshes name them.
#[derive(Default)]
pub struct Runs {
    /// First weight of each, and how many.
    all: Vec<(usize, usize)>,
    /// All weights at rest.
    pub rest: Vec<f32>,
}

impl Runs {
    /// Where the weights of a mesh begin.
    pub fn first_weight(&mut self, doc: &document::Mesh) -> Result<usize, RigError> {
        let (width, bad) =
            (doc.targets.len(), |why: String| RigError::value(format!("mesh `{}`", doc.name), why));
        if !doc.weights.is_empty() && doc.weights.len() != width {
            return Err(bad(format!("`weights` has {} entries, expected {width}", doc.weights.len())));
        }
        if doc.weights.iter().any(|w| !w.is_finite()) {
            return Err(bad("a weight is not finite".into()));
        }
        let run = match doc.morph {
            _ if width == 0 => return Ok(0),
            Some(run) if run > self.all.len() => {
                return Err(bad(format!("`morph` is {run}, but the next run is {}", self.all.len())));
            }
            run => run.unwrap_or(self.all.len()),
        };
        if run == self.all.len() {
            self.all.push((self.rest.len(), width));
            self.rest.resize(self.rest.len() + width, 0.0);
        }
        let (first, count) = self.all[run];
        if count != width {
            return Err(bad(format!("has {width} targets, but run {run} has {count}")));
        }
        self.rest[first..first + doc.weights.len()].copy_from_slice(&doc.weights);
        Ok(first)
    }
}

/// One mesh, checked and bound; `first_weight` is still 0.
pub fn mesh(
    id: MeshId,
    doc: &document::Mesh,
    materials: &[document::Material],
    rest: &Rest,
    warnings: &mut Vec<Warning>,
) -> Result<(Mesh, Instance), RigError> {
    let place = format!("mesh `{}`", doc.name);
    let material = doc.material.as_ref().map(|name| material_id(name, materials, &place)).transpose()?;
    let data = MeshData {
        name: doc.name.clone(),
        positions: doc.positions.iter().map(|p| Vec3::from_array(*p)).collect(),
        normals: unit_normals(doc, &place)?,
        uvs: [doc.uvs.iter().map(|p| Vec2::from_array(*p)).collect(), Vec::new()],
        colors: doc.colors.iter().map(|c| c.0).collect(),
        triangles: doc.triangles.clone(),
        targets: doc.targets.iter().map(target).collect(),
        material,
        ..Default::default()
    };
    // Check before anything is computed from the indices.
    let data = Mesh::new(data)?.into_data();
    let mut rows: Vec<u32> = (0..data.positions.len() as u32).collect();
    let data = with_normals(data, doc.crease_deg, &mut rows, &place)?;
    let mesh = Mesh::new(data)?;
    let binding = bind(doc, &mesh, &rows, rest, &place, warnings)?;
    Ok((mesh, Instance { mesh: id, binding, first_weight: 0 }))
}

fn target(doc: &document::Target) -> MorphTarget {
    let list = |of: &[[f32; 3]]| of.iter().map(|d| Vec3::from_array(*d)).collect();
    MorphTarget {
        name: doc.name.clone(),
        positions: list(&doc.positions),
        normals: list(&doc.normals),
        tangents: vec![],
    }
}

fn material_id(name: &str, all: &[document::Material], place: &str) -> Result<MaterialId, RigError> {
    let found = all.iter().position(|m| m.name == name);
    found.map(|i| MaterialId(i as u32)).ok_or_else(|| RigError::Name {
        place: place.into(),
        what: "material",
        name: name.into(),
        why: format!("is none of the {} materials", all.len()),
    })
}

fn unit_normals(doc: &document::Mesh, place: &str) -> Result<Vec<Vec3>, RigError> {
    let list: Vec<Vec3> = doc.normals.iter().map(|n| Vec3::from_array(*n)).collect();
    if let Some(i) = list.iter().position(|n| n.is_finite() && (n.length() - 1.0).abs() > 0.02) {
        let why = format!("normal {i} must have length 1, found {}", list[i].length());
        return Err(RigError::value(place, why));
    }
    // Leave what is of length 1 but for rounding, so that writing and reading again changes nothing.
    let unit = |n: Vec3| if (n.length() - 1.0).abs() <= 1e-6 { n } else { n.normalize_or_zero() };
    Ok(list.into_iter().map(unit).collect())
}

/// Compute normals where there are none. At creases vertices are split; `rows` says which vertex of the file each
/// vertex was.
fn with_normals(
    mut data: MeshData,
    crease_deg: Option<f64>,
    rows: &mut Vec<u32>,
    place: &str,
) -> Result<MeshData, RigError> {
    if !data.normals.is_empty() {
        return match crease_deg {
            None => Ok(data),
            Some(_) => {
                Err(RigError::value(place, "`crease_deg` is for meshes without `normals`; remove one"))
            }
        };
    }
    let Some(crease) = crease_deg.filter(|c| *c < 180.0) else {
        data.normals = normals::vertex(&data.positions, &data.triangles, Weighting::Angle);
        return Ok(data);
    };
    if crease.is_nan() || crease < 0.0 {
        return Err(RigError::value(place, format!("`crease_deg` must be in 0…180, found {crease}")));
    }
    Ok(split(data, crease.to_radians() as f32, rows))
}

/// One vertex for each different normal of the corners that meet at a vertex.
fn split(data: MeshData, crease: f32, rows: &mut Vec<u32>) -> MeshData {
    let corners = normals::corner(&data.positions, &data.triangles, crease);
    let mut places: BTreeMap<(u32, [u32; 3]), u32> = BTreeMap::new();
    let mut out = MeshData { name: data.name, material: data.material, ..Default::default() };
    rows.clear();
    for (t, n) in data.triangles.iter().zip(&corners) {
        let corner = |k: usize| {
            // Normals that differ by rounding alone are one: compare to a thousandth.
            let key = n[k].to_array().map(|x| (x * 1000.0).round() as i32 as u32);
            *places.entry((t[k], key)).or_insert_with(|| {
                rows.push(t[k]);
                out.normals.push(n[k]);
                rows.len() as u32 - 1
            })
        };
        let mut corner = corner;
        let triangle = [corner(0), corner(1), corner(2)];
        out.triangles.push(triangle);
    }
    let pick = |i: &u32| *i as usize;
    let each = |of: &[Vec3]| rows.iter().filter_map(|i| of.get(pick(i)).copied()).collect();
    let split = |t: &MorphTarget| MorphTarget {
        name: t.name.clone(),
        positions: each(&t.positions),
        normals: each(&t.normals),
        tangents: vec![],
    };
    out.targets = data.targets.iter().map(split).collect();
    out.positions = rows.iter().map(|i| data.positions[pick(i)]).collect();
    if !data.uvs[0].is_empty() {
        out.uvs[0] = rows.iter().map(|i| data.uvs[0][pick(i)]).collect();
    }
    if !data.colors.is_empty() {
        out.colors = rows.iter().map(|i| data.colors[pick(i)]).collect();
    }
    out
}

fn bind(
    doc: &document::Mesh,
    mesh: &Mesh,
    rows: &[u32],
    rest: &Rest,
    place: &str,
    warnings: &mut Vec<Warning>,
) -> Result<Binding, RigError> {
    match &doc.bind {
        Bind::Rigid(name) => Ok(Binding::Bone(find(rest.skeleton, name, place)?)),
        Bind::Closest => closest(doc, rows, rest, place),
        Bind::Weights(w) => weighted(doc, w, mesh, rows, rest, place, warnings),
    }
}

fn closest(doc: &document::Mesh, rows: &[u32], rest: &Rest, place: &str) -> Result<Binding, RigError> {
    let skeleton = rest.skeleton;
    if doc.positions.len().saturating_mul(skeleton.len()) > MAX_CLOSEST {
        let why = format!(
            "`closest` compares {} vertices with {} bones; beyond {MAX_CLOSEST} pairs give `weights`",
            doc.positions.len(),
            skeleton.len()
        );
        return Err(RigError::value(place, why));
    }
    let world = |b: BoneId, p: Vec3| rest.posed.world_from_bone(b).transform_point3(p.as_dvec3()).as_vec3();
    let segments: Vec<_> =
        skeleton.ids().map(|b| [world(b, Vec3::ZERO), world(b, skeleton.tip(b))]).collect();
    // Parts are those of the file: splitting at creases must not tear them.
    let positions: Vec<Vec3> = doc.positions.iter().map(|p| Vec3::from_array(*p)).collect();
    let of_file = bind_closest(&positions, &doc.triangles, &segments)
        .map_err(|source| RigError::Weights { mesh: doc.name.clone(), source })?;
    let bones: Vec<u32> =
        rows.iter().map(|r| of_file.of(*r as usize).next().map_or(0, |w| w.0 as u32)).collect();
    let (weights, _) = Weights::new(1, &bones, &vec![1.0; bones.len()], skeleton.len(), 0)
        .map_err(|source| RigError::Weights { mesh: doc.name.clone(), source })?;
    let palette = skeleton.ids().map(|b| (b, bone_from_rest(rest.posed, b))).collect();
    Ok(Binding::Skin { palette, weights })
}

fn weighted(
    doc: &document::Mesh,
    w: &document::Weights,
    mesh: &Mesh,
    rows: &[u32],
    rest: &Rest,
    place: &str,
    warnings: &mut Vec<Warning>,
) -> Result<Binding, RigError> {
    let expect = |what: &str, found: usize, expected: usize| {
        let why = format!("`{what}` has {found} entries, expected {expected}");
        if found == expected { Ok(()) } else { Err(RigError::value(place, why)) }
    };
    expect("vertices", w.vertices.len(), doc.positions.len())?;
    if !w.inverse_bind.is_empty() {
        expect("inverse_bind", w.inverse_bind.len(), w.bones.len())?;
    }
    let most = w.vertices.iter().map(Vec::len).max().unwrap_or(0);
    if most > MAX_INFLUENCES {
        let why = format!("a vertex has {most} influences; at most {MAX_INFLUENCES} are read");
        return Err(RigError::value(place, why));
    }

    // Pad every vertex to the same number of influences.
    let k = most.max(1);
    let (mut bones, mut weights) = (vec![0u32; rows.len() * k], vec![0.0f32; rows.len() * k]);
    for (i, row) in rows.iter().enumerate() {
        for (slot, (bone, weight)) in w.vertices[*row as usize].iter().enumerate() {
            (bones[i * k + slot], weights[i * k + slot]) = (*bone, *weight);
        }
    }
    let (weights, report) = Weights::new(k, &bones, &weights, w.bones.len(), 0)
        .map_err(|source| RigError::Weights { mesh: doc.name.clone(), source })?;
    debug_assert_eq!(weights.vertex_count(), mesh.positions.len());
    let mut warn = |n: usize, what: &str| {
        if n > 0 {
            warnings.push(Warning { place: place.into(), message: format!("{n} vertices {what}") });
        }
    };
    warn(report.scaled, "had weights that did not sum to 1 and were scaled");
    warn(report.negative, "had weights below zero, which were dropped");
    warn(report.empty, "had no weights and were bound to the first bone of the list");

    let mut palette = Vec::with_capacity(w.bones.len());
    for (i, name) in w.bones.iter().enumerate() {
        let bone = find(rest.skeleton, name, place)?;
        let m = w.inverse_bind.get(i).map_or_else(|| bone_from_rest(rest.posed, bone), affine);
        if !m.is_finite() {
            return Err(RigError::value(place, format!("`inverse_bind` of bone `{name}` is not finite")));
        }
        palette.push((bone, m));
    }
    Ok(Binding::Skin { palette, weights })
}

/// The inverse of a bone's frame at rest, so that a rest pose leaves the mesh in place.
pub fn bone_from_rest(posed: &Posed, bone: BoneId) -> Affine3A {
    let m = posed.world_from_bone(bone).inverse();
    let column = |c: glam::DVec3| c.as_vec3();
    let a = m.matrix3;
    let out = Affine3A {
        matrix3: glam::Mat3A::from_cols(
            column(a.x_axis).into(),
            column(a.y_axis).into(),
            column(a.z_axis).into(),
        ),
        translation: column(m.translation).into(),
    };
    // A bone scaled to nothing has no inverse; what it carries stays where it is.
    if out.is_finite() && widen(&out).is_finite() { out } else { Affine3A::IDENTITY }
}

/// One material, without its picture.
pub fn material(doc: &document::Material) -> Result<Material, RigError> {
    let base = Material::default();
    let place = || format!("material `{}`", doc.name);
    let colors = [&doc.diffuse, &doc.specular, &doc.emissive];
    if colors.iter().any(|c| c.is_some_and(|c| !c.0.is_finite())) {
        return Err(RigError::value(place(), "a colour is not finite"));
    }
    let shininess = doc.shininess.unwrap_or(base.shininess);
    if !shininess.is_finite() || shininess < 0.0 {
        let why = format!("`shininess` must be a number of at least 0, found {shininess}");
        return Err(RigError::value(place(), why));
    }
    let diffuse = doc.diffuse.map_or(base.diffuse, |c| c.0);
    Ok(Material {
        name: doc.name.clone(),
        diffuse,
        specular: doc.specular.map_or(base.specular, |c| c.0.truncate()),
        shininess,
        emissive: doc.emissive.map_or(base.emissive, |c| c.0.truncate()),
        alpha: if diffuse.w < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
        double_sided: doc.double_sided,
        unlit: doc.unlit,
        ..base
    })
}
