//! Surfaces through ellipses: feathers, fish and fins.

use super::parts::Solid;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A cross-section: `center + u·cos a + v·sin a`.
#[derive(Clone, Copy)]
pub struct Ring {
    pub center: DVec3,
    pub u: DVec3,
    pub v: DVec3,
}

/// A closed solid through rings, with a pole at either end.
pub fn loft(rings: &[Ring], poles: [DVec3; 2], sides: u32) -> Solid {
    let mut s = Solid::default();
    for r in rings {
        for i in 0..sides {
            let a = TAU * i as f64 / sides as f64;
            s.positions.push(r.center + r.u * a.cos() + r.v * a.sin());
        }
    }
    let first = s.positions.len() as u32;
    s.positions.extend(poles);
    let v = |ring: usize, i: u32| ring as u32 * sides + i % sides;
    for i in 0..sides {
        s.triangles.push([first, v(0, i + 1), v(0, i)]);
        for k in 0..rings.len() - 1 {
            s.triangles.push([v(k, i), v(k, i + 1), v(k + 1, i + 1)]);
            s.triangles.push([v(k, i), v(k + 1, i + 1), v(k + 1, i)]);
        }
        s.triangles.push([first + 1, v(rings.len() - 1, i), v(rings.len() - 1, i + 1)]);
    }
    outward(&mut s);
    s
}

/// Turn all triangles round if the solid is inside out.
fn outward(s: &mut Solid) {
    let volume: f64 = s
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| s.positions[i as usize]);
            a.dot(b.cross(c))
        })
        .sum();
    if volume < 0.0 {
        s.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

/// A feather: a flat, pointed leaf from `base` to `tip` whose face looks along `up`.
pub fn feather(base: DVec3, tip: DVec3, up: DVec3, width: f64, thickness: f64) -> Solid {
    let along = tip - base;
    let up = (up - along * (up.dot(along) / along.length_squared())).normalize();
    let side = along.cross(up).normalize();
    let n = 4;
    let ring = |t: f64| {
        // Quickly wide, longest at two thirds, round at the tip; a little cupped.
        let w = width * (1.0 - (1.0 - (t * 2.2).min(1.0)).powi(2)).sqrt() * (1.0 - t.powi(5)).sqrt();
        let bow = up * (-0.05 * along.length() * t * t);
        Ring { center: base + along * t + bow, u: side * w.max(1e-3), v: up * thickness * (1.0 - 0.6 * t) }
    };
    let rings: Vec<Ring> = (1..=n).map(|k| ring(k as f64 / n as f64 * 0.97)).collect();
    loft(&rings, [base, tip - up * (0.05 * along.length())], 8)
}

/// A sheet of `n × m` cells with texture coordinates; `place` and the picture's part run over 0…1.
pub struct Sheet {
    pub solid: Solid,
    pub uvs: Vec<DVec2>,
    /// The two parameters of every vertex.
    pub params: Vec<DVec2>,
}

pub fn sheet(n: usize, m: usize, uv: [DVec2; 2], place: impl Fn(f64, f64) -> DVec3) -> Sheet {
    let mut s = Sheet { solid: Solid::default(), uvs: Vec::new(), params: Vec::new() };
    for j in 0..=m {
        for i in 0..=n {
            let p = DVec2::new(i as f64 / n as f64, j as f64 / m as f64);
            s.solid.positions.push(place(p.x, p.y));
            s.uvs.push(uv[0] + (uv[1] - uv[0]) * p);
            s.params.push(p);
        }
    }
    let v = |i: usize, j: usize| (j * (n + 1) + i) as u32;
    for j in 0..m {
        for i in 0..n {
            s.solid.triangles.push([v(i, j), v(i + 1, j), v(i + 1, j + 1)]);
            s.solid.triangles.push([v(i, j), v(i + 1, j + 1), v(i, j + 1)]);
        }
    }
    s
}
