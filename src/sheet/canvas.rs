//! The picture that a sheet becomes.

use super::layout::Layout;
use super::rect::Rect;

/// Pixels of any kind, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas<P> {
    /// Pixels across and down.
    pub size: [usize; 2],
    /// `size[0] · size[1]` pixels.
    pub pixels: Vec<P>,
}

impl<P: Copy> Canvas<P> {
    /// The canvas of a layout, everywhere `fill`.
    pub fn new(layout: &Layout, fill: P) -> Self {
        Self { size: layout.size, pixels: vec![fill; layout.size[0] * layout.size[1]] }
    }

    /// Put pixels in their place, and repeat those at its edges `extrude` times beyond it.
    ///
    /// # Panics
    /// If the place does not lie on the canvas, or `pixels` do not fill it.
    pub fn put(&mut self, place: Rect, pixels: &[P], extrude: usize) {
        assert_eq!(pixels.len(), place.w * place.h, "pixels for a place of {} × {}", place.w, place.h);
        let width = self.size[0];
        let (top, bottom) =
            (place.y.saturating_sub(extrude), (place.y + place.h + extrude).min(self.size[1]));
        let (left, right) = (place.x.saturating_sub(extrude), (place.x + place.w + extrude).min(width));
        for y in top..bottom {
            let from = &pixels[(y.max(place.y) - place.y).min(place.h - 1) * place.w..][..place.w];
            let row = &mut self.pixels[y * width..][..width];
            row[left..place.x].fill(from[0]);
            row[place.x..place.x + place.w].copy_from_slice(from);
            row[place.x + place.w..right].fill(from[place.w - 1]);
        }
    }
}
