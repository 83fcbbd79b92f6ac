//! Pip: a round creature on two feet, with ears and a tail that follow through.

use super::File;
use super::kit::bones::Bones;
use super::kit::face::{arc, cord, eye, eye_materials};
use super::kit::field::{Field, linear};
use super::kit::gait::Foot;
use super::kit::motion::{Stance, clip, ease};
use super::kit::parts::Machine;
use super::kit::skin::skin;
use super::kit::surface::polygonise;
use super::kit::{self, Look};
use glam::{DQuat, DVec3};
use sinew::io::rig_json::Clip;
use std::f64::consts::TAU;

const TEAL: u32 = 0x2aa79b;
const DEEP: u32 = 0x176a78;
const CREAM: u32 = 0xf7e9cc;
const CORAL: u32 = 0xff7d5a;

pub fn files() -> Vec<File> {
    let bones = bones();
    let clips = vec![walk(&bones), run(&bones), wave(&bones)];
    kit::files("pip", "Pip", &bones, look(&bones), clips)
}

fn bones() -> Bones {
    let mut b = Bones::default();
    b.add("root", None, [0.0, 0.0, 0.0], [0.0, 0.15, 0.0]);
    b.add("hips", Some("root"), [0.0, 0.47, 0.0], [0.0, 0.56, 0.0]);
    b.add("spine", Some("hips"), [0.0, 0.56, 0.0], [0.0, 0.67, 0.0]);
    b.add("chest", Some("spine"), [0.0, 0.67, 0.0], [0.0, 0.8, 0.0]);
    b.add("neck", Some("chest"), [0.0, 0.8, 0.0], [0.0, 0.86, 0.01]);
    b.add("head", Some("neck"), [0.0, 0.86, 0.01], [0.0, 1.22, 0.01]);
    for (s, side) in [(1.0, "L"), (-1.0, "R")] {
        let n = |name: &str| format!("{name}.{side}");
        b.add(&n("ear"), Some("head"), [s * 0.12, 1.16, 0.0], [s * 0.2, 1.29, -0.02]);
        b.add(&n("ear tip"), Some(&n("ear")), [s * 0.2, 1.29, -0.02], [s * 0.3, 1.4, -0.06]);
    }
    b.add("tail 1", Some("hips"), [0.0, 0.48, -0.12], [0.0, 0.45, -0.22]);
    b.add("tail 2", Some("tail 1"), [0.0, 0.45, -0.22], [0.0, 0.47, -0.32]);
    b.add("tail 3", Some("tail 2"), [0.0, 0.47, -0.32], [0.0, 0.55, -0.39]);
    for (s, side) in [(1.0, "L"), (-1.0, "R")] {
        let n = |name: &str| format!("{name}.{side}");
        b.add(&n("clavicle"), Some("chest"), [s * 0.03, 0.76, 0.0], [s * 0.12, 0.755, 0.0]);
        let swing = DVec3::Y;
        b.hinged(&n("upper arm"), &n("clavicle"), [s * 0.12, 0.755, 0.0], [s * 0.25, 0.66, 0.0], swing);
        b.hinged(&n("forearm"), &n("upper arm"), [s * 0.25, 0.66, 0.0], [s * 0.37, 0.57, 0.01], swing);
        b.hinged(&n("hand"), &n("forearm"), [s * 0.37, 0.57, 0.01], [s * 0.43, 0.525, 0.015], swing);
        b.hinged(&n("fingers"), &n("hand"), [s * 0.43, 0.525, 0.015], [s * 0.5, 0.475, 0.02], swing);
        b.add(&n("thumb"), Some(&n("hand")), [s * 0.385, 0.57, 0.03], [s * 0.41, 0.565, 0.085]);
        b.add(&n("thigh"), Some("hips"), [s * 0.095, 0.45, 0.0], [s * 0.1, 0.265, 0.012]);
        b.add(&n("shin"), Some(&n("thigh")), [s * 0.1, 0.265, 0.012], [s * 0.1, 0.085, -0.015]);
        b.add(&n("foot"), Some(&n("shin")), [s * 0.1, 0.085, -0.015], [s * 0.105, 0.035, 0.085]);
        b.add(&n("toes"), Some(&n("foot")), [s * 0.105, 0.035, 0.085], [s * 0.105, 0.035, 0.155]);
    }
    b
}

fn look(b: &Bones) -> Look {
    let mut look = Look::default();
    look.material("skin", 0xffffff, 0.12, 24.0);
    eye_materials(&mut look, 0x7a4bd0);
    look.material("mouth", 0x5a2230, 0.1, 20.0);
    let body = body(b);
    let solid = polygonise(&body, 0.029);
    look.meshes.push(skin("body", "skin", b, &body, solid, 8, paint));
    let mut m = Machine::default();
    for s in [1.0, -1.0] {
        eye(&mut m, b, "head", [s * 0.083, 1.03, 0.152], 0.062, DVec3::new(s * 0.22, 0.05, 1.0));
    }
    let smile =
        arc(DVec3::new(0.0, 0.972, 0.187), DVec3::X * 0.062, DVec3::new(0.0, -0.04, 0.006), 150.0, 11);
    m.add(b, "head", "mouth", cord(&smile, 0.008, 8));
    m.finish(b, &mut look, 180.0);
    look
}

fn body(b: &Bones) -> Field {
    let mut f = Field::default();
    let id = |n: &str| b.id(n);
    let none = DQuat::IDENTITY;
    f.egg(id("hips"), [0.0, 0.49, -0.005], [0.16, 0.13, 0.145], none, 0.0, TEAL);
    f.egg(id("spine"), [0.0, 0.61, 0.005], [0.15, 0.13, 0.135], none, 0.08, TEAL);
    f.egg(id("chest"), [0.0, 0.72, 0.0], [0.13, 0.11, 0.11], none, 0.08, TEAL);
    f.bone(b, "neck", [0.075, 0.075], 0.05, TEAL);
    f.egg(id("head"), [0.0, 1.04, 0.01], [0.205, 0.19, 0.18], none, 0.05, TEAL);
    f.egg(id("head"), [0.0, 0.97, 0.1], [0.12, 0.075, 0.09], none, 0.08, CREAM);
    f.bone(b, "tail 1", [0.06, 0.05], 0.06, TEAL);
    f.bone(b, "tail 2", [0.05, 0.05], 0.008, TEAL);
    f.bone(b, "tail 3", [0.052, 0.062], 0.02, CORAL);
    for side in ["L", "R"] {
        let n = |name: &str| format!("{name}.{side}");
        f.bone(b, &n("ear"), [0.06, 0.05], 0.06, TEAL);
        f.bone(b, &n("ear tip"), [0.05, 0.03], 0.008, CORAL);
        f.bone(b, &n("upper arm"), [0.058, 0.05], 0.05, TEAL);
        f.bone(b, &n("forearm"), [0.05, 0.05], 0.008, TEAL);
        f.bone(b, &n("hand"), [0.055, 0.06], 0.008, DEEP);
        f.bone(b, &n("fingers"), [0.055, 0.038], 0.008, DEEP);
        f.bone(b, &n("thumb"), [0.034, 0.028], 0.025, DEEP);
        f.bone(b, &n("thigh"), [0.088, 0.068], 0.05, TEAL);
        f.bone(b, &n("shin"), [0.068, 0.06], 0.008, TEAL);
        let (foot, toes) = (id(&n("foot")), id(&n("toes")));
        let lift = DVec3::Y * 0.022;
        f.limb(foot, [b.heads[foot] - DVec3::Y * 0.02, b.tails[foot] + lift], [0.064, 0.057], 0.03, DEEP);
        f.limb(toes, [b.heads[toes] + lift, b.tails[toes] + lift * 0.7], [0.057, 0.05], 0.02, DEEP);
    }
    f
}

/// A cream belly.
fn paint(p: DVec3, _: DVec3, base: DVec3) -> DVec3 {
    let belly = ((p - DVec3::new(0.0, 0.6, 0.14)) / DVec3::new(0.115, 0.15, 0.13)).length();
    base.lerp(linear(CREAM), 1.0 - ease((belly - 0.9) / 0.2))
}

/// How a gait goes; phases are those of the left leg.
struct Gait {
    foot: Foot,
    /// Mean height of the hips against rest, and how far they rise and fall, metres.
    low: f64,
    bob: f64,
    /// Phase at which the hips are highest, within half a cycle.
    high: f64,
    lean_deg: f64,
    sway: f64,
    twist_deg: f64,
    arms_deg: f64,
    elbows_deg: f64,
}

fn foot(stance: f64, reach: f64, lift: f64, strike_deg: f64, push_deg: f64) -> Foot {
    Foot {
        stance,
        reach,
        forward: 0.0,
        lift,
        strike_deg,
        push_deg,
        heel: DVec3::new(0.0, -0.085, -0.045),
        ball: DVec3::new(0.0, -0.085, 0.1),
    }
}

fn stride<'a>(b: &'a Bones, g: &Gait, phase: f64) -> Stance<'a> {
    let mut s = Stance::rest(b);
    let wave = |k: f64, shift: f64| (TAU * (k * (phase - shift))).cos();
    // Hips: up and down twice a cycle, over the standing leg once.
    let mid = g.foot.stance * 0.5;
    s.shift("hips", DVec3::new(g.sway * wave(1.0, mid), g.low + g.bob * wave(2.0, g.high), 0.0));
    s.pose("hips", g.lean_deg * 0.4, -g.twist_deg * wave(1.0, 0.0), -0.35 * g.twist_deg * wave(1.0, mid));

    // The spine turns against the hips, so that the face looks ahead.
    s.pose("spine", g.lean_deg * 0.3, g.twist_deg * wave(1.0, 0.02), 0.2 * g.twist_deg * wave(1.0, mid));
    s.pose("chest", g.lean_deg * 0.3, g.twist_deg * wave(1.0, 0.03), 0.2 * g.twist_deg * wave(1.0, mid));
    s.pose("neck", -g.lean_deg * 0.4, -0.5 * g.twist_deg * wave(1.0, 0.03), 0.0);
    s.pose(
        "head",
        -g.lean_deg * 0.5 + 60.0 * g.bob * wave(2.0, g.high + 0.12),
        -0.4 * g.twist_deg * wave(1.0, 0.04),
        0.0,
    );

    // Arms swing against the legs; the elbow bends more in front, the hand drags.
    for (side, sign, shift) in [("L", 1.0, 0.5), ("R", -1.0, 0.0)] {
        let n = |name: &str| format!("{name}.{side}");
        let swing = wave(1.0, shift);
        s.turn(&n("upper arm"), DVec3::Z, -sign * (42.0 - 0.1 * g.arms_deg));
        s.turn(&n("upper arm"), DVec3::X, -g.arms_deg * swing + 0.12 * g.elbows_deg);
        let up = s.world_turn(b.id(&n("upper arm"))) * elbow_axis(b, &n("upper arm"));
        let local = s.world_turn(b.id(&n("upper arm"))).conjugate() * up;
        s.turn(&n("forearm"), local * -sign, g.elbows_deg + 0.35 * g.arms_deg * wave(1.0, shift + 0.06));
        s.turn(&n("hand"), local * -sign, 10.0 - 0.3 * g.arms_deg * wave(1.0, shift - 0.2));
        s.turn(&n("fingers"), DVec3::new(0.0, 0.0, 1.0), -sign * 18.0);
        s.turn(&n("clavicle"), DVec3::Y, -sign * 0.15 * g.arms_deg * swing);
        let flop = 400.0 * g.bob * wave(2.0, g.high + 0.2);
        s.turn(&n("ear"), DVec3::X, -0.4 * g.lean_deg + 0.6 * flop);
        s.turn(&n("ear"), DVec3::Z, sign * 0.5 * flop);
        s.turn(&n("ear tip"), DVec3::X, 600.0 * g.bob * wave(2.0, g.high + 0.28));
    }
    for (k, name) in ["tail 1", "tail 2", "tail 3"].into_iter().enumerate() {
        let late = 0.12 * k as f64;
        s.turn(name, DVec3::Y, 1.3 * g.twist_deg * wave(1.0, 0.1 + late));
        s.turn(name, DVec3::X, 350.0 * g.bob * wave(2.0, g.high + 0.12 + late));
    }
    for (side, shift) in [("L", 0.0), ("R", 0.5)] {
        let step = g.foot.at(phase - shift);
        plant(&mut s, side, step.ankle, step.pitch_deg, step.toes_deg);
    }
    s
}

/// The axis at rest about which an elbow bends: across the arm, upright as far as it can be.
fn elbow_axis(b: &Bones, bone: &str) -> DVec3 {
    let i = b.id(bone);
    b.frames[i] * DVec3::Z
}

fn plant(s: &mut Stance, side: &str, ankle: DVec3, pitch_deg: f64, toes_deg: f64) {
    let n = |name: &str| format!("{name}.{side}");
    let goal = s.bones.head(&n("foot")) + ankle;
    s.reach(&n("thigh"), &n("shin"), goal, DVec3::Z);
    let turn = DQuat::from_rotation_x(pitch_deg.to_radians());
    s.set_world_turn(s.bones.id(&n("foot")), turn);
    s.turn(&n("toes"), DVec3::X, toes_deg);
}

fn walk(b: &Bones) -> Clip {
    let g = Gait {
        foot: foot(0.6, 0.16, 0.055, 22.0, 42.0),
        low: -0.022,
        bob: 0.012,
        high: 0.3,
        lean_deg: 4.0,
        sway: 0.018,
        twist_deg: 8.0,
        arms_deg: 28.0,
        elbows_deg: 22.0,
    };
    clip("walk", b, 0.96, 24, true, |phase| stride(b, &g, phase))
}

fn run(b: &Bones) -> Clip {
    let g = Gait {
        foot: Foot { forward: -0.02, ..foot(0.34, 0.17, 0.17, 8.0, 55.0) },
        low: 0.0,
        bob: 0.035,
        high: 0.43,
        lean_deg: 17.0,
        sway: 0.008,
        twist_deg: 13.0,
        arms_deg: 48.0,
        elbows_deg: 78.0,
    };
    clip("run", b, 0.6, 24, true, |phase| stride(b, &g, phase))
}

fn wave(b: &Bones) -> Clip {
    clip("wave", b, 3.2, 48, true, |phase| {
        let osc = |k: f64, shift: f64| (TAU * (k * phase - shift)).sin();
        // Up at the beginning, down at the end.
        let up = ease(phase / 0.2) * (1.0 - ease((phase - 0.78) / 0.22));
        let mut s = Stance::rest(b);
        s.shift("hips", DVec3::new(-0.02 * up, -0.012 + 0.004 * osc(2.0, 0.0), 0.0));
        s.pose("hips", 0.0, -4.0 * up, 3.0 * up);
        s.pose("spine", 1.0 + osc(2.0, 0.1), 0.0, -3.0 * up);
        s.pose("chest", 1.0 + osc(2.0, 0.15), 3.0 * up, -5.0 * up);
        s.pose("neck", 0.0, 2.0 * up, 3.0 * up);
        s.pose("head", 2.0 * osc(2.0, 0.3), 4.0 * up, 9.0 * up + 2.0 * up * osc(6.0, 0.4));

        // The left arm waves, the right hangs.
        let shake = up * osc(6.0, 0.0);
        s.turn("clavicle.L", DVec3::Z, 14.0 * up);
        s.turn("upper arm.L", DVec3::Z, -40.0 + 88.0 * up);
        s.turn("upper arm.L", DVec3::Y, -16.0 * up);
        s.turn("forearm.L", DVec3::Z, 8.0 + 30.0 * up + 24.0 * shake);
        s.turn("hand.L", DVec3::Z, 12.0 * up * osc(6.0, 0.8) + 5.0 * up);
        s.turn("fingers.L", DVec3::Z, -12.0 + 20.0 * up + 10.0 * up * osc(6.0, 1.4));
        s.turn("upper arm.R", DVec3::Z, 40.0 + 2.0 * osc(2.0, 0.4));
        s.turn("forearm.R", elbow_axis(b, "forearm.R"), 16.0);
        s.turn("fingers.R", DVec3::Z, 15.0);
        for (side, sign) in [("L", 1.0), ("R", -1.0)] {
            let late = 6.0 * up * osc(6.0, 1.2);
            s.turn(&format!("ear.{side}"), DVec3::Z, late + sign * 6.0 * up);
            s.turn(
                &format!("ear tip.{side}"),
                DVec3::Z,
                2.0 * up * osc(6.0, 2.2) + sign * 3.0 * osc(2.0, 0.9),
            );
            plant(&mut s, side, DVec3::ZERO, 0.0, 0.0);
        }
        for (k, name) in ["tail 1", "tail 2", "tail 3"].into_iter().enumerate() {
            s.turn(name, DVec3::Y, (8.0 + 12.0 * up) * osc(4.0, 0.9 * k as f64));
        }
        s
    })
}
