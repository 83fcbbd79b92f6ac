//! The exact nearest colour of a palette, by cells.

/// Weights of squared differences of 8-bit sRGB codes.
///
/// They are the diagonal of Oklab's metric in sRGB codes, averaged over the cube (0.138, 0.397, 0.114); its largest
/// off-diagonal entry is 0.046, small enough to leave out.
pub(super) const WEIGHT: [i32; 3] = [5, 14, 4];

/// Bits a channel of the cells that are filled when a colour asks for them.
const FINE: usize = 6;
/// Bits a channel of the cells that are filled at once.
const COARSE: usize = 4;

/// Finds the colour with the least `Σ wᵢ·(aᵢ − bᵢ)²`; of equals, the first.
///
/// A cell of 4³ colours lists the candidates that are nearest to any point of it. Whether `p` can
/// beat `q` in a box is decided exactly, because the difference of two squared distances is linear in the point.
#[derive(Clone, Debug)]
pub(super) struct Nearest {
    colors: Vec<[i32; 3]>,
    coarse: Vec<Vec<u8>>,
    /// `first << 9 | count` into `lists`; 0 where nobody asked yet.
    fine: Vec<u32>,
    lists: Vec<u8>,
    /// Answers for exact colours, `color << 8 | index`, each in the place that its hash says.
    known: Vec<u32>,
}

/// Bits of the places for known answers: 128 KB, which the second-level cache holds.
const KNOWN: u32 = 15;

impl Nearest {
    /// # Panics
    /// Without colours, or with more than 256.
    pub fn new(colors: &[[u8; 3]]) -> Self {
        assert!((1..=256).contains(&colors.len()), "a palette of {} colours", colors.len());
        let colors: Vec<_> = colors.iter().map(|c| c.map(i32::from)).collect();
        let all: Vec<u8> = (0..colors.len()).map(|i| i as u8).collect();
        let coarse = (0..1 << (3 * COARSE)).map(|cell| candidates(&colors, &all, cell, COARSE)).collect();
        // Black's place is 0; every other place starts with black, which no lookup there asks for.
        let mut known = vec![0; 1 << KNOWN];
        known[0] = u32::from(nearest(&colors, &all, [0; 3]));
        Self { colors, coarse, fine: vec![0; 1 << (3 * FINE)], lists: Vec::new(), known }
    }

    /// Index of the nearest colour.
    #[inline]
    pub fn of(&mut self, color: [u8; 3]) -> u8 {
        let key = u32::from_be_bytes([0, color[0], color[1], color[2]]);
        let place = (key.wrapping_mul(0x9e37_79b1) >> (32 - KNOWN)) as usize;
        let known = self.known[place];
        if known >> 8 == key {
            return known as u8;
        }
        let index = self.search(color);
        self.known[place] = key << 8 | u32::from(index);
        index
    }

    fn search(&mut self, color: [u8; 3]) -> u8 {
        let cell = cell_of(color, FINE);
        let mut entry = self.fine[cell];
        if entry == 0 {
            entry = self.fill(cell, color);
        }
        let (first, count) = ((entry >> 9) as usize, (entry & 511) as usize);
        nearest(&self.colors, &self.lists[first..first + count], color.map(i32::from))
    }

    #[cold]
    fn fill(&mut self, cell: usize, color: [u8; 3]) -> u32 {
        let list = candidates(&self.colors, &self.coarse[cell_of(color, COARSE)], cell, FINE);
        // 2¹⁸ cells of less than 32 candidates each fit 23 bits; a pathological palette starts its lists anew.
        if self.lists.len() + list.len() >= 1 << 23 {
            self.fine.fill(0);
            self.lists.clear();
        }
        let entry = (self.lists.len() as u32) << 9 | list.len() as u32;
        self.lists.extend(list);
        self.fine[cell] = entry;
        entry
    }
}

/// The cell of a colour, for cells of 2^(8−bits) codes a side.
#[inline]
fn cell_of(color: [u8; 3], bits: usize) -> usize {
    let [r, g, b] = color.map(|c| usize::from(c) >> (8 - bits));
    (r << bits | g) << bits | b
}

/// Those of `among` that are nearest to some point of a cell.
fn candidates(colors: &[[i32; 3]], among: &[u8], cell: usize, bits: usize) -> Vec<u8> {
    let side = 1i32 << (8 - bits);
    let low: [i32; 3] = std::array::from_fn(|i| (cell >> (bits * (2 - i)) & ((1 << bits) - 1)) as i32 * side);
    let high = low.map(|l| l + side - 1);
    let q = nearest(colors, among, low.map(|l| l + side / 2));
    among.iter().copied().filter(|&p| beats(colors[p as usize], colors[q as usize], low, high)).collect()
}

/// Whether `p` is at least as near as `q` somewhere between `low` and `high`.
///
/// `|x−p|² − |x−q|² = Σ w·(p² − q² − 2x(p − q))` is linear in `x`: each axis takes its least value at an end.
fn beats(p: [i32; 3], q: [i32; 3], low: [i32; 3], high: [i32; 3]) -> bool {
    let least = |i: usize| {
        let d = p[i] - q[i];
        let x = if d > 0 { high[i] } else { low[i] };
        WEIGHT[i] * (d * (p[i] + q[i]) - 2 * x * d)
    };
    least(0) + least(1) + least(2) <= 0
}

/// The nearest of some colours, the first of equals.
#[inline]
fn nearest(colors: &[[i32; 3]], among: &[u8], x: [i32; 3]) -> u8 {
    // Distance and index in one number, 21 bits and 8, so that the least needs no branch.
    let key = |&i: &u8| distance(colors[usize::from(i)], x) << 8 | i32::from(i);
    among.iter().map(key).min().unwrap_or(0) as u8
}

/// `Σ wᵢ·(aᵢ − bᵢ)²`
#[inline]
pub(super) fn distance(a: [i32; 3], b: [i32; 3]) -> i32 {
    let term = |i: usize| WEIGHT[i] * (a[i] - b[i]) * (a[i] - b[i]);
    term(0) + term(1) + term(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_rng::Rng;

    #[test]
    fn the_cells_find_what_a_full_search_finds() {
        let mut rng = Rng::new(7);
        // Palettes with clusters, so that cells hold many candidates.
        for spread in [255u64, 40, 6] {
            let colors: Vec<[u8; 3]> =
                (0..250).map(|_| std::array::from_fn(|_| (100 + rng.next() % spread) as u8)).collect();
            let full: Vec<_> = colors.iter().map(|c| c.map(i32::from)).collect();
            let all: Vec<u8> = (0..250).collect();
            let mut fast = Nearest::new(&colors);
            for _ in 0..20_000 {
                let c: [u8; 3] = std::array::from_fn(|_| (90 + rng.next() % (spread + 20)) as u8);
                assert_eq!(fast.of(c), nearest(&full, &all, c.map(i32::from)), "{c:?}");
            }
        }
    }
}
