//! Rectangles of pixels.

/// A part of a picture, in pixels from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub struct Rect {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub w: usize,
    /// Rows.
    pub h: usize,
}

impl Rect {
    /// A whole picture.
    pub fn whole(size: [usize; 2]) -> Self {
        Self { x: 0, y: 0, w: size[0], h: size[1] }
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.w, self.h]
    }

    /// Whether a pixel is in both.
    pub fn overlaps(&self, other: &Self) -> bool {
        let meet = |a: usize, n: usize, b: usize, m: usize| a < b + m && b < a + n;
        meet(self.x, self.w, other.x, other.w) && meet(self.y, self.h, other.y, other.h)
    }

    /// The pixels of this part of a picture that is `width` wide, row by row.
    ///
    /// # Panics
    /// If the picture ends before the rectangle does.
    pub fn cut<P: Copy>(&self, pixels: &[P], width: usize) -> Vec<P> {
        let rows = (self.y..self.y + self.h).map(|y| y * width + self.x);
        rows.flat_map(|at| &pixels[at..at + self.w]).copied().collect()
    }
}

/// The smallest rectangle that holds every pixel that is `seen`; the first pixel alone where there is none.
///
/// ```
/// use sinew::sheet::{Rect, visible};
/// let alpha = [0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 1, 0];
/// assert_eq!(visible(&alpha, 4, |&a| a > 0), Rect { x: 1, y: 1, w: 2, h: 2 });
/// ```
pub fn visible<P>(pixels: &[P], width: usize, seen: impl Fn(&P) -> bool) -> Rect {
    let (mut left, mut right, mut top, mut bottom) = (usize::MAX, 0, usize::MAX, 0);
    for (y, row) in pixels.chunks(width.max(1)).enumerate() {
        let Some(first) = row.iter().position(&seen) else { continue };
        let last = row.iter().rposition(&seen).unwrap_or(first);
        (left, right) = (left.min(first), right.max(last));
        (top, bottom) = (top.min(y), y);
    }
    match left {
        usize::MAX => Rect { x: 0, y: 0, w: 1, h: 1 },
        _ => Rect { x: left, y: top, w: right - left + 1, h: bottom - top + 1 },
    }
}
