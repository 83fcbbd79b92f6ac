//! The seeded generator of all property tests (SplitMix64, Steele et al. 2014).

use glam::Vec3;

pub struct Rng(u64);

#[allow(dead_code, reason = "each test program takes what it needs")]
impl Rng {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `lo..hi`.
    pub fn range(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `lo..hi`, in f32.
    pub fn span(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Uniform in −1…1.
    pub fn unit(&mut self) -> f32 {
        self.span(-1.0, 1.0)
    }

    /// In a cube around the origin.
    pub fn point(&mut self, reach: f32) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * reach
    }

    /// One of `0..n`; 0 for an empty range.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}
