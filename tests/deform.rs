//! What every deformer promises, and what skinning and kinematics keep at the extremes.

use glam::{Affine3A, DAffine3, DQuat, DVec3, Quat, Vec3, Vec3Swizzles};
use sinew::fk::{self, Posed};
use sinew::math::rotation::angle_between;
use sinew::pose::Pose;
use sinew::skeleton::{BoneDesc, BoneId, Skeleton};
use sinew::skin::{Deformed, Method, Rest, Weights, deform, deform_positions};

use crate::rng::Rng;

/// A tube of radius 1 along x from 0 to 4, with normals.
fn tube() -> (Vec<Vec3>, Vec<Vec3>) {
    let ring = |i: usize| (0..12).map(move |k| (i, k as f32 * std::f32::consts::TAU / 12.0));
    (0..=16)
        .flat_map(ring)
        .map(|(i, a)| {
            let n = Vec3::new(0.0, a.cos(), a.sin());
            (n + Vec3::X * (i as f32 * 0.25), n)
        })
        .unzip()
}

/// Two influences a vertex, blending from bone 0 to bone 1 along x.
fn blend(positions: &[Vec3]) -> Weights {
    let bones: Vec<u32> = positions.iter().flat_map(|_| [0, 1]).collect();
    let weights: Vec<f32> = positions.iter().flat_map(|p| [1.0 - p.x / 4.0, p.x / 4.0]).collect();
    Weights::new(2, &bones, &weights, 2, 0).unwrap().0
}

fn one_hot(n: usize) -> Weights {
    Weights::new(1, &vec![0; n], &vec![1.0; n], 1, 0).unwrap().0
}

fn run(method: Method, positions: &[Vec3], normals: &[Vec3], palette: &[Affine3A]) -> Deformed {
    let mut out = Deformed::default();
    deform(method, Rest { positions, normals, tangents: &[] }, palette, &mut out);
    out
}

fn random_rigid(rng: &mut Rng) -> Affine3A {
    let q = Quat::from_xyzw(rng.unit(), rng.unit(), rng.unit(), rng.unit()).normalize();
    Affine3A::from_rotation_translation(q, Vec3::new(rng.unit(), rng.unit(), rng.unit()) * 5.0)
}

#[test]
fn a_rigid_motion_of_the_whole_body_moves_every_vertex_rigidly_under_every_deformer() {
    let (p, n) = tube();
    let (blended, hot) = (blend(&p), one_hot(p.len()));
    let mut rng = Rng::new(11);
    for _ in 0..50 {
        let m = random_rigid(&mut rng);
        for method in [Method::Rigid(0), Method::Linear(&hot), Method::Linear(&blended)] {
            let out = run(method, &p, &n, &[m, m]);
            for i in 0..p.len() {
                assert!((out.positions[i] - m.transform_point3(p[i])).length() < 5e-6);
                assert!((out.normals[i] - m.transform_vector3(n[i])).length() < 2e-6);
            }
            assert!(!out.mirrored);
        }
    }
}

#[test]
fn identity_palettes_leave_positions_bitwise_alone_and_one_hot_linear_is_rigid_bitwise() {
    let (p, n) = tube();
    let hot = one_hot(p.len());
    let out = run(Method::Linear(&hot), &p, &n, &[Affine3A::IDENTITY]);
    assert!(out.positions == p);
    assert!(out.normals.iter().zip(&n).all(|(a, b)| a.distance(*b) <= 2.0 * f32::EPSILON));
    let m = random_rigid(&mut Rng::new(3));
    assert!(run(Method::Linear(&hot), &p, &n, &[m]) == run(Method::Rigid(0), &p, &n, &[m]));
}

#[test]
fn linear_blending_collapses_as_its_formula_says() {
    // A twist by θ between two bones: the middle has radius r·cos(θ/2) (MEASURED: .924, .707, .383, .087).
    let p = [Vec3::new(2.0, 1.0, 0.0)];
    for (deg, radius) in [(45_f32, 0.92388), (90.0, 0.5_f32.sqrt()), (135.0, 0.38268), (170.0, 0.08716)] {
        let w = blend(&p);
        let twist = Affine3A::from_rotation_x(deg.to_radians());
        let out = run(Method::Linear(&w), &p, &[], &[Affine3A::IDENTITY, twist]);
        let r = out.positions[0].yz().length();
        assert!((r - radius).abs() < 1e-4, "{deg}°: {r}");
    }
    // ½I + ½Rx(180°) = diag(1, 0, 0): flat, but finite, and the normal is a unit vector.
    let half_turn = Affine3A::from_rotation_x(std::f32::consts::PI);
    let out = run(Method::Linear(&blend(&p)), &p, &[Vec3::Y], &[Affine3A::IDENTITY, half_turn]);
    assert!((out.positions[0] - Vec3::new(2.0, 0.0, 0.0)).length() < 1e-6);
    assert!((out.normals[0].length() - 1.0).abs() < 1e-6);
}

#[test]
fn mirrors_and_uneven_scales_keep_normals_square_to_the_surface() {
    let (p, n) = tube();
    let mut rng = Rng::new(5);
    for k in 0..40 {
        let s = Vec3::new(0.3 + rng.unit().abs(), 0.3 + rng.unit().abs(), 0.3 + rng.unit().abs());
        let s = if k % 2 == 0 { s } else { s * Vec3::new(-1.0, 1.0, 1.0) };
        let m = random_rigid(&mut rng) * Affine3A::from_scale(s);
        let out = run(Method::Rigid(0), &p, &n, &[m]);
        assert_eq!(out.mirrored, k % 2 == 1);
        for i in 0..p.len() {
            // Along the tube and around it: both tangents must stay square to the normal, which points away from the axis.
            let around = m.transform_vector3(Vec3::X.cross(n[i])).normalize();
            let along = m.transform_vector3(Vec3::X).normalize();
            assert!(out.normals[i].dot(around).abs() < 1e-5 && out.normals[i].dot(along).abs() < 1e-5);
            assert!(out.normals[i].dot(m.transform_vector3(n[i])) > 0.0);
        }
    }
}

#[test]
fn zero_scale_is_finite() {
    let (p, n) = tube();
    for s in [Vec3::ZERO, Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 0.0, 1.0), Vec3::splat(1e-30)] {
        for method in [Method::Rigid(0), Method::Linear(&blend(&p))] {
            let m = Affine3A::from_scale(s);
            let out = run(method, &p, &n, &[m, m]);
            assert!(out.positions.iter().all(|v| v.is_finite()));
            assert!(out.normals.iter().all(|v| (v.length() - 1.0).abs() < 1e-5), "{s}");
        }
    }
}

/// `n` bones of length `l` in a chain, each turned at random.
fn chain(n: usize, l: f32, seed: u64) -> (Skeleton, Pose) {
    let bone = |i: usize| {
        let mut b = BoneDesc { parent: i.checked_sub(1), length: l, ..BoneDesc::new(i.to_string()) };
        b.rest.translation = if i == 0 { Vec3::ZERO } else { Vec3::new(l, 0.0, 0.0) };
        b
    };
    let (skeleton, _) = Skeleton::new((0..n).map(bone).collect()).unwrap();
    let mut pose = Pose::rest(&skeleton);
    let mut rng = Rng::new(seed);
    for b in skeleton.ids() {
        pose.set_xzx(&skeleton, b, Vec3::new(rng.unit(), rng.unit(), rng.unit()) * 0.5);
    }
    (skeleton, pose)
}

#[test]
fn chains_stay_within_their_bound_up_to_a_hundred_thousand_bones() {
    for n in [10, 1000, 100_000] {
        let l = 1.0_f32;
        let (skeleton, pose) = chain(n, l, 7);
        let mut posed = Posed::default();
        fk::forward(&skeleton, &pose, &mut posed);
        let exact = fk::forward_f64(&skeleton, &pose);
        let last = BoneId(n as u32 - 1);
        let off = posed.origin(last).distance(exact[n - 1].translation);
        let drift = posed.world_from_bone(last).matrix3 - exact[n - 1].matrix3;
        let drift = drift.to_cols_array().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let eps = f32::EPSILON as f64;
        let bound = 2.0 * eps * (n as f64 * l as f64) * (n as f64).sqrt();
        assert!(off <= bound, "{n} bones: {off:.2e} m, bound {bound:.2e}");
        assert!(drift <= 6.0 * eps * (n as f64).sqrt(), "{n} bones: {drift:.2e}");
    }
}

#[test]
fn ten_thousand_kilometres_away_a_rig_deforms_as_at_home() {
    let (skeleton, mut pose) = chain(12, 0.3, 9);
    let (p, n) = tube();
    let w = blend(&p);
    let shape = |pose: &Pose| {
        let mut posed = Posed::default();
        fk::forward(&skeleton, pose, &mut posed);
        let center = posed.origin(BoneId(0));
        let palette = [posed.near(BoneId(4), center), posed.near(BoneId(11), center)];
        run(Method::Linear(&w), &p, &n, &palette)
    };
    let place = |pose: &mut Pose, turn: DQuat, far: f64| {
        pose.placement = DAffine3::from_rotation_translation(turn, DVec3::new(far, -far, 0.5 * far));
        shape(pose).positions.iter().map(|p| p.as_dvec3()).collect::<Vec<_>>()
    };
    let apart = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    let turn = DQuat::from_rotation_y(0.9);
    let (home, turned) = (place(&mut pose, DQuat::IDENTITY, 0.0), place(&mut pose, turn, 0.0));

    // A turn alone rounds every vertex anew, at home as anywhere: 2ε of the distance to the centre.
    let extent = home.iter().map(|p| p.length()).fold(0.0, f64::max);
    let bound = 2.0 * f32::EPSILON as f64 * extent;
    for far in [0.0, 1.0, 1e3, 1e7] {
        let off = apart(&home, &place(&mut pose, DQuat::IDENTITY, far));
        assert!(off <= 1e-6, "{far} m away: {off:e}");
        let there = place(&mut pose, turn, far);
        let off = apart(&turned, &there);
        assert!(off <= 1e-6, "turned and {far} m away: {off:e}");
        let back: Vec<DVec3> = there.iter().map(|p| turn.conjugate() * *p).collect();
        let off = apart(&home, &back);
        assert!(off <= bound, "turned back, {far} m away: {off:e}, bound {bound:e}");
    }
}

#[test]
fn a_root_far_away_in_the_pose_itself_costs_nothing_either() {
    let (skeleton, pose) = chain(12, 0.3, 9);
    let mut far = pose.clone();
    // A value that f32 holds exactly: the file's own rounding is not ours.
    far.locals[0].translation = Vec3::new(9_999_360.0, 0.0, -9_999_360.0);
    let tip = |pose: &Pose| {
        let mut posed = Posed::default();
        fk::forward(&skeleton, pose, &mut posed);
        posed.origin(BoneId(11)) - posed.origin(BoneId(0))
    };
    assert!(tip(&far).distance(tip(&pose)) <= 1e-6);
}

#[test]
fn scales_of_a_millionth_and_a_million_keep_five_digits() {
    for s in [1e-6_f32, 1e6] {
        let (skeleton, mut pose) = chain(6, 0.3, 4);
        pose.locals[0].scale = Vec3::splat(s);
        pose.locals[3].scale = Vec3::new(1.0 / s, 2.0 / s, 0.5 / s);
        let mut posed = Posed::default();
        fk::forward(&skeleton, &pose, &mut posed);
        let exact = fk::forward_f64(&skeleton, &pose);
        for b in skeleton.ids() {
            let (got, want) = (posed.world_from_bone(b), exact[b.index()]);
            let size = want.matrix3.to_cols_array().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let off =
                (got.matrix3 - want.matrix3).to_cols_array().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            assert!(off <= 1e-5 * size, "{s}: {off} of {size}");
        }
    }
}

#[test]
fn twist_bend_twist_back_is_a_bend_about_y() {
    let theta = Vec3::new(90_f32, 40.0, -90.0).map(f32::to_radians);
    let r = sinew::math::euler::rotation_from_xzx(theta);
    assert!(angle_between(r, Quat::from_rotation_y(40_f32.to_radians())) < 1e-6);
}

#[test]
fn positions_alone_are_the_same_numbers() {
    let mut rng = Rng::new(11);
    let point = |rng: &mut Rng| Vec3::from_array([0; 3].map(|_| rng.range(-2.0, 2.0) as f32));
    let rest: Vec<Vec3> = (0..50).map(|_| point(&mut rng)).collect();
    let turn = |rng: &mut Rng| Affine3A::from_rotation_y(rng.range(-3.0, 3.0) as f32);
    let palette = [turn(&mut rng), Affine3A::from_translation(point(&mut rng)), turn(&mut rng)];
    let bones: Vec<u32> = (0..100).map(|i| i % 3).collect();
    let shares: Vec<f32> =
        (0..100).map(|i| if i % 10 < 2 { (1 - i % 2) as f32 } else { 0.3 + 0.004 * i as f32 }).collect();
    let (weights, _) = Weights::new(2, &bones, &shares, 3, 0).unwrap();
    for method in [Method::Rigid(2), Method::Linear(&weights)] {
        let (mut all, mut alone) = (Deformed::default(), vec![Vec3::ONE; 3]);
        deform(method, Rest { positions: &rest, normals: &[], tangents: &[] }, &palette, &mut all);
        deform_positions(method, &rest, &palette, &mut alone);
        assert_eq!(all.positions, alone);
    }
}
