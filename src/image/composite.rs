//! One picture on another: compositing by regions (notes §1.4; Porter and Duff 1984).
//!
//! A pixel that a source covers by `αs` and a destination by `αd`, at random with respect to each other, has four regions:
//!
//! | region | area |
//! |---|---|
//! | source alone | `A_src = αs(1 − αd)` |
//! | destination alone | `A_dst = αd(1 − αs)` |
//! | both | `A_both = αs·αd` |
//! | neither | the rest; always empty |
//!
//! An operator is what it shows in each: the result is `A_src·[source] + A_dst·[destination] + A_both·[both]`, premultiplied, and its
//! alpha is the sum of the areas that show anything. Right in linear light only, which is what [`Image`] has.

use super::Image;

/// The areas of the regions of a pixel; with the empty one they sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regions {
    /// `A_src`: where the source is alone.
    pub source: f32,
    /// `A_dst`: where the destination is alone.
    pub destination: f32,
    /// `A_both`.
    pub both: f32,
}

impl Regions {
    /// Of two coverages of 0…1.
    pub fn new(source: f32, destination: f32) -> Self {
        Self {
            source: source * (1.0 - destination),
            destination: destination * (1.0 - source),
            both: source * destination,
        }
    }

    /// Put a straight colour, or none, into each region: the premultiplied pixel.
    ///
    /// Every region operator and more: a line drawn where two things overlap, a silhouette.
    ///
    /// ```
    /// use sinew::image::composite::Regions;
    /// // Red where only the source is, white where both are.
    /// let p = Regions::new(0.5, 0.5).paint(Some([1.0, 0.0, 0.0]), None, Some([1.0, 1.0, 1.0]));
    /// assert_eq!(p, [0.5, 0.25, 0.25, 0.5]);
    /// ```
    pub fn paint(
        self,
        source: Option<[f32; 3]>,
        destination: Option<[f32; 3]>,
        both: Option<[f32; 3]>,
    ) -> [f32; 4] {
        let regions = [(self.source, source), (self.destination, destination), (self.both, both)];
        let shown = regions.into_iter().filter_map(|(area, color)| Some((area, color?)));
        shown.fold([0.0; 4], |p, (area, [r, g, b])| {
            [p[0] + area * r, p[1] + area * g, p[2] + area * b, p[3] + area]
        })
    }
}

/// What is shown where source and destination overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Both {
    /// Nothing.
    Nothing,
    /// The source.
    Source,
    /// The destination.
    Destination,
    /// The light of both; alpha is counted twice, up to 1.
    Sum,
}

/// A way to put a source on a destination: what is shown in each region.
///
/// The twelve of Porter and Duff and their sum are constants here; every other combination of the fields works too.
///
/// ```
/// use sinew::image::composite::Operator;
/// let (red, blue) = ([0.5, 0.0, 0.0, 0.5], [0.0, 0.0, 1.0, 1.0]);
/// assert_eq!(Operator::OVER.pixel(red, blue), [0.5, 0.0, 0.5, 1.0]);
/// assert_eq!(Operator::IN.pixel(red, blue), red);
/// assert_eq!(Operator::DST_OUT.pixel(red, blue), [0.0, 0.0, 0.5, 0.5]);
/// assert_eq!(Operator::from_name("over"), Some(Operator::OVER));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Operator {
    /// Whether the source is shown where it is alone.
    pub source: bool,
    /// Whether the destination is shown where it is alone.
    pub destination: bool,
    /// What is shown where both are.
    pub both: Both,
}

const fn operator(source: bool, destination: bool, both: Both) -> Operator {
    Operator { source, destination, both }
}

impl Operator {
    /// Nothing.
    pub const CLEAR: Self = operator(false, false, Both::Nothing);
    /// The source, whatever is below.
    pub const SRC: Self = operator(true, false, Both::Source);
    /// The destination, whatever is above.
    pub const DST: Self = operator(false, true, Both::Destination);
    /// The source in front of the destination: `αF + (1−α)B`.
    pub const OVER: Self = operator(true, true, Both::Source);
    /// The source behind the destination.
    pub const DST_OVER: Self = operator(true, true, Both::Destination);
    /// The source where the destination is.
    pub const IN: Self = operator(false, false, Both::Source);
    /// The destination where the source is.
    pub const DST_IN: Self = operator(false, false, Both::Destination);
    /// The source where the destination is not.
    pub const OUT: Self = operator(true, false, Both::Nothing);
    /// The destination where the source is not.
    pub const DST_OUT: Self = operator(false, true, Both::Nothing);
    /// The source painted on the destination, never beyond it.
    pub const ATOP: Self = operator(false, true, Both::Source);
    /// The destination painted on the source, never beyond it.
    pub const DST_ATOP: Self = operator(true, false, Both::Destination);
    /// What is covered once.
    pub const XOR: Self = operator(true, true, Both::Nothing);
    /// Light added to light.
    pub const PLUS: Self = operator(true, true, Both::Sum);

    /// The twelve of Porter and Duff and their sum, with their names.
    pub const ALL: [(&'static str, Self); 13] = [
        ("clear", Self::CLEAR),
        ("src", Self::SRC),
        ("dst", Self::DST),
        ("over", Self::OVER),
        ("dst-over", Self::DST_OVER),
        ("in", Self::IN),
        ("dst-in", Self::DST_IN),
        ("out", Self::OUT),
        ("dst-out", Self::DST_OUT),
        ("atop", Self::ATOP),
        ("dst-atop", Self::DST_ATOP),
        ("xor", Self::XOR),
        ("plus", Self::PLUS),
    ];

    /// The operator of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|o| o.0 == name).map(|o| o.1)
    }

    /// The same operator with source and destination exchanged.
    pub fn reversed(self) -> Self {
        let both = match self.both {
            Both::Source => Both::Destination,
            Both::Destination => Both::Source,
            same => same,
        };
        Self { source: self.destination, destination: self.source, both }
    }

    /// The shares of the premultiplied source and destination that are shown, of coverages `αs` and `αd`.
    ///
    /// The source is shown in `A_src + A_both = αs`, so its share is `[source](1−αd) + [both is source]·αd`; the destination alike.
    #[inline]
    pub fn shares(self, source: f32, destination: f32) -> [f32; 2] {
        let share = |alone: bool, both: bool, other: f32| match (alone, both) {
            (true, true) => 1.0,
            (true, false) => 1.0 - other,
            (false, true) => other,
            (false, false) => 0.0,
        };
        let shows = |one: Both| self.both == one || self.both == Both::Sum;
        [
            share(self.source, shows(Both::Source), destination),
            share(self.destination, shows(Both::Destination), source),
        ]
    }

    /// Two premultiplied linear pixels.
    #[inline]
    pub fn pixel(self, source: [f32; 4], destination: [f32; 4]) -> [f32; 4] {
        let [s, d] = self.shares(source[3], destination[3]);
        let mut p: [f32; 4] = std::array::from_fn(|c| s * source[c] + d * destination[c]);
        // Coverage ends at 1, light does not.
        p[3] = p[3].min(1.0);
        p
    }

    /// Two pixels with straight alpha, `[r, g, b, α]`, colours in any unit: the regions as the notes write them, divided by the result's
    /// alpha; nothing shown gives zeros.
    ///
    /// ```
    /// use sinew::image::composite::Operator;
    /// let p = Operator::OVER.straight([255.0, 0.0, 0.0, 0.5], [0.0, 0.0, 255.0, 0.5]);
    /// assert_eq!(p, [170.0, 0.0, 85.0, 0.75]);
    /// ```
    pub fn straight(self, source: [f64; 4], destination: [f64; 4]) -> [f64; 4] {
        let (s, d) = (source[3], destination[3]);
        let shows = |one: Both| f64::from(u8::from(self.both == one || self.both == Both::Sum));
        let alone = |shown: bool, area: f64| if shown { area } else { 0.0 };
        let of_source = alone(self.source, s * (1.0 - d)) + shows(Both::Source) * s * d;
        let of_destination = alone(self.destination, d * (1.0 - s)) + shows(Both::Destination) * s * d;
        let alpha = of_source + of_destination;
        if alpha <= 0.0 {
            return [0.0; 4];
        }
        let color = |c: usize| (of_source * source[c] + of_destination * destination[c]) / alpha.min(1.0);
        [color(0), color(1), color(2), alpha.min(1.0)]
    }

    /// Composite `source`, weighted by `opacity` of 0…1, with `destination`, in place.
    ///
    /// ```
    /// use sinew::image::{Image, composite::Operator};
    /// let mut picture = Image::filled(2, 1, [0.0, 0.0, 1.0, 1.0]);
    /// Operator::OVER.apply(&Image::filled(2, 1, [1.0, 0.0, 0.0, 1.0]), 0.25, &mut picture);
    /// assert_eq!(picture.pixels, [[0.25, 0.0, 0.75, 1.0]; 2]);
    /// ```
    ///
    /// # Panics
    /// If the sides differ.
    pub fn apply(self, source: &Image, opacity: f32, destination: &mut Image) {
        let sides = |i: &Image| [i.width, i.height];
        assert_eq!(sides(source), sides(destination), "only pictures of the same sides can be composited");
        for (s, d) in source.pixels.iter().zip(&mut destination.pixels) {
            *d = self.pixel(s.map(|c| c * opacity), *d);
        }
    }
}

/// A premultiplied pixel in another colour: `(1−amount)·p + amount·α·tint`, alpha unchanged. For ghosts of other frames.
///
/// ```
/// use sinew::image::composite::tinted;
/// assert_eq!(tinted([0.5, 0.5, 0.5, 0.5], [1.0, 0.0, 0.0], 0.5), [0.5, 0.25, 0.25, 0.5]);
/// ```
#[inline]
pub fn tinted(pixel: [f32; 4], tint: [f32; 3], amount: f32) -> [f32; 4] {
    let [.., a] = pixel;
    let mix = |c: usize| (1.0 - amount) * pixel[c] + amount * a * tint[c];
    [mix(0), mix(1), mix(2), a]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_rng::Rng;

    /// Porter and Duff's table of factors `F_A` and `F_B`, figure 5 of their paper, and their sum.
    type Factors = fn(f32, f32) -> [f32; 2];
    const TABLE: [(&str, Factors); 13] = [
        ("clear", |_, _| [0.0, 0.0]),
        ("src", |_, _| [1.0, 0.0]),
        ("dst", |_, _| [0.0, 1.0]),
        ("over", |a, _| [1.0, 1.0 - a]),
        ("dst-over", |_, b| [1.0 - b, 1.0]),
        ("in", |_, b| [b, 0.0]),
        ("dst-in", |a, _| [0.0, a]),
        ("out", |_, b| [1.0 - b, 0.0]),
        ("dst-out", |a, _| [0.0, 1.0 - a]),
        ("atop", |a, b| [b, 1.0 - a]),
        ("dst-atop", |a, b| [1.0 - b, a]),
        ("xor", |a, b| [1.0 - b, 1.0 - a]),
        ("plus", |_, _| [1.0, 1.0]),
    ];

    fn pixel(rng: &mut Rng) -> [f32; 4] {
        let a = rng.range(0.0, 1.0) as f32;
        let mut c = || a * rng.range(0.0, 2.0) as f32;
        [c(), c(), c(), a]
    }

    #[test]
    fn every_operator_has_the_factors_of_porter_and_duff() {
        for (name, factors) in TABLE {
            let o = Operator::from_name(name).unwrap_or_else(|| panic!("no operator {name}"));
            for (a, b) in [(0.0, 0.0), (0.25, 1.0), (1.0, 0.25), (0.5, 0.75), (1.0, 1.0)] {
                assert_eq!(o.shares(a, b), factors(a, b), "{name} {a} {b}");
            }
        }
        assert!(Operator::ALL.iter().all(|(name, o)| Operator::from_name(name) == Some(*o)));
    }

    #[test]
    fn premultiplied_straight_and_painted_regions_agree() {
        let mut rng = Rng::new(11);
        for (name, o) in Operator::ALL {
            for _ in 0..200 {
                let (s, d) = (pixel(&mut rng), pixel(&mut rng));
                let found = o.pixel(s, d);
                let straight = |p: [f32; 4]| [p[0] / p[3], p[1] / p[3], p[2] / p[3], p[3]].map(f64::from);
                let [r, g, b, a] = o.straight(straight(s), straight(d));
                let want = [r * a, g * a, b * a, a];
                assert!(
                    (0..4).all(|c| (f64::from(found[c]) - want[c]).abs() < 1e-5),
                    "{name}: {found:?} {want:?}"
                );
                if o.both != Both::Sum {
                    let color = |p: [f32; 4]| [p[0] / p[3], p[1] / p[3], p[2] / p[3]];
                    let both = match o.both {
                        Both::Source => Some(color(s)),
                        Both::Destination => Some(color(d)),
                        _ => None,
                    };
                    let (alone, below) = (o.source.then(|| color(s)), o.destination.then(|| color(d)));
                    let painted = Regions::new(s[3], d[3]).paint(alone, below, both);
                    assert!(
                        (0..4).all(|c| (found[c] - painted[c]).abs() < 1e-5),
                        "{name}: {found:?} {painted:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn reversing_an_operator_exchanges_the_pictures() {
        let mut rng = Rng::new(12);
        for (name, o) in Operator::ALL {
            let (s, d) = (pixel(&mut rng), pixel(&mut rng));
            assert_eq!(o.pixel(s, d), o.reversed().pixel(d, s), "{name}");
            assert_eq!(o.reversed().reversed(), o, "{name}");
        }
    }

    #[test]
    fn over_is_associative_and_alpha_is_the_sum_of_regions() {
        let mut rng = Rng::new(13);
        for _ in 0..500 {
            let [a, b, c] = std::array::from_fn(|_| pixel(&mut rng));
            let over = |x, y| Operator::OVER.pixel(x, y);
            let (left, right) = (over(over(a, b), c), over(a, over(b, c)));
            assert!((0..4).all(|k| (left[k] - right[k]).abs() < 1e-5), "{left:?} {right:?}");
            let r = Regions::new(a[3], b[3]);
            assert!((over(a, b)[3] - (r.source + r.destination + r.both)).abs() < 1e-6);
        }
    }
}
