//! SHA-256 (FIPS 180-4), to match files with their recorded answers.

/// The digest as lower-case hex.
pub fn hex(bytes: &[u8]) -> String {
    let (k, mut h) = constants();
    let mut message = bytes.to_vec();
    message.push(0x80);
    message.resize((message.len() + 8).next_multiple_of(64) - 8, 0);
    message.extend((bytes.len() as u64 * 8).to_be_bytes());
    message.chunks_exact(64).for_each(|block| compress(&mut h, &k, block));
    h.iter().map(|w| format!("{w:08x}")).collect()
}

fn compress(h: &mut [u32; 8], k: &[u32; 64], block: &[u8]) {
    let mut w = [0u32; 64];
    for (w, b) in w.iter_mut().zip(block.chunks_exact(4)) {
        *w = u32::from_be_bytes([b[0], b[1], b[2], b[3]]);
    }
    for i in 16..64 {
        let (a, b) = (w[i - 15], w[i - 2]);
        let s0 = a.rotate_right(7) ^ a.rotate_right(18) ^ (a >> 3);
        let s1 = b.rotate_right(17) ^ b.rotate_right(19) ^ (b >> 10);
        w[i] = w[i - 16].wrapping_add(s0).wrapping_add(w[i - 7]).wrapping_add(s1);
    }
    let mut v = *h;
    for i in 0..64 {
        let [a, b, c, _, e, f, g, last] = v;
        let s1 = e.rotate_right(6) ^ e.rotate_right(11) ^ e.rotate_right(25);
        let choice = (e & f) ^ (!e & g);
        let t1 = last.wrapping_add(s1).wrapping_add(choice).wrapping_add(k[i]).wrapping_add(w[i]);
        let s0 = a.rotate_right(2) ^ a.rotate_right(13) ^ a.rotate_right(22);
        let t2 = s0.wrapping_add((a & b) ^ (a & c) ^ (b & c));
        v.rotate_right(1);
        v[4] = v[4].wrapping_add(t1);
        v[0] = t1.wrapping_add(t2);
    }
    h.iter_mut().zip(v).for_each(|(h, v)| *h = h.wrapping_add(v));
}

/// Fractions of the cube and square roots of the first primes.
fn constants() -> ([u32; 64], [u32; 8]) {
    let primes: Vec<u64> = (2..312).filter(|&n| (2..n).all(|d| n % d != 0)).collect();
    // floor(root · 2³²) by bisection in integers, as f64 has too few digits to be trusted here.
    let fraction = |p: u64, power: u32| {
        let target = (p as u128) << (32 * power);
        let (mut lo, mut hi) = (0u128, 1u128 << 37);
        while hi - lo > 1 {
            let mid = (lo + hi) / 2;
            if mid.pow(power) <= target { lo = mid } else { hi = mid }
        }
        lo as u32
    };
    (std::array::from_fn(|i| fraction(primes[i], 3)), std::array::from_fn(|i| fraction(primes[i], 2)))
}
