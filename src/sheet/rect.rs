//! Rectangles of pixels.

use crate::image::Rgba8;

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

/// The smallest rectangle that holds every pixel whose alpha is not 0; the first pixel alone where there is none.
///
/// ```
/// use sinew::{image::Rgba8, sheet::{Rect, visible}};
/// let mut picture = Rgba8 { width: 4, height: 3, data: vec![0; 48] };
/// (picture.data[4 * 5 + 3], picture.data[4 * 10 + 3]) = (255, 1);
/// assert_eq!(visible(&picture), Rect { x: 1, y: 1, w: 2, h: 2 });
/// ```
pub fn visible(picture: &Rgba8) -> Rect {
    let w = picture.width.max(1);
    let (mut left, mut right, mut top, mut bottom) = (usize::MAX, 0, usize::MAX, 0);
    for (y, row) in picture.data.as_chunks::<4>().0.chunks(w).enumerate() {
        let Some(first) = row.iter().position(|p| p[3] > 0) else { continue };
        let last = row.iter().rposition(|p| p[3] > 0).unwrap_or(first);
        (left, right) = (left.min(first), right.max(last));
        (top, bottom) = (top.min(y), y);
    }
    match left {
        usize::MAX => Rect { x: 0, y: 0, w: 1, h: 1 },
        _ => Rect { x: left, y: top, w: right - left + 1, h: bottom - top + 1 },
    }
}
