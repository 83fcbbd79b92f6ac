//! A macaw on the wing.

use super::File;
use super::kit::bones::Bones;
use super::kit::face::{eye, eye_materials, tilt};
use super::kit::field::{Field, linear};
use super::kit::loft::feather;
use super::kit::motion::{Stance, clip, ease};
use super::kit::parts::Machine;
use super::kit::skin::skin;
use super::kit::surface::polygonise;
use super::kit::{self, Look};
use glam::DVec3;
use sinew::io::rig_json::Clip;
use std::f64::consts::TAU;

const RED: u32 = 0xd92b2f;
const WHITE: u32 = 0xf6efe6;
const HORN: u32 = 0xe9dcc0;
const DARK: u32 = 0x2b2a30;

pub fn files() -> Vec<File> {
    let bones = bones();
    let clips = vec![fly(&bones), glide(&bones)];
    kit::files("macaw", "Macaw", &bones, look(&bones), clips)
}

/// Quills of the left wing: bone that carries it, root, and tip.
const QUILLS: [(&str, [f64; 3], [f64; 3]); 8] = [
    ("hand", [0.72, 1.0, 0.1], [1.0, 0.99, -0.03]),
    ("hand", [0.68, 1.0, 0.1], [0.93, 0.99, -0.17]),
    ("hand", [0.62, 1.0, 0.11], [0.82, 0.99, -0.25]),
    ("hand", [0.56, 1.0, 0.11], [0.69, 0.99, -0.28]),
    ("forearm", [0.48, 1.0, 0.11], [0.55, 0.985, -0.28]),
    ("forearm", [0.4, 1.0, 0.1], [0.43, 0.98, -0.27]),
    ("forearm", [0.32, 1.0, 0.08], [0.31, 0.975, -0.26]),
    ("humerus", [0.22, 0.995, 0.07], [0.2, 0.97, -0.24]),
];

fn bones() -> Bones {
    let mut b = Bones::default();
    b.add("root", None, [0.0, 0.0, 0.0], [0.0, 0.1, 0.0]);
    b.add("body", Some("root"), [0.0, 0.9, -0.1], [0.0, 0.92, 0.05]);
    b.add("chest", Some("body"), [0.0, 0.92, 0.05], [0.0, 0.95, 0.2]);
    b.add("neck", Some("chest"), [0.0, 0.97, 0.2], [0.0, 1.04, 0.27]);
    b.add("head", Some("neck"), [0.0, 1.04, 0.27], [0.0, 1.07, 0.4]);
    b.add("beak", Some("head"), [0.0, 1.01, 0.37], [0.0, 0.96, 0.43]);
    b.add("tail", Some("body"), [0.0, 0.89, -0.18], [0.0, 0.87, -0.3]);
    b.add("tail feather", Some("tail"), [0.0, 0.87, -0.28], [0.0, 0.83, -0.78]);
    for (s, side) in [(1.0, "L"), (-1.0, "R")] {
        let n = |name: &str| format!("{name}.{side}");
        let m = |p: [f64; 3]| [s * p[0], p[1], p[2]];
        b.add(&n("tail feather"), Some("tail"), m([0.03, 0.87, -0.27]), m([0.12, 0.835, -0.66]));
        // Wings flap about the way that the bird flies.
        let flap = DVec3::Z;
        b.hinged(&n("humerus"), "chest", m([0.09, 0.98, 0.12]), m([0.28, 1.0, 0.08]), flap);
        b.hinged(&n("forearm"), &n("humerus"), m([0.28, 1.0, 0.08]), m([0.5, 1.005, 0.14]), flap);
        b.hinged(&n("hand"), &n("forearm"), m([0.5, 1.005, 0.14]), m([0.74, 1.0, 0.1]), flap);
        for (k, (bone, root, tip)) in QUILLS.into_iter().enumerate() {
            b.hinged(&n(&format!("quill {}", k + 1)), &n(bone), m(root), m(tip), DVec3::X);
        }
        b.add(&n("thigh"), Some("body"), m([0.05, 0.85, -0.1]), m([0.055, 0.8, -0.16]));
        b.add(&n("foot"), Some(&n("thigh")), m([0.055, 0.8, -0.16]), m([0.055, 0.79, -0.24]));
    }
    b
}

fn look(b: &Bones) -> Look {
    let mut look = Look::default();
    look.material("plumage", 0xffffff, 0.08, 16.0);
    look.material("red", RED, 0.08, 16.0);
    look.material("yellow", 0xf7b51d, 0.08, 16.0);
    look.material("blue", 0x1f5fc4, 0.12, 20.0);
    look.material("navy", 0x163a7d, 0.12, 20.0);
    eye_materials(&mut look, 0xf2e27a);
    let body = body(b);
    let solid = polygonise(&body, 0.0242);
    look.meshes.push(skin("body", "plumage", b, &body, solid, 7, paint));
    let mut m = Machine::default();
    for s in [1.0, -1.0] {
        eye(&mut m, b, "head", [s * 0.064, 1.075, 0.335], 0.028, DVec3::new(s, 0.1, 0.35));
        let side = if s > 0.0 { "L" } else { "R" };
        wing(b, &mut m, s, side);
        let tail = format!("tail feather.{side}");
        m.add(b, &tail, "blue", plume(b, &tail, 0.05));
    }
    m.add(b, "tail feather", "red", plume(b, "tail feather", 0.055));
    m.finish(b, &mut look, 180.0);
    look
}

/// A feather along its bone.
fn plume(b: &Bones, bone: &str, width: f64) -> kit::parts::Solid {
    feather(b.head(bone), b.tail(bone), DVec3::Y, width, 0.009)
}

/// Quills, and three rows of coverts that hide their roots.
fn wing(b: &Bones, m: &mut Machine, s: f64, side: &str) {
    for (k, (carrier, root, tip)) in QUILLS.into_iter().enumerate() {
        let bone = format!("quill {}.{side}", k + 1);
        let color = if k < 2 { "navy" } else { "blue" };
        m.add(b, &bone, color, plume(b, &bone, if k < 4 { 0.062 } else { 0.068 }));
        // A covert on top of each quill, bound to the bone that carries it.
        let (root, tip) = (DVec3::from(root), DVec3::from(tip));
        let mirror = DVec3::new(s, 1.0, 1.0);
        let row = |from: f64, to: f64, up: f64| {
            let at = |t: f64| (root.lerp(tip, t) + DVec3::Y * up) * mirror;
            (at(from), at(to))
        };
        let carrier = format!("{carrier}.{side}");
        let (from, to) = row(-0.12, 0.52, 0.012);
        m.add(b, &carrier, "yellow", feather(from, to, DVec3::Y, 0.062, 0.014));
        let (from, to) = row(-0.2, 0.26, 0.022);
        m.add(b, &carrier, "red", feather(from, to, DVec3::Y, 0.06, 0.018));
    }
}

fn body(b: &Bones) -> Field {
    let mut f = Field::default();
    f.egg(b.id("body"), [0.0, 0.905, -0.04], [0.1, 0.1, 0.16], tilt(-12.0), 0.0, RED);
    f.egg(b.id("chest"), [0.0, 0.94, 0.1], [0.105, 0.105, 0.14], tilt(-20.0), 0.06, RED);
    f.bone(b, "neck", [0.085, 0.075], 0.05, RED);
    f.egg(b.id("head"), [0.0, 1.07, 0.32], [0.078, 0.082, 0.09], tilt(0.0), 0.05, RED);
    f.bone(b, "tail", [0.075, 0.045], 0.05, RED);
    // The beak curves down in two pieces.
    let top = [DVec3::new(0.0, 1.07, 0.39), DVec3::new(0.0, 1.05, 0.445), DVec3::new(0.0, 0.99, 0.475)];
    f.limb(b.id("head"), [top[0], top[1]], [0.044, 0.04], 0.012, HORN);
    f.limb(b.id("head"), [top[1], top[2]], [0.04, 0.014], 0.012, HORN);
    f.limb(
        b.id("beak"),
        [DVec3::new(0.0, 1.01, 0.385), DVec3::new(0.0, 0.985, 0.425)],
        [0.032, 0.02],
        0.01,
        DARK,
    );
    for side in ["L", "R"] {
        let n = |name: &str| format!("{name}.{side}");
        f.bone(b, &n("humerus"), [0.055, 0.04], 0.05, RED);
        f.bone(b, &n("forearm"), [0.04, 0.033], 0.01, RED);
        f.bone(b, &n("hand"), [0.033, 0.018], 0.01, RED);
        f.bone(b, &n("thigh"), [0.045, 0.034], 0.03, RED);
        f.bone(b, &n("foot"), [0.03, 0.028], 0.012, DARK);
    }
    f
}

/// White cheeks, a dark tip of the beak.
fn paint(p: DVec3, _: DVec3, base: DVec3) -> DVec3 {
    let mix = |from: DVec3, to: u32, t: f64| from.lerp(linear(to), t.clamp(0.0, 1.0));
    let cheek = ((DVec3::new(p.x.abs(), p.y, p.z) - DVec3::new(0.07, 1.06, 0.35))
        / DVec3::new(0.05, 0.05, 0.045))
    .length();
    let horn = p.z > 0.395;
    let c = if horn { base } else { mix(base, WHITE, ease((1.25 - cheek) / 0.4)) };
    if horn { mix(c, DARK, ease((1.02 - p.y) / 0.03) * ease((p.z - 0.43) / 0.02)) } else { c }
}

/// What both wings do: flap of the shoulder, of elbow and wrist (degrees up), sweep backwards, and how quills bend.
struct Beat {
    shoulder: f64,
    elbow: f64,
    wrist: f64,
    sweep: f64,
    quills: f64,
    spread: f64,
}

fn beat(s: &mut Stance, side: &str, w: &Beat) {
    let sign = if side == "L" { 1.0 } else { -1.0 };
    let n = |name: &str| format!("{name}.{side}");
    // Up is +z for the left wing, −z for the right; back is +y for the left.
    let mut turn = |bone: &str, up: f64, back: f64, twist: f64| {
        s.turn(&n(bone), DVec3::X, twist);
        s.turn(&n(bone), DVec3::Y, sign * back);
        s.turn(&n(bone), DVec3::Z, sign * up);
    };
    turn("humerus", w.shoulder, 0.4 * w.sweep, -0.1 * w.shoulder);
    turn("forearm", w.elbow, -0.7 * w.sweep, 0.0);
    turn("hand", w.wrist, 1.3 * w.sweep, 0.0);
    for k in 0..QUILLS.len() {
        let outer = 1.0 - k as f64 / QUILLS.len() as f64;
        let fan = w.spread * (outer - 0.4) - w.sweep * 0.7 * f64::from(k < 4);
        turn(&format!("quill {}", k + 1), w.quills * outer, fan, -w.quills * (0.35 + 0.3 * outer));
    }
}

fn fly(b: &Bones) -> Clip {
    clip("fly", b, 0.8, 24, true, |phase| {
        // The stroke down is quicker in the middle; elbow, wrist and quills follow one after the other.
        let bend = |p: f64| p + 0.035 * (TAU * p).sin();
        let wave = |late: f64| (TAU * bend(phase - late)).cos();
        // 1 in the middle of the way up, when the wing folds to let the air by.
        let up = ease((-(TAU * bend(phase - 0.02)).sin() + 0.2) / 1.2);
        let mut s = Stance::rest(b);
        s.shift("body", DVec3::Y * (-0.055 * wave(0.03)));
        s.pose("body", -8.0 - 4.0 * wave(0.2), 0.0, 0.0);
        s.pose("chest", 3.0 * wave(0.2), 0.0, 0.0);
        s.pose("neck", 4.0 - 2.0 * wave(0.22), 0.0, 0.0);
        s.pose("head", 3.0 + 3.0 * wave(0.2), 0.0, 0.0);
        s.pose("tail", 9.0 * wave(0.3), 0.0, 0.0);
        s.pose("tail feather", 7.0 * wave(0.4), 0.0, 0.0);
        for (side, sign) in [("L", 1.0), ("R", -1.0)] {
            s.pose(&format!("tail feather.{side}"), 7.0 * wave(0.38), -sign * (2.0 + 4.0 * wave(0.5)), 0.0);
            s.pose(&format!("thigh.{side}"), 4.0 * wave(0.3), 0.0, 0.0);
            let w = Beat {
                shoulder: 6.0 + 42.0 * wave(0.0),
                elbow: -6.0 + 20.0 * wave(0.11) - 14.0 * up,
                wrist: -4.0 + 26.0 * wave(0.19) - 12.0 * up,
                sweep: 26.0 * up,
                quills: 13.0 * wave(0.27),
                spread: 10.0 - 8.0 * up,
            };
            beat(&mut s, side, &w);
        }
        s
    })
}

fn glide(b: &Bones) -> Clip {
    clip("glide", b, 5.0, 30, true, |phase| {
        let wave = |k: f64, at: f64| (TAU * k * (phase - at)).cos();
        let bank = wave(1.0, 0.0);
        let mut s = Stance::rest(b);
        s.shift("body", DVec3::new(0.05 * wave(1.0, 0.25), 0.03 * wave(2.0, 0.1), 0.0));
        s.pose("body", -3.0 + 2.0 * wave(2.0, 0.2), 8.0 * bank, -14.0 * bank);
        s.pose("neck", 2.0, 6.0 * wave(1.0, 0.95), 7.0 * bank);
        s.pose("head", 2.0 * wave(2.0, 0.3), 8.0 * wave(1.0, 0.95), 6.0 * bank);
        s.pose("tail", 3.0 * wave(2.0, 0.35), 0.0, 12.0 * wave(1.0, 0.06));
        for (side, sign) in [("L", 1.0), ("R", -1.0)] {
            s.pose(&format!("tail feather.{side}"), 0.0, -sign * 5.0, 0.0);
            let tremble = 1.5 * wave(9.0, 0.02 * sign) + 1.5 * wave(7.0, 0.3);
            let w = Beat {
                shoulder: 12.0 + 3.0 * wave(2.0, 0.05) - 3.0 * sign * bank,
                elbow: -5.0 + 2.0 * wave(2.0, 0.1),
                wrist: 4.0 + 2.0 * wave(2.0, 0.14),
                sweep: 3.0 - 3.0 * sign * bank,
                quills: 5.0 + tremble,
                spread: 9.0,
            };
            beat(&mut s, side, &w);
        }
        s
    })
}
