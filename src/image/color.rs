//! Linear light and sRGB (IEC 61966-2-1).

use std::sync::LazyLock;

/// Linear light from an sRGB value, both 0…1.
pub fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB value of linear light, both 0…1.
pub fn srgb_from_linear(c: f32) -> f32 {
    if c <= 0.0031308 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

/// Linear light of each 8-bit sRGB value.
pub static LINEAR_OF_SRGB8: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// Linear light above which the 8-bit sRGB code is at least `i + 1`: where `encode` rounds up.
static THRESHOLDS: LazyLock<[f32; 255]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb((i as f32 + 0.5) / 255.0)));

/// Least light of the table of [`STEPS`]: the code is 0 below.
pub(crate) const DARK: f32 = 1.0 / 8192.0;

/// Codes by the upper half of the bits of light in [`DARK`]…1, 128 intervals an octave: the code at the interval's start times 2¹⁶,
/// plus what makes the sum with the lower half of the bits reach the next code where light does. No interval holds two steps.
pub(crate) static STEPS: LazyLock<[u32; 2048]> = LazyLock::new(|| {
    let mut table = [255 << 16; 2048];
    for (i, entry) in table.iter_mut().take(13 * 128).enumerate() {
        let first = DARK.to_bits() + ((i as u32) << 16);
        let code = THRESHOLDS.partition_point(|t| t.to_bits() <= first);
        let to_next = THRESHOLDS.get(code).map_or(1 << 16, |t| (t.to_bits() - first).min(1 << 16));
        *entry = ((code as u32) << 16) + (1 << 16) - to_next;
    }
    table
});

/// The nearest 8-bit sRGB code of linear light; NaN gives 0, values outside 0…1 are clipped.
///
/// Exact: the code whose decoded sRGB value is nearest in sRGB.
///
/// ```
/// use sinew::image::color::{LINEAR_OF_SRGB8, srgb8};
/// assert!((0..256).all(|i| srgb8(LINEAR_OF_SRGB8[i]) == i as u8));
/// ```
#[inline]
pub fn srgb8(c: f32) -> u8 {
    let bits = if c > DARK { c.min(1.0) } else { DARK }.to_bits();
    let place = (bits >> 16) - (DARK.to_bits() >> 16);
    ((STEPS[place as usize & 2047] + (bits & 0xffff)) >> 16) as u8
}

/// One linear, premultiplied pixel as 8-bit sRGB with straight alpha.
#[inline]
pub fn encode_srgb8(p: [f32; 4]) -> [u8; 4] {
    let a = p[3];
    if a >= 1.0 {
        return [srgb8(p[0]), srgb8(p[1]), srgb8(p[2]), 255];
    }
    let alpha = (a.max(0.0) * 255.0 + 0.5) as u8;
    if alpha == 0 {
        return [0; 4];
    }
    let k = 1.0 / a;
    [srgb8(p[0] * k), srgb8(p[1] * k), srgb8(p[2] * k), alpha]
}

/// 8-bit sRGB with straight alpha as linear, premultiplied light.
#[inline]
pub fn decode_srgb8(p: [u8; 4]) -> [f32; 4] {
    let a = f32::from(p[3]) / 255.0;
    let light = |c: u8| LINEAR_OF_SRGB8[usize::from(c)] * a;
    [light(p[0]), light(p[1]), light(p[2]), a]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_rounds_like_the_formula() {
        for i in 0..=200_000 {
            let c = i as f32 / 200_000.0;
            let want = srgb_from_linear(c) * 255.0;
            assert!((srgb8(c) as f32 - want).abs() <= 0.5 + 1e-3, "{c}: {} {want}", srgb8(c));
        }
        assert_eq!((srgb8(f32::NAN), srgb8(-1.0), srgb8(f32::INFINITY)), (0, 0, 255));
        for (code, &t) in THRESHOLDS.iter().enumerate() {
            let below = f32::from_bits(t.to_bits() - 1);
            assert_eq!((srgb8(below), srgb8(t)), (code as u8, code as u8 + 1));
        }
    }
}
