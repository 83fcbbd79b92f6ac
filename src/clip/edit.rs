//! Edits of one curve's keys. Each gives a new curve, so whoever holds the old one keeps it.

use super::{Curve, CurveError, Interpolation};
use crate::math::spline::Tangents;

/// Keys nearer than this are one key: a twentieth of a frame at 50,000 frames a second.
const SAME: f64 = 1e-6;

/// A change of key times: `t' = snap(t · scale + offset)`; stored slopes are divided by `scale`.
pub struct Retime<'a> {
    /// Stretch about 0 s; negative turns keys around.
    pub scale: f64,
    /// Seconds added.
    pub offset: f64,
    /// Onto frames, or as it is.
    pub snap: &'a dyn Fn(f64) -> f64,
}

impl Curve {
    /// The key at `t`, to a microsecond; the last of several.
    pub fn key_at(&self, t: f64) -> Option<usize> {
        let k = self.times().partition_point(|&k| k <= t + SAME).checked_sub(1)?;
        (self.times()[k] >= t - SAME).then_some(k)
    }

    /// With a key of `value` at `t`, in place of one that is there. Stored slopes become the curve's own.
    ///
    /// ```
    /// use sinew::clip::{Curve, Interpolation};
    /// let c = Curve::new(vec![0.0, 2.0], vec![1.0, 5.0], 1, Interpolation::Linear)?;
    /// let c = c.with_key(1.0, &[0.0])?;
    /// assert_eq!((c.times(), c.values()), ([0.0, 1.0, 2.0].as_slice(), [1.0, 0.0, 5.0].as_slice()));
    /// # Ok::<(), sinew::clip::CurveError>(())
    /// ```
    ///
    /// # Errors
    /// [`CurveError`]: not `width` numbers, or not finite.
    pub fn with_key(&self, t: f64, value: &[f32]) -> Result<Self, CurveError> {
        if let Some(k) = self.key_at(t) {
            let mut keys = self.clone().into_keys();
            let (each, w) = (keys.each(), self.width());
            if value.len() != w {
                return Err(CurveError::Count { times: 1, width: w, expected: w, found: value.len() });
            }
            keys.values[each * k + (each - w) / 2..][..w].copy_from_slice(value);
            return keys.build();
        }
        let numbers = match self.interpolation() {
            Interpolation::Hermite => {
                let slope = self.slope_at(t);
                [&slope, value, &slope].concat()
            }
            _ => value.to_vec(),
        };
        let one = Self::new(vec![t], numbers, self.width(), self.interpolation())?;
        Ok(self.joined(&one)?.0)
    }

    /// Without the keys that `gone` names; `None` where none are left.
    pub fn without(&self, gone: impl Fn(usize) -> bool) -> Option<Self> {
        let mut keys = Keys::like(self);
        (0..self.times().len()).filter(|&k| !gone(k)).for_each(|k| keys.push(self, k));
        keys.build().ok()
    }

    /// With each key's value as `change(key, value)` leaves it.
    ///
    /// # Errors
    /// [`CurveError::NotFinite`].
    pub fn with_values(&self, mut change: impl FnMut(usize, &mut [f32])) -> Result<Self, CurveError> {
        let mut keys = self.clone().into_keys();
        let (each, w) = (keys.each(), self.width());
        for (k, numbers) in keys.values.chunks_mut(each).enumerate() {
            change(k, &mut numbers[(each - w) / 2..][..w]);
        }
        keys.build()
    }

    /// These keys and those of `other`, which win where both have one; and where each of `other`'s went.
    ///
    /// # Errors
    /// [`CurveError::Count`] where the widths differ.
    pub fn joined(&self, other: &Self) -> Result<(Self, Vec<usize>), CurveError> {
        if other.width() != self.width() {
            let (times, width, found) =
                (other.times().len(), self.width(), other.width() * other.times().len());
            return Err(CurveError::Count { times, width, expected: width * times, found });
        }
        let other = &other.with_interpolation(self.interpolation());
        let mut keys = Keys::like(self);
        let mut places = Vec::with_capacity(other.times().len());
        let (a, b) = (self.times(), other.times());
        let (mut i, mut j) = (0, 0);

        // Merge by time; a key of ours that another's falls on is passed over.
        while i < a.len() || j < b.len() {
            if j < b.len() && i < a.len() && (a[i] - b[j]).abs() <= SAME {
                i += 1;
            } else if j == b.len() || (i < a.len() && a[i] < b[j]) {
                keys.push(self, i);
                i += 1;
            } else {
                // Of others' keys at one time the last wins.
                let again = j > 0 && b[j] - b[j - 1] <= SAME;
                if again {
                    keys.pop();
                }
                places.push(keys.times.len());
                keys.push(other, j);
                j += 1;
                while i < a.len() && (a[i] - b[j - 1]).abs() <= SAME {
                    i += 1;
                }
            }
        }
        Ok((keys.build()?, places))
    }

    /// With the times of the keys that `moved` names changed; a key that another lands on gives way. Returns where the moved
    /// keys went as well.
    ///
    /// # Errors
    /// [`CurveError::NotFinite`].
    pub fn retimed(
        &self,
        moved: impl Fn(usize) -> bool,
        by: &Retime<'_>,
    ) -> Result<(Self, Vec<usize>), CurveError> {
        let Some(mut part) = self.without(|k| !moved(k)).map(Self::into_keys) else {
            return Ok((self.clone(), Vec::new()));
        };
        let each = part.each();
        let times = part.times.iter().map(|&t| (by.snap)(t * by.scale + by.offset));
        let mut order: Vec<(f64, usize)> = times.zip(0..).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        part.times = order.iter().map(|o| o.0).collect();
        part.values = order.iter().flat_map(|o| &part.values[each * o.1..][..each]).copied().collect();

        // A stretched curve is as much less steep.
        if part.interpolation == Interpolation::Hermite && by.scale != 0.0 {
            let w = part.width;
            for numbers in part.values.chunks_mut(each) {
                let (before, after) = numbers.split_at_mut(w);
                before.iter_mut().chain(&mut after[w..]).for_each(|m| *m = (f64::from(*m) / by.scale) as f32);
                if by.scale < 0.0 {
                    before.swap_with_slice(&mut after[w..]);
                }
            }
        }
        let part = part.build()?;
        match self.without(moved) {
            Some(rest) => rest.joined(&part),
            None => part.without(|k| k > 0).map_or(Ok((part.clone(), vec![])), |first| first.joined(&part)),
        }
    }

    /// The same keys run otherwise. Towards [`Interpolation::Hermite`] the slopes are those of a Catmull-Rom curve (by its own
    /// rule, else the notes'); from it they are dropped.
    pub fn with_interpolation(&self, to: Interpolation) -> Self {
        let from = self.interpolation();
        if from == to {
            return self.clone();
        }
        if to == Interpolation::Hermite {
            let rule = if let Interpolation::CatmullRom(_) = from {
                from
            } else {
                Interpolation::CatmullRom(Tangents::Notes)
            };
            return self.with_interpolation_of_values(rule).with_slopes();
        }
        self.with_interpolation_of_values(to)
    }

    fn with_interpolation_of_values(&self, to: Interpolation) -> Self {
        let values = (0..self.times().len()).flat_map(|k| self.value(k)).copied().collect();
        Self::new(self.times().to_vec(), values, self.width(), to).expect("keys of a curve")
    }

    fn into_keys(self) -> Keys {
        let Self { times, values, width, interpolation } = self;
        Keys { times, values, width, interpolation }
    }
}

/// A curve's parts, to be built anew.
struct Keys {
    times: Vec<f64>,
    values: Vec<f32>,
    width: usize,
    interpolation: Interpolation,
}

impl Keys {
    fn like(c: &Curve) -> Self {
        Self { times: Vec::new(), values: Vec::new(), width: c.width(), interpolation: c.interpolation() }
    }

    /// Numbers a key.
    fn each(&self) -> usize {
        if self.interpolation == Interpolation::Hermite { 3 * self.width } else { self.width }
    }

    fn push(&mut self, of: &Curve, k: usize) {
        let each = self.each();
        self.times.push(of.times()[k]);
        self.values.extend(&of.values()[each * k..][..each]);
    }

    fn pop(&mut self) {
        self.times.pop();
        self.values.truncate(self.each() * self.times.len());
    }

    fn build(self) -> Result<Curve, CurveError> {
        Curve::new(self.times, self.values, self.width, self.interpolation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(times: &[f64]) -> Curve {
        let values = times.iter().map(|&t| t as f32).collect();
        Curve::new(times.to_vec(), values, 1, Interpolation::Linear).unwrap()
    }

    fn shift(offset: f64) -> Retime<'static> {
        Retime { scale: 1.0, offset, snap: &|t| t }
    }

    #[test]
    fn moved_keys_win_and_are_found_again() {
        let (c, places) = curve(&[0.0, 1.0, 2.0, 3.0]).retimed(|k| k < 2, &shift(2.0)).unwrap();
        assert_eq!((c.times(), c.values()), ([2.0, 3.0].as_slice(), [0.0, 1.0].as_slice()));
        assert_eq!(places, [0, 1]);
        let (c, places) = curve(&[0.0, 1.0, 2.0]).retimed(|k| k == 2, &shift(-1.5)).unwrap();
        assert_eq!((c.times(), places), ([0.0, 0.5, 1.0].as_slice(), vec![1]));
    }

    #[test]
    fn keys_moved_onto_each_other_are_one() {
        let all = Retime { scale: 0.0, offset: 1.0, snap: &|t| t };
        let (c, places) = curve(&[0.0, 1.0, 2.0]).retimed(|_| true, &all).unwrap();
        assert_eq!((c.times(), c.values(), places), ([1.0].as_slice(), [2.0].as_slice(), vec![0, 0, 0]));
    }

    #[test]
    fn turned_around_a_curve_runs_backwards() {
        let c = Curve::new(
            vec![0.0, 1.0, 3.0],
            vec![0.0, 2.0, 1.0],
            1,
            Interpolation::CatmullRom(Tangents::Notes),
        );
        let c = c.unwrap().with_interpolation(Interpolation::Hermite);
        let back = Retime { scale: -1.0, offset: 3.0, snap: &|t| t };
        let (r, _) = c.retimed(|_| true, &back).unwrap();
        for t in [0.0, 0.3, 1.7, 2.5, 3.0] {
            let (mut a, mut b) = ([0.0], [0.0]);
            c.sample(t, &mut a);
            r.sample(3.0 - t, &mut b);
            assert!((a[0] - b[0]).abs() < 1e-6, "{t}: {a:?} {b:?}");
        }
    }

    #[test]
    fn an_inserted_key_changes_nothing_that_slopes_can_keep() {
        let c = Curve::new(vec![0.0, 1.0], vec![0.0, 0.0, 2.0, 1.0, 3.0, 0.0], 1, Interpolation::Hermite)
            .unwrap();
        let mut v = [0.0];
        c.sample(0.25, &mut v);
        let d = c.with_key(0.25, &v).unwrap();
        for k in 0..=20 {
            let (mut a, mut b) = ([0.0], [0.0]);
            c.sample(k as f64 / 20.0, &mut a);
            d.sample(k as f64 / 20.0, &mut b);
            assert!((a[0] - b[0]).abs() < 1e-6);
        }
        assert_eq!(d.with_key(0.25, &[9.0]).unwrap().value(1), [9.0]);
        assert!(d.with_key(0.25, &[]).is_err() && d.with_key(0.5, &[f32::NAN]).is_err());
        assert!(d.without(|_| true).is_none());
    }
}
