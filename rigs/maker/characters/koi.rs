//! A koi: its skin is a picture that is painted here.

use super::File;
use super::kit::bones::Bones;
use super::kit::face::{eye, eye_materials};
use super::kit::field::linear;
use super::kit::loft::{Ring, Sheet, loft, sheet};
use super::kit::motion::{Stance, clip, ease};
use super::kit::parts::{Machine, Solid, lathe};
use super::kit::skin::{Row, weights};
use super::kit::{self, Look, point, round};
use glam::{DVec2, DVec3};
use sinew::image::color::srgb8;
use sinew::io::rig_json::{Clip, Mesh};
use std::f64::consts::TAU;

/// Pixels of the picture: the body takes the upper three quarters, fins the lower one.
const WIDE: usize = 384;
const HIGH: usize = 256;
const BODY: f64 = 0.75;
/// Joints of the spine along z, head first.
const SPINE: [f64; 8] = [0.24, 0.1, -0.04, -0.18, -0.31, -0.43, -0.54, -0.64];
const LEVEL: f64 = 0.6;

pub fn files() -> Vec<File> {
    let bones = bones();
    let clips = vec![swim(&bones), turn(&bones)];
    let mut files = kit::files("koi", "Koi", &bones, look(&bones), clips);
    files.push(File { path: "rigs/koi.png".into(), bytes: png(&picture()) });
    files
}

fn bones() -> Bones {
    let mut b = Bones::default();
    let at = |z: f64| [0.0, LEVEL, z];
    b.add("root", None, [0.0, 0.0, 0.0], [0.0, 0.1, 0.0]);
    // A fish bends to the sides: hinges stand upright.
    let up = DVec3::Y;
    b.hinged("body", "root", at(SPINE[1]), at(SPINE[0]), up);
    b.hinged("head", "body", at(SPINE[0]), at(0.56), up);
    b.add("jaw", Some("head"), [0.0, LEVEL - 0.045, 0.42], [0.0, LEVEL - 0.03, 0.55]);
    for k in 1..SPINE.len() - 1 {
        let parent = if k == 1 { "body".into() } else { format!("spine {}", k - 1) };
        b.hinged(&format!("spine {k}"), &parent, at(SPINE[k]), at(SPINE[k + 1]), up);
    }
    b.hinged("tail", "spine 6", at(-0.64), at(-0.76), up);
    b.hinged("tail tip", "tail", at(-0.76), at(-0.92), up);
    b.hinged("dorsal 1", "spine 1", [0.0, 0.77, 0.06], [0.0, 0.86, 0.0], DVec3::Z);
    b.hinged("dorsal 2", "spine 3", [0.0, 0.75, -0.2], [0.0, 0.82, -0.26], DVec3::Z);
    for (s, side) in [(1.0, "L"), (-1.0, "R")] {
        let n = |name: &str| format!("{name}.{side}");
        b.hinged(&n("pectoral"), "body", [s * 0.1, 0.53, 0.2], [s * 0.2, 0.47, 0.13], DVec3::Z);
        b.hinged(&n("pectoral tip"), &n("pectoral"), [s * 0.2, 0.47, 0.13], [s * 0.31, 0.42, 0.03], DVec3::Z);
        b.hinged(&n("pelvic"), "spine 2", [s * 0.06, 0.48, -0.1], [s * 0.12, 0.38, -0.2], DVec3::Z);
        b.add(&n("barbel"), Some("head"), [s * 0.045, 0.555, 0.53], [s * 0.07, 0.5, 0.56]);
    }
    b
}

/// Half height, half width and height of the middle of the body at `t` from the snout (0) to the tail's root (1).
fn girth(t: f64) -> (f64, f64, f64) {
    let table = [
        (0.0, 0.03, 0.034, -0.012),
        (0.05, 0.07, 0.065, -0.01),
        (0.15, 0.115, 0.095, 0.0),
        (0.3, 0.155, 0.12, 0.006),
        (0.45, 0.16, 0.12, 0.006),
        (0.6, 0.135, 0.098, 0.004),
        (0.75, 0.095, 0.065, 0.002),
        (0.88, 0.06, 0.036, 0.0),
        (1.0, 0.058, 0.018, 0.0),
    ];
    let k = table.iter().rposition(|r| r.0 <= t).unwrap_or(0).min(table.len() - 2);
    let at = |i: usize| table[i.min(table.len() - 1)];
    let (a, b) = (at(k), at(k + 1));
    let (before, after) = (at(k.saturating_sub(1)), at(k + 2));
    let u = (t - a.0) / (b.0 - a.0);
    let cubic = |f: fn((f64, f64, f64, f64)) -> f64| {
        let slope = |p: (f64, f64, f64, f64), q: (f64, f64, f64, f64)| {
            if q.0 > p.0 { (f(q) - f(p)) / (q.0 - p.0) } else { 0.0 }
        };
        sinew::math::spline::hermite(f(a), slope(before, b), f(b), slope(a, after), b.0 - a.0, u)
    };
    (cubic(|r| r.1), cubic(|r| r.2), cubic(|r| r.3))
}

fn look(b: &Bones) -> Look {
    let mut look = Look::default();
    look.material("scales", 0xffffff, 0.35, 60.0).texture = Some("koi.png".into());
    let fins = look.material("fins", 0xffffff, 0.2, 30.0);
    fins.texture = Some("koi.png".into());
    fins.double_sided = true;
    eye_materials(&mut look, 0xd9a441);
    look.material("barbel", 0xe8b48a, 0.2, 30.0);
    look.meshes.push(body(b));
    fins_of(b, &mut look);
    let mut m = Machine::default();
    for s in [1.0, -1.0] {
        eye(&mut m, b, "head", [s * 0.064, LEVEL + 0.028, 0.465], 0.028, DVec3::new(s, 0.15, 0.35));
        let side = if s > 0.0 { "L" } else { "R" };
        let bone = format!("barbel.{side}");
        let (head, tail) = (b.head(&bone), b.tail(&bone));
        let profile = [(0.0, 0.0), (0.002, 0.009), (0.03, 0.007), (head.distance(tail), 0.0)];
        m.add(b, &bone, "barbel", lathe(&profile, 8).along(tail - head).at(head.to_array()));
    }
    m.finish(b, &mut look, 180.0);
    look
}

/// Weights along the spine: each vertex between the two nearest joints' bones.
fn spine_row(b: &Bones, z: f64) -> Row {
    let chain = ["head", "body", "spine 1", "spine 2", "spine 3", "spine 4", "spine 5", "spine 6", "tail"];
    let middle = |name: &str| 0.5 * (b.head(name).z + b.tail(name).z);
    let k = chain.iter().rposition(|n| middle(n) >= z);
    let Some(k) = k.filter(|k| k + 1 < chain.len()) else {
        return Row::from([(b.id(if k.is_none() { chain[0] } else { chain[chain.len() - 1] }), 1.0)]);
    };
    let (a, c) = (middle(chain[k]), middle(chain[k + 1]));
    let u = ease((a - z) / (a - c));
    Row::from([(b.id(chain[k]), 1.0 - u), (b.id(chain[k + 1]), u)])
}

fn body(b: &Bones) -> Mesh {
    let (rings, sides) = (42, 24u32);
    let (snout, end) = (0.57, -0.66);
    let ring = |t: f64| {
        let (high, wide, middle) = girth(t);
        let center = DVec3::new(0.0, LEVEL + middle, snout + (end - snout) * t);
        Ring { center, u: DVec3::Y * high, v: DVec3::X * wide }
    };
    let at: Vec<f64> = (0..rings).map(|k| (k as f64 / (rings - 1) as f64).powf(1.05)).collect();
    let list: Vec<Ring> = at.iter().map(|t| ring(*t)).collect();
    let poles = [DVec3::new(0.0, LEVEL - 0.012, snout + 0.012), DVec3::new(0.0, LEVEL, end - 0.008)];
    let solid = loft(&list, poles, sides);
    // Left and right share the picture: v runs from the back (0) to the belly, so that there is no seam.
    let uv = |i: usize| {
        let (k, side) = (i / sides as usize, i % sides as usize);
        if k >= rings {
            return DVec2::new(if i == rings * sides as usize { 0.0 } else { 1.0 }, 0.5 * BODY);
        }
        let around = (side as f64 / sides as f64 - 0.5).abs() * 2.0;
        DVec2::new(at[k], BODY * (0.01 + 0.98 * (1.0 - around)))
    };
    let uvs = (0..solid.positions.len()).map(uv).collect::<Vec<_>>();
    let jaw = b.id("jaw");
    let row = |p: &DVec3| {
        let mut row = spine_row(b, p.z);
        // The lower lip opens.
        let open = 0.6 * ease((p.z - 0.43) / 0.12) * ease((LEVEL + 0.01 - p.y) / 0.08);
        row.values_mut().for_each(|w| *w *= 1.0 - open);
        *row.entry(jaw).or_insert(0.0) += open;
        row.retain(|_, w| *w > 1e-6);
        row
    };
    let rows: Vec<Row> = solid.positions.iter().map(row).collect();
    textured("body", "scales", b, solid, &uvs, &rows)
}

fn textured(name: &str, material: &str, b: &Bones, solid: Solid, uvs: &[DVec2], rows: &[Row]) -> Mesh {
    Mesh {
        name: name.into(),
        material: Some(material.into()),
        bind: weights(b, rows),
        crease_deg: None,
        positions: solid.positions.iter().map(|p| point(*p)).collect(),
        normals: Vec::new(),
        uvs: uvs.iter().map(|p| p.to_array().map(|x| round(x, 4) as f32)).collect(),
        colors: Vec::new(),
        triangles: solid.triangles,
        ..Default::default()
    }
}

/// A fin's sheet: along its root (first parameter) and out to its edge (second).
fn fin(b: &Bones, look: &mut Look, name: &str, s: Sheet, row: impl Fn(DVec2, DVec3) -> Row) {
    let rows: Vec<Row> = s.params.iter().zip(&s.solid.positions).map(|(q, p)| row(*q, *p)).collect();
    look.meshes.push(textured(name, "fins", b, s.solid, &s.uvs, &rows));
}

fn fins_of(b: &Bones, look: &mut Look) {
    let strip = [DVec2::new(0.02, 0.98), DVec2::new(0.98, 0.79)];
    let blend = |from: Row, bone: &str, u: f64| {
        let mut row: Row = from.into_iter().map(|(k, w)| (k, w * (1.0 - u))).collect();
        *row.entry(b.id(bone)).or_insert(0.0) += u;
        row.retain(|_, w| *w > 1e-6);
        row
    };

    // The tail: two lobes, notched in the middle.
    let tail = sheet(16, 8, strip, |u, v| {
        let y = 2.0 * u - 1.0;
        let reach = 0.13 + 0.2 * y.abs().powf(1.3);
        let spread = 0.045 + 0.2 * v.powf(0.8);
        DVec3::new(0.0, LEVEL + y * spread, -0.63 - reach * v)
    });
    fin(b, look, "tail fin", tail, |q, p| {
        let root = spine_row(b, -0.66);
        let near = blend(root, "tail", ease(q.y / 0.5));
        blend(near, "tail tip", ease((-0.68 - p.z) / 0.2))
    });

    let dorsal = sheet(14, 5, strip, |u, v| {
        let z = 0.12 - 0.42 * u;
        let t = (0.57 - z) / 1.23;
        let back = LEVEL + girth(t).2 + girth(t).0 - 0.012;
        let tall = 0.035 + 0.085 * (1.0 - u).powf(0.7) * ease(u / 0.3 + 0.1);
        DVec3::new(0.0, back + tall * v, z - 0.07 * v)
    });
    fin(b, look, "dorsal fin", dorsal, |q, p| {
        let root = spine_row(b, p.z + 0.07 * q.y);
        let front = blend(root.clone(), "dorsal 1", ease(q.y) * (1.0 - ease((q.x - 0.2) / 0.5)));
        blend(front, "dorsal 2", ease(q.y) * ease((q.x - 0.3) / 0.5))
    });

    for (s, side) in [(1.0, "L"), (-1.0, "R")] {
        let n = |name: &str| format!("{name}.{side}");
        let paddle = |root: DVec3, tip: DVec3, across: DVec3| {
            move |u: f64, v: f64| {
                let round = 0.12 + 0.88 * (1.0 - v.powi(4)).sqrt();
                let width = round * (0.35 + 0.85 * (v * 2.4).sin().max(0.0).powf(0.8) * (1.0 - 0.35 * v));
                let p =
                    root.lerp(tip, v) + across * ((u - 0.5) * width) - across.normalize() * (0.03 * v * v);
                DVec3::new(p.x * s, p.y, p.z)
            }
        };
        let place =
            paddle(DVec3::new(0.085, 0.53, 0.19), DVec3::new(0.33, 0.41, 0.02), DVec3::new(0.05, 0.03, 0.15));
        fin(b, look, &n("pectoral fin"), sheet(8, 8, strip, place), |q, _| {
            let near = blend(spine_row(b, 0.17), &n("pectoral"), ease(q.y / 0.45));
            blend(near, &n("pectoral tip"), ease((q.y - 0.3) / 0.6))
        });
        let place = paddle(
            DVec3::new(0.055, 0.475, -0.1),
            DVec3::new(0.13, 0.37, -0.21),
            DVec3::new(0.01, 0.03, 0.09),
        );
        fin(b, look, &n("pelvic fin"), sheet(6, 5, strip, place), |q, _| {
            blend(spine_row(b, -0.11), &n("pelvic"), ease(q.y / 0.7))
        });
    }
    let anal = sheet(6, 4, strip, |u, v| {
        let z = -0.36 - 0.11 * u;
        let t = (0.57 - z) / 1.23;
        let belly = LEVEL + girth(t).2 - girth(t).0 + 0.01;
        DVec3::new(0.0, belly - (0.03 + 0.07 * (1.0 - u)) * v, z - 0.07 * v)
    });
    fin(b, look, "anal fin", anal, |q, p| spine_row(b, p.z + 0.05 * q.y));
}

/// Rows of sRGB pixels from the top left.
fn picture() -> Vec<[u8; 3]> {
    let mut out = Vec::with_capacity(WIDE * HIGH);
    for y in 0..HIGH {
        for x in 0..WIDE {
            let p = DVec2::new((x as f64 + 0.5) / WIDE as f64, (y as f64 + 0.5) / HIGH as f64);
            let c = if p.y < BODY { scales(p.x, p.y / BODY) } else { rays(p.x, (p.y - BODY) / (1.0 - BODY)) };
            out.push(c.to_array().map(|c| srgb8(c as f32)));
        }
    }
    out
}

/// The body: `u` from snout to tail, `v` from back to belly.
fn scales(u: f64, v: f64) -> DVec3 {
    let mix = |from: DVec3, to: DVec3, t: f64| from.lerp(to, t.clamp(0.0, 1.0));
    let mut c = mix(linear(0xfdf6ec), linear(0xe9d3bf), ease((v - 0.6) / 0.4) * 0.6);
    // Patches: middle along and around, size along and around; their edges wander.
    let wander = 0.16 * ((u * 41.0).sin() * (v * 13.0 + 1.0).sin() + 0.6 * (u * 23.0 + v * 17.0).sin());
    let patch = |list: &[[f64; 4]]| {
        let d = list.iter().map(|[a, b, r, s]| (((u - a) / r).powi(2) + ((v - b) / s).powi(2)).sqrt());
        d.fold(f64::MAX, f64::min) + wander
    };
    let red = patch(&[
        [0.12, 0.0, 0.09, 0.34],
        [0.36, 0.05, 0.13, 0.55],
        [0.46, 0.3, 0.08, 0.3],
        [0.68, 0.0, 0.1, 0.6],
        [0.93, 0.3, 0.05, 0.6],
    ]);
    c = mix(c, linear(0xe8461c), ease((1.06 - red) / 0.12));
    let black = patch(&[
        [0.27, 0.22, 0.025, 0.1],
        [0.55, 0.1, 0.035, 0.16],
        [0.8, 0.35, 0.025, 0.12],
        [0.42, 0.02, 0.02, 0.1],
    ]);
    c = mix(c, linear(0x1c1a22), ease((1.0 - black) / 0.15));
    if u < 0.2 {
        return c;
    }
    // Overlapping scales: the rim of each is a darker arc.
    let (rows, columns) = (15.0, 44.0);
    let row = (v * rows).floor();
    let along = u * columns + 0.5 * (row % 2.0);
    let (a, r) = (along.fract() - 0.5, (v * rows).fract() - 0.5);
    let rim = ((a * 1.1 - 0.1).powi(2) + (r * 0.95).powi(2)).sqrt();
    let shade = ease((rim - 0.36) / 0.16) * ease((u - 0.2) / 0.06) * (0.3 - 0.2 * v);
    c * (1.0 - shade)
}

/// Fins: rays that run from the root (`v` = 1) to a pale edge.
fn rays(u: f64, v: f64) -> DVec3 {
    let ray = (0.5 + 0.5 * (u * TAU * 22.0).cos()).powi(2);
    let root = linear(0xf0875a).lerp(linear(0xfaead9), ease((1.0 - v) / 0.6));
    root * (0.82 + 0.18 * ray) * (1.0 - 0.12 * ease((0.2 - v) / 0.2))
}

fn png(pixels: &[[u8; 3]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, WIDE as u32, HIGH as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder
        .write_header()
        .and_then(|mut w| w.write_image_data(pixels.as_flattened()))
        .expect("memory takes every byte");
    bytes
}

/// A wave runs from head to tail and grows on its way.
fn undulate(s: &mut Stance, phase: f64, strength: f64) {
    let wave = |late: f64| (TAU * (phase - late)).sin();
    s.turn("body", DVec3::Y, 2.0 * strength * wave(0.45));
    s.turn("head", DVec3::Y, 3.0 * strength * wave(0.5));
    for k in 1..=6 {
        let t = k as f64 / 6.0;
        s.turn(&format!("spine {k}"), DVec3::Y, strength * (2.0 + 8.0 * t) * wave(0.09 * k as f64));
    }
    s.turn("tail", DVec3::Y, strength * 17.0 * wave(0.66));
    s.turn("tail tip", DVec3::Y, strength * 20.0 * wave(0.8));
    s.turn("dorsal 1", DVec3::Z, strength * 5.0 * wave(0.3));
    s.turn("dorsal 2", DVec3::Z, strength * 8.0 * wave(0.5));
    s.shift("body", DVec3::X * (0.012 * strength * wave(0.2)));
}

fn fins(s: &mut Stance, phase: f64, beats: f64) {
    for (side, sign) in [("L", 1.0), ("R", -1.0)] {
        let n = |name: &str| format!("{name}.{side}");
        let wave = |late: f64| (TAU * (beats * phase - late - 0.06 * sign)).sin();
        s.turn(&n("pectoral"), DVec3::X, 8.0 * wave(0.25));
        s.turn(&n("pectoral"), DVec3::Z, sign * (4.0 + 14.0 * wave(0.0)));
        s.turn(&n("pectoral tip"), DVec3::Z, sign * 16.0 * wave(0.18));
        s.turn(&n("pelvic"), DVec3::Z, sign * 8.0 * wave(0.3));
        s.turn(&n("barbel"), DVec3::X, 10.0 * wave(0.4));
    }
    s.turn("jaw", DVec3::X, 5.0 + 5.0 * (TAU * beats * phase).sin());
}

fn swim(b: &Bones) -> Clip {
    clip("swim", b, 1.2, 24, true, |phase| {
        let mut s = Stance::rest(b);
        undulate(&mut s, phase, 1.0);
        fins(&mut s, phase, 1.0);
        s.shift("body", DVec3::Y * (0.01 * (TAU * phase).cos()));
        s
    })
}

/// Idling: slow strokes, a look to the left and one to the right.
fn turn(b: &Bones) -> Clip {
    clip("turn", b, 4.8, 48, true, |phase| {
        let mut s = Stance::rest(b);
        undulate(&mut s, 2.0 * phase, 0.55);
        fins(&mut s, phase, 4.0);
        let bend = (TAU * phase).sin();
        s.turn("body", DVec3::Y, 16.0 * bend);
        s.turn("body", DVec3::Z, -6.0 * bend);
        s.turn("head", DVec3::Y, 8.0 * bend);
        for k in 1..=6 {
            s.turn(&format!("spine {k}"), DVec3::Y, -4.5 * bend);
        }
        s.shift("body", DVec3::new(0.03 * bend, 0.03 * (TAU * phase).cos(), 0.0));
        s
    })
}
