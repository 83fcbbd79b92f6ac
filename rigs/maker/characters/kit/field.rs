//! Bodies as distance fields: lumps around bones that melt into each other.

use super::bones::Bones;
use glam::{DQuat, DVec3};

/// One lump of flesh.
pub struct Lump {
    /// Which bone carries it.
    bone: usize,
    shape: Shape,
    /// Metres over which it melts into what was there before.
    blend: f64,
    /// Linear RGB.
    color: DVec3,
}

enum Shape {
    /// A cone with round ends.
    Limb { a: DVec3, b: DVec3, ra: f64, rb: f64 },
    /// An ellipsoid.
    Egg { center: DVec3, radii: DVec3, from_world: DQuat },
}

impl Shape {
    /// Signed distance, negative inside; exact for spheres, close to it for the rest.
    fn distance(&self, p: DVec3) -> f64 {
        match self {
            Shape::Limb { a, b, ra, rb } => {
                let d = *b - *a;
                let t = ((p - *a).dot(d) / d.length_squared().max(1e-12)).clamp(0.0, 1.0);
                p.distance(*a + d * t) - (ra + (rb - ra) * t)
            }
            Shape::Egg { center, radii, from_world } => {
                let q = *from_world * (p - *center);
                let (k0, k1) = ((q / *radii).length(), (q / (*radii * *radii)).length());
                if k1 < 1e-9 { -radii.min_element() } else { k0 * (k0 - 1.0) / k1 }
            }
        }
    }

    fn bounds(&self) -> (DVec3, DVec3) {
        match self {
            Shape::Limb { a, b, ra, rb } => (a.min(*b) - ra.max(*rb), a.max(*b) + ra.max(*rb)),
            Shape::Egg { center, radii, .. } => {
                (*center - radii.max_element(), *center + radii.max_element())
            }
        }
    }
}

/// A body.
#[derive(Default)]
pub struct Field {
    lumps: Vec<Lump>,
}

impl Field {
    /// A cone with round ends between two points.
    pub fn limb(&mut self, bone: usize, ends: [DVec3; 2], radii: [f64; 2], blend: f64, color: u32) {
        let shape = Shape::Limb { a: ends[0], b: ends[1], ra: radii[0], rb: radii[1] };
        self.lumps.push(Lump { bone, shape, blend, color: linear(color) });
    }

    /// A limb from a bone's head to its tail.
    pub fn bone(&mut self, bones: &Bones, name: &str, radii: [f64; 2], blend: f64, color: u32) {
        let i = bones.id(name);
        self.limb(i, [bones.heads[i], bones.tails[i]], radii, blend, color);
    }

    /// An ellipsoid; `turn` is its rotation in the world.
    pub fn egg(
        &mut self,
        bone: usize,
        center: [f64; 3],
        radii: [f64; 3],
        turn: DQuat,
        blend: f64,
        color: u32,
    ) {
        let shape = Shape::Egg { center: center.into(), radii: radii.into(), from_world: turn.conjugate() };
        self.lumps.push(Lump { bone, shape, blend, color: linear(color) });
    }

    /// Signed distance to the whole body: a polynomial smooth minimum of the lumps, in their order.
    pub fn distance(&self, p: DVec3) -> f64 {
        let mut sum = f64::MAX;
        for l in &self.lumps {
            let d = l.shape.distance(p);
            let h = (l.blend - (d - sum).abs()).max(0.0) / l.blend.max(1e-9);
            sum = sum.min(d) - 0.25 * h * h * l.blend;
        }
        sum
    }

    /// The outward direction.
    pub fn normal(&self, p: DVec3) -> DVec3 {
        let e = 1e-4;
        let along = |axis: DVec3| self.distance(p + axis * e) - self.distance(p - axis * e);
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)).normalize_or(DVec3::Y)
    }

    /// The bone of the nearest lump.
    pub fn nearest_bone(&self, p: DVec3) -> usize {
        let d = self.lumps.iter().map(|l| l.shape.distance(p)).enumerate();
        d.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| self.lumps[i].bone)
    }

    /// Colours of the lumps around a point, mixed over about two centimetres.
    pub fn color(&self, p: DVec3) -> DVec3 {
        let d: Vec<f64> = self.lumps.iter().map(|l| l.shape.distance(p)).collect();
        let nearest = d.iter().copied().fold(f64::MAX, f64::min);
        let mut sum = (DVec3::ZERO, 0.0);
        for (l, d) in self.lumps.iter().zip(d) {
            let w = (-(d - nearest) / 0.012).exp();
            sum = (sum.0 + l.color * w, sum.1 + w);
        }
        sum.0 / sum.1
    }

    pub fn bounds(&self) -> (DVec3, DVec3) {
        let all = self.lumps.iter().map(|l| l.shape.bounds());
        all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default()
    }
}

/// Linear RGB of `0xrrggbb`.
pub fn linear(hex: u32) -> DVec3 {
    super::rgb(hex).0.truncate().as_dvec3()
}
