//! A picture as a function of the plane, and the way back (notes §1.1).
//!
//! `I(x, y)` is constant on squares of side 1 about the integers: pixel `(0, 0)` is the one at the *bottom left*, the picture reaches
//! from −½ to `n − ½`. Memory and files start at the top left; [`Raster`] is the one place that knows both.
//!
//! A pixel holds the mean of the light over its square, `(1/A) ∫ I dA`. That is right for linear, premultiplied values only, which is
//! what [`Image`] has.

use super::Image;

/// The sides of a picture, and where its pixels are.
///
/// ```
/// use sinew::image::sample::Raster;
/// let r = Raster { width: 2, height: 2 };
/// // The bottom left pixel is the third in memory, and its corner is the corner of the picture.
/// assert_eq!(r.index([0, 0]), 2);
/// assert_eq!(r.pixel(2), [0, 0]);
/// assert_eq!(r.pixel_at([-0.5, -0.5]), Some([0, 0]));
/// assert_eq!(r.pixel_at([1.5, 0.0]), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Raster {
    /// Pixels a row, `n_x`.
    pub width: usize,
    /// Rows, `n_y`.
    pub height: usize,
}

impl Raster {
    /// Of a picture.
    pub fn of(image: &Image) -> Self {
        Self { width: image.width, height: image.height }
    }

    /// Where pixel `(i, j)`, `j` from the bottom, is in memory.
    ///
    /// # Panics
    /// Outside the picture.
    pub fn index(self, [i, j]: [usize; 2]) -> usize {
        assert!(i < self.width && j < self.height, "pixel ({i}, {j}) of {} × {}", self.width, self.height);
        (self.height - 1 - j) * self.width + i
    }

    /// The pixel, row from the bottom, that is at a place in memory.
    ///
    /// # Panics
    /// Outside the picture.
    pub fn pixel(self, index: usize) -> [usize; 2] {
        assert!(index < self.width * self.height, "place {index} of {} × {}", self.width, self.height);
        [index % self.width, self.height - 1 - index / self.width]
    }

    /// The pixel whose square holds a point; `None` outside −½ … n − ½.
    pub fn pixel_at(self, [x, y]: [f64; 2]) -> Option<[usize; 2]> {
        let inside = |v: f64, n: usize| v >= -0.5 && v < n as f64 - 0.5;
        let cell = |v: f64, n: usize| ((v + 0.5).floor() as usize).min(n - 1);
        (inside(x, self.width) && inside(y, self.height)).then(|| [cell(x, self.width), cell(y, self.height)])
    }

    /// The height `y` of the notes as rows from the top, `n_y − 1 − y`; its own inverse.
    pub fn flip(self, y: f64) -> f64 {
        self.height as f64 - 1.0 - y
    }
}

/// How a picture is read between its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Filter {
    /// The pixel that holds the point: hard squares.
    Nearest,
    /// The four pixels about the point, each by how near it is.
    Bilinear,
    /// The mean over the area: what a pixel is. The right one to make a picture smaller.
    #[default]
    Area,
}

impl Filter {
    /// Every filter.
    pub const ALL: [Self; 3] = [Self::Nearest, Self::Bilinear, Self::Area];

    /// The name for messages and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::Bilinear => "bilinear",
            Self::Area => "area",
        }
    }

    /// The filter of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.name() == name)
    }
}

/// The light at `(x, y)` of §1.1; the border's pixels go on for ever.
///
/// [`Filter::Area`] is the mean over the unit square about the point, which for a picture of squares is the bilinear value.
///
/// ```
/// use sinew::image::{Image, sample::{Filter, sample}};
/// let ramp = Image { width: 2, height: 1, pixels: vec![[0.0, 0.0, 0.0, 1.0], [1.0; 4]] };
/// assert_eq!(sample(&ramp, [0.25, 0.0], Filter::Bilinear)[0], 0.25);
/// assert_eq!(sample(&ramp, [0.25, 0.0], Filter::Nearest)[0], 0.0);
/// ```
///
/// # Panics
/// For a picture without pixels.
pub fn sample(image: &Image, [x, y]: [f64; 2], filter: Filter) -> [f32; 4] {
    assert!(!image.pixels.is_empty(), "a picture without pixels cannot be sampled");
    let raster = Raster::of(image);
    let row = raster.flip(y);
    let at = |i: usize, j: usize| image.pixels[j * image.width + i];
    if filter == Filter::Nearest {
        // Ties go to the right and, as seen in the picture, up.
        return at(clamped((x + 0.5).floor(), image.width), clamped((row - 0.5).ceil(), image.height));
    }
    let (i, j) = (x.floor(), row.floor());
    let (s, t) = ((x - i) as f32, (row - j) as f32);
    let [i0, i1] = [i, i + 1.0].map(|i| clamped(i, image.width));
    let [j0, j1] = [j, j + 1.0].map(|j| clamped(j, image.height));
    mix(mix(at(i0, j0), at(i1, j0), s), mix(at(i0, j1), at(i1, j1), s), t)
}

fn clamped(v: f64, n: usize) -> usize {
    (v.max(0.0) as usize).min(n - 1)
}

fn mix(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|c| a[c] * (1.0 - t) + b[c] * t)
}

/// A picture of other sides that covers the same area.
///
/// A new pixel is centred at `x = (i + ½)·n/N − ½` of the old one. With [`Filter::Area`] it is the mean over the square that it
/// covers, so the mean of the whole stays what it was.
///
/// ```
/// use sinew::image::{Image, sample::{Filter, resize}};
/// let fine = Image { width: 2, height: 1, pixels: vec![[0.0, 0.0, 0.0, 1.0], [1.0; 4]] };
/// assert_eq!(resize(&fine, [1, 1], Filter::Area).pixels, [[0.5, 0.5, 0.5, 1.0]]);
/// ```
pub fn resize(image: &Image, [width, height]: [usize; 2], filter: Filter) -> Image {
    if image.pixels.is_empty() {
        return Image::filled(width, height, [0.0; 4]);
    }
    // Rows first, then columns: the weights of a rectangle are products.
    let (columns, rows) = (taps(image.width, width, filter), taps(image.height, height, filter));
    let mut narrow = Vec::with_capacity(width * image.height);
    for row in image.pixels.chunks(image.width) {
        narrow.extend(columns.iter().map(|t| t.sum(|k| row[k])));
    }
    let mut pixels = Vec::with_capacity(width * height);
    for t in &rows {
        pixels.extend((0..width).map(|x| t.sum(|k| narrow[k * width + x])));
    }
    Image { width, height, pixels }
}

/// Which old pixels of a line make a new one.
struct Taps {
    first: usize,
    weights: Vec<f32>,
}

impl Taps {
    #[inline]
    fn sum(&self, pixel: impl Fn(usize) -> [f32; 4]) -> [f32; 4] {
        let mut sum = [0.0; 4];
        for (k, &w) in self.weights.iter().enumerate() {
            let p = pixel(self.first + k);
            sum = std::array::from_fn(|c| sum[c] + w * p[c]);
        }
        sum
    }
}

fn taps(from: usize, to: usize, filter: Filter) -> Vec<Taps> {
    let step = from as f64 / to as f64;
    let one = |i: usize| {
        let center = (i as f64 + 0.5) * step - 0.5;
        match filter {
            Filter::Nearest => Taps { first: clamped((center + 0.5).floor(), from), weights: vec![1.0] },
            Filter::Bilinear => {
                let low = center.floor();
                let (a, b) = (clamped(low, from), clamped(low + 1.0, from));
                let t = (center - low) as f32;
                if a == b {
                    Taps { first: a, weights: vec![1.0] }
                } else {
                    Taps { first: a, weights: vec![1.0 - t, t] }
                }
            }
            Filter::Area => covered(i as f64 * step, (i + 1) as f64 * step, from),
        }
    };
    (0..to).map(one).collect()
}

/// How much of `low … high` (from the left edge) each old pixel covers.
fn covered(low: f64, high: f64, n: usize) -> Taps {
    let first = clamped(low.floor(), n);
    let last = clamped(high.ceil() - 1.0, n).max(first);
    let share = |k: usize| ((high.min(k as f64 + 1.0) - low.max(k as f64)).max(0.0) / (high - low)) as f32;
    Taps { first, weights: (first..=last).map(share).collect() }
}

/// The picture of a function: every pixel is the mean of `n × n` values over its square (the midpoint rule).
///
/// `light(x, y)` is linear and premultiplied, `(x, y)` as in §1.1. The error falls with `1/n²` where the function is smooth and with
/// `1/n` along its edges.
///
/// ```
/// use sinew::image::sample::picture_of;
/// // Half of the middle pixel is left of x = 1.
/// let edge = picture_of([3, 1], 4, |x, _| if x < 1.0 { [1.0; 4] } else { [0.0; 4] });
/// assert_eq!(edge.pixels.iter().map(|p| p[0]).collect::<Vec<_>>(), [1.0, 0.5, 0.0]);
/// ```
pub fn picture_of([width, height]: [usize; 2], n: usize, light: impl Fn(f64, f64) -> [f32; 4]) -> Image {
    let raster = Raster { width, height };
    let n = n.max(1);
    let offset = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
    let mean = |index: usize| {
        let [i, j] = raster.pixel(index);
        let mut sum = [0.0f64; 4];
        for (a, b) in (0..n).flat_map(|b| (0..n).map(move |a| (a, b))) {
            let l = light(i as f64 + offset(a), j as f64 + offset(b));
            sum = std::array::from_fn(|c| sum[c] + f64::from(l[c]));
        }
        sum.map(|s| (s / (n * n) as f64) as f32)
    };
    Image { width, height, pixels: (0..width * height).map(mean).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns to the right, rows upwards, as in the notes: `red = i`, `green = j`.
    fn numbered(width: usize, height: usize) -> Image {
        picture_of([width, height], 1, |x, y| [x as f32, y as f32, 0.0, 1.0])
    }

    #[test]
    fn the_corners_of_two_by_two_are_where_the_notes_have_them() {
        let image = numbered(2, 2);
        // In memory: top left, top right, bottom left, bottom right.
        assert_eq!(
            image.pixels.iter().map(|p| [p[0], p[1]]).collect::<Vec<_>>(),
            [[0., 1.], [1., 1.], [0., 0.], [1., 0.]]
        );
        let r = Raster::of(&image);
        for (corner, pixel) in
            [([-0.5, -0.5], [0, 0]), ([1.49, -0.5], [1, 0]), ([-0.5, 1.49], [0, 1]), ([1.49, 1.49], [1, 1])]
        {
            assert_eq!(r.pixel_at(corner), Some(pixel));
            assert_eq!(sample(&image, corner, Filter::Nearest)[..2], pixel.map(|v| v as f32));
        }
        assert!([[-0.51, 0.0], [0.0, 1.5], [f64::NAN, 0.0]].iter().all(|&p| r.pixel_at(p).is_none()));
        assert!((0..4).all(|k| r.index(r.pixel(k)) == k));
    }

    #[test]
    fn every_filter_gives_a_pixel_at_its_centre() {
        let image = numbered(5, 4);
        for filter in Filter::ALL {
            for (i, j) in (0..5).flat_map(|i| (0..4).map(move |j| (i, j))) {
                assert_eq!(
                    sample(&image, [i as f64, j as f64], filter)[..2],
                    [i as f32, j as f32],
                    "{filter:?}"
                );
            }
            assert_eq!(resize(&image, [5, 4], filter), image, "{filter:?}");
            assert_eq!(Filter::from_name(filter.name()), Some(filter));
        }
    }

    #[test]
    fn areas_keep_the_mean_whatever_the_sides() {
        let image = numbered(7, 5);
        for size in [[1, 1], [3, 2], [7, 5], [4, 9], [20, 13]] {
            let mean =
                |m: &Image| m.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / m.pixels.len() as f64;
            let other = resize(&image, size, Filter::Area);
            assert_eq!([other.width, other.height], size);
            assert!((mean(&other) - mean(&image)).abs() < 1e-5, "{size:?}: {}", mean(&other));
        }
    }

    #[test]
    fn nothing_to_read_gives_nothing_to_see() {
        let none = Image::default();
        assert_eq!(resize(&none, [2, 1], Filter::Area).pixels, [[0.0; 4]; 2]);
        assert!(resize(&numbered(2, 2), [0, 3], Filter::Area).pixels.is_empty());
    }
}
