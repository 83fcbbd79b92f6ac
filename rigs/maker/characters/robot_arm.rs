//! A six-axis arm with a camera eye that carries a cube from one stand to the other and back.

use super::File;
use super::kit::bones::{Bones, limit};
use super::kit::motion::{Stance, clip, ease};
use super::kit::parts::{Machine, ball, bevel_box, cylinder, lathe, taper_box};
use super::kit::{self, Look, rgb};
use glam::{DAffine3, DQuat, DVec3};
use sinew::io::rig_json::Clip;

/// Height of shoulder and elbow at rest, reach of the forearm, wrist to grip.
const SHOULDER: f64 = 0.46;
const ELBOW: f64 = 1.02;
const WRIST: f64 = 0.52;
const GRIP: f64 = 0.34;
/// Half of the cube's edge, and of the stands' top.
const CUBE: f64 = 0.06;
const STAND: f64 = 0.22;
/// Where the stands are: distance, and angle from +z.
const FAR: f64 = 0.62;
const SIDE_DEG: f64 = 52.0;

pub fn files() -> Vec<File> {
    let bones = bones();
    let clips = vec![pick_and_place(&bones), look_around(&bones)];
    kit::files("robot-arm", "Robot arm", &bones, look(&bones), clips)
}

fn bones() -> Bones {
    let mut b = Bones::default();
    b.add("base", None, [0.0, 0.0, 0.0], [0.0, 0.16, 0.0]);
    limit(
        b.add("turret", Some("base"), [0.0, 0.16, 0.0], [0.0, SHOULDER, 0.0]),
        [-170.0, 0.0, 0.0],
        [170.0, 0.0, 0.0],
    );
    limit(
        b.add("upper arm", Some("turret"), [0.0, SHOULDER, 0.0], [0.0, ELBOW, 0.0]),
        [0.0, -60.0, 0.0],
        [0.0, 100.0, 0.0],
    );
    limit(
        b.add("forearm", Some("upper arm"), [0.0, ELBOW, 0.0], [0.0, ELBOW, WRIST]),
        [0.0, -60.0, 0.0],
        [0.0, 120.0, 0.0],
    );
    limit(
        b.add("wrist", Some("forearm"), [0.0, ELBOW, WRIST], [0.0, ELBOW, WRIST + 0.14]),
        [-180.0, -120.0, 0.0],
        [180.0, 120.0, 0.0],
    );
    limit(
        b.add("palm", Some("wrist"), [0.0, ELBOW, WRIST + 0.14], [0.0, ELBOW, WRIST + 0.22]),
        [-180.0, 0.0, 0.0],
        [180.0, 0.0, 0.0],
    );
    for (name, x) in [("finger.L", 0.1), ("finger.R", -0.1)] {
        b.add(name, Some("palm"), [x, ELBOW, WRIST + 0.22], [x, ELBOW, WRIST + 0.38]);
    }
    let [x, _, z] = stand(1.0).to_array();
    b.add("cube", None, [x, STAND, z], [x, STAND + 2.0 * CUBE, z]);
    b
}

/// The foot of a stand: +1 is on the left (+x), −1 on the right.
fn stand(side: f64) -> DVec3 {
    let (s, c) = (side * SIDE_DEG).to_radians().sin_cos();
    DVec3::new(FAR * s, 0.0, FAR * c)
}

fn look(bones: &Bones) -> Look {
    let mut look = Look::default();
    look.material("paint", 0xf0781e, 0.25, 60.0);
    look.material("steel", 0x4a5563, 0.35, 80.0);
    look.material("dark", 0x20262e, 0.15, 30.0);
    look.material("light", 0xe9edf0, 0.2, 40.0);
    look.material("glow", 0x103040, 0.8, 200.0).emissive = Some(rgb(0x2bb8e6));
    look.material("cube", 0x2f9e6e, 0.2, 40.0);
    let mut m = Machine::default();
    body(bones, &mut m);
    hand(bones, &mut m);
    stands(bones, &mut m);
    m.finish(bones, &mut look, 32.0);
    look
}

fn body(b: &Bones, m: &mut Machine) {
    // A turned foot with a row of bolts.
    let foot = [
        (0.0, 0.0),
        (0.0, 0.29),
        (0.02, 0.31),
        (0.06, 0.31),
        (0.08, 0.29),
        (0.1, 0.21),
        (0.15, 0.18),
        (0.16, 0.0),
    ];
    m.add(b, "base", "steel", lathe(&foot, 40).along(DVec3::Y));
    for k in 0..10 {
        let a = std::f64::consts::TAU * (k as f64 + 0.5) / 10.0;
        let bolt = cylinder(0.03, 0.018, 0.005, 8).along(DVec3::Y);
        m.add(b, "base", "light", bolt.at([0.255 * a.sin(), 0.092, 0.255 * a.cos()]));
    }

    // The turret: a drum and two cheeks that hold the shoulder.
    let drum = [(0.16, 0.0), (0.16, 0.16), (0.175, 0.185), (0.27, 0.185), (0.3, 0.16), (0.31, 0.0)];
    m.add(b, "turret", "paint", lathe(&drum, 36).along(DVec3::Y));
    m.add(b, "turret", "dark", cylinder(0.02, 0.188, 0.004, 36).along(DVec3::Y).at([0.0, 0.215, 0.0]));
    for x in [-1.0, 1.0] {
        let cheek =
            taper_box(0.27, SHOULDER, [-0.028, 0.028, -0.13, 0.13], [-0.028, 0.028, -0.09, 0.09], 0.012);
        m.add(b, "turret", "paint", upright(cheek).at([x * 0.125, 0.0, 0.0]));
        m.add(b, "turret", "paint", cylinder(0.056, 0.1, 0.012, 32).at([x * 0.125, SHOULDER, 0.0]));
        m.add(b, "turret", "light", cylinder(0.02, 0.05, 0.006, 20).at([x * 0.158, SHOULDER, 0.0]));
    }

    // The upper arm: a drum at each end, a tapering beam with a lighter inlay between.
    m.add(b, "upper arm", "steel", cylinder(0.19, 0.088, 0.012, 32).at([0.0, SHOULDER, 0.0]));
    let beam = taper_box(SHOULDER, ELBOW, [-0.07, 0.07, -0.085, 0.085], [-0.055, 0.055, -0.06, 0.06], 0.02);
    m.add(b, "upper arm", "paint", upright(beam));
    for x in [-1.0, 1.0] {
        let inlay = bevel_box([-0.008, 0.58, -0.03], [0.008, 0.88, 0.03], 0.004);
        m.add(b, "upper arm", "dark", inlay.at([x * 0.064, 0.0, 0.0]));
        m.add(b, "upper arm", "paint", cylinder(0.05, 0.085, 0.012, 28).at([x * 0.083, ELBOW, 0.0]));
        m.add(b, "upper arm", "light", cylinder(0.018, 0.042, 0.005, 20).at([x * 0.112, ELBOW, 0.0]));
    }
    let hose = bevel_box([-0.025, 0.56, -0.1], [0.025, 0.92, -0.06], 0.012);
    m.add(b, "upper arm", "dark", hose);

    // The forearm: a motor behind the elbow, a tapering tube in front.
    m.add(b, "forearm", "steel", cylinder(0.112, 0.075, 0.01, 28).at([0.0, ELBOW, 0.0]));
    let motor = [(-0.19, 0.0), (-0.19, 0.05), (-0.175, 0.066), (-0.06, 0.066), (-0.05, 0.05), (-0.05, 0.0)];
    m.add(b, "forearm", "steel", lathe(&motor, 24).along(DVec3::Z).at([0.0, ELBOW, 0.0]));
    let tube = [
        (0.03, 0.0),
        (0.03, 0.05),
        (0.06, 0.075),
        (0.17, 0.075),
        (0.2, 0.06),
        (0.42, 0.048),
        (0.44, 0.056),
        (0.475, 0.056),
        (0.485, 0.0),
    ];
    m.add(b, "forearm", "paint", lathe(&tube, 28).along(DVec3::Z).at([0.0, ELBOW, 0.0]));
    m.add(b, "forearm", "dark", cylinder(0.016, 0.078, 0.004, 28).along(DVec3::Z).at([0.0, ELBOW, 0.12]));
    for x in [-1.0, 1.0] {
        let fork = bevel_box([-0.012, -0.04, 0.44], [0.012, 0.04, WRIST + 0.03], 0.008);
        m.add(b, "forearm", "paint", fork.at([x * 0.058, ELBOW, 0.0]));
    }
}

fn hand(b: &Bones, m: &mut Machine) {
    let at = |z: f64| [0.0, ELBOW, WRIST + z];
    m.add(b, "wrist", "steel", cylinder(0.1, 0.05, 0.008, 24).at(at(0.0)));
    m.add(b, "wrist", "paint", cylinder(0.11, 0.048, 0.01, 24).along(DVec3::Z).at(at(0.085)));

    // The eye sits on top of the wrist and looks along the tool.
    let eye = [0.0, ELBOW + 0.085, WRIST + 0.09];
    m.add(b, "wrist", "light", cylinder(0.1, 0.05, 0.014, 24).along(DVec3::Z).at(eye));
    m.add(
        b,
        "wrist",
        "dark",
        cylinder(0.02, 0.042, 0.004, 24).along(DVec3::Z).at([0.0, eye[1], eye[2] + 0.046]),
    );
    let lens = ball(0.034, 8, 18).by(DAffine3::from_scale(DVec3::new(0.5, 1.0, 1.0)));
    m.add(b, "wrist", "glow", lens.along(DVec3::Z).at([0.0, eye[1], eye[2] + 0.052]));

    m.add(b, "palm", "steel", cylinder(0.03, 0.055, 0.006, 24).along(DVec3::Z).at(at(0.155)));
    m.add(b, "palm", "paint", bevel_box([-0.15, -0.035, 0.17], [0.15, 0.035, 0.215], 0.01).at(at(0.0)));
    m.add(b, "palm", "dark", bevel_box([-0.14, -0.015, 0.205], [0.14, 0.015, 0.225], 0.004).at(at(0.0)));
    for (name, s) in [("finger.L", 1.0), ("finger.R", -1.0)] {
        let x = s * 0.1;
        m.add(
            b,
            name,
            "steel",
            bevel_box([x - 0.018, -0.028, 0.215], [x + 0.018, 0.028, 0.26], 0.006).at(at(0.0)),
        );
        let blade = bevel_box([x - 0.009, -0.022, 0.25], [x + 0.009, 0.022, 0.38], 0.006);
        m.add(b, name, "steel", blade.at(at(0.0)).at([s * 0.008, 0.0, 0.0]));
        let pad = bevel_box([x - 0.007, -0.02, 0.3], [x + 0.007, 0.02, 0.375], 0.004);
        m.add(b, name, "dark", pad.at(at(0.0)).at([-s * 0.006, 0.0, 0.0]));
    }
}

fn stands(b: &Bones, m: &mut Machine) {
    let top = [(0.0, 0.0), (0.0, 0.15), (0.015, 0.16), (0.04, 0.16), (0.06, 0.1), (STAND - 0.04, 0.09)];
    let rim = [(STAND - 0.025, 0.13), (STAND - 0.01, 0.135), (STAND, 0.125), (STAND, 0.0)];
    let profile = [top.as_slice(), &rim].concat();
    for (side, color) in [(1.0, "light"), (-1.0, "light")] {
        m.add(b, "base", color, lathe(&profile, 28).along(DVec3::Y).at(stand(side).to_array()));
    }
    let [x, _, z] = stand(1.0).to_array();
    let turned = DQuat::from_rotation_y(SIDE_DEG.to_radians());
    let c = CUBE;
    let cube = bevel_box([-c, 0.0, -c], [c, 2.0 * c, c], 0.012).by(DAffine3::from_quat(turned));
    m.add(b, "cube", "cube", cube.at([x, STAND, z]));
    for k in 0..4 {
        let q = turned * DQuat::from_rotation_y(k as f64 * std::f64::consts::FRAC_PI_2);
        let spot = cylinder(0.006, 0.028, 0.002, 16).along(DVec3::Z).at([0.0, c, c]);
        m.add(b, "cube", "light", spot.by(DAffine3::from_rotation_translation(q, DVec3::new(x, STAND, z))));
    }
}

/// A solid along x, stood up along y.
fn upright(s: super::kit::parts::Solid) -> super::kit::parts::Solid {
    // x → y, y → x, z stays: a mirror, which turns triangles round.
    s.by(DAffine3::from_mat3(glam::DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::Z)))
}

/// What the arm is doing: yaw in degrees, distance and height of the grip, opening of the fingers (0 closed on the cube).
#[derive(Clone, Copy)]
struct Goal {
    yaw: f64,
    far: f64,
    up: f64,
    open: f64,
}

/// Moments of half a cycle and the goals there; the other half is its mirror image.
const STEPS: [(f64, Goal); 9] = [
    (0.0, Goal { yaw: 0.0, far: 0.5, up: HIGH, open: 1.0 }),
    (0.2, Goal { yaw: SIDE_DEG, far: FAR, up: HIGH, open: 1.0 }),
    (0.34, Goal { yaw: SIDE_DEG, far: FAR, up: LOW, open: 1.0 }),
    (0.42, Goal { yaw: SIDE_DEG, far: FAR, up: LOW, open: 0.0 }),
    (0.54, Goal { yaw: SIDE_DEG, far: FAR, up: HIGH, open: 0.0 }),
    (0.76, Goal { yaw: -SIDE_DEG, far: FAR, up: HIGH, open: 0.0 }),
    (0.86, Goal { yaw: -SIDE_DEG, far: FAR, up: LOW, open: 0.0 }),
    (0.92, Goal { yaw: -SIDE_DEG, far: FAR, up: LOW, open: 1.0 }),
    (1.0, Goal { yaw: 0.0, far: 0.5, up: HIGH, open: 1.0 }),
];

/// Height of the grip on the way, and around the cube.
const HIGH: f64 = 0.55;
const LOW: f64 = STAND + CUBE + 0.005;

fn goal(phase: f64) -> Goal {
    // Two halves: there, and back with left and right exchanged.
    let half = (phase * 2.0).fract();
    let sign = if phase * 2.0 % 2.0 < 1.0 { 1.0 } else { -1.0 };
    let k = STEPS.iter().rposition(|s| s.0 <= half).unwrap_or(0);
    let ((t0, a), (t1, b)) = (STEPS[k], STEPS[k + 1]);
    let u = ease((half - t0) / (t1 - t0));
    let mix = |x: f64, y: f64| x + (y - x) * u;
    Goal {
        yaw: sign * mix(a.yaw, b.yaw),
        far: mix(a.far, b.far),
        up: mix(a.up, b.up),
        open: mix(a.open, b.open),
    }
}

fn at_goal<'a>(bones: &'a Bones, g: Goal) -> Stance<'a> {
    let mut s = Stance::rest(bones);
    s.turn("turret", DVec3::Y, g.yaw);
    let dir = DQuat::from_rotation_y(g.yaw.to_radians()) * DVec3::Z;
    let wrist = dir * g.far + DVec3::Y * (g.up + GRIP);
    s.reach("upper arm", "forearm", wrist, DVec3::Y * 0.9 - dir * 0.44);

    // The tool hangs straight down.
    let down = DQuat::from_rotation_y(g.yaw.to_radians()) * DQuat::from_rotation_x(90_f64.to_radians());
    s.set_world_turn(bones.id("wrist"), down);
    let slide = 0.1 - (CUBE + 0.013) - 0.03 * g.open;
    s.shift("finger.L", DVec3::X * -slide);
    s.shift("finger.R", DVec3::X * slide);
    s
}

fn pick_and_place(bones: &Bones) -> Clip {
    let cube = bones.id("cube");
    clip("pick and place", bones, 8.0, 80, true, |phase| {
        let g = goal(phase);
        let mut s = at_goal(bones, g);
        // The cube stands on the left, rides in the hand, stands on the right, and comes back.
        let half = (phase * 2.0).fract();
        let there = phase * 2.0 % 2.0 < 1.0;
        let angle = if half < STEPS[3].0 {
            if there { SIDE_DEG } else { -SIDE_DEG }
        } else if half > STEPS[6].0 {
            if there { -SIDE_DEG } else { SIDE_DEG }
        } else {
            g.yaw
        };
        let held = half >= STEPS[3].0 && half <= STEPS[6].0;
        let lift = if held { g.up - STEPS[2].1.up } else { 0.0 };
        let turned = DQuat::from_rotation_y((angle - SIDE_DEG).to_radians());
        let place = turned * stand(1.0) + DVec3::Y * lift;
        s.turns[cube] = turned;
        s.offsets[cube] = place - stand(1.0);
        s
    })
}

/// The eye looks left, right and at you.
fn look_around(bones: &Bones) -> Clip {
    clip("look around", bones, 6.0, 24, true, |phase| {
        let wave = |k: f64, shift: f64| (std::f64::consts::TAU * (k * phase + shift)).sin();
        let mut s = Stance::rest(bones);
        s.turn("turret", DVec3::Y, 45.0 * wave(1.0, 0.0));
        s.turn("upper arm", DVec3::X, -12.0 + 9.0 * wave(2.0, 0.1));
        s.turn("forearm", DVec3::X, 10.0 - 14.0 * wave(2.0, 0.15));
        s.turn("wrist", DVec3::X, 8.0 + 12.0 * wave(2.0, 0.4));
        s.turn("wrist", DVec3::Z, 18.0 * wave(1.0, 0.2));
        s.shift("finger.L", DVec3::X * (-0.03 + 0.015 * wave(4.0, 0.0)));
        s.shift("finger.R", DVec3::X * (0.03 - 0.015 * wave(4.0, 0.0)));
        s
    })
}
