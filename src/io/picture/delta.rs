//! What changed between two frames.

/// A part of a picture, in pixels from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rect {
    pub left: usize,
    pub top: usize,
    /// First column that is outside.
    pub right: usize,
    /// First row that is outside.
    pub bottom: usize,
}

impl Rect {
    /// The whole picture.
    pub fn full(size: [usize; 2]) -> Self {
        Self { left: 0, top: 0, right: size[0], bottom: size[1] }
    }

    /// One pixel: the smallest frame that a film can have.
    pub fn corner() -> Self {
        Self { left: 0, top: 0, right: 1, bottom: 1 }
    }

    pub fn width(&self) -> usize {
        self.right - self.left
    }

    pub fn height(&self) -> usize {
        self.bottom - self.top
    }

    /// The smallest rectangle that holds both.
    pub fn union(self, other: Self) -> Self {
        Self {
            left: self.left.min(other.left),
            top: self.top.min(other.top),
            right: self.right.max(other.right),
            bottom: self.bottom.max(other.bottom),
        }
    }

    /// The same rectangle, its left and upper side moved outwards to even pixels.
    pub fn even(self) -> Self {
        Self { left: self.left & !1, top: self.top & !1, ..self }
    }

    /// Where each row starts and ends in a buffer of `width` pixels a row.
    pub fn rows(&self, width: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let Self { left, right, .. } = *self;
        (self.top..self.bottom).map(move |y| y * width + left..y * width + right)
    }
}

/// Pixels that are compared at a time.
const WIDE: usize = 32;

/// Whether some pixels are those. A comparison of slices would call the system's, which for so few costs more than it does.
#[inline(always)]
fn same<const N: usize>(a: &[[u8; N]], b: &[[u8; N]]) -> bool {
    a.as_flattened().iter().zip(b.as_flattened()).fold(0, |d, (x, y)| d | (x ^ y)) == 0
}

/// The first column in which two rows differ, and the first after the last.
pub(super) fn span<const N: usize>(before: &[[u8; N]], after: &[[u8; N]]) -> Option<(usize, usize)> {
    let wide = |row| <[[u8; N]]>::as_chunks::<WIDE>(row).0;
    let skip = wide(before).iter().zip(wide(after)).take_while(|(a, b)| same(*a, *b)).count() * WIDE;
    let differs = |x: &usize| before[*x] != after[*x];
    let first = (skip..before.len().min(after.len())).find(differs)?;
    let (before, after) = (&before[first..], &after[first..]);
    let wide = |row| <[[u8; N]]>::as_rchunks::<WIDE>(row).1;
    let skip =
        wide(before).iter().rev().zip(wide(after).iter().rev()).take_while(|(a, b)| same(*a, *b)).count();
    let differs = |x: &usize| before[*x] != after[*x];
    let last = (0..before.len() - skip * WIDE).rfind(differs).unwrap_or_default();
    Some((first, first + last + 1))
}

/// The smallest rectangle that holds every pixel that differs.
pub(super) fn bounds<const N: usize>(before: &[[u8; N]], after: &[[u8; N]], width: usize) -> Option<Rect> {
    let rows = before.chunks_exact(width).zip(after.chunks_exact(width)).enumerate();
    let rects = rows.filter_map(|(y, (a, b))| {
        span(a, b).map(|(left, right)| Rect { left, top: y, right, bottom: y + 1 })
    });
    rects.reduce(Rect::union)
}

/// The smallest rectangle that holds every pixel where `differs(before, after)`.
pub(super) fn bounds_where<T>(
    before: &[T],
    after: &[T],
    width: usize,
    differs: impl Fn(&T, &T) -> bool,
) -> Option<Rect> {
    let mut rect: Option<Rect> = None;
    for (y, (a, b)) in before.chunks_exact(width).zip(after.chunks_exact(width)).enumerate() {
        let differs = |x: &usize| differs(&a[*x], &b[*x]);
        let Some(left) = (0..width).find(differs) else { continue };
        let right = (0..width).rfind(differs).map_or(left, |x| x) + 1;
        let row = Rect { left, top: y, right, bottom: y + 1 };
        rect = Some(rect.map_or(row, |r| r.union(row)));
    }
    rect
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rectangle_is_tight() {
        let before = [[0u8]; 20];
        let mut after = before;
        assert_eq!(bounds(&before, &after, 5), None);
        (after[7], after[13]) = ([1], [1]);
        let rect = bounds(&before, &after, 5).unwrap();
        assert_eq!(rect, Rect { left: 2, top: 1, right: 4, bottom: 3 });
        assert_eq!(bounds_where(&before, &after, 5, |a, b| a != b), Some(rect));
        assert_eq!(rect.rows(5).collect::<Vec<_>>(), [7..9, 12..14]);
    }

    #[test]
    fn spans_are_found_at_any_column() {
        for width in [1, 15, 16, 17, 70] {
            let row = vec![[7; 4]; width];
            assert_eq!(span(&row, &row), None);
            for first in 0..width {
                for last in [first, (first + 20).min(width - 1)] {
                    let mut other = row.clone();
                    (other[first], other[last]) = ([7, 7, 8, 7], [9; 4]);
                    assert_eq!(span(&row, &other), Some((first, last + 1)), "{width}");
                }
            }
        }
    }
}
