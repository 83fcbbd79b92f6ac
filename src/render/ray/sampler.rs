//! Where samples lie: the first two dimensions of Sobol's sequence, scrambled after Owen by a hash (Burley, "Practical Hash-based
//! Owen Scrambling", JCGT 9(4), 2020). The first 2ᵏ samples of a pixel are one in each of 2ᵏ rectangles of every shape.

/// Where one sample of a pixel lies in `0…1 × 0…1`; another `dimension` is another pair, independent of it.
pub(super) fn sample(seed: u32, pixel: [u32; 2], index: u32, dimension: u32) -> [f64; 2] {
    let seed = hash(seed ^ hash(pixel[0] ^ hash(pixel[1] ^ hash(dimension))));
    // The order of the samples is scrambled, too, so that pairs do not run in step.
    let i = scrambled(index.reverse_bits(), seed).reverse_bits();
    let unit = |x: u32, salt: u32| {
        f64::from(scrambled(x.reverse_bits(), hash(seed ^ salt)).reverse_bits()) * (0.5f64).powi(32)
    };
    [unit(i.reverse_bits(), 0x9e37_79b9), unit(second(i), 0x85eb_ca6b)]
}

/// Sobol's second dimension.
fn second(mut i: u32) -> u32 {
    let (mut out, mut column) = (0, 1 << 31);
    while i != 0 {
        out ^= if i & 1 != 0 { column } else { 0 };
        column ^= column >> 1;
        i >>= 1;
    }
    out
}

/// Each bit is turned over or not, as the lower ones say: a nested scrambling of the reversed number (Laine and Karras 2011).
fn scrambled(mut x: u32, seed: u32) -> u32 {
    x = x.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^ x.wrapping_mul(0x8d22_f6e6)
}

/// Mixes all bits (Wellons 2018, "lowbias32").
fn hash(mut x: u32) -> u32 {
    x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
    x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}
