//! Pictures mirrored and turned, pixel for pixel (chapter 1 of the notes, its reference pictures).

use super::{Image, Rgba8};

/// A new order of pixels: mirrored left to right.
fn mirrored<T: Copy>(pixels: &[T], width: usize) -> Vec<T> {
    pixels.chunks(width.max(1)).flat_map(|row| row.iter().rev().copied()).collect()
}

/// A new order of pixels: turned by 90° counter-clockwise, so that the last column becomes the first row.
fn turned<T: Copy>(pixels: &[T], width: usize, height: usize) -> Vec<T> {
    (0..width).rev().flat_map(|x| (0..height).map(move |y| pixels[y * width + x])).collect()
}

impl Image {
    /// Left to right, as in a mirror.
    pub fn mirrored(&self) -> Self {
        Self { pixels: mirrored(&self.pixels, self.width), ..*self }
    }

    /// By 90° counter-clockwise; width and height are exchanged.
    pub fn turned_left(&self) -> Self {
        let pixels = turned(&self.pixels, self.width, self.height);
        Self { width: self.height, height: self.width, pixels }
    }
}

impl Rgba8 {
    /// Left to right, as in a mirror.
    ///
    /// ```
    /// use sinew::image::Rgba8;
    /// let p = Rgba8 { width: 2, height: 1, data: vec![1, 1, 1, 1, 2, 2, 2, 2] };
    /// assert_eq!(p.mirrored().data, [2, 2, 2, 2, 1, 1, 1, 1]);
    /// // What was at the right is at the top.
    /// assert_eq!((p.turned_left().height, p.turned_left().data[0]), (2, 2));
    /// ```
    pub fn mirrored(&self) -> Self {
        Self { data: mirrored(self.data.as_chunks::<4>().0, self.width).concat(), ..*self }
    }

    /// By 90° counter-clockwise; width and height are exchanged.
    pub fn turned_left(&self) -> Self {
        let data = turned(self.data.as_chunks::<4>().0, self.width, self.height).concat();
        Self { width: self.height, height: self.width, data }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_mirrors_and_four_turns_change_nothing() {
        let image = Image { width: 3, height: 2, pixels: (0..6).map(|i| [i as f32; 4]).collect() };
        assert_eq!(image.mirrored().mirrored(), image);
        let left = image.turned_left();
        assert_eq!(left.pixels.iter().map(|p| p[0]).collect::<Vec<_>>(), [2., 5., 1., 4., 0., 3.]);
        assert_eq!(left.turned_left().turned_left().turned_left(), image);
        assert_eq!(Image::default().turned_left(), Image::default());
        let bytes = image.to_rgba8();
        assert_eq!(
            bytes.turned_left().turned_left(),
            bytes.mirrored().turned_left().turned_left().mirrored()
        );
    }
}
