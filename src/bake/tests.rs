//! The bound between moments, against clips that were looked at much more closely.

use super::BakeDesc;
use super::gauge::{Gauge, Metric};
use super::times::verify;
use crate::character::{Binding, Character, Instance, MeshId};
use crate::clip::{Clip, Curve, Interpolation, Target, Track};
use crate::math::Trs;
use crate::math::spline::Tangents;
use crate::mesh::{Mesh, MeshData, MorphTarget};
use crate::skeleton::{BoneDesc, BoneId, Skeleton};
use crate::skin::Weights;
use crate::test_rng::Rng;
use glam::{Affine3A, Vec3};

const BONES: u32 = 5;

/// A chain with a morphing skin on its last two bones.
fn chain(rng: &mut Rng) -> Character {
    let rest = Trs { translation: Vec3::X * 0.4, ..Trs::IDENTITY };
    let bone = |i: u32| BoneDesc {
        parent: i.checked_sub(1).map(|p| p as usize),
        rest,
        ..BoneDesc::new(format!("b{i}"))
    };
    let (skeleton, _) = Skeleton::new((0..BONES).map(bone).collect()).unwrap();
    let positions: Vec<Vec3> = (0..30).map(|_| rng.point(0.3)).collect();
    let targets = (0..2)
        .map(|_| MorphTarget {
            positions: positions.iter().map(|_| rng.point(0.2)).collect(),
            ..Default::default()
        })
        .collect();
    let palette = vec![
        (BoneId(BONES - 2), Affine3A::from_translation(Vec3::Y * 0.1)),
        (BoneId(BONES - 1), Affine3A::from_rotation_z(0.4)),
    ];
    let weights: Vec<f32> = positions.iter().flat_map(|p| [0.5 + p.x, 0.5 - p.x]).collect();
    let (weights, _) = Weights::new(2, &[0, 1].repeat(30), &weights, 2, 0).unwrap();
    let mesh =
        Mesh::new(MeshData { positions, triangles: vec![[0, 1, 2]], targets, ..Default::default() }).unwrap();
    let instance = Instance { mesh: MeshId(0), binding: Binding::Skin { palette, weights }, first_weight: 0 };
    Character::new(skeleton, vec![mesh], vec![instance], vec![0.0; 2], vec![]).unwrap()
}

/// A curve of any kind; `near` makes it a little different from one of the same seed.
fn curve(seed: u64, width: usize, scale: f32, near: f32, other: &mut Rng) -> Curve {
    let mut rng = Rng::new(seed);
    let kinds = [
        Interpolation::Linear,
        Interpolation::Hermite,
        Interpolation::CatmullRom(Tangents::Notes),
        Interpolation::Hold,
        Interpolation::Linear,
    ];
    let mut kind = kinds[(rng.next() % 5) as usize];
    if near > 0.0 && kind == Interpolation::Linear && other.next().is_multiple_of(4) {
        kind = Interpolation::CatmullRom(Tangents::Monotone);
    }
    let n = 3 + rng.next() as usize % 4;
    let mut times: Vec<f64> = (0..n).map(|k| 0.3 * k as f64 + rng.range(0.0, 0.2)).collect();
    if rng.next().is_multiple_of(3) {
        times[2] = times[1];
    }
    let each = if kind == Interpolation::Hermite { 3 * width } else { width };
    let mut value = |k: usize| {
        let base = if width == 4 && (each == 4 || (k / 4) % 3 == 1) && k % 4 == 3 { 1.0 } else { 0.0 };
        base + scale * rng.unit() + near * scale * other.unit()
    };
    let values = (0..n * each).map(&mut value).collect();
    Curve::new(times, values, width, kind).unwrap()
}

fn clip(seed: u64, near: f32) -> Clip {
    let mut other = Rng::new(seed + 77);
    let mut tracks = vec![];
    for i in 0..BONES {
        let bone = BoneId(i);
        let seed = seed + 1000 * i as u64;
        let (target, width) = match (seed / 1000 + seed) % 3 {
            0 => (Target::Xzx(bone), 3),
            _ => (Target::Rotation(bone), 4),
        };
        tracks.push(Track { target, curve: curve(seed, width, 0.5, near, &mut other) });
        if i % 2 == 1 {
            tracks.push(Track {
                target: Target::Translation(bone),
                curve: curve(seed + 1, 3, 0.2, near, &mut other),
            });
            tracks.push(Track {
                target: Target::Scale(bone),
                curve: curve(seed + 2, 3, 0.3, near, &mut other),
            });
        }
    }
    tracks.push(Track {
        target: Target::Weights { first: 0 },
        curve: curve(seed + 3, 2, 1.0, near, &mut other),
    });
    Clip { name: String::new(), tracks }
}

#[test]
fn nothing_hides_above_the_ceiling() {
    let mut moments = 0;
    for seed in 0..60 {
        let character = chain(&mut Rng::new(seed));
        let (a, b) = (clip(seed, 0.0), clip(seed, 0.02));
        let metric = if seed % 4 == 0 { Metric::Shell(0.1) } else { Metric::Vertices };
        let pins = if seed % 5 == 0 { vec![(BoneId(2), 1e9)] } else { vec![] };
        let mut desc = BakeDesc { metric, pins, ..BakeDesc::default() };
        let end = a.range().end;
        let dense: Vec<f64> = (0..6000).map(|k| end * k as f64 / 5999.0).collect();
        let found = Gauge::of(&character, &desc).worst(&a, &b, &dense);

        // Allowed enough, the truth is bracketed.
        desc.tolerance = 1.2 * found.distance;
        let v = verify(&Gauge::of(&character, &desc), &a, &b);
        let dense = found.distance / desc.tolerance;
        assert!(v.ceiling <= 1.0 && dense <= v.ceiling + 1e-5, "{seed}: {dense} {v:?}");
        assert!(
            v.worst.share() >= 0.95 * dense && v.ceiling <= 1.06 * v.worst.share(),
            "{seed}: {dense} {v:?}"
        );
        moments += v.moments;

        // Allowed less than there is, a moment shows it.
        desc.tolerance = 0.99 * found.distance;
        assert!(verify(&Gauge::of(&character, &desc), &a, &b).worst.share() > 1.0, "{seed}");
    }
    assert!(moments < 60 * 20_000, "{moments}");
}

#[test]
fn a_swing_between_two_keys_that_agree_is_found() {
    // Both curves have the same keys; in between, one leaves and comes back within a hundredth of a second.
    let character = chain(&mut Rng::new(1));
    let swing = |slope: f32| {
        let one = |into: f32, out: f32| [0.0, 0.0, into, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, out, 0.0];
        let values = [one(0.0, 0.0), one(0.0, slope), one(-slope, 0.0), one(0.0, 0.0)].concat();
        let curve = Curve::new(vec![0.0, 5.0, 5.01, 10.0], values, 4, Interpolation::Hermite).unwrap();
        Clip { name: String::new(), tracks: vec![Track { target: Target::Rotation(BoneId(0)), curve }] }
    };
    let desc = BakeDesc { tolerance: 0.01, ..BakeDesc::default() };
    let v = verify(&Gauge::of(&character, &desc), &swing(0.0), &swing(20.0));
    assert!(v.worst.share() > 1.0 && (5.0..5.01).contains(&v.worst.time), "{v:?}");
}

#[test]
fn fast_turns_late_in_a_clip_keep_the_bound_at_times_that_files_hold() {
    let character = chain(&mut Rng::new(1));
    for (half, first, apart) in [(1.5, 0.0, 0.1), (1.5, 3000.0, 0.1), (0.2, 3000.0, 1.0 / 60.0)] {
        let times: Vec<f64> = (0..40).map(|k| f64::from((first + f64::from(k) * apart) as f32)).collect();
        let turn = |k: u32| [0.0, 0.0, (half * k as f32).sin(), (half * k as f32).cos()];
        let values = (0..40).flat_map(turn).collect();
        let curve = Curve::new(times.clone(), values, 4, Interpolation::Linear).unwrap();
        let source =
            Clip { name: String::new(), tracks: vec![Track { target: Target::Rotation(BoneId(3)), curve }] };
        let desc = BakeDesc { tolerance: 1e-4, ..BakeDesc::default() };
        let baked = super::bake(&character, &source, &desc).unwrap();
        let keys = baked.clip.tracks.iter().flat_map(|t| t.curve.times());
        assert!(keys.copied().all(|t| t == f64::from(t as f32)));
        assert!(baked.report.bytes[1] <= baked.report.bytes[0]);
        let dense: Vec<f64> =
            (0..40_000).map(|k| times[0] + (times[39] - times[0]) * f64::from(k) / 39_999.0).collect();
        let found = Gauge::of(&character, &desc).worst(&source, &baked.clip, &dense);
        // Vertices are told apart to some 1e-7 m.
        assert!(found.share() <= baked.report.ceiling + 2e-3, "{half} {first}: {found:?} {:?}", baked.report);
    }
}

#[test]
fn a_loop_of_half_turns_goes_round_as_it_did() {
    let character = chain(&mut Rng::new(2));
    // What a full turn in two arcs of half a turn comes to in single precision: the smallest parts say which way round.
    let [w, y] = [-4.371_139e-8, -8.742_278e-8];
    let values = vec![0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, w, 0.0, y, 0.0, -1.0];
    let curve = Curve::new(vec![0.0, 1.0, 2.0], values, 4, Interpolation::Linear).unwrap();
    let source =
        Clip { name: String::new(), tracks: vec![Track { target: Target::Rotation(BoneId(3)), curve }] };
    let desc = BakeDesc { cycle: true, ..BakeDesc::default() };
    let baked = super::bake(&character, &source, &desc).unwrap();
    let dense: Vec<f64> = (0..=2000).map(|k| f64::from(k) * 1e-3).collect();
    let found = Gauge::of(&character, &desc).worst(&source, &baked.clip, &dense);
    assert!(found.share() <= 1.0, "{found:?} {baked:?}");
}
