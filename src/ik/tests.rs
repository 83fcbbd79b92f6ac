use super::*;
use crate::fk;
use crate::math::Trs;
use crate::skeleton::{BoneDesc, Limits};
use crate::test_rng::Rng;
use glam::{DAffine3, Quat};

fn quat(rng: &mut Rng) -> Quat {
    Quat::from_scaled_axis(rng.point(2.0))
}

/// A chain of `n` bones with frames of all kinds; every `limited`-th has limits around its rest.
fn arm(rng: &mut Rng, n: usize, limited: usize, scaled: bool) -> Skeleton {
    let bone = |i: usize| {
        let wide = rng.point(1.5).abs() + 0.2;
        let limits = (limited > 0 && i.is_multiple_of(limited)).then_some(Limits { min: -wide, max: wide });
        let scale = if scaled { Vec3::ONE + rng.point(0.3) } else { Vec3::ONE };
        let rest = Trs { translation: rng.point(0.5), rotation: quat(rng), scale };
        let desc = BoneDesc::new(format!("{i}"));
        BoneDesc { parent: i.checked_sub(1), rest, aim: quat(rng), length: 0.4, limits, ..desc }
    };
    Skeleton::new((0..n).map(bone).collect()).unwrap().0
}

/// A pose within the limits.
fn allowed(s: &Skeleton, rng: &mut Rng) -> Pose {
    let mut pose = Pose::rest(s);
    for b in s.ids() {
        let wide = s.limits(b).map_or(Vec3::splat(1.5), |l| l.max);
        pose.set_xzx(s, b, Vec3::new(rng.unit(), rng.unit(), rng.unit()) * wide);
    }
    pose
}

fn tip(s: &Skeleton, pose: &Pose, bone: BoneId) -> DVec3 {
    fk::forward_f64(s, pose)[bone.index()].transform_point3(s.tip(bone).as_dvec3())
}

#[test]
fn derivatives_are_exact() {
    let mut rng = Rng::new(1);
    for k in 0..40 {
        let s = arm(&mut rng, 5, k % 3, k % 2 == 0);
        let mut pose = allowed(&s, &mut rng);
        pose.placement = DAffine3::from_rotation_translation(quat(&mut rng).as_dquat(), DVec3::splat(3.0));
        let goals = [4, 2].map(|b| Goal { bone: BoneId(b), point: rng.point(0.5), target: DVec3::ZERO });
        let mut body = Body::new(&s, &pose, &s.ids().collect::<Vec<_>>(), &goals);
        let columns = body.jacobian(&body.world());
        for (i, column) in columns.iter().enumerate() {
            let h = 1e-6;
            let at = |body: &mut Body, by: f64| {
                let kept = body.joints[i / 3].1;
                match &mut body.joints[i / 3].1 {
                    Joint::Limited { theta, .. } => theta[i % 3] += by,
                    joint => joint.turn(DVec3::AXES[i % 3] * by),
                }
                let missing = body.missing(&body.world());
                body.joints[i / 3].1 = kept;
                missing
            };
            let (less, more) = (at(&mut body, -h), at(&mut body, h));
            for g in 0..2 {
                let slope = (less[g] - more[g]) / (2.0 * h);
                assert!((slope - column[g]).length() < 1e-8, "{k}, {i}: {slope} {}", column[g]);
            }
        }
    }
}

/// Two bones of a metre: the law of cosines says the elbow's bend.
#[test]
fn an_elbow_bends_as_cosines_say() {
    let mut fore = BoneDesc { parent: Some(0), length: 1.0, ..BoneDesc::new("fore") };
    fore.rest.translation = Vec3::X;
    let (s, of) = Skeleton::new(vec![BoneDesc { length: 1.0, ..BoneDesc::new("upper") }, fore]).unwrap();
    // Along the straight arm nothing pulls sideways; behind and beside it something does.
    for target in
        [DVec3::X, DVec3::NEG_X * 0.5, DVec3::new(0.0, 0.0, 1.2), DVec3::new(0.3, -0.4, 0.5), DVec3::Y * 1.9]
    {
        let mut pose = Pose::rest(&s);
        let goal = Goal { bone: of[1], point: s.tip(of[1]), target };
        let found = solve(&s, &mut pose, &of, &[goal], &Settings::default());
        assert!(found.reached && tip(&s, &pose, of[1]).distance(target) < 1e-5, "{target}: {found:?}");
        let bend = pose.xzx(&s, of[1], None).y as f64;
        let want = std::f64::consts::PI - (1.0 - target.length_squared() / 2.0).acos();
        assert!((bend - want).abs() < 1e-4, "{target}: {bend} {want}");
    }
    // Too far away: stretched towards it, and the rest is said.
    let mut pose = Pose::rest(&s);
    let goal = Goal { bone: of[1], point: s.tip(of[1]), target: DVec3::new(0.0, 3.0, 4.0) };
    let found = solve(&s, &mut pose, &of, &[goal], &Settings::default());
    assert!(!found.reached && (found.residual - 3.0).abs() < 1e-4, "{found:?}");
}

#[test]
fn what_can_be_reached_is_reached_within_the_limits() {
    let mut rng = Rng::new(2);
    for limited in [0, 2, 1] {
        let (mut reached, mut steps) = (0, 0);
        for _ in 0..200 {
            let s = arm(&mut rng, 4, limited, false);
            let end = BoneId(3);
            let target = tip(&s, &allowed(&s, &mut rng), end);
            let mut pose = Pose::rest(&s);
            let before = tip(&s, &pose, end).distance(target);
            let goal = Goal { bone: end, point: s.tip(end), target };
            let found = solve(&s, &mut pose, &chain(&s, end, 9), &[goal], &Settings::default());
            assert!(found.residual <= before + 1e-9);
            assert!((tip(&s, &pose, end).distance(target) - found.residual).abs() < 2e-6);
            for (b, theta) in &found.angles {
                let l = s.limits(*b).unwrap();
                assert!(theta.cmpge(l.min).all() && theta.cmple(l.max).all(), "{theta} {l:?}");
                let mut again = Pose::rest(&s);
                again.set_xzx(&s, *b, *theta);
                let (p, q) = (again.locals[b.index()].rotation, pose.locals[b.index()].rotation);
                assert!(crate::math::rotation::angle_between(p, q) < 1e-6);
            }
            reached += u32::from(found.reached);
            steps += found.steps;
        }
        let least = [200, 196, 198][limited];
        assert!(reached >= least, "limits on each {limited}th bone: {reached} of 200, {steps} steps");
    }
}

#[test]
fn several_goals_and_senseless_ones() {
    let mut rng = Rng::new(3);
    let s = arm(&mut rng, 6, 0, false);
    let wanted = allowed(&s, &mut rng);
    let goals = [2, 5].map(|b| Goal {
        bone: BoneId(b),
        point: s.tip(BoneId(b)),
        target: tip(&s, &wanted, BoneId(b)),
    });
    let mut pose = Pose::rest(&s);
    let all: Vec<BoneId> = s.ids().collect();
    let found = solve(&s, &mut pose, &all, &goals, &Settings::default());
    assert!(found.reached, "{found:?}");
    for target in [DVec3::NAN, DVec3::INFINITY, DVec3::splat(1e300)] {
        let mut same = pose.clone();
        let found = solve(&s, &mut same, &all, &[Goal { target, ..goals[0] }], &Settings::default());
        assert!(!found.reached && same.locals.iter().all(|l| l.is_finite()));
    }
    let mut same = pose.clone();
    let none = solve(&s, &mut same, &[], &goals, &Settings::default());
    assert!(none.reached && same == pose);
    // Squashed flat, a chain still gives numbers.
    pose.locals[1].scale = Vec3::ZERO;
    let found = solve(&s, &mut pose, &all, &[Goal { target: DVec3::ONE, ..goals[1] }], &Settings::default());
    assert!(found.residual.is_finite() && pose.locals.iter().all(|l| l.is_finite()));
}
