//! A small octopus: eight arms of six bones each.

use super::File;
use super::kit::bones::Bones;
use super::kit::face::{eye, eye_materials, tilt};
use super::kit::field::{Field, linear};
use super::kit::motion::{Stance, clip, ease};
use super::kit::parts::Machine;
use super::kit::skin::skin;
use super::kit::surface::polygonise;
use super::kit::{self, Look};
use glam::DVec3;
use sinew::io::rig_json::Clip;
use std::f64::consts::TAU;

const ROSE: u32 = 0xd8486b;
const PLUM: u32 = 0x8e2a63;
const PEACH: u32 = 0xffc9a8;
const ARMS: usize = 8;
const JOINTS: usize = 6;

/// Distance from the middle, height and thickness along an arm.
const REACH: [f64; JOINTS + 1] = [0.1, 0.21, 0.32, 0.425, 0.525, 0.615, 0.69];
const HEIGHT: [f64; JOINTS + 1] = [0.2, 0.125, 0.07, 0.05, 0.043, 0.045, 0.06];
const THICK: [f64; JOINTS + 1] = [0.075, 0.064, 0.055, 0.047, 0.04, 0.033, 0.026];

pub fn files() -> Vec<File> {
    let bones = bones();
    let clips = vec![sway(&bones), swim(&bones)];
    kit::files("octopus", "Octopus", &bones, look(&bones), clips)
}

/// The way an arm points: the first to the left of the face.
fn way(arm: usize) -> DVec3 {
    let (s, c) = (TAU * (arm as f64 + 0.5) / ARMS as f64).sin_cos();
    DVec3::new(s, 0.0, c)
}

fn name(arm: usize, joint: usize) -> String {
    format!("arm {} {}", arm + 1, joint + 1)
}

fn bones() -> Bones {
    let mut b = Bones::default();
    b.add("root", None, [0.0, 0.0, 0.0], [0.0, 0.1, 0.0]);
    b.add("body", Some("root"), [0.0, 0.2, 0.0], [0.0, 0.36, 0.0]);
    b.add("mantle 1", Some("body"), [0.0, 0.36, 0.0], [0.0, 0.52, -0.06]);
    b.add("mantle 2", Some("mantle 1"), [0.0, 0.52, -0.06], [0.0, 0.68, -0.14]);
    b.add("mantle 3", Some("mantle 2"), [0.0, 0.68, -0.14], [0.0, 0.83, -0.22]);
    for arm in 0..ARMS {
        let at = |k: usize| (way(arm) * REACH[k] + DVec3::Y * HEIGHT[k]).to_array();
        for joint in 0..JOINTS {
            let parent = if joint == 0 { "body".into() } else { name(arm, joint - 1) };
            b.hinged(&name(arm, joint), &parent, at(joint), at(joint + 1), curl_axis(arm));
        }
    }
    b
}

/// A turn about this axis lifts an arm.
fn curl_axis(arm: usize) -> DVec3 {
    way(arm).cross(DVec3::Y)
}

fn look(b: &Bones) -> Look {
    let mut look = Look::default();
    look.material("skin", 0xffffff, 0.3, 50.0);
    eye_materials(&mut look, 0xf2b632);
    let body = body(b);
    let solid = polygonise(&body, 0.0285);
    look.meshes.push(skin("body", "skin", b, &body, solid, 6, paint));
    let mut m = Machine::default();
    for s in [1.0, -1.0] {
        eye(&mut m, b, "body", [s * 0.098, 0.365, 0.125], 0.058, DVec3::new(s * 0.45, 0.1, 1.0));
    }
    m.finish(b, &mut look, 180.0);
    look
}

fn body(b: &Bones) -> Field {
    let mut f = Field::default();
    f.egg(b.id("body"), [0.0, 0.26, 0.0], [0.15, 0.12, 0.145], tilt(0.0), 0.0, ROSE);
    f.egg(b.id("mantle 1"), [0.0, 0.44, -0.03], [0.165, 0.15, 0.16], tilt(-20.0), 0.07, ROSE);
    f.egg(b.id("mantle 2"), [0.0, 0.59, -0.1], [0.195, 0.19, 0.19], tilt(-25.0), 0.09, ROSE);
    f.egg(b.id("mantle 3"), [0.0, 0.72, -0.165], [0.15, 0.15, 0.15], tilt(-25.0), 0.08, ROSE);
    for s in [1.0, -1.0] {
        f.egg(b.id("body"), [s * 0.1, 0.37, 0.095], [0.075, 0.075, 0.07], tilt(0.0), 0.04, ROSE);
    }
    for arm in 0..ARMS {
        for joint in 0..JOINTS {
            let blend = if joint == 0 { 0.05 } else { 0.006 };
            f.bone(b, &name(arm, joint), [THICK[joint], THICK[joint + 1]], blend, ROSE);
        }
    }
    f
}

/// Peach below, plum spots and arm tips.
fn paint(p: DVec3, n: DVec3, base: DVec3) -> DVec3 {
    let mix = |from: DVec3, to: u32, t: f64| from.lerp(linear(to), t.clamp(0.0, 1.0));
    let out = DVec3::new(p.x, 0.0, p.z).length();
    let mut c = mix(base, PLUM, 0.75 * ease((out - 0.45) / 0.25) * f64::from(p.y < 0.2));
    let spots = [
        [0.13, 0.72, -0.06, 0.05],
        [-0.02, 0.79, -0.02, 0.045],
        [-0.15, 0.66, -0.04, 0.06],
        [0.03, 0.64, 0.09, 0.035],
        [0.17, 0.55, -0.16, 0.055],
        [-0.11, 0.81, -0.19, 0.05],
        [-0.17, 0.52, -0.13, 0.045],
        [0.06, 0.87, -0.17, 0.04],
    ];
    for [x, y, z, r] in spots {
        let d = p.distance(DVec3::new(x, y, z)) / r;
        c = mix(c, PLUM, 0.7 * ease((1.35 - d) / 0.4));
    }
    mix(c, PEACH, ease((-n.y - 0.3) / 0.35) * f64::from(p.y < 0.25))
}

/// Arms that wander: a wave runs down each, and tips curl.
fn sway(b: &Bones) -> Clip {
    clip("sway", b, 4.0, 32, true, |phase| {
        let wave = |k: f64, at: f64| (TAU * (k * phase - at)).sin();
        let mut s = Stance::rest(b);
        let breath = wave(1.0, 0.0);
        s.shift("body", DVec3::Y * (0.012 + 0.012 * breath));
        s.pose("mantle 1", 3.0 * wave(1.0, 0.1), 3.0 * wave(1.0, 0.3), 4.0 * wave(1.0, 0.0));
        s.pose("mantle 2", 3.0 * wave(1.0, 0.2), 0.0, 5.0 * wave(1.0, 0.12));
        s.pose("mantle 3", 4.0 * wave(1.0, 0.3), 0.0, 6.0 * wave(1.0, 0.24));
        s.scales[b.id("mantle 2")] =
            DVec3::new(1.0 - 0.03 * breath, 1.0 + 0.05 * breath, 1.0 + 0.05 * breath);
        for arm in 0..ARMS {
            let own = [0.0, 0.37, 0.71, 0.13, 0.55, 0.88, 0.29, 0.63][arm];
            for joint in 0..JOINTS {
                let (j, bone) = (joint as f64, name(arm, joint));
                // Roots stay low, tips lift and curl.
                let lift = 0.5 + 0.5 * wave(1.0, own + 0.11 * j);
                s.turn(&bone, curl_axis(arm), [1.0, 4.0, 7.0, 11.0, 16.0, 22.0][joint] * (lift + 0.15));
                s.turn(
                    &bone,
                    DVec3::Y,
                    [2.0, 4.0, 6.0, 9.0, 12.0, 14.0][joint] * wave(1.0, own + 0.2 + 0.13 * j),
                );
            }
        }
        s
    })
}

/// One stroke: arms open, then snap together while the mantle squeezes and the body shoots up.
fn swim(b: &Bones) -> Clip {
    clip("swim", b, 1.8, 36, true, |phase| {
        let stroke = |at: f64| {
            let p = (phase - at).rem_euclid(1.0);
            // Slowly open until 0.55, quickly closed until 0.75, drifting after that.
            ease(p / 0.55) - ease((p - 0.55) / 0.2)
        };
        let squeeze = stroke(0.06);
        let p = phase;
        let mut s = Stance::rest(b);
        s.shift("body", DVec3::Y * (0.42 + 0.1 * (TAU * (p - 0.93)).cos()));
        s.pose("body", -6.0 + 4.0 * (TAU * (p - 0.8)).cos(), 0.0, 0.0);
        s.pose("mantle 1", 4.0 - 6.0 * squeeze, 0.0, 0.0);
        s.pose("mantle 2", 5.0 - 6.0 * stroke(0.1), 0.0, 0.0);
        let swell = 0.13 * stroke(0.02);
        s.scales[b.id("mantle 2")] = DVec3::new(1.04 - 0.5 * swell, 0.93 + swell, 0.93 + swell);
        for arm in 0..ARMS {
            let own = 0.012 * (arm % 3) as f64;
            for joint in 0..JOINTS {
                let open = stroke(own + 0.055 * joint as f64);
                let shut = [-38.0, -22.0, -8.0, 0.0, 4.0, 6.0][joint];
                let wide = [4.0, 6.0, 4.0, 2.0, -4.0, -10.0][joint];
                s.turn(&name(arm, joint), curl_axis(arm), shut + (wide - shut) * open);
                s.turn(&name(arm, joint), DVec3::Y, 3.0 * (TAU * (p - 0.1 * joint as f64)).sin());
            }
        }
        s
    })
}
