//! From index lists of any mode to triangles (glTF 2.0 §3.7.2.1).

use super::error::{GltfError, Result};
use super::warnings::Warnings;
use ::gltf::json::mesh::Mode;

/// Triangles of a primitive; without `indices` its vertices are taken in order. Points and lines have none.
pub(super) fn triangles(
    mode: Mode,
    indices: Option<Vec<u32>>,
    count: usize,
    place: &str,
    w: &mut Warnings,
) -> Result<Vec<[u32; 3]>> {
    let list = indices.unwrap_or_else(|| (0..count as u32).collect());
    if let Some(at) = list.iter().position(|&i| i as usize >= count) {
        let place = format!("{place}.indices[{at}]");
        return Err(GltfError::Index { place, what: "vertex", index: list[at] as usize, count });
    }
    let odd = |ok: bool, w: &mut Warnings| {
        if !ok {
            w.push(place, "its number of indices makes no whole triangles; the rest is left out");
        }
    };
    Ok(match mode {
        Mode::Triangles => {
            odd(list.len().is_multiple_of(3), w);
            list.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect()
        }
        // Every other triangle of a strip winds the other way round.
        Mode::TriangleStrip => {
            odd(list.len() != 1 && list.len() != 2, w);
            let one =
                |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] };
            list.windows(3).enumerate().map(one).collect()
        }
        Mode::TriangleFan => {
            odd(list.len() != 1 && list.len() != 2, w);
            let rim = list.get(1..).unwrap_or_default();
            rim.windows(2).map(|t| [t[0], t[1], list[0]]).collect()
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => Vec::new(),
    })
}
