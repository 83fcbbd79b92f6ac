//! Which points a framing must hold: all vertices, over the whole clip.

use super::view::Framing;
use super::worker::Worker;
use crate::asset::Asset;
use glam::DVec3;

/// Widen `framing` until it holds the whole clip.
pub(super) fn fit(
    asset: &Asset,
    clip: Option<usize>,
    center: DVec3,
    worker: &mut Worker,
    framing: &mut Framing,
) {
    let range = clip.map(|c| asset.character.clips()[c].playback()).unwrap_or_default();
    // A moment each 24th of a second, both ends included; long clips of large meshes are looked at more thinly.
    let vertices: usize =
        asset.character.instances().iter().map(|i| asset.character.mesh(i).positions.len()).sum();
    let most = (Framing::VERTICES / vertices.max(1)).clamp(Framing::FEWEST, Framing::MOST);
    let moments = (range.duration() * 24.0).clamp(0.0, (most - 1) as f64).ceil() as usize + 1;
    let mut positions = Vec::new();
    for k in 0..moments {
        let t = range.start + range.duration() * k as f64 / (moments - 1).max(1) as f64;
        worker.evaluate(asset, clip, t);
        for (i, inst) in asset.character.instances().iter().enumerate() {
            if !asset.character.mesh(inst).triangles.is_empty() {
                let Worker { pose, posed, scratch, .. } = worker;
                asset.character.positions(i, pose, posed, center, scratch, &mut positions);
                framing.include(&positions);
            }
        }
    }
}
