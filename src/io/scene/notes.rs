//! The notes' scenes: `camera`, `objects` (spheres, planes, triangles, soups in STL files) and, for ray tracing, `lights` and
//! `materials`; all in `f64`.

use super::{SceneError, point, share, vector};
use crate::io::look_json::LookError;
use crate::io::{read_below, stl};
use crate::scene::{Geometry, Pinhole, Shape, ShapeLight, ShapeMaterial, ShapeScene, Soup, Source};
use glam::DVec3;
use serde::Deserialize;
use std::path::Path;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    camera: Camera,
    #[serde(default)]
    lights: Vec<Light>,
    #[serde(default)]
    materials: Vec<Material>,
    objects: Vec<Object>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Camera {
    #[serde(rename = "type", default)]
    _kind: Kind,
    focal_length: f64,
    eye: [f64; 3],
    up: [f64; 3],
    look: [f64; 3],
    height: f64,
    width: f64,
}

/// There is one kind.
#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum Kind {
    #[default]
    Perspective,
}

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
enum Light {
    Directional { direction: [f64; 3], color: [f64; 3] },
    Point { position: [f64; 3], color: [f64; 3] },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Material {
    name: String,
    ka: [f64; 3],
    kd: [f64; 3],
    ks: [f64; 3],
    km: [f64; 3],
    phong_exponent: f64,
}

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
enum Object {
    Sphere { center: [f64; 3], radius: f64, material: Option<String> },
    Plane { point: [f64; 3], normal: [f64; 3], material: Option<String> },
    Triangle { corners: [[f64; 3]; 3], material: Option<String> },
    Soup { stl: String, material: Option<String> },
}

/// Read a scene of the notes, with the folder in which its STL files lie.
///
/// Without lights there is one at the eye; objects without a material are light grey.
///
/// # Errors
/// [`SceneError`]: where, what was expected, what was found.
pub fn from_bytes(bytes: &[u8], folder: &Path) -> Result<ShapeScene, SceneError> {
    let file: File = serde_json::from_slice(bytes).map_err(LookError::from)?;
    let mut materials: Vec<ShapeMaterial> =
        file.materials.iter().enumerate().map(|(i, m)| material(i, m)).collect::<Result<_, _>>()?;
    let gray =
        ShapeMaterial { ambient: DVec3::splat(0.8), diffuse: DVec3::splat(0.8), ..ShapeMaterial::default() };
    materials.push(gray);
    let mut lights: Vec<ShapeLight> =
        file.lights.iter().enumerate().map(|(i, l)| light(i, l)).collect::<Result<_, _>>()?;
    if file.lights.is_empty() {
        let source = Source::Point(DVec3::from_array(file.camera.eye));
        lights.push(ShapeLight { source, color: DVec3::splat(0.9), radius: 0.0 });
    }
    let mut scene = ShapeScene {
        camera: camera(&file.camera)?,
        ambient: DVec3::splat(0.1),
        gated: false,
        lights,
        materials,
        shapes: Vec::new(),
        soups: Vec::new(),
    };
    for (i, object) in file.objects.iter().enumerate() {
        place(&mut scene, &format!("objects[{i}]"), object, folder)?;
    }
    Ok(scene)
}

fn camera(c: &Camera) -> Result<Pinhole, SceneError> {
    for (name, v) in [("focal_length", c.focal_length), ("width", c.width), ("height", c.height)] {
        if !(v > 0.0 && v <= 1e9) {
            return Err(SceneError::value("camera", format!("`{name}` must be above 0, found {v}")));
        }
    }
    let axes = Pinhole::axes(vector("camera", "look", c.look)?, vector("camera", "up", c.up)?);
    let axes = axes.ok_or_else(|| {
        let why = format!(
            "`look` {} and `up` {} leave no picture plane: expected two directions that are not parallel; give another `up`",
            DVec3::from_array(c.look),
            DVec3::from_array(c.up)
        );
        SceneError::value("camera", why)
    })?;
    let eye = vector("camera", "eye", c.eye)?;
    Ok(Pinhole { eye, axes, focal: c.focal_length, width: c.width, height: c.height })
}

fn light(i: usize, light: &Light) -> Result<ShapeLight, SceneError> {
    let place = format!("lights[{i}]");
    let (source, color) = match *light {
        Light::Directional { direction, color } => {
            (Source::Directional(vector(&place, "direction", direction)?), color)
        }
        Light::Point { position, color } => (Source::Point(point(&place, "position", position)?), color),
    };
    Ok(ShapeLight { source, color: share(&place, "color", color)?, radius: 0.0 })
}

fn material(i: usize, m: &Material) -> Result<ShapeMaterial, SceneError> {
    let place = format!("materials[{i}] `{}`", m.name);
    if !(0.0..=1e6).contains(&m.phong_exponent) {
        let why = format!("`phong_exponent` must be a number from 0 to 1e6, found {}", m.phong_exponent);
        return Err(SceneError::value(place, why));
    }
    Ok(ShapeMaterial {
        name: m.name.clone(),
        ambient: share(&place, "ka", m.ka)?,
        diffuse: share(&place, "kd", m.kd)?,
        specular: share(&place, "ks", m.ks)?,
        shininess: m.phong_exponent,
        mirror: share(&place, "km", m.km)?,
        ..ShapeMaterial::default()
    })
}

fn place(scene: &mut ShapeScene, place: &str, object: &Object, folder: &Path) -> Result<(), SceneError> {
    let (name, geometry) = match object {
        Object::Sphere { center, radius, material } => {
            if !(*radius > 0.0 && *radius <= 1e9) {
                return Err(SceneError::value(place, format!("`radius` must be above 0, found {radius}")));
            }
            (material, Geometry::Sphere { center: point(place, "center", *center)?, radius: *radius })
        }
        Object::Plane { point: p, normal, material } => {
            let (point, normal) = (point(place, "point", *p)?, vector(place, "normal", *normal)?);
            (material, Geometry::Plane { point, normal })
        }
        Object::Triangle { corners, material } => {
            let [a, b, c] = corners.map(|c| point(place, "corners", c));
            (material, Geometry::Triangle([a?, b?, c?]))
        }
        Object::Soup { stl, material } => {
            let material = find(&scene.materials, place, material)?;
            scene.soups.push(Soup { triangles: soup(place, stl, folder)?, material });
            return Ok(());
        }
    };
    scene.shapes.push(Shape { geometry, material: find(&scene.materials, place, name)? });
    Ok(())
}

/// The material of a name; the last one is for objects that name none.
fn find(materials: &[ShapeMaterial], place: &str, name: &Option<String>) -> Result<usize, SceneError> {
    let last = materials.len() - 1;
    let Some(name) = name else { return Ok(last) };
    materials[..last].iter().position(|m| m.name == *name).ok_or_else(|| {
        let names: Vec<&str> = materials[..last].iter().map(|m| m.name.as_str()).collect();
        SceneError::value(place, format!("no material is called `{name}`; there are: {}", names.join(", ")))
    })
}

fn soup(place: &str, name: &str, folder: &Path) -> Result<stl::Triangles, SceneError> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = crate::io::beside(folder, name).ok_or_else(|| {
        SceneError::value(
            place,
            format!("`stl`: `{name}` leaves the scene's folder; put the file beside the scene"),
        )
    })?;
    let failed = |source| SceneError::Read { place: place.into(), path: path.clone(), source };
    let bytes = read_below(folder, &path).map_err(failed)?;
    stl::parse(&bytes).map_err(|source| SceneError::Stl { place: place.into(), path, source })
}
