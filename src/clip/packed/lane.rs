//! A list of integers that any place of can be read from without the others.
//!
//! Every so many numbers one is stored as it is: an anchor. Between two anchors the middle one is stored as what it differs from a
//! guess by, then the middles of both halves, and so on. The guess is the straight line between both ends, and, if the lane says so, a
//! quarter of the bend that was found a level above. Each level has a number of bits of its own, and each block takes so many less
//! as it can spare.

use super::bits::{BitReader, BitWriter, Bits};

/// Halvings of the longest block.
const LEVELS: usize = 5;

/// No number takes more bits.
const WIDEST: u32 = 24;

/// Of a stretch of so many steps, how many of its inner numbers lie on each level; the shortest stretches are on level 0.
const INNER: [[u8; LEVELS]; 33] = {
    let mut t = [[0; LEVELS]; 33];
    let mut len = 2;
    while len < 33 {
        let (left, right) = (len / 2, len - len / 2);
        let mut level = 0;
        while level < LEVELS {
            t[len][level] = t[left][level] + t[right][level] + (level == level_of(len)) as u8;
            level += 1;
        }
        len += 1;
    }
    t
};

const fn level_of(len: usize) -> usize {
    (len - 1).ilog2() as usize
}

/// Where the numbers are, and how they are to be read.
#[derive(Clone, Debug, PartialEq, Default)]
pub(super) struct Lane {
    count: usize,
    /// The smallest anchor.
    offset: i32,
    /// Bits of an anchor, and of the numbers on each level.
    anchor: u32,
    widths: [u8; LEVELS],
    /// Bits of what a block can spare.
    spare: u32,
    bend: bool,
    anchors_at: usize,
    /// Where each block begins.
    blocks: Vec<u32>,
}

/// A place in a block on the way down.
#[derive(Clone, Copy)]
struct Stretch {
    ends: [usize; 2],
    values: [i32; 2],
    bend: i32,
    at: usize,
}

/// The numbers that are asked for.
struct Wanted<'o> {
    first: usize,
    out: &'o mut [i32],
}

impl Wanted<'_> {
    fn put(&mut self, place: usize, value: i32) {
        if let Some(o) = place.checked_sub(self.first).and_then(|i| self.out.get_mut(i)) {
            *o = value;
        }
    }

    /// Whether any lies strictly between both ends.
    fn within(&self, ends: [usize; 2]) -> bool {
        ends[0] + 1 < ends[1] && self.first < ends[1] && self.first + self.out.len() > ends[0] + 1
    }
}

impl Lane {
    /// Read the head of `count` numbers, and step over them.
    pub fn read(r: &mut BitReader, count: usize) -> Option<Self> {
        let mut lane = Self { count, offset: r.signed(6)?, ..Self::default() };
        if count < 2 {
            return Some(lane);
        }
        lane.anchor = r.get(5).filter(|w| *w <= WIDEST)?;
        let levels = r.get(3).filter(|l| *l as usize <= LEVELS)?;
        let steps = count - 1;
        let mut n = steps;
        if levels > 0 {
            n = steps.div_ceil(1 << levels);
            lane.spare = r.get(2)?;
            lane.bend = r.get(1)? == 1;
            let mut width = 0;
            for level in (0..levels as usize).rev() {
                width = if level + 1 == levels as usize {
                    r.get(5)? as i32
                } else {
                    width.checked_sub(r.signed(0)?)?
                };
                lane.widths[level] = u8::try_from(width).ok().filter(|w| u32::from(*w) <= WIDEST)?;
            }
        }
        lane.anchors_at = r.skip((n + 1) * lane.anchor as usize)?;
        if levels > 0 {
            for b in 0..n {
                lane.blocks.push(u32::try_from(r.at).ok()?);
                let spare = r.get(lane.spare)?;
                let len = lane.start(b + 1, n) - lane.start(b, n);
                r.skip(inside(len, &lane.spared(spare)))?;
            }
        }
        Some(lane)
    }

    fn start(&self, block: usize, of: usize) -> usize {
        block * (self.count - 1) / of
    }

    fn spared(&self, spare: u32) -> [u8; LEVELS] {
        self.widths.map(|w| w.saturating_sub(spare as u8))
    }

    fn anchor(&self, bits: &Bits, k: usize) -> i32 {
        self.offset + bits.get(self.anchors_at + k * self.anchor as usize, self.anchor) as i32
    }

    /// Numbers from `first` on, as many as fit into `out`.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn window(&self, bits: &Bits, first: usize, out: &mut [i32]) {
        let last = first + out.len() - 1;
        assert!(last < self.count, "number {last} of {}", self.count);
        if self.blocks.is_empty() {
            (first..=last).zip(out).for_each(|(k, o)| *o = self.anchor(bits, k));
            return;
        }
        let (n, steps) = (self.blocks.len(), self.count - 1);
        let block_of = |i: usize| (((i + 1) * n - 1) / steps).min(n - 1);
        let mut wanted = Wanted { first, out };
        for b in block_of(first)..=block_of(last) {
            let ends = [self.start(b, n), self.start(b + 1, n)];
            let values = [self.anchor(bits, b), self.anchor(bits, b + 1)];
            wanted.put(ends[0], values[0]);
            wanted.put(ends[1], values[1]);
            if !wanted.within(ends) {
                continue;
            }
            let at = self.blocks[b] as usize;
            let widths = self.spared(bits.get(at, self.spare));
            // The bend of the anchors around says how this block may bend.
            let beyond = |k: usize, end: i32| self.anchor(bits, k).wrapping_sub(end);
            let bend = if self.bend && b > 0 && b + 1 < n {
                anchors_bend(beyond(b - 1, values[0]).wrapping_add(beyond(b + 2, values[1])))
            } else {
                0
            };
            let whole = Stretch { ends, values, bend, at: at + self.spare as usize };
            self.descend(bits, &widths, whole, &mut wanted);
        }
    }

    fn descend(&self, bits: &Bits, widths: &[u8; LEVELS], s: Stretch, wanted: &mut Wanted) {
        let [lo, hi] = s.ends;
        let width = u32::from(widths[level_of(hi - lo)]);
        let (middle, line) = halved(s.ends, s.values);
        let value = line.wrapping_add(s.bend).wrapping_add(bits.get_signed(s.at, width));
        wanted.put(middle, value);
        let bend = if self.bend { value.wrapping_sub(line) >> 2 } else { 0 };
        let at = s.at + width as usize;
        if wanted.within([lo, middle]) {
            let left = Stretch { ends: [lo, middle], values: [s.values[0], value], bend, at };
            self.descend(bits, widths, left, wanted);
        }
        if wanted.within([middle, hi]) {
            let at = at + inside(middle - lo, widths);
            let right = Stretch { ends: [middle, hi], values: [value, s.values[1]], bend, at };
            self.descend(bits, widths, right, wanted);
        }
    }
}

/// Bits of all inner numbers of a stretch.
fn inside(len: usize, widths: &[u8; LEVELS]) -> usize {
    INNER[len].iter().zip(widths).map(|(n, w)| *n as usize * *w as usize).sum()
}

/// What the sum of the outer anchors' distances from the inner ones makes of the middle.
fn anchors_bend(outer: i32) -> i32 {
    outer.wrapping_neg() >> 4
}

/// The middle place, and where the straight line is there.
fn halved([lo, hi]: [usize; 2], [a, b]: [i32; 2]) -> (usize, i32) {
    let (len, half) = ((hi - lo) as i64, ((hi - lo) / 2) as i64);
    let apart = b as i64 - a as i64;
    // Where both halves are as long, the length cancels out.
    let rise = if 2 * half == len { (apart + 1) >> 1 } else { (2 * apart * half + len).div_euclid(2 * len) };
    (lo + half as usize, a.wrapping_add(rise as i32))
}

/// Bits of a signed number in two's complement.
fn width_of(v: i32) -> u8 {
    if v == 0 { 0 } else { (33 - if v < 0 { (!v).leading_zeros() } else { v.leading_zeros() }) as u8 }
}

/// A number inside of a block: its level and what it differs from the guess by.
type Inner = (usize, i32);

/// One way to write a list.
struct Layout<'v> {
    values: &'v [i32],
    levels: usize,
    bend: bool,
    /// Steps from anchor to anchor.
    n: usize,
    anchors: Vec<i32>,
    blocks: Vec<Vec<Inner>>,
    /// What each block can spare.
    slack: Vec<u8>,
    widths: [u8; LEVELS],
    /// Bits of an anchor.
    anchor: u32,
    spare: u32,
}

impl<'v> Layout<'v> {
    /// `None` if a number is too wide.
    fn new(values: &'v [i32], levels: usize, bend: bool) -> Option<Self> {
        let steps = values.len() - 1;
        let n = if levels > 0 { steps.div_ceil(1 << levels) } else { steps };
        let anchors: Vec<i32> = (0..=n).map(|b| values[b * steps / n]).collect();
        let (least, most) = (*anchors.iter().min()?, *anchors.iter().max()?);
        let mut l = Self {
            values,
            levels,
            bend,
            n,
            anchor: u32::BITS - ((most - least) as u32).leading_zeros(),
            anchors,
            blocks: vec![],
            slack: vec![],
            widths: [0; LEVELS],
            spare: 0,
        };
        l.blocks = (0..if levels > 0 { n } else { 0 }).map(|b| l.inner(b)).collect();
        for &(level, v) in l.blocks.iter().flatten() {
            l.widths[level] = l.widths[level].max(width_of(v));
        }
        let widths = l.widths;
        let slack = |block: &Vec<Inner>| {
            let each = block.iter().filter(|b| b.1 != 0).map(|b| widths[b.0] - width_of(b.1));
            each.min().unwrap_or(u8::MAX)
        };
        l.slack = l.blocks.iter().map(slack).collect();
        l.spare = (0..if levels > 0 { 4 } else { 1 }).min_by_key(|s| l.size(*s))?;
        (l.anchor <= WIDEST && widths.iter().all(|w| u32::from(*w) <= WIDEST)).then_some(l)
    }

    fn spared(&self, block: usize, bits: u32) -> u8 {
        self.slack[block].min((1 << bits) - 1)
    }

    /// Bits, but for the head, which is much the same for all.
    fn size(&self, spare: u32) -> usize {
        let block = |b: usize| {
            let s = self.spared(b, spare);
            spare as usize
                + self.blocks[b].iter().map(|i| self.widths[i.0].saturating_sub(s) as usize).sum::<usize>()
        };
        let head = if self.levels > 0 { 4 + 4 * self.levels } else { 0 };
        head + self.anchor as usize * self.anchors.len() + (0..self.blocks.len()).map(block).sum::<usize>()
    }

    /// The inner numbers of a block in the order that they are stored in.
    fn inner(&self, b: usize) -> Vec<Inner> {
        let steps = self.values.len() - 1;
        let ends = [b, b + 1].map(|b| b * steps / self.n);
        let a = &self.anchors;
        let bend = if self.bend && b > 0 && b + 1 < self.n {
            anchors_bend(a[b - 1] - a[b] + a[b + 2] - a[b + 1])
        } else {
            0
        };
        let mut out = vec![];
        self.descend(ends, bend, &mut out);
        out
    }

    fn descend(&self, ends: [usize; 2], bend: i32, out: &mut Vec<Inner>) {
        let [lo, hi] = ends;
        if hi - lo < 2 {
            return;
        }
        let (middle, line) = halved(ends, [self.values[lo], self.values[hi]]);
        let value = self.values[middle];
        out.push((level_of(hi - lo), value - line - bend));
        let bend = if self.bend { (value - line) >> 2 } else { 0 };
        self.descend([lo, middle], bend, out);
        self.descend([middle, hi], bend, out);
    }

    fn write(&self, w: &mut BitWriter) {
        let offset = *self.anchors.iter().min().expect("two anchors or more");
        w.signed(offset.into(), 6);
        w.put(self.anchor.into(), 5);
        w.put(self.levels as u64, 3);
        if self.levels > 0 {
            w.put(self.spare.into(), 2);
            w.put(self.bend.into(), 1);
            w.put(self.widths[self.levels - 1].into(), 5);
            for level in (0..self.levels - 1).rev() {
                w.signed(i64::from(self.widths[level + 1]) - i64::from(self.widths[level]), 0);
            }
        }
        self.anchors.iter().for_each(|a| w.put((a - offset) as u64, self.anchor));
        for (b, block) in self.blocks.iter().enumerate() {
            let spared = self.spared(b, self.spare);
            w.put(spared.into(), self.spare);
            for &(level, v) in block {
                w.put(v as u32 as u64, self.widths[level].saturating_sub(spared).into());
            }
        }
    }
}

/// The layout of fewest bits of a list; `None` if its numbers are too far apart.
fn best(values: &[i32]) -> Option<Layout<'_>> {
    let ways = [(0, false)].into_iter().chain((2..=LEVELS).flat_map(|l| [(l, false), (l, true)]));
    // Levels beyond those that the list has add nothing.
    let useful = ways.filter(|w| w.0 < 3 || values.len() > 1 << (w.0 - 1));
    useful.filter_map(|(levels, bend)| Layout::new(values, levels, bend)).min_by_key(|l| l.size(l.spare))
}

/// About how many bits a list takes.
pub(super) fn size(values: &[i32]) -> Option<usize> {
    if values.len() < 2 { Some(16) } else { best(values).map(|l| l.size(l.spare) + 24) }
}

/// Write a list in the way that takes the fewest bits; `None` if its numbers are too far apart.
pub(super) fn write(w: &mut BitWriter, values: &[i32]) -> Option<()> {
    match values {
        [only] => w.signed((*only).into(), 6),
        _ => best(values)?.write(w),
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_place_of_any_list_comes_back() {
        let mut rng = crate::test_rng::Rng::new(7);
        for count in (1..80).chain([333]) {
            for rough in [0.0, 3.0, 4000.0] {
                let wave = |k: usize| 900.0 * (k as f64 * 0.2).sin() + rough * rng.unit() as f64;
                let values: Vec<i32> = (0..count).map(wave).map(|v| v as i32).collect();
                let mut w = BitWriter::default();
                w.put(5, 3);
                write(&mut w, &values).unwrap();
                let (len, bits) = (w.len(), Bits::new(&w.into_bytes()));
                let mut r = BitReader { bits: &bits, at: 3 };
                let lane = Lane::read(&mut r, count).unwrap();
                assert_eq!(r.at, len);
                for first in 0..count {
                    for n in 1..=4.min(count - first) {
                        let mut out = [0; 4];
                        lane.window(&bits, first, &mut out[..n]);
                        assert_eq!(out[..n], values[first..first + n], "{count} {rough} {first}");
                    }
                }
            }
        }
    }
}
