//! A fox that gallops, walks and waits.

use super::File;
use super::kit::bones::Bones;
use super::kit::face::{eye, eye_materials};
use super::kit::field::{Field, linear};
use super::kit::gait::{Foot, Step};
use super::kit::motion::{Stance, clip, ease};
use super::kit::parts::{Machine, ball};
use super::kit::skin::skin;
use super::kit::surface::polygonise;
use super::kit::{self, Look};
use glam::{DQuat, DVec3};
use sinew::io::rig_json::Clip;
use std::f64::consts::TAU;

const ORANGE: u32 = 0xe8762c;
const CREAM: u32 = 0xfdf1e0;
const BROWN: u32 = 0x3b241a;
const TAIL: [&str; 5] = ["tail 1", "tail 2", "tail 3", "tail 4", "tail 5"];

pub fn files() -> Vec<File> {
    let bones = bones();
    let clips = vec![gallop(&bones), walk(&bones), idle(&bones)];
    kit::files("fox", "Fox", &bones, look(&bones), clips)
}

fn bones() -> Bones {
    let mut b = Bones::default();
    b.add("root", None, [0.0, 0.0, 0.0], [0.0, 0.1, 0.0]);
    b.add("hips", Some("root"), [0.0, 0.5, -0.3], [0.0, 0.515, -0.15]);
    b.add("spine 1", Some("hips"), [0.0, 0.515, -0.15], [0.0, 0.515, 0.0]);
    b.add("spine 2", Some("spine 1"), [0.0, 0.515, 0.0], [0.0, 0.505, 0.14]);
    b.add("chest", Some("spine 2"), [0.0, 0.505, 0.14], [0.0, 0.52, 0.28]);
    b.add("neck", Some("chest"), [0.0, 0.53, 0.29], [0.0, 0.67, 0.4]);
    b.add("head", Some("neck"), [0.0, 0.67, 0.4], [0.0, 0.69, 0.66]);
    b.add("jaw", Some("head"), [0.0, 0.65, 0.5], [0.0, 0.635, 0.64]);
    for (s, side) in [(1.0, "L"), (-1.0, "R")] {
        let ear = format!("ear.{side}");
        b.add(&ear, Some("head"), [s * 0.065, 0.77, 0.45], [s * 0.105, 0.93, 0.43]);
    }
    let tail = [
        [0.0, 0.52, -0.34],
        [0.0, 0.5, -0.45],
        [0.0, 0.46, -0.57],
        [0.0, 0.43, -0.69],
        [0.0, 0.43, -0.81],
        [0.0, 0.46, -0.92],
    ];
    for (k, name) in TAIL.into_iter().enumerate() {
        b.add(name, Some(if k == 0 { "hips" } else { TAIL[k - 1] }), tail[k], tail[k + 1]);
    }
    for (s, side) in [(1.0, "L"), (-1.0, "R")] {
        let n = |name: &str| format!("{name}.{side}");
        let x = s * 0.095;
        b.add(&n("femur"), Some("hips"), [x, 0.47, -0.28], [x, 0.3, -0.2]);
        b.add(&n("tibia"), Some(&n("femur")), [x, 0.3, -0.2], [x, 0.17, -0.34]);
        b.add(&n("metatarsus"), Some(&n("tibia")), [x, 0.17, -0.34], [x, 0.045, -0.315]);
        b.add(&n("hind paw"), Some(&n("metatarsus")), [x, 0.045, -0.315], [x, 0.03, -0.23]);
        let x = s * 0.085;
        b.add(&n("scapula"), Some("chest"), [x, 0.53, 0.2], [x, 0.41, 0.27]);
        b.add(&n("humerus"), Some(&n("scapula")), [x, 0.41, 0.27], [x, 0.275, 0.2]);
        b.add(&n("radius"), Some(&n("humerus")), [x, 0.275, 0.2], [x, 0.12, 0.225]);
        b.add(&n("metacarpus"), Some(&n("radius")), [x, 0.12, 0.225], [x, 0.045, 0.235]);
        b.add(&n("fore paw"), Some(&n("metacarpus")), [x, 0.045, 0.235], [x, 0.03, 0.31]);
    }
    b
}

fn look(b: &Bones) -> Look {
    let mut look = Look::default();
    look.material("fur", 0xffffff, 0.06, 14.0);
    eye_materials(&mut look, 0xc98a1b);
    let body = body(b);
    let solid = polygonise(&body, 0.0275);
    look.meshes.push(skin("body", "fur", b, &body, solid, 8, |p, n, base| paint(b, p, n, base)));
    let mut m = Machine::default();
    for s in [1.0, -1.0] {
        eye(&mut m, b, "head", [s * 0.058, 0.737, 0.545], 0.036, DVec3::new(s * 0.5, 0.1, 1.0));
    }
    m.add(b, "head", "pupil", ball(0.024, 8, 14).at([0.0, 0.69, 0.705]));
    m.finish(b, &mut look, 180.0);
    look
}

fn body(b: &Bones) -> Field {
    let mut f = Field::default();
    let id = |n: &str| b.id(n);
    let none = DQuat::IDENTITY;
    f.egg(id("hips"), [0.0, 0.49, -0.25], [0.115, 0.125, 0.14], none, 0.0, ORANGE);
    f.egg(id("spine 1"), [0.0, 0.485, -0.08], [0.1, 0.105, 0.13], none, 0.07, ORANGE);
    f.egg(id("spine 2"), [0.0, 0.475, 0.07], [0.11, 0.12, 0.13], none, 0.07, ORANGE);
    f.egg(id("chest"), [0.0, 0.475, 0.22], [0.115, 0.14, 0.13], none, 0.07, ORANGE);
    f.bone(b, "neck", [0.1, 0.075], 0.07, ORANGE);
    f.egg(id("head"), [0.0, 0.72, 0.47], [0.112, 0.098, 0.11], none, 0.05, ORANGE);
    f.egg(id("head"), [0.0, 0.69, 0.5], [0.13, 0.055, 0.07], none, 0.05, CREAM);
    f.limb(
        id("head"),
        [DVec3::new(0.0, 0.695, 0.55), DVec3::new(0.0, 0.682, 0.675)],
        [0.055, 0.03],
        0.05,
        ORANGE,
    );
    f.limb(
        id("jaw"),
        [DVec3::new(0.0, 0.655, 0.54), DVec3::new(0.0, 0.652, 0.64)],
        [0.036, 0.024],
        0.03,
        CREAM,
    );
    for (k, name) in TAIL.into_iter().enumerate() {
        let r = [0.04, 0.065, 0.085, 0.092, 0.075, 0.03];
        f.bone(
            b,
            name,
            [r[k], r[k + 1]],
            if k == 0 { 0.05 } else { 0.01 },
            if k < 3 { ORANGE } else { CREAM },
        );
    }
    for side in ["L", "R"] {
        let n = |name: &str| format!("{name}.{side}");
        f.bone(b, &n("ear"), [0.054, 0.024], 0.04, ORANGE);
        f.bone(b, &n("femur"), [0.092, 0.06], 0.05, ORANGE);
        f.bone(b, &n("tibia"), [0.06, 0.037], 0.012, ORANGE);
        f.bone(b, &n("metatarsus"), [0.037, 0.036], 0.008, BROWN);
        f.bone(b, &n("hind paw"), [0.04, 0.034], 0.012, BROWN);
        f.bone(b, &n("scapula"), [0.06, 0.07], 0.05, ORANGE);
        f.bone(b, &n("humerus"), [0.068, 0.05], 0.02, ORANGE);
        f.bone(b, &n("radius"), [0.048, 0.037], 0.01, ORANGE);
        f.bone(b, &n("metacarpus"), [0.037, 0.038], 0.008, BROWN);
        f.bone(b, &n("fore paw"), [0.04, 0.034], 0.012, BROWN);
    }
    f
}

/// Cream below, dark socks and ear tips.
fn paint(b: &Bones, p: DVec3, n: DVec3, base: DVec3) -> DVec3 {
    let mix = |from: DVec3, to: u32, t: f64| from.lerp(linear(to), t.clamp(0.0, 1.0));
    let belly = ease((0.16 - p.z) / 0.06) * ease((p.z + 0.3) / 0.08) * ease((p.y - 0.3) / 0.05);
    let mut c = mix(base, CREAM, belly * ease((-n.y - 0.3) / 0.5));
    // A bib from the chin down to the chest.
    let bib = ((p - DVec3::new(0.0, 0.52, 0.38)) / DVec3::new(0.085, 0.15, 0.11)).length();
    c = mix(c, CREAM, ease((1.3 - bib) / 0.5));
    c = mix(c, CREAM, ease((0.7 - p.y) / 0.05) * ease((p.z - 0.45) / 0.06));
    if p.y < 0.3 && p.z > -0.45 {
        c = mix(c, BROWN, ease((0.2 - p.y) / 0.05));
    }
    c = mix(c, CREAM, ease((-p.z - 0.73) / 0.06));
    mix(c, BROWN, ease((p.y - b.tail("ear.L").y + 0.06) / 0.03))
}

/// One leg at one moment: where its paw is, and how the bone above it leans.
fn leg(s: &mut Stance, names: [&str; 4], side: &str, pole: f64, step: &Step, lean_deg: f64) {
    let n = names.map(|name| format!("{name}.{side}"));
    let (cannon, paw) = (s.bones.id(&n[2]), s.bones.id(&n[3]));
    let lean = DQuat::from_rotation_x(lean_deg.to_radians());
    let ground = s.bones.heads[paw] + step.ankle;
    let ankle = ground + lean * (s.bones.heads[cannon] - s.bones.heads[paw]);
    s.reach(&n[0], &n[1], ankle, DVec3::Z * pole);
    s.set_world_turn(cannon, lean);
    s.set_world_turn(paw, DQuat::from_rotation_x((step.pitch_deg + step.toes_deg * 0.3).to_radians()));
}

/// How a gait goes.
struct Gait {
    /// Phases of touch-down: hind left, hind right, fore left, fore right.
    order: [f64; 4],
    hind: Foot,
    fore: Foot,
    /// How far the bones above the paws lean on the ground, and how far they fold in the air, degrees.
    lean_deg: f64,
    fold_deg: f64,
}

fn paw(stance: f64, reach: f64, forward: f64, lift: f64, push_deg: f64) -> Foot {
    Foot {
        stance,
        reach,
        forward,
        lift,
        strike_deg: 6.0,
        push_deg,
        heel: DVec3::ZERO,
        ball: DVec3::new(0.0, -0.012, 0.07),
    }
}

fn legs(s: &mut Stance, g: &Gait, phase: f64) {
    let lean = |foot: &Foot, at: f64| {
        let at = at.rem_euclid(1.0);
        if at < foot.stance {
            g.lean_deg * (2.0 * at / foot.stance - 1.0)
        } else {
            // From leaning back over folded to leaning forward.
            let u = (at - foot.stance) / (1.0 - foot.stance);
            let fold = (std::f64::consts::PI * u.powf(0.75)).sin().powi(2);
            g.lean_deg * (1.0 - 2.0 * ease(u)) + g.fold_deg * fold
        }
    };
    for (k, side) in ["L", "R"].into_iter().enumerate() {
        let at = phase - g.order[k];
        let hind = ["femur", "tibia", "metatarsus", "hind paw"];
        leg(s, hind, side, 1.0, &g.hind.at(at), lean(&g.hind, at));
        let at = phase - g.order[k + 2];
        let swing = (TAU * (at - 0.5 * g.fore.stance)).sin();
        s.turn(&format!("scapula.{side}"), DVec3::X, 60.0 * g.fore.reach * swing);
        let fore = ["humerus", "radius", "metacarpus", "fore paw"];
        leg(s, fore, side, -1.0, &g.fore.at(at), lean(&g.fore, at));
    }
}

fn gallop(b: &Bones) -> Clip {
    let g = Gait {
        order: [0.0, 0.09, 0.43, 0.53],
        hind: paw(0.27, 0.19, 0.1, 0.075, 42.0),
        fore: paw(0.26, 0.2, 0.05, 0.17, 40.0),
        lean_deg: 24.0,
        fold_deg: 42.0,
    };
    clip("gallop", b, 0.56, 24, true, |phase| {
        let wave = |k: f64, at: f64| (TAU * k * (phase - at)).cos();
        let mut s = Stance::rest(b);
        // Gathered in the air with an arched back, stretched out between hind and fore feet.
        let arch = wave(1.0, 0.9);
        s.shift(
            "hips",
            DVec3::new(0.0, -0.045 + 0.03 * wave(2.0, 0.39) + 0.012 * wave(1.0, 0.85), 0.02 * arch),
        );
        s.pose("hips", -13.0 * arch + 7.0 * wave(1.0, 0.62), 0.0, 0.0);
        s.pose("spine 1", 9.0 * arch, 0.0, 0.0);
        s.pose("spine 2", 9.0 * arch, 0.0, 0.0);
        s.pose("chest", 6.0 * arch - 3.0 * wave(1.0, 0.62), 0.0, 0.0);
        s.pose("neck", 12.0 - 9.0 * arch - 3.0 * wave(1.0, 0.6), 0.0, 0.0);
        s.pose("head", -8.0 - 3.0 * arch, 0.0, 0.0);
        s.pose("jaw", 5.0 + 3.0 * wave(1.0, 0.2), 0.0, 0.0);
        for (side, sign) in [("L", 1.0), ("R", -1.0)] {
            s.pose(&format!("ear.{side}"), -22.0 - 9.0 * wave(1.0, 0.15), 0.0, -sign * 6.0 * wave(1.0, 0.3));
        }
        for (k, name) in TAIL.into_iter().enumerate() {
            let late = 0.1 * k as f64;
            let level = [-22.0, 4.0, 2.0, -2.0, -6.0][k];
            s.pose(name, level + 10.0 * wave(1.0, 0.95 + late), 3.0 * wave(1.0, 0.2 + late), 0.0);
        }
        legs(&mut s, &g, phase);
        s
    })
}

fn walk(b: &Bones) -> Clip {
    let g = Gait {
        order: [0.0, 0.5, 0.25, 0.75],
        hind: paw(0.64, 0.11, 0.01, 0.05, 32.0),
        fore: paw(0.63, 0.11, 0.0, 0.055, 30.0),
        lean_deg: 13.0,
        fold_deg: 42.0,
    };
    clip("walk", b, 1.0, 24, true, |phase| {
        let wave = |k: f64, at: f64| (TAU * k * (phase - at)).cos();
        let mut s = Stance::rest(b);
        s.shift("hips", DVec3::new(0.008 * wave(1.0, 0.3), -0.02 + 0.006 * wave(2.0, 0.3), 0.0));
        s.pose("hips", 1.5 * wave(2.0, 0.1), -5.0 * wave(1.0, 0.0), 4.0 * wave(1.0, 0.8));
        s.pose("spine 1", 0.0, 3.0 * wave(1.0, 0.05), -1.5 * wave(1.0, 0.8));
        s.pose("spine 2", 0.0, 3.0 * wave(1.0, 0.1), -2.0 * wave(1.0, 0.8));
        s.pose("chest", -wave(2.0, 0.1), -3.0 * wave(1.0, 0.25), -2.0 * wave(1.0, 0.05));
        s.pose("neck", 6.0 + 2.5 * wave(2.0, 0.1), 1.5 * wave(1.0, 0.25), 0.0);
        s.pose("head", -4.0 - 2.0 * wave(2.0, 0.18), 1.0 * wave(1.0, 0.25), 1.5 * wave(1.0, 0.0));
        for (side, sign) in [("L", 1.0), ("R", -1.0)] {
            s.pose(&format!("ear.{side}"), 3.0 * wave(2.0, 0.3), 0.0, sign * 2.0 * wave(2.0, 0.35));
        }
        for (k, name) in TAIL.into_iter().enumerate() {
            let late = 0.09 * k as f64;
            s.pose(
                name,
                [6.0, 2.0, 0.0, -4.0, -8.0][k] + 2.0 * wave(2.0, 0.2 + late),
                8.0 * wave(1.0, 0.15 + late),
                0.0,
            );
        }
        legs(&mut s, &g, phase);
        s
    })
}

fn idle(b: &Bones) -> Clip {
    clip("idle", b, 4.0, 32, true, |phase| {
        let wave = |k: f64, at: f64| (TAU * k * (phase - at)).cos();
        // A look to the left, a look to the right, and an ear that twitches.
        let side =
            ease((phase - 0.12) / 0.1) - 2.0 * ease((phase - 0.42) / 0.14) + ease((phase - 0.8) / 0.12);
        let twitch = |at: f64| {
            let u = (phase - at) / 0.09;
            if (0.0..1.0).contains(&u) { (TAU * 2.0 * u).sin() * (1.0 - u) } else { 0.0 }
        };
        let breath = wave(2.0, 0.1);
        let mut s = Stance::rest(b);
        s.shift("hips", DVec3::new(0.006 * wave(1.0, 0.2), -0.006 + 0.003 * breath, 0.0));
        s.pose("chest", -0.8 * breath, 3.0 * side, 0.0);
        s.pose("neck", -2.0 + 1.0 * breath, 14.0 * side, 0.0);
        s.pose("head", 3.0 - 4.0 * side.abs(), 18.0 * side, 9.0 * side);
        s.pose("ear.L", 0.0, 0.0, 18.0 * twitch(0.3) + 3.0 * side);
        s.pose("ear.R", 0.0, 0.0, -18.0 * twitch(0.66) + 3.0 * side);
        for (k, name) in TAIL.into_iter().enumerate() {
            let late = 0.06 * k as f64;
            s.pose(name, [14.0, 6.0, 0.0, -8.0, -14.0][k], 11.0 * wave(2.0, late), 0.0);
        }
        for side in ["L", "R"] {
            let still = Step { ankle: DVec3::ZERO, pitch_deg: 0.0, toes_deg: 0.0 };
            leg(&mut s, ["femur", "tibia", "metatarsus", "hind paw"], side, 1.0, &still, 0.0);
            leg(&mut s, ["humerus", "radius", "metacarpus", "fore paw"], side, -1.0, &still, 0.0);
        }
        s
    })
}
