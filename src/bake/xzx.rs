//! Quaternion keys into XZX angles and back, within an error on the skin.
//!
//! Between two keys angles run straight and quaternions on an arc: different paths with the same ends. Each piece of the source is
//! tried from its start, and halved where the new path leaves it; of the keys that come of that [`bake`](super::bake) chooses.
//! Of all triples of a rotation the one nearest to the key before is taken, over all three angles and both solutions
//! ([`nearest_xzx`](crate::math::euler::nearest_xzx)): each angle unwrapped on its own would turn a bone over where it passes its rest.

mod path;

use super::cost::Costs;
use super::gauge::Gauge;
use super::{BakeDesc, BakeError, Baked, SEAM, Watch, bake_from, check, edit, plan, start, times};
use crate::character::Character;
use crate::clip::{Clip, Curve, Target, Track};
use crate::math::rotation;
use crate::skeleton::{BoneDesc, BoneId, Skeleton};
use glam::{Quat, Vec3};
use path::Path;

/// How rotations are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// XZX angles about aim frames.
    Angles,
    /// Quaternions against the parent.
    Quaternions,
}

/// The part of the tolerance that the other path may use at first; the rest is left to the reduction of keys.
const FIRST_PART: f64 = 0.25;

/// Radians below which paths are not told apart: angles of a few radians are stored in single precision.
const FINEST: f64 = 1e-6;

/// The clip with XZX angles in place of quaternions, about the bones' aim frames; few keys within the bound.
///
/// Angles run straight between their keys, as everywhere else in this library; steps stay steps. The result is compared with the clip as
/// it was. The bones should point along themselves: [`with_aims`].
///
/// ```
/// use sinew::bake::{BakeDesc, Metric, xzx};
/// use sinew::character::Character;
/// use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
/// use sinew::skeleton::{BoneDesc, BoneId, Skeleton};
/// use glam::Quat;
/// let (skeleton, _) = Skeleton::new(vec![BoneDesc { length: 1.0, ..BoneDesc::new("arm") }]).unwrap();
/// let arm = Character::new(skeleton, vec![], vec![], vec![], vec![]).unwrap();
/// let keys = [Quat::IDENTITY, Quat::from_rotation_z(1.5)].map(|q| q.to_array()).concat();
/// let curve = Curve::new(vec![0.0, 1.0], keys, 4, Interpolation::Linear).unwrap();
/// let nod = Clip { name: "nod".into(), tracks: vec![Track { target: Target::Rotation(BoneId(0)), curve }] };
/// let desc = BakeDesc { metric: Metric::Shell(0.1), ..BakeDesc::default() };
/// let angles = xzx::to_xzx(&arm, &nod, &desc).unwrap().clip;
/// assert_eq!((&angles.tracks[0].target, angles.key_count()), (&Target::Xzx(BoneId(0)), 2));
/// assert!((angles.tracks[0].curve.value(1)[1] - 1.5).abs() < 1e-6);
/// ```
///
/// # Errors
/// [`BakeError`] as for [`bake`](super::bake).
///
/// # Panics
/// If the clip is not of the character.
pub fn to_xzx(character: &Character, clip: &Clip, desc: &BakeDesc) -> Result<Baked, BakeError> {
    convert(character, clip, desc, Form::Angles, &|_, _| {})
}

/// The clip with quaternions in place of XZX angles, as other programs read it: what [`to_xzx`] undoes.
///
/// Arcs are short: an angle that turns on and on gets a key every third of a turn or more. Cubics by a rule become cubics with slopes.
///
/// # Errors
/// [`BakeError`] as for [`bake`](super::bake).
///
/// # Panics
/// If the clip is not of the character.
pub fn to_quat(character: &Character, clip: &Clip, desc: &BakeDesc) -> Result<Baked, BakeError> {
    convert(character, clip, desc, Form::Quaternions, &|_, _| {})
}

/// Either of them, and tell how many poses were compared as it goes.
///
/// # Errors
/// [`BakeError`] as for [`bake`](super::bake).
///
/// # Panics
/// If the clip is not of the character.
pub fn convert(
    character: &Character,
    clip: &Clip,
    desc: &BakeDesc,
    form: Form,
    watch: Watch,
) -> Result<Baked, BakeError> {
    check(character, clip, desc)?;
    let gauge = Gauge::of(character, desc).watched(watch);
    let frames = start(clip, desc, desc.fps)?;
    let costs = Costs::new(&gauge, clip);
    let mut part = FIRST_PART;
    let mut last = None;
    for _ in 0..12 {
        let allowed = |b: BoneId| (part * desc.tolerance / costs.turn(b)).max(FINEST);
        let mut path = rewritten(character, &frames, form, desc.fps.is_none(), allowed);
        if desc.cycle {
            path = edit::close(&path, SEAM);
        }
        let worst = gauge.worst(clip, &path, &times::coarse(&path, plan::SEARCH_MOMENTS));
        if worst.share() > 0.6 && desc.fps.is_none() {
            // Errors of a chain of bones add up.
            part *= (0.4 / worst.share()).min(0.7);
            let (tolerance, reached, time) = (worst.limit, worst.distance, worst.time);
            last = Some(BakeError::Missed { clip: clip.name.clone(), tolerance, reached, time });
            continue;
        }
        match bake_from(character, clip, &path, desc, watch) {
            Ok(mut baked) => {
                baked.report.keys[0] = clip.key_count();
                baked.report.bytes[0] = plan::bytes(clip, &[]);
                return Ok(baked);
            }
            Err(e) if desc.fps.is_some() => return Err(e),
            Err(e) => last = Some(e),
        }
        part *= 0.3;
    }
    Err(last.expect("a try that failed"))
}

/// All tracks in the form, each within what its bone is allowed, radians.
fn rewritten(
    character: &Character,
    clip: &Clip,
    form: Form,
    halve: bool,
    allowed: impl Fn(BoneId) -> f64,
) -> Clip {
    let skeleton = character.skeleton();
    let follow = |b: BoneId, curve: &Curve| Path::new(skeleton, b, curve, form, halve).follow(allowed(b));
    let track = |t: &Track| match (form, &t.target) {
        (Form::Angles, Target::Rotation(b)) => Track { target: Target::Xzx(*b), curve: follow(*b, &t.curve) },
        (Form::Quaternions, Target::Xzx(b)) => {
            Track { target: Target::Rotation(*b), curve: follow(*b, &t.curve) }
        }
        _ => Track { target: t.target.clone(), curve: t.curve.with_slopes() },
    };
    Clip { name: clip.name.clone(), tracks: clip.tracks.iter().map(track).collect() }
}

/// The character with every bone aimed along itself: one without a length of its own points at the mean of its children, a leaf goes on
/// as its parent does. Nothing deforms otherwise; bones that have a length, and those that angles of its clips move, stay as they are.
pub fn with_aims(character: &Character) -> Character {
    let skeleton = character.skeleton();
    let mut descs: Vec<BoneDesc> = skeleton.ids().map(|b| skeleton.desc(b)).collect();
    let moved = |b: BoneId| {
        let mut tracks = character.clips().iter().flat_map(|c| &c.tracks);
        tracks.any(|t| t.target == Target::Xzx(b))
    };
    let mut children = vec![(Vec3::ZERO, 0.0_f32); skeleton.len()];
    for child in skeleton.ids() {
        let origin = skeleton.fixed(child).map_or(skeleton.rest(child).translation, |m| m.translation.into());
        if let Some(parent) = skeleton.parent(child) {
            let (sum, count) = &mut children[parent.index()];
            (*sum, *count) = (*sum + origin, *count + 1.0);
        }
    }
    for bone in skeleton.ids() {
        if skeleton.length(bone) > 0.0 || moved(bone) {
            continue;
        }
        let (sum, count) = children[bone.index()];
        let mean = sum / count.max(1.0);
        let rest = skeleton.rest(bone);
        let inherited = || {
            let of = &descs[skeleton.parent(bone)?.index()];
            let tip = rest.rotation.conjugate() * (of.aim * Vec3::new(of.length, 0.0, 0.0));
            Some(tip / rest.scale.abs().max_element().max(1e-9))
        };
        let tip = if mean.length() > 1e-9 { mean } else { inherited().unwrap_or(Vec3::ZERO) };
        if let Some(along) = tip.try_normalize().filter(|_| tip.length().is_finite()) {
            let desc = &mut descs[bone.index()];
            desc.length = tip.length();
            desc.aim = rotation::unit(Quat::from_rotation_arc(Vec3::X, along));
        }
    }
    let (aimed, _) = Skeleton::new(descs).expect("the bones of a skeleton, in order");
    let (meshes, instances) = (character.meshes().to_vec(), character.instances().to_vec());
    let weights = character.rest_pose().weights;
    Character::new(aimed, meshes, instances, weights, character.clips().to_vec()).expect("the same bones")
}
