//! The same where it is not the clip that differs but the vertices: with `y` the place of a vertex in a bone's frame times its weight,
//! `e = Σⱼ Aⱼ Δyⱼ + Δwⱼ oⱼ`.

use super::{Bound, Ends, Jet, component};
use crate::character::{Binding, Character};
use crate::clip::Clip;
use glam::{Affine3A, DVec3};

/// What of an instance's vertices differs, as sums over the bones of a vertex: the largest of any.
pub(in crate::bake) struct Change {
    pub instance: usize,
    bones: Vec<usize>,
    /// Metres in the bones' frames, times weights: at rest, and for a unit of each morph weight.
    places: Vec<f64>,
    weights: f64,
}

/// Of one bone of a vertex: its weight, and places by it.
type Part = (usize, f64, Vec<DVec3>);

impl Change {
    /// From one character's vertices to those of another with the same bones; from nothing without one.
    pub fn new(from: Option<&Character>, to: &Character, instance: usize) -> Self {
        let mesh = to.mesh(&to.instances()[instance]);
        let mut out =
            Self { instance, bones: vec![], places: vec![0.0; 1 + mesh.targets.len()], weights: 0.0 };
        let mut parts = vec![];
        for v in 0..mesh.positions.len() {
            parts.clear();
            from.into_iter().for_each(|c| add(c, instance, v, -1.0, &mut parts));
            add(to, instance, v, 1.0, &mut parts);
            out.weights = out.weights.max(parts.iter().map(|p| p.1.abs()).sum());
            for (k, most) in out.places.iter_mut().enumerate() {
                *most = most.max(parts.iter().map(|p| p.2[k].length()).sum());
            }
            out.bones.extend(parts.iter().map(|p| p.0));
            out.bones.sort_unstable();
            out.bones.dedup();
        }
        out
    }

    /// Nothing differs.
    pub fn is_none(&self) -> bool {
        self.weights == 0.0 && self.places.iter().all(|p| *p == 0.0)
    }
}

/// Add what moves a vertex, bone by bone.
fn add(c: &Character, instance: usize, vertex: usize, sign: f64, parts: &mut Vec<Part>) {
    let of = &c.instances()[instance];
    let mesh = c.mesh(of);
    let mut put = |bone: usize, bind: Affine3A, weight: f32| {
        let (bind, w) = (crate::fk::widen(&bind), sign * weight as f64);
        let k = parts.iter().position(|p| p.0 == bone).unwrap_or_else(|| {
            parts.push((bone, 0.0, vec![DVec3::ZERO; 1 + mesh.targets.len()]));
            parts.len() - 1
        });
        let part = &mut parts[k];
        part.1 += w;
        part.2[0] += w * bind.transform_point3(mesh.positions[vertex].as_dvec3());
        for (sum, target) in part.2[1..].iter_mut().zip(&mesh.targets) {
            let shift = target.positions.get(vertex).map_or(DVec3::ZERO, |d| d.as_dvec3());
            *sum += w * bind.transform_vector3(shift);
        }
    };
    match &of.binding {
        Binding::Bone(b) => put(b.index(), Affine3A::IDENTITY, 1.0),
        Binding::Skin { palette, weights } => {
            weights
                .of(vertex)
                .filter(|w| w.1 > 0.0)
                .for_each(|(b, w)| put(palette[b].0.index(), palette[b].1, w));
        }
    }
}

impl Bound<'_> {
    /// The largest second derivative of what changes make of a clip, as a part of the limit.
    pub fn bend_of(&self, clip: &Clip, times: [f64; 2], changes: &[Change]) -> f64 {
        // The end belongs to the piece before it.
        let times = [times[0], times[1].next_down().max(times[0])];
        let poses = times.map(|t| self.gauge.pose(clip, t));
        let ends = Ends { times, a: poses.clone(), b: poses };
        let h = times[1] - times[0];
        let skeleton = self.gauge.character.skeleton();
        // Linear part and origin of each bone.
        let mut frames = vec![[Jet::ZERO; 2]; skeleton.len()];
        for bone in skeleton.ids() {
            let [up, origin] =
                skeleton.parent(bone).map_or([Jet::constant(1.0), Jet::ZERO], |p| frames[p.index()]);
            let (linear, shift) = self.local(bone, &ends, h);
            frames[bone.index()] = [up * linear.a, origin + up * shift.a];
        }
        let of = |c: &Change| {
            let most = |k: usize| c.bones.iter().map(|b| frames[*b][k]).fold(Jet::ZERO, Jet::max);
            let rest = Jet::constant(c.places[0]);
            let first = self.gauge.character.instances()[c.instance].first_weight;
            let morphed = c.places[1..].iter().enumerate();
            let places =
                morphed.fold(rest, |sum, (k, p)| sum + Jet::constant(*p) * self.weight(first + k, &ends, h));
            (most(0) * places).bend + c.weights * most(1).bend
        };
        super::most(changes.iter().map(of)) / self.gauge.limit
    }

    /// A morph weight's size.
    fn weight(&self, index: usize, ends: &Ends, h: f64) -> Jet {
        let value = |e: usize| DVec3::X * ends.a[e].weights[index] as f64;
        let run =
            self.weights.iter().find(|(first, reach, _)| (*first..first + reach.len()).contains(&index));
        match run {
            Some((first, _, channel)) => {
                component(channel, index - first, [[value(0), value(1)]; 2], ends.times, h).a
            }
            None => Jet::constant(value(0).x.abs()),
        }
    }
}

impl Jet {
    /// What bounds both.
    fn max(self, o: Self) -> Self {
        let most = |a, b| super::most([a, b].into_iter());
        Self {
            value: most(self.value, o.value),
            rate: most(self.rate, o.rate),
            bend: most(self.bend, o.bend),
        }
    }
}
