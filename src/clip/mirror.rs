//! A clip the other way round.

use super::{Clip, Curve, Interpolation, Target, Track};
use crate::math::rotation;
use crate::math::spline::Tangents;
use crate::pose::mirror::Mirror;
use crate::skeleton::{BoneId, Skeleton};
use glam::{Quat, Vec3};

impl Clip {
    /// Left does what right did, at every moment as [`Mirror::pose`] would have it; morph weights stay.
    ///
    /// Keys stay at their times and curves of their kinds, which is exact but for XZX angles of bones that are not
    /// [plain](Mirror::is_plain): these are right at their keys. Where the rest pose is not its own mirror image, bones that the clip
    /// leaves at rest get a key.
    ///
    /// # Panics
    /// If the clip is of another skeleton.
    pub fn mirrored(&self, skeleton: &Skeleton, mirror: &Mirror) -> Self {
        let mut tracks: Vec<Track> = self.tracks.iter().map(|t| track(t, mirror)).collect();
        let start = self.range().start;
        for bone in skeleton.ids() {
            tracks.extend(self.at_rest(skeleton, mirror, bone, start));
        }
        Self { name: self.name.clone(), tracks }
    }

    /// Keys for the partner of a bone that no track moves.
    fn at_rest(&self, skeleton: &Skeleton, mirror: &Mirror, bone: BoneId, start: f64) -> Vec<Track> {
        let pair = mirror.pair(bone);
        let (own, other) = (skeleton.rest(bone), skeleton.rest(pair));
        let key = |target, values: &[f32]| {
            let curve = Curve::new(vec![start], values.to_vec(), values.len(), Interpolation::Hold);
            Track { target, curve: curve.expect("one finite key") }
        };
        let moved = |kinds: &[Target]| self.tracks.iter().any(|t| kinds.contains(&t.target));
        let mut keys = vec![];
        let turned = mirror.rotation(bone, own.rotation);
        if !moved(&[Target::Xzx(bone), Target::Rotation(bone)])
            && rotation::angle_between(turned, other.rotation) > 1e-5
        {
            keys.push(key(Target::Rotation(pair), &turned.to_array()));
        }
        let shifted = mirror.translation(bone, own.translation);
        if !moved(&[Target::Translation(bone)])
            && (shifted - other.translation).length() > 1e-6 * (1.0 + shifted.length())
        {
            keys.push(key(Target::Translation(pair), &shifted.to_array()));
        }
        keys
    }
}

fn track(t: &Track, mirror: &Mirror) -> Track {
    let c = &t.curve;
    let vec3 = |v: &[f32]| Vec3::from_slice(v);
    let (target, curve) = match t.target {
        Target::Weights { .. } => return t.clone(),
        Target::Rotation(b) => {
            // Monotone slopes are made component by component, and components are mixed here.
            let mixed = match c.interpolation() {
                Interpolation::CatmullRom(Tangents::Monotone) => &c.with_slopes(),
                _ => c,
            };
            (
                Target::Rotation(mirror.pair(b)),
                map(mixed, |v, _| mirror.rotation(b, Quat::from_slice(v)).to_array()),
            )
        }
        Target::Translation(b) => {
            let mixed = match c.interpolation() {
                Interpolation::CatmullRom(Tangents::Monotone) => &c.with_slopes(),
                _ => c,
            };
            let image = |v: &[f32], slope| match slope {
                true => mirror.vector(b, vec3(v)),
                false => mirror.translation(b, vec3(v)),
            };
            (Target::Translation(mirror.pair(b)), map(mixed, |v, slope| image(v, slope).to_array()))
        }
        Target::Scale(b) => {
            (Target::Scale(mirror.pair(b)), map(c, |v, _| mirror.scale(b, vec3(v)).to_array()))
        }
        Target::Xzx(b) => (Target::Xzx(mirror.pair(b)), angles(c, b, mirror)),
    };
    Track { target, curve }
}

/// Every run of `N` numbers, each known to be a value or a slope.
fn map<const N: usize>(c: &Curve, image: impl Fn(&[f32], bool) -> [f32; N]) -> Curve {
    let slopes = c.interpolation() == Interpolation::Hermite;
    let runs = c.values().chunks_exact(N).enumerate();
    let values = runs.flat_map(|(i, v)| image(v, slopes && i % 3 != 1)).collect();
    Curve::new(c.times().to_vec(), values, N, c.interpolation()).expect("finite keys at the same times")
}

fn angles(c: &Curve, bone: BoneId, mirror: &Mirror) -> Curve {
    if mirror.is_plain(bone) {
        return map(c, |v, slope| {
            let v = Vec3::from_slice(v);
            let image = mirror.xzx_slope(bone, v).filter(|_| slope);
            image.unwrap_or_else(|| mirror.xzx(bone, v, None)).to_array()
        });
    }
    // Slopes would have to be made anew; the three-point rule stands in for them.
    let kind = match c.interpolation() {
        Interpolation::Hermite => Interpolation::CatmullRom(Tangents::ThreePoint),
        kind => kind,
    };
    let (mut values, mut last) = (Vec::new(), None);
    for k in 0..c.times().len() {
        let theta = mirror.xzx(bone, Vec3::from_slice(c.value(k)), last);
        values.extend(theta.to_array());
        last = Some(theta);
    }
    Curve::new(c.times().to_vec(), values, 3, kind).expect("finite keys at the same times")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::angle_between;
    use crate::pose::Pose;
    use crate::pose::mirror::tests::{body, turn};
    use crate::test_rng::Rng;

    fn random(rng: &mut Rng, s: &Skeleton) -> Clip {
        let kinds = [
            Interpolation::Hold,
            Interpolation::Linear,
            Interpolation::CatmullRom(Tangents::Notes),
            Interpolation::CatmullRom(Tangents::Monotone),
            Interpolation::Hermite,
        ];
        let mut tracks = vec![];
        for b in s.ids() {
            let kind = kinds[rng.below(5)];
            let runs = if kind == Interpolation::Hermite { 12 } else { 4 };
            let (target, width) = match rng.below(4) {
                0 => (Target::Xzx(b), 3),
                1 => (Target::Rotation(b), 4),
                2 => (Target::Translation(b), 3),
                _ => continue,
            };
            let one = |rng: &mut Rng| match width {
                4 => turn(rng).to_array().to_vec(),
                _ => rng.point(1.0).to_array().to_vec(),
            };
            let values = (0..runs).flat_map(|_| one(rng)).collect();
            let curve = Curve::new(vec![0.0, 0.3, 1.0, 2.0], values, width, kind).unwrap();
            tracks.push(Track { target, curve });
        }
        Clip { name: "c".into(), tracks }
    }

    /// At every moment a mirrored clip shows the mirrored pose, also where the reference is not the rest pose.
    #[test]
    fn every_moment_is_mirrored() {
        let mut rng = Rng::new(3);
        for _ in 0..40 {
            let s = body(&mut rng, true);
            let mut crooked = Pose::rest(&s);
            crooked.locals[2].rotation = turn(&mut rng);
            // In the middle only bones that lie in the plane are plain; all of these do.
            for m in [Mirror::new(&s), Mirror::about(&s, &crooked, Some(Vec3::X))] {
                let clip = random(&mut rng, &s);
                let other = clip.mirrored(&s, &m);
                let steps: Vec<f64> = (-2..23).map(|k| f64::from(k) * 0.1).collect();
                for t in steps {
                    let at = |c: &Clip| {
                        let mut pose = Pose::rest(&s);
                        c.sample(&s, t, &mut pose);
                        pose
                    };
                    let (want, found) = (m.pose(&at(&clip)), at(&other));
                    for b in s.ids().filter(|b| m.is_plain(m.pair(*b))) {
                        let (w, f) = (want.locals[b.index()], found.locals[b.index()]);
                        assert!(angle_between(w.rotation, f.rotation) < 2e-5, "{} at {t}", s.name(b));
                        assert!((w.translation - f.translation).length() < 1e-5, "{} at {t}", s.name(b));
                    }
                }
            }
        }
    }
}
