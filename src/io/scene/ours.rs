//! Scenes of ours (`rigs/scenes/README.md` describes every field): a character and its clip, light, materials, shapes and a camera.
//!
//! A key that the format does not have is an error that names it, because hand-written files have typos.

use super::{SceneError, point, vector};
use crate::io::look_json::{self, LookError, LookFile};
use crate::io::{Import, Options, read_import};
use crate::scene::{Geometry, Material, Shape};
use glam::{DVec3, Vec3};
use serde::Deserialize;
use std::path::{Component, Path};

/// Shapes that one scene may have: rays look at all of them.
pub const MAX_SHAPES: usize = 4096;

/// What a file says beside its character; what it leaves out is `None` or empty.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct SceneFile {
    /// Which clip.
    pub clip: Option<Clip>,
    /// Seconds of a single picture.
    pub at: Option<f64>,
    /// Light, background and changes of the character's materials.
    pub look: LookFile,
    /// What shapes are made of.
    pub materials: Vec<Material>,
    /// Spheres, planes and triangles, world space; their materials index `materials`.
    pub shapes: Vec<Shape>,
    /// The eye.
    pub camera: Option<View>,
    /// Pixels a row, and rows.
    pub size: Option<[usize; 2]>,
    /// Samples a pixel.
    pub samples: Option<usize>,
    /// How often light is followed through mirrors and glass.
    pub depth: Option<usize>,
}

/// Which clip.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "expected a clip's name or index")]
pub enum Clip {
    /// By its index.
    Index(usize),
    /// By its name.
    Name(String),
}

/// Where the camera stands; angles in radians, 0 for a parallel projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// At a place.
    LookAt {
        /// Where it stands, metres.
        eye: DVec3,
        /// What it looks at.
        target: DVec3,
        /// Which way is up.
        up: Vec3,
        /// Vertical field of view.
        fov_y: f32,
    },
    /// Around the character, all of which it sees.
    Orbit {
        /// Around the vertical, 0 before the character.
        yaw: f32,
        /// Above the horizon.
        pitch: f32,
        /// Vertical field of view.
        fov_y: f32,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    sinew_scene: u32,
    character: Option<String>,
    clip: Option<Clip>,
    at: Option<f64>,
    look: Option<look_json::Document>,
    #[serde(default)]
    materials: Vec<look_json::MaterialDoc>,
    #[serde(default)]
    shapes: Vec<ShapeDoc>,
    camera: Option<CameraDoc>,
    size: Option<[usize; 2]>,
    samples: Option<usize>,
    depth: Option<usize>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ShapeDoc {
    material: Option<String>,
    sphere: Option<Sphere>,
    plane: Option<Plane>,
    triangle: Option<[[f64; 3]; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sphere {
    center: [f64; 3],
    radius: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Plane {
    point: [f64; 3],
    normal: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraDoc {
    eye: Option<[f64; 3]>,
    target: Option<[f64; 3]>,
    up: Option<[f64; 3]>,
    yaw_deg: Option<f32>,
    pitch_deg: Option<f32>,
    fov_deg: Option<f32>,
}

/// Read a scene of ours and its character.
pub(crate) fn import(bytes: &[u8], folder: &Path, options: &Options) -> Result<Import, SceneError> {
    let (scene, character) = from_bytes(bytes)?;
    let mut import = match character {
        Some(name) => self::character(&name, folder, options)?,
        None => Import::default(),
    };
    import.format = match import.format.as_str() {
        "" => "sinew scene".into(),
        of => format!("sinew scene of a {of}"),
    };
    import.setting = Some(super::Setting::Ours(Box::new(scene)));
    Ok(import)
}

/// A file in the folder above the scene's, or below.
fn character(name: &str, folder: &Path, options: &Options) -> Result<Import, SceneError> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = folder.join(name);
    let failed = |source| SceneError::Read { place: "character".into(), path: path.clone(), source };
    let real = path.canonicalize().map_err(failed)?;
    let home = folder.join("..").canonicalize().map_err(failed)?;
    let relative =
        Path::new(name).components().all(|c| !matches!(c, Component::RootDir | Component::Prefix(_)));
    if !relative || !real.starts_with(&home) {
        let why = format!("`{name}` leaves the folder above the scene's; put the character there or below");
        return Err(SceneError::value("character", why));
    }
    read_import(&path, options, false, &mut |_| ())
        .map_err(|e| SceneError::Character { path, source: Box::new(e) })
}

/// Read a scene; also the name of its character.
///
/// # Errors
/// [`SceneError`]: where, what was expected, what was found.
pub fn from_bytes(bytes: &[u8]) -> Result<(SceneFile, Option<String>), SceneError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let doc: Document = serde_json::from_slice(text).map_err(LookError::from)?;
    if doc.sinew_scene != 1 {
        return Err(SceneError::Version { found: doc.sinew_scene });
    }
    let within = |field: &str, found: Option<f64>, low: f64, high: f64| match found {
        Some(v) if !(low..=high).contains(&v) => {
            Err(SceneError::value(field, format!("expected a number from {low} to {high}, found {v}")))
        }
        _ => Ok(()),
    };
    within("at", doc.at, -1e6, 1e6)?;
    within("samples", doc.samples.map(|n| n as f64), 1.0, 65536.0)?;
    within("depth", doc.depth.map(|n| n as f64), 0.0, 64.0)?;
    for side in doc.size.iter().flatten() {
        within("size", Some(*side as f64), 1.0, 16384.0)?;
    }
    let look = doc.look.map(look_json::read).transpose().map_err(|e| match e {
        LookError::Value { place, why } => SceneError::value(format!("look.{place}"), why),
        e => e.into(),
    })?;
    let mut materials = Vec::new();
    for (i, m) in doc.materials.iter().enumerate() {
        if doc.materials[..i].iter().any(|other| other.name == m.name) {
            return Err(SceneError::value(
                format!("materials[{i}]"),
                format!("`{}` is there already", m.name),
            ));
        }
        let mut material = Material { name: m.name.clone(), ..Material::default() };
        look_json::patch(i, m)?.apply(&mut material);
        materials.push(material);
    }
    if doc.shapes.len() > MAX_SHAPES {
        let why = format!("expected at most {MAX_SHAPES}, found {}", doc.shapes.len());
        return Err(SceneError::value("shapes", why));
    }
    let shapes: Vec<Shape> = doc
        .shapes
        .iter()
        .enumerate()
        .map(|(i, s)| shape(&format!("shapes[{i}]"), s, &materials))
        .collect::<Result<_, _>>()?;
    // What shapes wear that name no material.
    materials.push(Material::default());
    let camera = doc.camera.as_ref().map(camera).transpose()?;
    Ok((
        SceneFile {
            clip: doc.clip,
            at: doc.at,
            look: look.unwrap_or_default(),
            materials,
            shapes,
            camera,
            size: doc.size,
            samples: doc.samples,
            depth: doc.depth,
        },
        doc.character,
    ))
}

fn shape(place: &str, doc: &ShapeDoc, materials: &[Material]) -> Result<Shape, SceneError> {
    let geometry = match (&doc.sphere, &doc.plane, &doc.triangle) {
        (Some(s), None, None) if s.radius > 0.0 && s.radius <= 1e9 => {
            Geometry::Sphere { center: point(place, "center", s.center)?, radius: s.radius }
        }
        (Some(s), None, None) => {
            return Err(SceneError::value(place, format!("`radius` must be above 0, found {}", s.radius)));
        }
        (None, Some(p), None) => Geometry::Plane {
            point: point(place, "point", p.point)?,
            normal: vector(place, "normal", p.normal)?,
        },
        (None, None, Some(corners)) => {
            let [a, b, c] = corners.map(|c| point(place, "triangle", c));
            Geometry::Triangle([a?, b?, c?])
        }
        _ => return Err(SceneError::value(place, "expected one of `sphere`, `plane` and `triangle`")),
    };
    let material = match &doc.material {
        None => materials.len(),
        Some(name) => materials.iter().position(|m| m.name == *name).ok_or_else(|| {
            let names: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
            let has = if names.is_empty() { "none".into() } else { names.join(", ") };
            let why = format!("no material is called `{name}`; `materials` has: {has}");
            SceneError::value(place, why)
        })?,
    };
    Ok(Shape { geometry, material })
}

fn camera(doc: &CameraDoc) -> Result<View, SceneError> {
    let bad = |why: &str| Err(SceneError::value("camera", why));
    let fov = doc.fov_deg.unwrap_or(30.0);
    if !(0.0..=160.0).contains(&fov) {
        return bad("`fov_deg` must be a number from 0 to 160");
    }
    let fov_y = fov.to_radians();
    let turned = doc.yaw_deg.is_some() || doc.pitch_deg.is_some();
    match (doc.eye, doc.target) {
        (Some(eye), Some(target)) if !turned => {
            let (eye, target) = (point("camera", "eye", eye)?, point("camera", "target", target)?);
            let up = vector("camera", "up", doc.up.unwrap_or([0.0, 1.0, 0.0]))?.as_vec3();
            Ok(View::LookAt { eye, target, up, fov_y })
        }
        (None, None) if doc.up.is_none() => {
            let (yaw, pitch) = (doc.yaw_deg.unwrap_or(30.0), doc.pitch_deg.unwrap_or(12.0));
            match yaw.is_finite() && pitch.abs() <= 90.0 {
                true => Ok(View::Orbit { yaw: yaw.to_radians(), pitch: pitch.to_radians(), fov_y }),
                false => bad("`pitch_deg` must be a number from -90 to 90"),
            }
        }
        _ => bad("expected `eye` and `target`, or `yaw_deg` and `pitch_deg`"),
    }
}
