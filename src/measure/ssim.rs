//! Structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004).

use super::picture::{SidesDiffer, same_sides};
use crate::image::{Rgba8, hue};

/// Side of the window, pixels.
const SIDE: usize = 11;
/// Standard deviation of the Gaussian window, pixels.
const SIGMA: f64 = 1.5;
/// `C₁ = (K₁L)²` and `C₂ = (K₂L)²` with `K₁ = 0.01`, `K₂ = 0.03` and `L = 255`.
const C1: f64 = 6.5025;
const C2: f64 = 58.5225;

/// Means of `x`, `y`, `x²`, `y²` and `xy` over a window.
type Moments = [f64; 5];

/// The mean structural similarity of two pictures: 1 for equal ones, about 0 for unrelated ones.
///
/// `SSIM = (2μxμy + C₁)(2σxy + C₂) / ((μx² + μy² + C₁)(σx² + σy² + C₂))`, equation 13, over every window of 11 × 11 pixels (Gaussian,
/// σ = 1.5) that lies inside, of the luma of 8-bit codes, `0.2126 R + 0.7152 G + 0.0722 B`. Where a side is below 11 there is one
/// window, the whole picture, all pixels alike. What is not opaque is laid over black and over white, and the lower value counts.
///
/// ```
/// use sinew::{image::Rgba8, measure::ssim};
/// let ramp = |k: u8| Rgba8 { width: 16, height: 16, data: (0..256).flat_map(|i| [i as u8 / 16 * k, 0, 0, 255]).collect() };
/// assert_eq!(ssim(&ramp(9), &ramp(9)).unwrap(), 1.0);
/// assert!(ssim(&ramp(9), &ramp(2)).unwrap() < 0.5);
/// ```
///
/// # Errors
/// [`SidesDiffer`].
pub fn ssim(expected: &Rgba8, actual: &Rgba8) -> Result<f64, SidesDiffer> {
    same_sides([expected.width, expected.height], [actual.width, actual.height])?;
    if expected.data == actual.data {
        return Ok(1.0);
    }
    let opaque = |p: &Rgba8| p.data.as_chunks::<4>().0.iter().all(|p| p[3] == 255);
    let over = |matte: f64| mean(&luma(expected, matte), &luma(actual, matte), expected.width);
    let least = if opaque(expected) && opaque(actual) { over(0.0) } else { over(0.0).min(over(255.0)) };
    Ok(least)
}

/// The luma of a picture over a gray one.
fn luma(picture: &Rgba8, matte: f64) -> Vec<f64> {
    let over = |[r, g, b, a]: &[u8; 4]| {
        let a = f64::from(*a) / 255.0;
        a * hue::gray([r, g, b].map(|&c| f64::from(c))) + (1.0 - a) * matte
    };
    picture.data.as_chunks::<4>().0.iter().map(over).collect()
}

fn mean(x: &[f64], y: &[f64], width: usize) -> f64 {
    let height = x.len() / width.max(1);
    if width < SIDE || height < SIDE {
        return similarity(whole(x, y));
    }
    // Rows are filtered once and kept for as long as a window reaches them.
    let weights = weights();
    let columns = width - SIDE + 1;
    let mut kept: Vec<Vec<Moments>> = Vec::with_capacity(SIDE);
    let mut sum = 0.0;
    for row in 0..height {
        let (a, b) = (&x[row * width..][..width], &y[row * width..][..width]);
        let filtered = (0..columns).map(|c| filter(&a[c..c + SIDE], &b[c..c + SIDE], &weights));
        if kept.len() < SIDE {
            kept.push(filtered.collect());
        } else {
            kept.rotate_left(1);
            kept[SIDE - 1].clear();
            kept[SIDE - 1].extend(filtered);
        }
        if kept.len() == SIDE {
            sum += (0..columns).map(|c| similarity(down(&kept, c, &weights))).sum::<f64>();
        }
    }
    sum / (columns * (height - SIDE + 1)) as f64
}

fn weights() -> [f64; SIDE] {
    let gauss = |i: usize| (-(i as f64 - (SIDE / 2) as f64).powi(2) / (2.0 * SIGMA * SIGMA)).exp();
    let sum: f64 = (0..SIDE).map(gauss).sum();
    std::array::from_fn(|i| gauss(i) / sum)
}

#[inline]
fn filter(x: &[f64], y: &[f64], weights: &[f64; SIDE]) -> Moments {
    let mut m = [0.0; 5];
    for i in 0..SIDE {
        let (w, x, y) = (weights[i], x[i], y[i]);
        let term = [x, y, x * x, y * y, x * y];
        m = std::array::from_fn(|k| m[k] + w * term[k]);
    }
    m
}

#[inline]
fn down(rows: &[Vec<Moments>], column: usize, weights: &[f64; SIDE]) -> Moments {
    let mut m = [0.0; 5];
    for (row, w) in rows.iter().zip(weights) {
        m = std::array::from_fn(|k| m[k] + w * row[column][k]);
    }
    m
}

fn whole(x: &[f64], y: &[f64]) -> Moments {
    let mut m = [0.0; 5];
    for (x, y) in x.iter().zip(y) {
        let term = [*x, *y, x * x, y * y, x * y];
        m = std::array::from_fn(|k| m[k] + term[k]);
    }
    m.map(|s| s / x.len().max(1) as f64)
}

#[inline]
fn similarity([x, y, xx, yy, xy]: Moments) -> f64 {
    let (vx, vy, vxy) = (xx - x * x, yy - y * y, xy - x * y);
    (2.0 * x * y + C1) * (2.0 * vxy + C2) / ((x * x + y * y + C1) * (vx + vy + C2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::picture::difference;

    fn picture(pixel: impl Fn(i32, i32) -> [i32; 3]) -> Rgba8 {
        let places = (0..48).flat_map(|y| (0..64).map(move |x| (x, y)));
        let data = places.flat_map(|(x, y)| {
            let [r, g, b] = pixel(x, y).map(|c| c.clamp(0, 255) as u8);
            [r, g, b, 255]
        });
        Rgba8 { width: 64, height: 48, data: data.collect() }
    }

    fn pattern(x: i32, y: i32) -> [i32; 3] {
        let a = (4 * x + 3 * y) & 255;
        [a, 255 - a, (x * y) & 255]
    }

    /// Numbers of scikit-image 0.26.0, `structural_similarity(gaussian_weights=True, sigma=1.5, use_sample_covariance=False,
    /// data_range=255)` of the luma in f64, and `peak_signal_noise_ratio` of the codes.
    #[test]
    fn an_independent_program_finds_the_same() {
        let a = picture(pattern);
        let noisy = picture(|x, y| pattern(x, y).map(|c| c + (x * x + 3 * y) % 17 - 8));
        let coarse = picture(|x, y| pattern(x, y).map(|c| c / 16 * 16));
        for (b, want, db) in
            [(noisy, 0.8595331897697992, 34.41713815323557), (coarse, 0.9608715374344602, 29.472856985034873)]
        {
            let found = ssim(&a, &b).unwrap();
            assert!((found - want).abs() < 1e-9, "{found} {want}");
            let found = difference(&a, &b).unwrap().psnr();
            assert!((found - db).abs() < 1e-9, "{found} {db}");
        }
    }

    #[test]
    fn a_hole_in_a_black_shape_is_seen() {
        let shape = |hole: bool| {
            let pixel = |i: usize| [0, 0, 0, if hole && (20..40).contains(&(i % 64)) { 0 } else { 255 }];
            Rgba8 { width: 64, height: 48, data: (0..64 * 48).flat_map(pixel).collect() }
        };
        assert!(ssim(&shape(false), &shape(true)).unwrap() < 0.8);
    }

    #[test]
    fn pictures_smaller_than_the_window_are_one_window() {
        let small = |v: u8| Rgba8 { width: 2, height: 1, data: vec![0, 0, 0, 255, v, v, v, 255] };
        // Means 50 and 100, variances 2500 and 10000, covariance 5000.
        let want = (2.0 * 5000.0 + C1) * (2.0 * 5000.0 + C2) / ((12500.0 + C1) * (12500.0 + C2));
        assert!((ssim(&small(100), &small(200)).unwrap() - want).abs() < 1e-12);
        assert_eq!(ssim(&Rgba8::default(), &Rgba8::default()).unwrap(), 1.0);
    }
}
