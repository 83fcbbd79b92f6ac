//! Point caches (PC2), written: where each point of a mesh is, frame by frame.
//!
//! The layout, little-endian: `POINTCACHE2` and a zero byte; the version, 1, as a 32-bit integer; the number of points; the first frame and
//! the frames from one sample to the next, in single precision; the number of samples; then three numbers in single precision for
//! each point of each sample.

use glam::Vec3;

/// The head of a cache of so many points and samples, one a frame, the first of them frame 0.
pub fn head(points: u32, samples: u32) -> Vec<u8> {
    let mut out = b"POINTCACHE2\0".to_vec();
    out.extend(1_u32.to_le_bytes());
    out.extend(points.to_le_bytes());
    out.extend(0.0_f32.to_le_bytes());
    out.extend(1.0_f32.to_le_bytes());
    out.extend(samples.to_le_bytes());
    out
}

/// One sample.
pub fn sample(points: &[Vec3]) -> impl Iterator<Item = u8> + '_ {
    points.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes)
}
