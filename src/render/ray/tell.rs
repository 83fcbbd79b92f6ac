//! What pixels show beside their colour.

use super::coat::{self, Batch};
use super::sampler;
use super::stage::{Hit, Real, Stage};
use super::wave::Path;
use super::{RaySettings, ShapeCast};
use crate::math::simd::F8;
use crate::render::channel::{Channel, Channels};
use crate::render::{ROTATED, Settings, Window};
use crate::scene::Scene;
use glam::{DVec3, Vec2, Vec3};

/// What the rays through the centres of a window's pixels meet first.
pub(super) fn cast<R: Real>(stage: &Stage<R>, window: Window, focal: f64, out: &mut ShapeCast) {
    let n = window.width * window.height;
    (out.width, out.height) = (window.width, window.height);
    out.objects = vec![0; n];
    out.distances = vec![f64::INFINITY; n];
    out.normals = vec![DVec3::ZERO; n];
    let (shapes, bodies) = (stage.solids.len() as u32, stage.bodies.len() as u32);
    for at in 0..n {
        let pixel = [window.x + at % window.width, window.y + at / window.width];
        let path = stage.eye.path(pixel.map(|x| x as f64 + 0.5), at as u32);
        let Some(hit) = stage.nearest(&path, f64::INFINITY, true) else { continue };
        // Bodies come first here, shapes there.
        out.objects[at] = 1 + if hit.object < bodies { hit.object + shapes } else { hit.object - bodies };
        out.distances[at] = hit.t * path.direction.length() / focal;
        out.normals[at] = stage.spot(&path, &hit).face;
    }
}

/// Samples that are looked at, of many.
const MOST: u32 = 64;

/// Samples of a pixel that show one triangle, or one solid.
#[derive(Clone, Copy)]
struct Entry {
    hit: Hit,
    path: Path,
    samples: u32,
    /// The one that has most of the object's samples.
    leads: bool,
}

/// Who has a pixel, by the rules of [`Channels`]; the object's least distance, and its triangles there.
fn pixel<R: Real>(
    stage: &Stage<R>,
    [x, y]: [f64; 2],
    place: u32,
    offsets: &[[f64; 2]],
) -> Option<(f64, Vec<Entry>)> {
    let seen: Vec<([f64; 2], Hit)> = offsets
        .iter()
        .filter_map(|o| {
            let path = stage.eye.path([x + o[0], y + o[1]], place);
            stage.nearest(&path, f64::INFINITY, false).map(|hit| (*o, hit))
        })
        .collect();
    let share = |object: u32| seen.iter().filter(|(_, h)| h.object == object).count();
    let least = |object: u32| {
        seen.iter().filter(|(_, h)| h.object == object).map(|(_, h)| h.t).fold(f64::INFINITY, f64::min)
    };
    let rank = |object: u32| (std::cmp::Reverse(share(object)), least(object));
    let objects = seen.iter().map(|(_, h)| h.object);
    let object = objects
        .reduce(|a, b| if rank(b).partial_cmp(&rank(a)).is_some_and(|o| o.is_lt()) { b } else { a })?;

    // Each triangle is looked at in the middle of its samples.
    let mut entries: Vec<Entry> = Vec::new();
    for (k, (_, hit)) in seen.iter().enumerate().filter(|(_, s)| s.1.object == object) {
        let same = |s: &&([f64; 2], Hit)| s.1.object == object && s.1.triangle == hit.triangle;
        if seen[..k].iter().any(|s| same(&s)) {
            continue;
        }
        let all: Vec<[f64; 2]> = seen.iter().filter(same).map(|s| s.0).collect();
        let mean = |c: usize| all.iter().map(|o| o[c]).sum::<f64>() / all.len() as f64;
        let path = stage.eye.path([x + mean(0), y + mean(1)], place);
        let hit = stage.meet(&path, object, hit.triangle).unwrap_or(*hit);
        entries.push(Entry { hit, path, samples: all.len() as u32, leads: false });
    }
    let lead = entries.iter_mut().rev().max_by_key(|e| e.samples);
    lead.into_iter().for_each(|e| e.leads = true);
    Some((least(object), entries))
}

/// Fill channels as the rasterizer does.
pub(super) fn tell<R: Real>(
    stage: &Stage<R>,
    scene: &Scene,
    settings: &Settings,
    ray: &RaySettings,
    window: Window,
    wanted: &[Channel],
    out: &mut Channels,
) {
    out.reset(window.width, window.height, wanted);
    let rotated = ROTATED.map(|o| o.map(|c| f64::from(c) / 256.0));
    let fixed = if settings.samples == 1 { &[[0.0; 2]][..] } else { &rotated };
    // A picture of several samples is looked at where they lie, so that both cover the same.
    let lie = |[x, y]: [usize; 2]| {
        let sample = |i| sampler::sample(ray.seed, [x as u32, y as u32], i, 0).map(|c| c - 0.5);
        (0..ray.samples.min(MOST)).map(sample).collect::<Vec<_>>()
    };
    let mut entries = Vec::new();
    for at in 0..window.width * window.height {
        let place = [window.x + at % window.width, window.y + at / window.width];
        let lying = if ray.samples > 1 { lie(place) } else { Vec::new() };
        let offsets = if ray.samples > 1 { &lying } else { fixed };
        let middle = place.map(|x| x as f64 + 0.5);
        let Some((distance, found)) = pixel(stage, middle, at as u32, offsets) else { continue };
        out.objects[at] = found[0].hit.object + 1;
        if let Some(depth) = out.depth.get_mut(at) {
            *depth = distance as f32;
        }
        entries.extend(found);
    }

    // Eight at a time of one object.
    entries.sort_by_key(|e| e.hit.object);
    let view_from_scene = scene.camera.scene_from_view.matrix3.transpose();
    for run in entries.chunk_by(|a, b| a.hit.object == b.hit.object).flat_map(|run| run.chunks(8)) {
        let pick: [Entry; 8] = std::array::from_fn(|k| run[if k < run.len() { k } else { 0 }]);
        let (paths, hits) = (pick.map(|e| e.path), pick.map(|e| e.hit));
        let spots = std::array::from_fn(|k| stage.spot(&paths[k], &hits[k]));
        let (body, material) =
            (stage.bodies.get(hits[0].object as usize), stage.finish(hits[0].object).material);
        let batch = Batch { body, material, paths, hits, spots };
        let (normals, [u, v]) = coat::look(stage.isa, scene, &batch);
        for (k, e) in run.iter().enumerate() {
            let at = e.path.place as usize;
            if let Some(normal) = out.normals.get_mut(at) {
                let n = Vec3::new(normals.x.0[k], normals.y.0[k], normals.z.0[k]);
                *normal += if n.is_finite() { view_from_scene * n } else { Vec3::ZERO } * e.samples as f32;
            }
            if e.leads {
                put(out, at, &batch, k, [u, v]);
            }
        }
    }
    for (normal, _) in out.normals.iter_mut().zip(&out.objects).filter(|p| *p.1 > 0) {
        *normal = normal.normalize_or(Vec3::Z);
    }
}

/// What does not mix.
fn put(out: &mut Channels, at: usize, batch: &Batch, k: usize, [u, v]: [F8; 2]) {
    if let Some(position) = out.positions.get_mut(at) {
        *position = batch.spots[k].position.as_vec3();
    }
    if let Some(uv) = out.uvs.get_mut(at) {
        *uv = Vec2::new(u.0[k], v.0[k]);
    }
    let Some(object) = batch.body.and_then(|b| b.object) else { return };
    if let Some(label) = out.labels.get_mut(at) {
        let b = batch.spots[k].b;
        let nearest = if b[0] >= b[1].max(b[2]) { 0 } else { 1 + usize::from(b[2] > b[1]) };
        *label = object.label(object.mesh.triangles[batch.hits[k].triangle as usize][nearest]);
    }
}
