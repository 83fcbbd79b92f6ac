//! Influences in integers whose sum means 1.

use super::Work;
use super::pool::Int;
use crate::io::gltf::error::Result;
use crate::io::gltf::rewrite::list;
use ::gltf::json::accessor::Type;
use serde_json::Value;

impl Work<'_> {
    /// Replace the sets of a primitive, if all weights are floats.
    pub(super) fn influences(&mut self, attributes: &mut Value, int: Int) -> Result<()> {
        let set = |what: &str, k: usize| attributes[format!("{what}_{k}")].as_u64();
        let sets: Vec<[u64; 2]> =
            (0..).map_while(|k| Some([set("JOINTS", k)?, set("WEIGHTS", k)?])).collect();
        if sets.is_empty() || sets.iter().any(|s| self.float(&s[1].into()).is_none()) {
            return Ok(());
        }
        let tag = (sets.concat(), int, 0, false);
        let made = match self.pool.known(&tag) {
            Some(known) => known.clone(),
            None => {
                let made = self.quantized_sets(&sets, int)?;
                self.pool.remember(tag, made.clone());
                made
            }
        };
        for (k, pair) in made.chunks_exact(2).enumerate() {
            attributes[format!("JOINTS_{k}")] = pair[0].into();
            attributes[format!("WEIGHTS_{k}")] = pair[1].into();
        }
        Ok(())
    }

    fn quantized_sets(&mut self, sets: &[[u64; 2]], int: Int) -> Result<Vec<u64>> {
        let mut read = vec![];
        for [joints, weights] in sets {
            let joints = self.doc.integers(*joints as usize, &[Type::Vec4], "JOINTS")?.values;
            read.push((joints, self.doc.floats(*weights as usize, &[Type::Vec4], "WEIGHTS")?.values));
        }
        let vertices = read.iter().map(|(j, w)| j.len().min(w.len()) / 4).min().unwrap_or(0);
        let mut out = vec![(vec![], vec![]); sets.len()];
        for v in 0..vertices {
            let weights: Vec<f64> =
                read.iter().flat_map(|r| &r.1[4 * v..4 * v + 4]).map(|w| w.max(0.0) as f64).collect();
            let numbers = shares(&weights, int.unit());
            for (set, numbers) in numbers.chunks_exact(4).enumerate() {
                for (slot, n) in numbers.iter().enumerate() {
                    // No joint where there is no weight.
                    out[set].0.push(if *n > 0 { read[set].0[4 * v + slot] } else { 0 });
                    out[set].1.push(*n);
                }
            }
        }
        let mut made = vec![];
        for (joints, weights) in out {
            let base = self.count();
            let pair = [
                self.pool.joints(base, &joints),
                self.pool.vertices(base + 1, &weights, 4, int, false, false),
            ];
            list(self.json, "accessors").extend(pair);
            made.extend([base, base + 1]);
        }
        Ok(made)
    }
}

/// Whole numbers that sum to `unit`, near the weights' parts of their sum: what rounding down leaves goes to those that lost most. Without any
/// weight the first has all.
fn shares(weights: &[f64], unit: i32) -> Vec<i32> {
    let sum: f64 = weights.iter().sum();
    if sum <= 0.0 || !sum.is_finite() {
        return (0..weights.len()).map(|i| if i == 0 { unit } else { 0 }).collect();
    }
    let exact: Vec<f64> = weights.iter().map(|w| w / sum * unit as f64).collect();
    let mut out: Vec<i32> = exact.iter().map(|e| e.floor() as i32).collect();
    let mut order: Vec<usize> = (0..out.len()).filter(|i| weights[*i] > 0.0).collect();
    order.sort_by(|a, b| exact[*b].fract().total_cmp(&exact[*a].fract()).then(a.cmp(b)));
    let left = unit - out.iter().sum::<i32>();
    order.iter().cycle().take(left.max(0) as usize).for_each(|i| out[*i] += 1);
    out
}

#[cfg(test)]
mod tests {
    use super::shares;

    #[test]
    fn weights_sum_to_one_whatever_they_are() {
        for (weights, want) in [
            (vec![1.0, 1.0, 1.0, 0.0], vec![85, 85, 85, 0]),
            (vec![0.0; 4], vec![255, 0, 0, 0]),
            (vec![0.5, 0.5, 0.0, 0.0], vec![128, 127, 0, 0]),
            (vec![1e-9, 1.0, 1e-9, 0.0], vec![0, 255, 0, 0]),
            (vec![3.0, 1.0], vec![191, 64]),
        ] {
            assert_eq!(shares(&weights, 255), want);
        }
    }
}
