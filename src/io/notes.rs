//! The notes' rigs: a JSON file of bones and XZX keys beside a PLY mesh and a table of weights.
//!
//! `bones[]` = `parent_id` (−1: root), `weight_id` (column of the table, −1: none), `length`, `rest_T` (`rest_from_bone`,
//! 4×4 row-major), `xzx_min`/`xzx_max` in degrees (±10¹⁰: free); `fk_animation[]` = `{bone_id, keys: [{t, xzx}]}` in degrees;
//! bones without an entry stay at rest. The table is text: `columns rows`, then numbers column by column.

use super::ply::{self, PlyError};
use super::{Import, MAX_CLOSEST, Options, Warning, read_below, read_file};
use crate::asset::Asset;
use crate::character::{Binding, Character, CharacterError, Instance, MeshId};
use crate::clip::{Clip, Curve, CurveError, Interpolation, Target, Track};
use crate::math::Trs;
use crate::math::spline::Tangents;
use crate::mesh::normals::{self, Weighting};
use crate::mesh::{MaterialId, Mesh, MeshData, MeshError};
use crate::scene::Material;
use crate::skeleton::{BoneDesc, BoneId, Limits, Skeleton, SkeletonError};
use crate::skin::{Weights, WeightsError, bind_closest};
use glam::{Affine3A, DAffine3, DMat3, DVec3, Mat3A, Quat, Vec3};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Why a rig cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum NotesError {
    /// A file that cannot be opened.
    #[error("{path}: {source}")]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// JSON that is none, or not of this form.
    #[error("not a rig of the notes: {0}")]
    Json(#[from] serde_json::Error),
    /// A file name that leaves the rig's folder.
    #[error("{field}: `{name}` leaves the rig's folder; put the file beside the rig")]
    Outside {
        /// Which entry.
        field: &'static str,
        /// What it says.
        name: String,
    },
    /// The mesh.
    #[error("{path}: {source}")]
    Ply {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        source: PlyError,
    },
    /// The table of weights.
    #[error("{path}: {why}")]
    Table {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// A rig without a table that is too large to bind by distance.
    #[error(
        "weights.file: there is no table, and {vertices} vertices with {bones} bones are more than the {MAX_CLOSEST} pairs \
         that are bound by distance; supply the table"
    )]
    Closest {
        /// Of the mesh.
        vertices: usize,
        /// That move vertices.
        bones: usize,
    },
    /// A bone that cannot stand as it says.
    #[error("bones[{bone}]: {why}")]
    Bone {
        /// Which bone.
        bone: usize,
        /// What is wrong.
        why: String,
    },
    /// Keys that make no curve.
    #[error("fk_animation[{entry}]: {why}")]
    Keys {
        /// Which entry.
        entry: usize,
        /// What is wrong.
        why: String,
    },
    /// Bones that make no tree.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// A mesh that does not hold together.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Weights that cannot be repaired.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// Parts that do not fit.
    #[error(transparent)]
    Character(#[from] CharacterError),
}

#[derive(Deserialize)]
struct File {
    model: FileRef,
    weights: FileRef,
    bones: Vec<Bone>,
    #[serde(default)]
    fk_animation: Vec<Animation>,
    ik_constraints: Option<serde_json::Value>,
}

#[derive(Deserialize)]
struct FileRef {
    file: String,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
struct Bone {
    parent_id: i64,
    weight_id: i64,
    length: f64,
    #[serde(rename = "rest_T")]
    rest: [[f64; 4]; 4],
    xzx_min: Option<[f64; 3]>,
    xzx_max: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Animation {
    bone_id: usize,
    keys: Vec<Key>,
}

#[derive(Deserialize)]
struct Key {
    t: f64,
    xzx: [f64; 3],
}

/// Read a rig of the notes and the files beside it.
///
/// # Errors
/// [`NotesError`] names the file and the entry; so does a link that leads out of the rig's folder. A missing table of weights is a [`Warning`]: parts then follow their closest
/// bone.
pub fn import(path: &Path, options: &Options) -> Result<Import, NotesError> {
    let bytes = read_file(path).map_err(|source| NotesError::Read { path: path.into(), source })?;
    import_bytes(&bytes, path.parent().unwrap_or(Path::new("")), options)
}

/// [`import`] of bytes, with the folder in which the other files lie.
///
/// # Errors
/// As [`import`].
pub fn import_bytes(bytes: &[u8], folder: &Path, _options: &Options) -> Result<Import, NotesError> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let file: File = serde_json::from_slice(bytes)?;
    let mut warnings = Vec::new();
    if file.ik_constraints.is_some() {
        let message = "goals for inverse kinematics are left out".to_string();
        warnings.push(Warning { place: "ik_constraints".into(), message });
    }

    // Bones: rest transforms relative to the parent, composed in f64.
    let rest_from_bone = rest_transforms(&file.bones)?;
    let (skeleton, of) = Skeleton::new(describe(&file.bones, &rest_from_bone)?)?;

    // The mesh, with normals that the file does not have.
    let model = beside(folder, "model.file", &file.model.file)?;
    let read =
        read_below(folder, &model).map_err(|source| NotesError::Read { path: model.clone(), source })?;
    let ply = ply::parse(&read).map_err(|source| NotesError::Ply { path: model, source })?;
    let mesh = mesh(&file.model.file, &ply)?;

    let binding = bind(&file, folder, &rest_from_bone, &of, &mesh, &mut warnings)?;
    let instance = Instance { mesh: MeshId(0), binding, first_weight: 0 };
    let clips = clips(&file.fk_animation, &of)?;
    let character = Character::new(skeleton, vec![mesh], vec![instance], vec![], clips)?;
    let asset = Asset { character, materials: vec![Material::default()], ..Default::default() };
    Ok(Import { asset, format: "notes rig".into(), warnings, ..Default::default() })
}

/// A path beside the rig; anything but a plain relative name is refused.
fn beside(folder: &Path, field: &'static str, name: &str) -> Result<PathBuf, NotesError> {
    super::beside(folder, name).ok_or_else(|| NotesError::Outside { field, name: name.into() })
}

fn rest_transforms(bones: &[Bone]) -> Result<Vec<DAffine3>, NotesError> {
    let one = |(bone, b): (usize, &Bone)| {
        let m = b.rest;
        let col = |c: usize| DVec3::new(m[0][c], m[1][c], m[2][c]);
        let axes = DMat3::from_cols(col(0), col(1), col(2));
        let off = (axes.transpose() * axes - DMat3::IDENTITY).to_cols_array();
        if !off.iter().all(|x| x.abs() < 1e-4) || axes.determinant() < 0.0 || !col(3).is_finite() {
            let why =
                "rest_T is no rotation and translation; its first three columns must be orthonormal".into();
            return Err(NotesError::Bone { bone, why });
        }
        Ok(DAffine3 { matrix3: axes, translation: col(3) })
    };
    bones.iter().enumerate().map(one).collect()
}

fn describe(bones: &[Bone], rest_from_bone: &[DAffine3]) -> Result<Vec<BoneDesc>, NotesError> {
    let one = |(bone, b): (usize, &Bone)| {
        let parent = match b.parent_id {
            -1 => None,
            p if p >= 0 && (p as usize) < bones.len() => Some(p as usize),
            p => {
                let why = format!("parent_id {p}: expected −1 or 0…{}", bones.len() - 1);
                return Err(NotesError::Bone { bone, why });
            }
        };
        let local = match parent {
            Some(p) => rest_from_bone[p].inverse() * rest_from_bone[bone],
            None => rest_from_bone[bone],
        };
        let (_, rotation, translation) = local.to_scale_rotation_translation();
        let rest = Trs {
            translation: translation.as_vec3(),
            rotation: rotation.normalize().as_quat(),
            scale: Vec3::ONE,
        };
        let limit = |l: [f64; 3]| Vec3::from_array(l.map(|d| d.to_radians() as f32));
        let limits = b.xzx_min.zip(b.xzx_max).map(|(lo, hi)| Limits { min: limit(lo), max: limit(hi) });
        let length = b.length as f32;
        Ok(BoneDesc {
            name: format!("bone {bone}"),
            parent,
            rest,
            fixed: None,
            length,
            aim: Quat::IDENTITY,
            limits,
        })
    };
    bones.iter().enumerate().map(one).collect()
}

fn mesh(name: &str, ply: &ply::Ply) -> Result<Mesh, MeshError> {
    let positions: Vec<Vec3> = ply.positions.iter().map(|p| p.as_vec3()).collect();
    let normals = normals::vertex(&positions, &ply.triangles, Weighting::Angle);
    Mesh::new(MeshData {
        name: name.into(),
        positions,
        normals,
        triangles: ply.triangles.clone(),
        material: Some(MaterialId(0)),
        ..Default::default()
    })
}

fn bind(
    file: &File,
    folder: &Path,
    rest_from_bone: &[DAffine3],
    of: &[BoneId],
    mesh: &Mesh,
    warnings: &mut Vec<Warning>,
) -> Result<Binding, NotesError> {
    // Bones that the table has a column for, by column.
    let driving: Vec<usize> = (0..file.bones.len()).filter(|&b| file.bones[b].weight_id >= 0).collect();
    let palette = |bones: &[usize]| {
        bones.iter().map(|&b| (of[b], narrow(&rest_from_bone[b].inverse()))).collect::<Vec<_>>()
    };
    let path = beside(folder, "weights.file", &file.weights.file)?;
    let text = match read_below(folder, &path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            let message = format!("`{}` is missing; each part follows its closest bone", file.weights.file);
            warnings.push(Warning { place: "weights.file".into(), message });
            let weights = closest(file, rest_from_bone, &driving, mesh)?;
            return Ok(Binding::Skin { palette: palette(&driving), weights });
        }
        Err(source) => return Err(NotesError::Read { path, source }),
    };
    let wrong = |why| NotesError::Table { path: path.clone(), why };
    let text = std::str::from_utf8(&text).map_err(|e| wrong(format!("no text: {e}")))?;
    let table = parse_table(text).map_err(wrong)?;
    let v = mesh.positions.len();
    if table.rows != v {
        return Err(wrong(format!("expected {v} rows, one a vertex, found {}", table.rows)));
    }
    if let Some(&b) = driving.iter().find(|&&b| file.bones[b].weight_id as usize >= table.columns) {
        let why =
            format!("weight_id {} but the table has {} columns", file.bones[b].weight_id, table.columns);
        return Err(NotesError::Bone { bone: b, why });
    }
    // Each vertex gets a number a bone: bones that share columns must not make more of them than the table holds.
    let k = driving.len();
    if k > table.columns {
        return Err(wrong(format!(
            "{} columns for {k} bones with a weight_id; each needs its own",
            table.columns
        )));
    }
    let bones: Vec<u32> = (0..v).flat_map(|_| 0..k as u32).collect();
    let column = |b: usize| &table.values[file.bones[b].weight_id as usize * v..][..v];
    let weights: Vec<f32> = (0..v).flat_map(|i| driving.iter().map(move |&b| column(b)[i])).collect();
    let (weights, report) = Weights::new(k.max(1), &bones, &weights, k, 0)?;
    if report.scaled + report.negative + report.empty > 0 {
        let message = format!(
            "{} vertices scaled to sum 1 (worst off by {:.1e}), {} negative weights dropped, {} vertices without weight",
            report.scaled, report.worst_sum, report.negative, report.empty
        );
        warnings.push(Warning { place: "weights".into(), message });
    }
    Ok(Binding::Skin { palette: palette(&driving), weights })
}

fn closest(
    file: &File,
    rest_from_bone: &[DAffine3],
    driving: &[usize],
    mesh: &Mesh,
) -> Result<Weights, NotesError> {
    let (vertices, bones) = (mesh.positions.len(), driving.len());
    if vertices.saturating_mul(bones) > MAX_CLOSEST {
        return Err(NotesError::Closest { vertices, bones });
    }
    let segment = |&b: &usize| {
        let m = &rest_from_bone[b];
        [m.translation, m.transform_point3(DVec3::X * file.bones[b].length)].map(|p| p.as_vec3())
    };
    let segments: Vec<_> = driving.iter().map(segment).collect();
    Ok(bind_closest(&mesh.positions, &mesh.triangles, &segments)?)
}

struct Table {
    columns: usize,
    rows: usize,
    values: Vec<f32>,
}

fn parse_table(text: &str) -> Result<Table, String> {
    let mut words = text.split_ascii_whitespace();
    let mut size = |what| match words.next().map(str::parse::<usize>) {
        Some(Ok(n)) => Ok(n),
        other => Err(format!("expected the number of {what} at the top, found {other:?}")),
    };
    let (columns, rows) = (size("columns")?, size("rows")?);
    let values = words.enumerate().map(|(i, w)| w.parse().map_err(|_| format!("number {i} is `{w}`")));
    let values: Vec<f32> = values.collect::<Result<_, _>>()?;
    match columns.checked_mul(rows) {
        Some(n) if n == values.len() => Ok(Table { columns, rows, values }),
        _ => Err(format!("{columns} columns of {rows} rows expected, found {} numbers", values.len())),
    }
}

fn clips(animations: &[Animation], of: &[BoneId]) -> Result<Vec<Clip>, NotesError> {
    let one = |(entry, a): (usize, &Animation)| {
        let fail = |why| NotesError::Keys { entry, why };
        let bone = of.get(a.bone_id);
        let bone = bone.ok_or_else(|| fail(format!("bone_id {} of {} bones", a.bone_id, of.len())))?;
        let times = a.keys.iter().map(|k| k.t).collect();
        let angles = a.keys.iter().flat_map(|k| k.xzx.map(|d| d.to_radians() as f32)).collect();
        let curve = Curve::new(times, angles, 3, Interpolation::CatmullRom(Tangents::Notes));
        let curve = curve.map_err(|e: CurveError| fail(e.to_string()))?;
        Ok(Track { target: Target::Xzx(*bone), curve })
    };
    let tracks = animations.iter().enumerate().filter(|(_, a)| !a.keys.is_empty());
    let tracks: Vec<Track> = tracks.map(one).collect::<Result<_, NotesError>>()?;
    Ok(if tracks.is_empty() { vec![] } else { vec![Clip { name: "fk_animation".into(), tracks }] })
}

fn narrow(m: &DAffine3) -> Affine3A {
    let c = m.matrix3;
    Affine3A {
        matrix3: Mat3A::from_cols(c.x_axis.as_vec3a(), c.y_axis.as_vec3a(), c.z_axis.as_vec3a()),
        translation: m.translation.as_vec3a(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn neither_links_out_of_the_folder_nor_pipes_are_read() {
        let home = std::env::temp_dir().join(format!("sinew-notes-{}", std::process::id()));
        std::fs::create_dir_all(home.join("rig")).unwrap();
        std::fs::write(home.join("out.ply"), "ply").unwrap();
        std::os::unix::fs::symlink("../out.ply", home.join("rig/link.ply")).unwrap();
        std::process::Command::new("mkfifo").arg(home.join("rig/pipe.ply")).status().unwrap();
        let error = |model: &str| {
            let rig = format!(
                r#"{{"model": {{"file": "{model}"}}, "weights": {{"file": "w"}}, "bones": [{{"parent_id": -1, "weight_id": 0,
                "length": 1, "rest_T": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}}]}}"#
            );
            import_bytes(rig.as_bytes(), &home.join("rig"), &Options::default()).unwrap_err().to_string()
        };
        let (link, pipe) = (error("link.ply"), error("pipe.ply"));
        std::fs::remove_dir_all(&home).unwrap();
        assert!(link.contains("link.ply: it is a link to "), "{link}");
        assert!(pipe.contains("pipe.ply: this is a pipe"), "{pipe}");
    }

    #[test]
    fn too_many_pairs_for_binding_by_distance_are_an_error() {
        let identity = [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.], [0., 0., 0., 1.]];
        let bone = || Bone {
            parent_id: -1,
            weight_id: 0,
            length: 1.0,
            rest: identity,
            xzx_min: None,
            xzx_max: None,
        };
        let file = |n| File {
            model: FileRef { file: "m.ply".into() },
            weights: FileRef { file: "w".into() },
            bones: (0..n).map(|_| bone()).collect(),
            fk_animation: vec![],
            ik_constraints: None,
        };
        let mesh =
            Mesh::new(MeshData { positions: vec![Vec3::ZERO; 1 << 16], ..Default::default() }).unwrap();
        let bind = |n: usize| {
            let file = file(n);
            closest(&file, &rest_transforms(&file.bones).unwrap(), &(0..n).collect::<Vec<_>>(), &mesh)
        };
        assert!(bind(2).is_ok());
        let error = bind((1 << 10) + 1).unwrap_err().to_string();
        assert!(
            error.starts_with("weights.file: there is no table, and 65536 vertices with 1025 bones"),
            "{error}"
        );
    }
}
