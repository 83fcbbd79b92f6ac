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

/// The smallest rectangle that holds every pixel that differs.
pub(super) fn bounds<T: PartialEq>(before: &[T], after: &[T], width: usize) -> Option<Rect> {
    bounds_where(before, after, width, |a, b| a != b)
}

/// The smallest rectangle that holds every pixel where `differs(before, after)`; it must not where both are equal.
pub(super) fn bounds_where<T: PartialEq>(
    before: &[T],
    after: &[T],
    width: usize,
    differs: impl Fn(&T, &T) -> bool,
) -> Option<Rect> {
    let mut rect: Option<Rect> = None;
    for (y, (a, b)) in before.chunks_exact(width).zip(after.chunks_exact(width)).enumerate() {
        // Whole rows compare many pixels at a time, and most rows of most films stand still.
        if a == b {
            continue;
        }
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
        let before = [0u8; 20];
        let mut after = before;
        assert_eq!(bounds(&before, &after, 5), None);
        (after[7], after[13]) = (1, 1);
        let rect = bounds(&before, &after, 5).unwrap();
        assert_eq!(rect, Rect { left: 2, top: 1, right: 4, bottom: 3 });
        assert_eq!(rect.rows(5).collect::<Vec<_>>(), [7..9, 12..14]);
    }
}
