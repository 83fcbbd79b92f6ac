//! Animations: channels become tracks, sampler modes become curves.

use super::document::Document;
use super::error::{GltfError, Result, entry, value};
use super::geometry::Runs;
use super::mend::NO_NODE;
use super::nodes::Nodes;
use super::warnings::Warnings;
use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use ::gltf::json::accessor::Type;
use ::gltf::json::animation::{Animation, Channel, Interpolation as Mode, Property, Sampler};
use ::gltf::json::validation::Checked;

/// Which nodes have a channel for translation, rotation or scale.
pub(super) fn animated(doc: &Document) -> Vec<bool> {
    let mut moved = vec![false; doc.root.nodes.len()];
    for c in doc.root.animations.iter().flat_map(|a| &a.channels) {
        let node = c.target.node.value();
        if c.target.path != Checked::Valid(Property::MorphTargetWeights) && node < moved.len() {
            moved[node] = true;
        }
    }
    moved
}

/// All animations.
pub(super) fn build(doc: &Document, nodes: &Nodes, runs: &Runs, w: &mut Warnings) -> Result<Vec<Clip>> {
    let one = |(a, animation): (usize, &Animation)| {
        let mut clip = Clip { name: clip_name(animation, a), tracks: Vec::new() };
        let channels = animation.channels.iter().enumerate();
        for (c, channel) in channels.filter(|(_, c)| c.target.node.value() != NO_NODE as usize) {
            let place = format!("animations[{a}].channels[{c}]");
            clip.tracks.extend(track(doc, nodes, runs, animation, channel, &place, w)?);
        }
        Ok(clip)
    };
    doc.root.animations.iter().enumerate().map(one).collect()
}

fn clip_name(animation: &Animation, a: usize) -> String {
    animation.name.clone().filter(|n| !n.is_empty()).unwrap_or_else(|| format!("animation_{a}"))
}

fn track(
    doc: &Document,
    nodes: &Nodes,
    runs: &Runs,
    animation: &Animation,
    channel: &Channel,
    place: &str,
    w: &mut Warnings,
) -> Result<Option<Track>> {
    let node = channel.target.node.value();
    let bone = super::nodes::bone(nodes, node, || format!("{place}.target.node"))?;
    let (target, width, shape) = match channel.target.path {
        Checked::Valid(Property::Translation) => (Target::Translation(bone), 3, Type::Vec3),
        Checked::Valid(Property::Scale) => (Target::Scale(bone), 3, Type::Vec3),
        Checked::Valid(Property::Rotation) => (Target::Rotation(bone), 4, Type::Vec4),
        Checked::Valid(Property::MorphTargetWeights) => match runs.of(node) {
            Some((first, width)) if width > 0 => (Target::Weights { first }, width, Type::Scalar),
            _ => {
                w.push(place, "moves morph weights of a node that has none in the scene; left out");
                return Ok(None);
            }
        },
        Checked::Invalid => {
            w.push(format!("{place}.target.path"), "is unknown; the channel is left out");
            return Ok(None);
        }
    };
    let index = channel.sampler.value();
    let sampler = entry(&animation.samplers, index, "sampler", || format!("{place}.sampler"))?;
    let curve = curve(doc, sampler, width, shape, place, w)?;
    if matches!(target, Target::Rotation(_)) {
        check_rotations(&curve, place, w);
    }
    Ok(Some(Track { target, curve }))
}

/// How far from 1 the length of a rotation may be: quaternions of bytes are off by almost as much.
const UNIT: f32 = 0.01;

/// Say which rotations are none as they stand.
fn check_rotations(curve: &Curve, place: &str, w: &mut Warnings) {
    let length = |k: usize| curve.value(k).iter().map(|v| v * v).sum::<f32>().sqrt();
    let mut off = (0..curve.times().len()).filter(|&k| (length(k) - 1.0).abs() > UNIT);
    if let Some(first) = off.next() {
        let (time, length, more) = (curve.times()[first], length(first), off.count());
        let what = if length > 0.0 { "normalised" } else { "no rotation is taken" };
        let others = if more > 0 { format!(" ({more} more like it)") } else { String::new() };
        w.push(place, format!("its key at {time} s is a quaternion of length {length}; {what}{others}"));
    }
}

/// The keys of a sampler, of whatever width.
pub(super) fn any_curve(doc: &Document, animation: usize, sampler: usize, place: &str) -> Result<Curve> {
    let samplers = &doc.root.animations[animation].samplers;
    let sampler = entry(samplers, sampler, "sampler", || format!("{place}.sampler"))?;
    let output = entry(&doc.root.accessors, sampler.output.value(), "accessor", || place.into())?;
    let Checked::Valid(shape) = output.type_ else {
        return Err(value(place, "a type of values", "another word"));
    };
    let keys = doc.count(sampler.input.value(), place)?.max(1);
    let each = if sampler.interpolation == Checked::Valid(Mode::CubicSpline) { 3 } else { 1 };
    let width =
        (output.count.0 / keys / each) as usize * doc.width(sampler.output.value(), &[shape], place)?;
    curve(doc, sampler, width, shape, place, &mut Warnings::default())
}

fn curve(
    doc: &Document,
    sampler: &Sampler,
    width: usize,
    shape: Type,
    place: &str,
    w: &mut Warnings,
) -> Result<Curve> {
    let interpolation = match sampler.interpolation {
        Checked::Valid(Mode::Step) => Interpolation::Hold,
        Checked::Valid(Mode::Linear) => Interpolation::Linear,
        Checked::Valid(Mode::CubicSpline) => Interpolation::Hermite,
        Checked::Invalid => {
            w.push(place, "interpolation is unknown; LINEAR is used");
            Interpolation::Linear
        }
    };
    let input = doc.floats(sampler.input.value(), &[Type::Scalar], &format!("{place} (input)"))?;
    let output = doc.floats(sampler.output.value(), &[shape], &format!("{place} (output)"))?;
    let times: Vec<f64> = input.values.iter().map(|&t| t as f64).collect();
    let each = width * if interpolation == Interpolation::Hermite { 3 } else { 1 };
    if times.is_empty() || output.values.len() != times.len() * each {
        let expected = format!("{} numbers for {} keys, at least one", times.len() * each, times.len());
        return Err(value(format!("{place} (output)"), expected, output.values.len().to_string()));
    }
    let (times, values) = sorted(times, output.values, each, place, w);
    Curve::new(times, values, width, interpolation)
        .map_err(|source| GltfError::Keys { place: place.into(), source })
}

/// Keys in the order of their times; equal times keep the order of the file.
fn sorted(
    times: Vec<f64>,
    values: Vec<f32>,
    each: usize,
    place: &str,
    w: &mut Warnings,
) -> (Vec<f64>, Vec<f32>) {
    if times.windows(2).any(|t| t[0] == t[1]) {
        w.push(place, "has several keys at one time; the last of them counts");
    }
    if times.windows(2).all(|t| t[0] <= t[1]) || times.iter().any(|t| t.is_nan()) {
        return (times, values);
    }
    w.push(place, "its key times run backwards; the keys were sorted");
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by(|&a, &b| times[a].total_cmp(&times[b]));
    let values = order.iter().flat_map(|&k| values[k * each..(k + 1) * each].iter().copied()).collect();
    (order.iter().map(|&k| times[k]).collect(), values)
}
