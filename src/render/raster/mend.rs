//! Pixels of four samples that show more than one triangle: most come to show one, which stands for all.
//!
//! [`merge`] says which: one by one, by branches that nobody can foretell. So they are listed first, and those that are decided by vertices
//! in common, which is most, are found without a branch: where two triangles meet eight at a time, where more do singly. Of what is left,
//! [`merge`] tells. That takes 5 to 10 % off a picture.

use super::TILE;
use super::fill::{NONE, before};
use super::frame::{Draw, Frame};
use super::merge::{self, share_a_vertex};
use super::resolve::Area;
use super::scan::{WHOLE, bits, key};
use super::tile::TileScratch;
use crate::math::simd::{I, I8};

/// Let pixels of four samples that show several triangles show one, or nothing where their parts are listed.
#[inline(always)]
pub(super) fn mend(frame: &Frame, area: Area, scratch: &mut TileScratch) {
    scratch.torn.resize(TILE * TILE + 8, 0);
    let n = list(area, scratch);
    if n == 0 {
        return;
    }
    let n = join_pairs(frame, n, scratch);
    let n = join_fans(frame, n, scratch);
    for k in 0..n {
        let place = scratch.torn[k] as usize;
        let id = pixel(frame, place, scratch);
        scratch.seen.id[4 * place..][..4].fill(id);
    }
}

/// List those pixels; how many there are.
#[inline(always)]
fn list(area: Area, scratch: &mut TileScratch) -> usize {
    let TileScratch { seen, torn, .. } = scratch;
    let ids: &[u32; 4 * TILE * TILE] = seen.id[..4 * TILE * TILE].try_into().expect("a tile");
    let (mut left, mut n) = (seen.touched, 0);
    while left != 0 {
        let b = left.trailing_zeros() as usize;
        left &= left - 1;
        let [x, y] = [b % 8 * 8, b / 8 * 8];
        if x >= area.w || y >= area.h {
            continue;
        }
        let columns = (1u32 << (area.w - x).min(8)) - 1;
        for row in y..(y + 8).min(area.h) {
            let place = (row * TILE + x) & (TILE * TILE - 8);
            let several = several(ids[4 * place..4 * place + 32].try_into().expect("eight pixels")) & columns;
            // What is written beyond those that are there is overwritten by the next.
            torn[n..n + 8].copy_from_slice(&(I8::splat(place as i32) + bits(several)).0);
            n += several.count_ones() as usize;
        }
    }
    n
}

/// Pixels that go through memory together: numbers that are looked up one by one are not computed with right away.
const TOGETHER: usize = 64;

/// A number of each.
type Plane = [i32; TOGETHER];

/// Pixels of two triangles.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Pairs {
    samples: [Plane; 4],
    /// The triangle that is to be shown.
    lead: Plane,
    /// Both triangles, counted from the draw's first; 0 where `ours` is not set.
    triangles: [Plane; 2],
    ours: Plane,
    corners: [[Plane; 3]; 2],
}

#[inline(always)]
fn eight(plane: &Plane, first: usize) -> I8 {
    I(plane[first..first + 8].try_into().expect("eight"))
}

/// Let those of the first `n` that show two triangles of a draw with a vertex in common show the one with more samples, or the first;
/// how many are left, which come first then.
#[inline(always)]
fn join_pairs(frame: &Frame, n: usize, scratch: &mut TileScratch) -> usize {
    let TileScratch { seen, torn, last_draw, .. } = scratch;
    let ids: &mut [u32; 4 * TILE * TILE] = (&mut seen.id[..4 * TILE * TILE]).try_into().expect("a tile");
    let torn: &mut [i32; TILE * TILE + 8] = (&mut torn[..TILE * TILE + 8]).try_into().expect("of a tile");
    let none = [0; TOGETHER];
    let mut pairs =
        Pairs { samples: [none; 4], lead: none, triangles: [none; 2], ours: none, corners: [[none; 3]; 2] };
    let (n, mut left) = (n.min(TILE * TILE), 0);
    for first in (0..n).step_by(TOGETHER) {
        let count = (n - first).min(TOGETHER);
        let pairs = std::hint::black_box(&mut pairs);
        for k in 0..count {
            let at = 4 * (torn[first + k] as usize % (TILE * TILE));
            for s in 0..4 {
                pairs.samples[s][k] = ids[at + s] as i32;
            }
        }
        let pairs = std::hint::black_box(pairs);

        // Where one of the two is nothing, the other is of no draw.
        let [a, b, c, d] = [0, 1, 2, 3].map(|s: usize| pairs.samples[s][0] as u32);
        let draw = last_draw.find(frame, a.min(b).min(c.min(d)));
        let list = &draw.object.mesh.triangles[..];
        let (start, len) = (I8::splat(draw.first_triangle as i32), I8::splat(list.len() as i32));
        for e in (0..count).step_by(8) {
            let [a, b, c, d] = &pairs.samples;
            let (a, b, c, d) = (eight(a, e), eight(b, e), eight(c, e), eight(d, e));
            let [ab, ac, ad] = [a.equal(b), a.equal(c), a.equal(d)];
            let other = ab.select_int(ac.select_int(d, c), b);
            let two = (ab | b.equal(other)) & (ac | c.equal(other)) & (ad | d.equal(other));
            let lead = (ab | ac | ad).select_int(a, other);
            let (i, j) = (a - start, other - start);
            let ours = two & before(i, len) & before(j, len);
            let put = |plane: &mut Plane, v: I8| plane[e..e + 8].copy_from_slice(&v.0);
            put(&mut pairs.lead, lead);
            put(&mut pairs.ours, ours);
            put(&mut pairs.triangles[0], i & ours);
            put(&mut pairs.triangles[1], j & ours);
        }
        let pairs = std::hint::black_box(pairs);
        for k in 0..count {
            for t in 0..2 {
                let triangle = &list[pairs.triangles[t][k] as usize];
                for v in 0..3 {
                    pairs.corners[t][v][k] = triangle[v] as i32;
                }
            }
        }
        let pairs = std::hint::black_box(pairs);
        for e in (0..count).step_by(8) {
            let [p, q] = &pairs.corners;
            let with = |v: I8| v.equal(eight(&q[0], e)) | v.equal(eight(&q[1], e)) | v.equal(eight(&q[2], e));
            let shared = with(eight(&p[0], e)) | with(eight(&p[1], e)) | with(eight(&p[2], e));
            let ours = if draw.continuous { eight(&pairs.ours, e) } else { I8::ZERO };
            pairs.ours[e..e + 8].copy_from_slice(&(ours & shared).0);
        }
        let pairs = std::hint::black_box(pairs);
        for k in 0..count {
            let place = torn[first + k];
            let at = 4 * (place as usize % (TILE * TILE));
            let (joins, lead) = (pairs.ours[k] as u32, pairs.lead[k] as u32);
            for s in 0..4 {
                ids[at + s] = lead & joins | ids[at + s] & !joins;
            }
            torn[left] = place;
            left += (!joins & 1) as usize;
        }
    }
    left
}

/// Let those of the first `n` show the triangle with the most samples, or the first of those, that have a vertex of it in common with
/// each other; how many are left.
#[inline(always)]
fn join_fans(frame: &Frame, n: usize, scratch: &mut TileScratch) -> usize {
    let TileScratch { seen, torn, last_draw, .. } = scratch;
    let ids: &mut [u32; 4 * TILE * TILE] = (&mut seen.id[..4 * TILE * TILE]).try_into().expect("a tile");
    let mut left = 0;
    for k in 0..n {
        let place = torn[k];
        let at = 4 * (place as usize % (TILE * TILE));
        let pixel: [u32; 4] = ids[at..at + 4].try_into().expect("four");
        let [a, b, c, d] = pixel;
        // One of them is a triangle, of which the numbers are lower than what stands for none.
        let draw = last_draw.find(frame, a.min(b).min(c.min(d)));
        let (id, joins) = of_all(draw, pixel);
        let joins = joins & draw.continuous;
        let mask = if joins { u32::MAX } else { 0 };
        for s in 0..4 {
            ids[at + s] = id & mask | pixel[s] & !mask;
        }
        torn[left] = place;
        left += !joins as usize;
    }
    left
}

/// The triangle with the most samples, or the first of those, and whether it has a vertex in common with each other.
#[inline(always)]
fn of_all(draw: &Draw, ids: [u32; 4]) -> (u32, bool) {
    let (mut lead, mut most) = (ids[0], 0);
    for s in 0..4 {
        let mut count = 0;
        for other in ids {
            count += (other == ids[s]) as u32;
        }
        let more = count > most;
        (lead, most) = if more { (ids[s], count) } else { (lead, most) };
    }
    let triangles = &draw.object.mesh.triangles[..];
    let mut corners = [[0; 3]; 5];
    for (k, id) in ids.into_iter().chain([lead]).enumerate() {
        let Some(of) = triangles.get(id.wrapping_sub(draw.first_triangle) as usize) else {
            return (lead, false);
        };
        corners[k] = *of;
    }
    let mut all = true;
    for s in 0..4 {
        all &= share_a_vertex(corners[4], corners[s]);
    }
    (lead, all)
}

/// A pixel with more than one triangle, or with an empty part: the triangle if one stands for all, else nothing, and what is to
/// be shaded is in `parts`.
#[inline(always)]
fn pixel(frame: &Frame, place: usize, scratch: &mut TileScratch) -> u32 {
    let ids: &[u32; 4] = scratch.seen.id[4 * place..][..4].try_into().expect("four");
    let z: &[f32; 4] = scratch.seen.z[4 * place..][..4].try_into().expect("four");
    let (groups, n) = merge::groups(frame, ids, z, &mut scratch.last_draw);
    if groups[0].covers == WHOLE {
        return groups[0].id;
    }
    let mut covered = 0;
    for g in &groups[..n] {
        covered |= g.covers;
        scratch.entries.push_part(key(place, g.covers), g.id);
    }
    let count = covered.count_ones();
    scratch.stats.samples += count as u64;
    scratch.colors.share(place, 4 - count, frame.scene.background);
    NONE
}

/// Which of eight pixels of four samples show more than one thing.
#[inline(always)]
fn several(ids: &[u32; 32]) -> u32 {
    let mut by_sample = [I8::ZERO; 4];
    for s in 0..4 {
        for k in 0..8 {
            by_sample[s].0[k] = ids[4 * k + s] as i32;
        }
    }
    let [a, b, c, d] = by_sample;
    !(a.equal(b) & a.equal(c) & a.equal(d)).bitmask() & 0xff
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::Isa;
    use crate::mesh::{Mesh, MeshData};
    use crate::render::Settings;
    use crate::scene::{Camera, Material, Object, Projection, Scene, Style};
    use crate::test_rng::Rng;
    use glam::Vec3;

    /// A grid of so many vertices a side; alternate normals are turned away where it is `rough`.
    fn grid(side: u32, rough: bool) -> Mesh {
        let mut data = MeshData::default();
        for k in 0..side * side {
            data.positions.push(Vec3::new((k % side) as f32, (k / side) as f32, 0.0));
            data.normals.push(if rough && k % 2 == 1 { Vec3::X } else { Vec3::Z });
        }
        for k in (0..(side - 1) * side).filter(|k| k % side + 1 < side) {
            data.triangles.extend([[k, k + 1, k + side], [k + 1, k + side + 1, k + side]]);
        }
        Mesh::new(data).expect("a grid is a mesh")
    }

    /// Whatever four samples show, they come to show what [`merge`] says of the pixel by itself.
    #[test]
    fn many_at_once_become_what_each_does_by_itself() {
        let meshes = [grid(6, false), grid(5, true), grid(4, false)];
        let object = |k: usize, flat: bool| Object {
            mesh: &meshes[k],
            positions: &meshes[k].positions,
            normals: if flat { &[] } else { &meshes[k].normals },
            tangents: &[],
            material: 0,
            mirrored: false,
            labels: &[],
        };
        let projection = Projection::Orthographic { height: 4.0 };
        let scene = Scene {
            camera: Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, projection).expect("it looks ahead"),
            ambient: Vec3::ONE,
            lights: vec![],
            style: Style::default(),
            background: [0.0; 4],
            objects: vec![object(0, false), object(1, false), object(2, true)],
            shapes: &[],
            materials: &[Material::default()],
            textures: &[],
        };
        let settings = Settings { width: 61, height: 50, samples: 4, threads: 1 };
        let frame = Frame::new(Isa::Portable, &scene, &settings);
        let area = Area { origin: [0, 0], to: 0, w: 61, h: 50 };
        let mut rng = Rng::new(3);
        let (mut joined, mut apart) = (0, 0);
        for kinds in [2, 3, 4, 4] {
            let mut scratch = TileScratch::default();
            scratch.seen.start(4);
            scratch.colors.start(crate::render::raster::colors::Sink::Linear, 4, [0.0; 4]);
            scratch.seen.touch([0, 60], [0, 49]);
            for place in 0..TILE * TILE {
                // Neighbours in the list of a mesh, of another, and nothing.
                let first = rng.next() as u32 % frame.triangle_count;
                let mut some = [0; 4].map(|_: u32| (first + rng.next() as u32 % 3) % frame.triangle_count);
                match rng.next() % 8 {
                    0 => some[1] = NONE,
                    1 => some[1] = rng.next() as u32 % frame.triangle_count,
                    _ => {}
                }
                for s in 0..4 {
                    let at = 4 * place + s;
                    scratch.seen.id[at] = some[(rng.next() % kinds) as usize];
                    scratch.seen.z[at] = 0.5 + 0.2 * rng.unit();
                }
            }
            let before = scratch.seen.id.clone();
            mend(&frame, area, &mut scratch);
            for place in (0..TILE * 50).filter(|p| p % TILE < 61) {
                let [ids, now]: [[u32; 4]; 2] =
                    [&before, &scratch.seen.id].map(|all| all[4 * place..][..4].try_into().expect("four"));
                let z = scratch.seen.z[4 * place..][..4].try_into().expect("four");
                let (groups, _) = merge::groups(&frame, &ids, z, &mut Default::default());
                let same = ids == [ids[0]; 4];
                let whole = same || groups[0].covers == WHOLE;
                let apart_or_one = if whole { groups[0].id } else { NONE };
                let want = if same { ids[0] } else { apart_or_one };
                assert_eq!(now, [want; 4], "{ids:?}");
                (joined, apart) = (joined + usize::from(whole && !same), apart + usize::from(!whole));
            }
        }
        assert!(joined > 3000 && apart > 1000, "{joined} {apart}");
    }
}
