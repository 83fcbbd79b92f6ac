//! Skin weights: checked and repaired once, at the door.

/// `k` influences for each of `V` vertices, strongest first; unused places have weight 0.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Weights {
    per_vertex: usize,
    bones: Vec<u16>,
    weights: Vec<f32>,
}

/// What was repaired on the way in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WeightsReport {
    /// Vertices whose weights summed to something else than 1 (beyond 1e-3) and were scaled.
    pub scaled: usize,
    /// Largest |Σw − 1| found.
    pub worst_sum: f32,
    /// Weights below zero (beyond −1e-3) that became 0.
    pub negative: usize,
    /// Vertices without any weight, bound to the fallback bone.
    pub empty: usize,
}

/// What cannot be repaired.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WeightsError {
    /// NaN or infinity.
    #[error("vertex {vertex}: weight {slot} is not finite")]
    NotFinite {
        /// Which vertex.
        vertex: usize,
        /// Which of its influences.
        slot: usize,
    },
    /// A bone that the skin does not have.
    #[error("vertex {vertex}: influence {slot} names bone {bone}, but the skin has {count}")]
    Bone {
        /// Which vertex.
        vertex: usize,
        /// Which of its influences.
        slot: usize,
        /// The bone that it asks for.
        bone: u32,
        /// Number of bones.
        count: usize,
    },
    /// Lists that do not fit together.
    #[error("{bones} bone indices and {weights} weights do not make {per_vertex} influences a vertex")]
    Count {
        /// Bone indices given.
        bones: usize,
        /// Weights given.
        weights: usize,
        /// Influences a vertex.
        per_vertex: usize,
    },
}

impl Weights {
    /// Check, repair and sort `k` influences a vertex. `bones` index the palette of `bone_count` matrices; an index
    /// beside a weight of 0 may be anything. Vertices without weight follow `fallback`.
    ///
    /// Weights are scaled to sum 1 exactly as other players do; sums within 1e-3 of 1 are scaled in silence (quantised
    /// files never sum to 1), larger deviations are reported.
    ///
    /// ```
    /// use sinew::skin::Weights;
    /// let (w, report) = Weights::new(2, &[0, 1, 1, 0], &[0.25, 0.75, 0.0, 0.0], 2, 0).unwrap();
    /// assert_eq!(w.of(0).collect::<Vec<_>>(), [(1, 0.75), (0, 0.25)]);
    /// assert_eq!(w.of(1).next(), Some((0, 1.0)));
    /// assert_eq!(report.empty, 1);
    /// ```
    ///
    /// # Errors
    /// [`WeightsError`]: a weight that is not finite, a bone out of range, lists that do not fit.
    pub fn new(
        per_vertex: usize,
        bones: &[u32],
        weights: &[f32],
        bone_count: usize,
        fallback: u16,
    ) -> Result<(Self, WeightsReport), WeightsError> {
        if per_vertex == 0 || bones.len() != weights.len() || !bones.len().is_multiple_of(per_vertex) {
            return Err(WeightsError::Count { bones: bones.len(), weights: weights.len(), per_vertex });
        }
        let mut report = WeightsReport::default();
        let mut out = Self { per_vertex, bones: Vec::new(), weights: Vec::new() };
        out.bones.reserve(bones.len());
        out.weights.reserve(bones.len());
        let mut row: Vec<(u16, f32)> = Vec::with_capacity(per_vertex);
        for (vertex, (bs, ws)) in bones.chunks(per_vertex).zip(weights.chunks(per_vertex)).enumerate() {
            row.clear();
            for (slot, (&bone, &w)) in bs.iter().zip(ws).enumerate() {
                if !w.is_finite() {
                    return Err(WeightsError::NotFinite { vertex, slot });
                }
                if w != 0.0 && (bone as usize >= bone_count || bone > u16::MAX as u32) {
                    return Err(WeightsError::Bone { vertex, slot, bone, count: bone_count });
                }
                report.negative += usize::from(w < -1e-3);
                if w > 0.0 {
                    row.push((bone as u16, w));
                }
            }
            repair(&mut row, fallback, &mut report);
            row.resize(per_vertex, (row[0].0, 0.0));
            out.bones.extend(row.iter().map(|r| r.0));
            out.weights.extend(row.iter().map(|r| r.1));
        }
        out.trim();
        Ok((out, report))
    }

    /// Drop places that no vertex uses.
    fn trim(&mut self) {
        let used = self.weights.chunks(self.per_vertex).map(|w| w.iter().take_while(|&&w| w > 0.0).count());
        let k = used.max().unwrap_or(1).max(1);
        if k < self.per_vertex {
            let keep = |i: usize| i % self.per_vertex < k;
            let (mut i, mut j) = (0, 0);
            self.bones.retain(|_| (keep(i), i += 1).0);
            self.weights.retain(|_| (keep(j), j += 1).0);
            self.per_vertex = k;
        }
    }

    /// The `k` largest influences of each vertex, scaled to sum 1.
    ///
    /// # Panics
    /// If `k` is 0.
    pub fn strongest(&self, k: usize) -> Self {
        assert!(k > 0, "no influence is none");
        let (mut out, old) =
            (Self { per_vertex: k.min(self.per_vertex), ..Self::default() }, self.per_vertex);
        for (bones, weights) in self.bones.chunks(old).zip(self.weights.chunks(old)) {
            let (bones, weights) = (&bones[..out.per_vertex], &weights[..out.per_vertex]);
            let sum: f64 = weights.iter().map(|w| *w as f64).sum();
            out.bones.extend(bones);
            out.weights.extend(weights.iter().map(|w| (*w as f64 / sum) as f32));
        }
        out
    }

    /// Influences a vertex, `k`.
    pub fn per_vertex(&self) -> usize {
        self.per_vertex
    }

    /// Number of vertices, `V`.
    pub fn vertex_count(&self) -> usize {
        self.bones.len() / self.per_vertex.max(1)
    }

    /// (palette index, weight) of one vertex, strongest first.
    #[inline]
    pub fn of(&self, vertex: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        let r = vertex * self.per_vertex..(vertex + 1) * self.per_vertex;
        self.bones[r.clone()].iter().zip(&self.weights[r]).map(|(&b, &w)| (b as usize, w))
    }

    /// Palette indices and weights of all vertices, one after the other, strongest first.
    #[inline]
    pub(super) fn rows(&self) -> impl ExactSizeIterator<Item = (&[u16], &[f32])> {
        self.bones.chunks_exact(self.per_vertex.max(1)).zip(self.weights.chunks_exact(self.per_vertex.max(1)))
    }
}

fn repair(row: &mut Vec<(u16, f32)>, fallback: u16, report: &mut WeightsReport) {
    let sum: f64 = row.iter().map(|r| r.1 as f64).sum();
    if row.is_empty() || sum < 1e-12 {
        report.empty += 1;
        *row = vec![(fallback, 1.0)];
        return;
    }
    let off = (sum - 1.0).abs() as f32;
    report.scaled += usize::from(off > 1e-3);
    report.worst_sum = report.worst_sum.max(off);
    // A sum within ε of 1 is as near as rounded weights get: leave them, so that repairing twice changes nothing.
    if off > f32::EPSILON {
        row.iter_mut().for_each(|r| r.1 = (r.1 as f64 / sum) as f32);
    }
    row.sort_by(|a, b| b.1.total_cmp(&a.1));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_weights_are_repaired_and_reported() {
        let bones = [0, 1, 0, 1, 0, 9, 0, 1];
        let weights = [0.5, 0.6, 1.0, -0.5, 1.0, 0.0, 0.0, 0.0];
        let (w, r) = Weights::new(2, &bones, &weights, 2, 1).unwrap();
        assert_eq!((r.scaled, r.negative, r.empty), (1, 1, 1));
        assert!((w.of(0).map(|x| x.1).sum::<f32>() - 1.0).abs() < 1e-6);
        assert_eq!(w.of(1).next(), Some((0, 1.0)));
        assert_eq!(w.of(3).next(), Some((1, 1.0)));
    }

    #[test]
    fn what_cannot_be_repaired_is_named() {
        let e = Weights::new(1, &[0, 5], &[1.0, 1.0], 2, 0).unwrap_err();
        assert_eq!(e.to_string(), "vertex 1: influence 0 names bone 5, but the skin has 2");
        assert!(Weights::new(1, &[0], &[f32::NAN], 2, 0).is_err());
        assert!(Weights::new(2, &[0], &[1.0], 2, 0).is_err());
    }
}
