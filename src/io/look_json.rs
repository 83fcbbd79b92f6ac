//! Looks: light, background and changes of materials in JSON that people write (`rigs/looks/README.md` describes every field).
//!
//! A key that the format does not have is an error that names it, because hand-written files have typos.

use super::json_color::Color;
use crate::scene::{Lamp, LampFrame, Light, LightKind, Lighting, MaterialPatch};
use glam::Vec3;
use serde::Deserialize;

/// Lamps that one look may have: each is looked at for every pixel.
pub const MAX_LAMPS: usize = 64;

/// What a file says of a look; what it leaves out is `None` or empty.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct LookFile {
    /// Ambient light and lamps.
    pub lighting: Option<Lighting>,
    /// Linear RGBA behind everything, alpha premultiplied: at the top and at the bottom.
    pub background: Option<[[f32; 4]; 2]>,
    /// Changes of materials, in order.
    pub materials: Vec<MaterialPatch>,
}

/// Why a look cannot be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LookError {
    /// No JSON, or keys that the format does not have.
    #[error("line {line}, column {column}: {message}")]
    Json {
        /// Counted from 1.
        line: usize,
        /// Counted from 1.
        column: usize,
        /// What was expected and what was found.
        message: String,
    },
    /// A version of the format that this reader does not know.
    #[error("`sinew_look` is {found}; this version reads 1")]
    Version {
        /// The version that the file has.
        found: u32,
    },
    /// Fields that contradict each other, are missing, or make no sense.
    #[error("{place}: {why}")]
    Value {
        /// Where: `lamps[2]`, `materials[0]`.
        place: String,
        /// What was expected and what was found.
        why: String,
    },
}

impl From<serde_json::Error> for LookError {
    fn from(e: serde_json::Error) -> Self {
        // serde_json ends its message with the place, which has fields of its own here.
        let text = e.to_string();
        let message = text.rsplit_once(" at line ").map_or(text.as_str(), |(m, _)| m).to_string();
        Self::Json { line: e.line(), column: e.column(), message }
    }
}

impl LookError {
    pub(super) fn value(place: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Value { place: place.into(), why: why.into() }
    }
}

/// The file as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Document {
    /// Not needed within a scene.
    sinew_look: Option<u32>,
    background: Option<Background>,
    light: Option<Preset>,
    ambient: Option<Ambient>,
    lamps: Option<Vec<LampDoc>>,
    #[serde(default)]
    materials: Vec<MaterialDoc>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Preset {
    Studio,
    Sun,
    Flat,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected \"transparent\", a colour, or a list of two colours, top and bottom")]
enum Background {
    Clear(Clear),
    Two([Color; 2]),
    One(Color),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Clear {
    Transparent,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a colour, or {\"above\": colour, \"below\": colour}")]
enum Ambient {
    Even(Color),
    Two(TwoSided),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TwoSided {
    above: Color,
    below: Color,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Directional,
    Point,
    Spot,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FrameDoc {
    World,
    Camera,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LampDoc {
    kind: Kind,
    frame: Option<FrameDoc>,
    color: Option<Color>,
    intensity: Option<f32>,
    from: Option<[f32; 3]>,
    position: Option<[f32; 3]>,
    target: Option<[f32; 3]>,
    range: Option<f32>,
    radius: Option<f32>,
    radius_deg: Option<f32>,
    inner_deg: Option<f32>,
    outer_deg: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MaterialDoc {
    pub name: String,
    diffuse: Option<Color>,
    alpha: Option<f32>,
    specular: Option<Color>,
    shininess: Option<f32>,
    emissive: Option<Color>,
    unlit: Option<bool>,
    double_sided: Option<bool>,
    textures: Option<bool>,
    ambient: Option<Color>,
    mirror: Option<Color>,
    transmission: Option<Color>,
    ior: Option<f32>,
}

/// Read a look.
///
/// ```
/// use sinew::io::look_json;
/// let look = look_json::from_bytes(br##"{
///   "sinew_look": 1,
///   "ambient": {"above": "#808890", "below": "#404040"},
///   "lamps": [{"kind": "directional", "from": [0, 1, 1], "color": "#fff0d0", "frame": "camera"}],
///   "materials": [{"name": "skin*", "specular": [0.2, 0.2, 0.2], "shininess": 60}]
/// }"##)?;
/// assert_eq!(look.lighting.unwrap().lamps.len(), 1);
/// assert!(look.materials[0].matches("skin_face"));
///
/// let typo = look_json::from_bytes(br#"{"sinew_look": 1, "lamp": []}"#).unwrap_err();
/// assert!(typo.to_string().contains("unknown field `lamp`"), "{typo}");
/// # Ok::<(), look_json::LookError>(())
/// ```
///
/// # Errors
/// [`LookError`]: where, what was expected, what was found.
pub fn from_bytes(bytes: &[u8]) -> Result<LookFile, LookError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let doc: Document = serde_json::from_slice(text)?;
    if doc.sinew_look.is_none() {
        return Err(LookError::value(
            "the look",
            "missing field `sinew_look`: expected the format's version, 1",
        ));
    }
    read(doc)
}

/// What a document says.
pub(super) fn read(doc: Document) -> Result<LookFile, LookError> {
    if let Some(found) = doc.sinew_look.filter(|v| *v != 1) {
        return Err(LookError::Version { found });
    }
    let lighting = lighting(&doc)?;
    let background = doc.background.map(background).transpose()?;
    let materials = doc.materials.iter().enumerate().map(|(i, m)| patch(i, m));
    Ok(LookFile { lighting, background, materials: materials.collect::<Result<_, _>>()? })
}

/// Light, if the file says anything of it.
fn lighting(doc: &Document) -> Result<Option<Lighting>, LookError> {
    if let Some(preset) = doc.light {
        if doc.ambient.is_some() || doc.lamps.is_some() {
            let why = "a preset has its own `ambient` and `lamps`; leave out one or the other";
            return Err(LookError::value("light", why));
        }
        return Ok(Some(match preset {
            Preset::Studio => Lighting::studio(),
            Preset::Sun => Lighting::sun(),
            Preset::Flat => Lighting::flat(),
        }));
    }
    if doc.ambient.is_none() && doc.lamps.is_none() {
        return Ok(None);
    }
    let lamps = doc.lamps.as_deref().unwrap_or_default();
    if lamps.len() > MAX_LAMPS {
        return Err(LookError::value(
            "lamps",
            format!("expected at most {MAX_LAMPS}, found {}", lamps.len()),
        ));
    }
    let [above, below] = match &doc.ambient {
        None => [Vec3::ZERO; 2],
        Some(Ambient::Even(c)) => [light("ambient", c)?; 2],
        Some(Ambient::Two(t)) => [light("ambient.above", &t.above)?, light("ambient.below", &t.below)?],
    };
    let lamps = lamps.iter().enumerate().map(|(i, l)| lamp(&format!("lamps[{i}]"), l));
    Ok(Some(Lighting { above, below, lamps: lamps.collect::<Result<_, _>>()? }))
}

/// A colour without alpha: finite and not negative.
fn light(place: &str, color: &Color) -> Result<Vec3, LookError> {
    let c = color.0;
    if !c.is_finite() || c.min_element() < 0.0 {
        return Err(LookError::value(
            place,
            format!("expected numbers of at least 0, found {:?}", c.to_array()),
        ));
    }
    if c.w != 1.0 {
        return Err(LookError::value(place, "light has no alpha: expected #rrggbb or three numbers"));
    }
    Ok(c.truncate())
}

fn lamp(place: &str, doc: &LampDoc) -> Result<Lamp, LookError> {
    let intensity = number(place, "intensity", doc.intensity.unwrap_or(1.0), 0.0, 1e6)?;
    let color = match &doc.color {
        Some(c) => light(&format!("{place}.color"), c)?,
        None => Vec3::ONE,
    };
    let kind = match doc.kind {
        Kind::Directional => {
            only(place, "a directional lamp", doc, &["from", "radius_deg"])?;
            let from = direction(place, "from", vector(place, "from", doc.from)?)?;
            LightKind::Directional { direction: -from }
        }
        Kind::Point => {
            only(place, "a point lamp", doc, &["position", "range", "radius"])?;
            let position = vector(place, "position", doc.position)?;
            LightKind::Point { position, falloff: falloff(place, doc)? }
        }
        Kind::Spot => spot(place, doc)?,
    };
    let frame = match doc.frame {
        Some(FrameDoc::Camera) => LampFrame::Camera,
        _ => LampFrame::World,
    };
    let radius = match doc.kind {
        Kind::Directional => {
            number(place, "radius_deg", doc.radius_deg.unwrap_or(0.0), 0.0, 45.0)?.to_radians()
        }
        _ => number(place, "radius", doc.radius.unwrap_or(0.0), 0.0, 1e6)?,
    };
    Ok(Lamp { light: Light { radius, ..Light::new(kind, color * intensity) }, frame })
}

fn spot(place: &str, doc: &LampDoc) -> Result<LightKind, LookError> {
    let fields = ["position", "target", "range", "inner_deg", "outer_deg", "radius"];
    only(place, "a spot lamp", doc, &fields)?;
    let (position, target) = (vector(place, "position", doc.position)?, vector(place, "target", doc.target)?);
    let direction = direction(place, "target − position", target - position)?;
    let outer = number(place, "outer_deg", doc.outer_deg.unwrap_or(30.0), 0.1, 90.0)?;
    let inner = number(place, "inner_deg", doc.inner_deg.unwrap_or(0.8 * outer), 0.0, outer)?;
    Ok(LightKind::Spot {
        position,
        direction,
        falloff: falloff(place, doc)?,
        cos_inner: inner.to_radians().cos(),
        cos_outer: outer.to_radians().cos(),
    })
}

fn falloff(place: &str, doc: &LampDoc) -> Result<Option<f32>, LookError> {
    doc.range.map(|r| number(place, "range", r, 1e-6, 1e9)).transpose()
}

/// Refuse what a kind of lamp has no use for.
fn only(place: &str, kind: &str, doc: &LampDoc, fields: &[&str]) -> Result<(), LookError> {
    let given = [
        ("from", doc.from.is_some()),
        ("position", doc.position.is_some()),
        ("target", doc.target.is_some()),
        ("range", doc.range.is_some()),
        ("radius", doc.radius.is_some()),
        ("radius_deg", doc.radius_deg.is_some()),
        ("inner_deg", doc.inner_deg.is_some()),
        ("outer_deg", doc.outer_deg.is_some()),
    ];
    match given.iter().find(|(name, there)| *there && !fields.contains(name)) {
        Some((name, _)) => {
            Err(LookError::value(place, format!("{kind} has no `{name}`; it has `{}`", fields.join("`, `"))))
        }
        None => Ok(()),
    }
}

fn vector(place: &str, field: &str, found: Option<[f32; 3]>) -> Result<Vec3, LookError> {
    let v =
        found.ok_or_else(|| LookError::value(place, format!("`{field}` is missing: expected [x, y, z]")))?;
    let v = Vec3::from_array(v);
    if v.abs().max_element() <= 1e9 {
        return Ok(v);
    }
    Err(LookError::value(place, format!("`{field}` must be numbers up to 1e9, found {:?}", v.to_array())))
}

fn direction(place: &str, what: &str, v: Vec3) -> Result<Vec3, LookError> {
    v.try_normalize()
        .ok_or_else(|| LookError::value(place, format!("`{what}` has no length, so no direction")))
}

fn number(place: &str, field: &str, found: f32, low: f32, high: f32) -> Result<f32, LookError> {
    if (low..=high).contains(&found) {
        return Ok(found);
    }
    Err(LookError::value(place, format!("`{field}` must be a number from {low} to {high}, found {found}")))
}

fn background(doc: Background) -> Result<[[f32; 4]; 2], LookError> {
    let one = |c: Color| {
        let c = c.0;
        if !c.is_finite() || c.min_element() < 0.0 || c.w > 1.0 {
            let why = format!("expected numbers of at least 0, alpha up to 1, found {:?}", c.to_array());
            return Err(LookError::value("background", why));
        }
        Ok([c.x * c.w, c.y * c.w, c.z * c.w, c.w])
    };
    match doc {
        Background::Clear(Clear::Transparent) => Ok([[0.0; 4]; 2]),
        Background::One(c) => Ok([one(c)?; 2]),
        Background::Two([top, bottom]) => Ok([one(top)?, one(bottom)?]),
    }
}

pub(super) fn patch(i: usize, doc: &MaterialDoc) -> Result<MaterialPatch, LookError> {
    let place = format!("materials[{i}] `{}`", doc.name);
    let color = |field: &str, c: &Option<Color>| {
        c.as_ref().map(|c| light(&format!("{place}.{field}"), c)).transpose()
    };
    // What comes back is no more than what arrives.
    let share = |field: &str, c: &Option<Color>| match color(field, c)? {
        Some(v) if v.max_element() > 1.0 => {
            let why = format!("`{field}` must be at most 1 in every channel, found {}", v.max_element());
            Err(LookError::value(&place, why))
        }
        v => Ok(v),
    };
    let bounded =
        |field: &str, v: Option<f32>, high: f32| v.map(|v| number(&place, field, v, 0.0, high)).transpose();
    // Alpha may stand in the colour, as in a rig.
    let (mut opaque, mut alpha) = (doc.diffuse, doc.alpha);
    if let Some(c) = opaque.as_mut().filter(|c| c.0.w != 1.0) {
        if alpha.is_some() {
            return Err(LookError::value(place, "alpha is given twice: in `diffuse` and as `alpha`"));
        }
        alpha = Some(std::mem::replace(&mut c.0.w, 1.0));
    }
    Ok(MaterialPatch {
        name: doc.name.clone(),
        diffuse: color("diffuse", &opaque)?,
        alpha: bounded("alpha", alpha, 1.0)?,
        specular: color("specular", &doc.specular)?,
        shininess: bounded("shininess", doc.shininess, 1024.0)?,
        emissive: color("emissive", &doc.emissive)?,
        unlit: doc.unlit,
        double_sided: doc.double_sided,
        textures: doc.textures,
        ambient: color("ambient", &doc.ambient)?,
        mirror: share("mirror", &doc.mirror)?,
        transmission: share("transmission", &doc.transmission)?,
        ior: doc.ior.map(|v| number(&place, "ior", v, 0.1, 10.0)).transpose()?,
    })
}
