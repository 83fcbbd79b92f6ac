//! Machined solids: bevelled boxes and turned profiles.

use super::bones::Bones;
use super::{Look, point};
use glam::{DAffine3, DQuat, DVec3};
use sinew::io::rig_json::{Bind, Mesh};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Triangles in f64.
#[derive(Clone, Default)]
pub struct Solid {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Solid {
    /// Moved by `m`.
    pub fn by(mut self, m: DAffine3) -> Self {
        self.positions.iter_mut().for_each(|p| *p = m.transform_point3(*p));
        if m.matrix3.determinant() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    /// Moved to `p`.
    pub fn at(self, p: [f64; 3]) -> Self {
        self.by(DAffine3::from_translation(p.into()))
    }

    /// The profile's axis, +x, turned to `axis`.
    pub fn along(self, axis: DVec3) -> Self {
        self.by(DAffine3::from_quat(DQuat::from_rotation_arc(DVec3::X, axis.normalize())))
    }

    pub fn add(&mut self, other: Solid) {
        let base = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
    }
}

/// A box between two corners with edges cut off by `bevel`.
pub fn bevel_box(lo: [f64; 3], hi: [f64; 3], bevel: f64) -> Solid {
    let (lo, hi) = (DVec3::from(lo), DVec3::from(hi));
    taper_box(lo.x, hi.x, [lo.y, hi.y, lo.z, hi.z], [lo.y, hi.y, lo.z, hi.z], bevel)
}

/// A box along x whose section `[y0, y1, z0, z1]` differs between its ends, with edges cut off.
pub fn taper_box(x0: f64, x1: f64, start: [f64; 4], end: [f64; 4], bevel: f64) -> Solid {
    // Three vertices a corner: each pulled in by the bevel along the two other axes of its face.
    let mut s = Solid::default();
    for corner in 0..8u32 {
        let sign = [0, 1, 2].map(|k| if corner >> k & 1 == 1 { 1.0 } else { -1.0 });
        let section = if sign[0] > 0.0 { end } else { start };
        let x = if sign[0] > 0.0 { x1 } else { x0 };
        let p = DVec3::new(
            x,
            if sign[1] > 0.0 { section[1] } else { section[0] },
            if sign[2] > 0.0 { section[3] } else { section[2] },
        );
        for face in 0..3 {
            let inward = |k: usize| if k == face { 0.0 } else { -sign[k] * bevel };
            s.positions.push(p + DVec3::new(inward(0), inward(1), inward(2)));
        }
    }
    let v = |corner: u32, face: u32| corner * 3 + face;
    let mut quad = |q: [u32; 4]| s.triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    for face in 0..3u32 {
        let (a, b) = (1 << ((face + 1) % 3), 1 << ((face + 2) % 3));
        let f = 1 << face;
        // The face itself, both ends.
        quad([v(0, face), v(a, face), v(a + b, face), v(b, face)]);
        quad([v(f, face), v(f + a, face), v(f + a + b, face), v(f + b, face)]);
        // The four bevels along this axis lie between the two other faces.
        let (fa, fb) = ((face + 1) % 3, (face + 2) % 3);
        for c in [0, a, b, a + b] {
            quad([v(c, fa), v(c, fb), v(c + f, fb), v(c + f, fa)]);
        }
    }
    for corner in 0..8u32 {
        s.triangles.push([v(corner, 0), v(corner, 1), v(corner, 2)]);
    }
    outwards(&mut s);
    s
}

/// Wind the triangles of a convex solid so that they face outwards.
fn outwards(s: &mut Solid) {
    let middle = s.positions.iter().sum::<DVec3>() / s.positions.len() as f64;
    for t in &mut s.triangles {
        let [a, b, c] = t.map(|i| s.positions[i as usize]);
        if (b - a).cross(c - a).dot(a - middle) < 0.0 {
            t.swap(1, 2);
        }
    }
}

/// A profile of `(x, radius)` turned about the x axis; it begins and ends on the axis.
pub fn lathe(profile: &[(f64, f64)], sides: u32) -> Solid {
    let mut s = Solid::default();
    let rings = &profile[1..profile.len() - 1];
    for (x, r) in rings {
        for k in 0..sides {
            let a = TAU * k as f64 / sides as f64;
            s.positions.push(DVec3::new(*x, r * a.cos(), r * a.sin()));
        }
    }
    let pole = |s: &mut Solid, x: f64| {
        s.positions.push(DVec3::new(x, 0.0, 0.0));
        s.positions.len() as u32 - 1
    };
    let (first, last) = (pole(&mut s, profile[0].0), pole(&mut s, profile[profile.len() - 1].0));
    let v = |ring: usize, k: u32| ring as u32 * sides + k % sides;
    for k in 0..sides {
        s.triangles.push([first, v(0, k + 1), v(0, k)]);
        for ring in 0..rings.len() - 1 {
            s.triangles.push([v(ring, k), v(ring, k + 1), v(ring + 1, k + 1)]);
            s.triangles.push([v(ring, k), v(ring + 1, k + 1), v(ring + 1, k)]);
        }
        s.triangles.push([last, v(rings.len() - 1, k), v(rings.len() - 1, k + 1)]);
    }
    s
}

/// A cylinder along x, centred, with bevelled rims.
pub fn cylinder(length: f64, radius: f64, bevel: f64, sides: u32) -> Solid {
    let h = 0.5 * length;
    let rim =
        [(-h, 0.0), (-h, radius - bevel), (-h + bevel, radius), (h - bevel, radius), (h, radius - bevel)];
    lathe(&[rim.as_slice(), &[(h, 0.0)]].concat(), sides)
}

/// A ball.
pub fn ball(radius: f64, rings: usize, sides: u32) -> Solid {
    let at = |k: usize| {
        let a = 0.5 * TAU * k as f64 / rings as f64;
        (-radius * a.cos(), if k == 0 || k == rings { 0.0 } else { radius * a.sin() })
    };
    lathe(&(0..=rings).map(at).collect::<Vec<_>>(), sides)
}

/// Solids sorted by the bone that carries them and by material, given in rest space.
#[derive(Default)]
pub struct Machine {
    solids: BTreeMap<(usize, String), Solid>,
}

impl Machine {
    pub fn add(&mut self, bones: &Bones, bone: &str, material: &str, solid: Solid) {
        self.solids.entry((bones.id(bone), material.into())).or_default().add(solid);
    }

    /// One rigid mesh for each bone and material.
    pub fn finish(self, bones: &Bones, look: &mut Look, crease_deg: f64) {
        for ((bone, material), solid) in self.solids {
            let name = &bones.list[bone].name;
            look.meshes.push(Mesh {
                name: format!("{name} {material}"),
                material: Some(material),
                bind: Bind::Rigid(name.clone()),
                crease_deg: (crease_deg < 180.0).then_some(crease_deg),
                positions: solid.positions.iter().map(|p| point(bones.to_local(bone, *p))).collect(),
                normals: Vec::new(),
                uvs: Vec::new(),
                colors: Vec::new(),
                triangles: solid.triangles,
                ..Default::default()
            });
        }
    }
}
