//! What is visible in a tile, written as objects, depths, normals and so on instead of colours.

use super::TILE;
use super::fill::{NONE, Visibility};
use super::frame::Frame;
use super::resolve::{Area, CENTROIDS};
use super::scan::WHOLE;
use super::surface::{Found, Look};
use crate::math::simd::{F8, V8};
use crate::render::channel::Channels;
use crate::scene::Object;
use glam::{Mat3A, Vec2, Vec3};

/// 64 rows of channels; planes that nobody asked for are empty.
pub(super) struct Band<'a> {
    width: usize,
    pub rows: usize,
    objects: &'a mut [u32],
    depth: &'a mut [f32],
    normals: &'a mut [Vec3],
    labels: &'a mut [u32],
    positions: &'a mut [Vec3],
    uvs: &'a mut [Vec2],
    entries: Vec<Entry>,
}

/// Samples of a pixel that show one triangle.
#[derive(Clone, Copy)]
struct Entry {
    place: usize,
    id: u32,
    mask: u8,
    /// The triangle that has most of the object's samples.
    leads: bool,
}

/// The rows of tiles.
pub(super) fn bands(out: &mut Channels) -> Vec<Band<'_>> {
    let Channels { width, height, objects, depth, normals, labels, positions, uvs } = out;
    let (mut objects, mut depth, mut normals) = (&mut objects[..], &mut depth[..], &mut normals[..]);
    let (mut labels, mut positions, mut uvs) = (&mut labels[..], &mut positions[..], &mut uvs[..]);
    let mut bands = Vec::new();
    for top in (0..if *width > 0 { *height } else { 0 }).step_by(TILE) {
        let rows = TILE.min(*height - top);
        let n = rows * *width;
        bands.push(Band {
            width: *width,
            rows,
            objects: take(&mut objects, n),
            depth: take(&mut depth, n),
            normals: take(&mut normals, n),
            labels: take(&mut labels, n),
            positions: take(&mut positions, n),
            uvs: take(&mut uvs, n),
            entries: Vec::new(),
        });
    }
    bands
}

/// The first `n` of a list, or as many as there are.
fn take<'a, T>(list: &mut &'a mut [T], n: usize) -> &'a mut [T] {
    let n = n.min(list.len());
    let (first, rest) = std::mem::take(list).split_at_mut(n);
    *list = rest;
    first
}

impl Band<'_> {
    /// Write a tile; what it does not show is left as it was cleared.
    pub fn write(&mut self, frame: &Frame, area: Area, seen: &Visibility) {
        self.entries.clear();
        for (y, x) in (0..area.h).flat_map(|y| (0..area.w).map(move |x| (y, x))) {
            self.pixel(frame, area, y * TILE + x, seen);
        }
        if self.looks() {
            self.shade(frame, area);
        }
    }

    /// Whether anything is asked for that the visibility buffer does not know.
    fn looks(&self) -> bool {
        let [n, l] = [self.normals.len(), self.labels.len()];
        n + l + self.positions.len() + self.uvs.len() > 0
    }

    /// A place in the tile as a place in the band.
    fn at(&self, area: Area, place: usize) -> usize {
        place / TILE * self.width + area.to + place % TILE
    }

    /// Who has a pixel, and what of it has to be shaded.
    fn pixel(&mut self, frame: &Frame, area: Area, place: usize, seen: &Visibility) {
        // Object, samples and least distance of each draw in the pixel.
        let mut held = [(usize::MAX, 0u32, f32::INFINITY); 4];
        let samples = frame.samples.min(4);
        let ids: [u32; 4] = std::array::from_fn(|s| if s < samples { seen.look(place, s).0 } else { NONE });
        let mut draws = [usize::MAX; 4];
        for s in (0..samples).filter(|&s| ids[s] != NONE) {
            let d = if s > 0 && ids[s] == ids[s - 1] { draws[s - 1] } else { frame.draw_of(ids[s]) };
            draws[s] = d;
            let distance = frame.distance(seen.look(place, s).1);
            if let Some(h) = held.iter_mut().find(|h| h.0 == d || h.1 == 0) {
                *h = (d, h.1 + 1, h.2.min(distance));
            }
        }
        let mut best = held[0];
        for h in &held[1..] {
            if h.1 > best.1 || (h.1 == best.1 && h.1 > 0 && h.2 < best.2) {
                best = *h;
            }
        }
        if best.1 == 0 {
            return;
        }
        let at = self.at(area, place);
        self.objects[at] = frame.draws[best.0].index as u32 + 1;
        if let Some(depth) = self.depth.get_mut(at) {
            *depth = best.2;
        }
        if !self.looks() {
            return;
        }
        let (mut done, first) = (0u8, self.entries.len());
        for s in (0..samples).filter(|&s| draws[s] == best.0) {
            let mask = (s..samples).filter(|&t| ids[t] == ids[s]).fold(0u8, |m, t| m | 1 << t);
            if done & mask == 0 {
                // A lone sample stands at the pixel's centre, as the mean of four does.
                let mask = if samples == 1 { WHOLE as u8 } else { mask };
                self.entries.push(Entry { place, id: ids[s], mask, leads: false });
            }
            done |= mask;
        }
        // The first of those with most samples.
        let lead = self.entries[first..].iter_mut().rev().max_by_key(|e| e.mask.count_ones());
        lead.into_iter().for_each(|e| e.leads = true);
    }

    /// Look at what was collected, eight at a time; normals become means.
    fn shade(&mut self, frame: &Frame, area: Area) {
        let view_from_scene = frame.scene.camera.scene_from_view.matrix3.transpose();
        let entries = std::mem::take(&mut self.entries);
        let mut rest = &entries[..];
        while let Some(first) = rest.first() {
            let draw = &frame.draws[frame.draw_of(first.id)];
            let n = rest.iter().take(8).take_while(|e| draw.ids().contains(&e.id)).count();
            let (mut ids, mut px, mut py) = ([0; 8], F8::ZERO, F8::ZERO);
            let [left, top] = area.corner(frame);
            for k in 0..8 {
                let e = rest[if k < n { k } else { 0 }];
                let c = CENTROIDS[e.mask as usize & 15];
                ids[k] = e.id - draw.first_triangle;
                px.0[k] = left + (e.place % TILE) as f32 + c[0];
                py.0[k] = top + (e.place / TILE) as f32 + c[1];
            }
            let found = Look { frame, draw, ids: &ids, px, py }.find();
            for (k, e) in rest[..n].iter().enumerate() {
                let at = self.at(area, e.place);
                if let Some(normal) = self.normals.get_mut(at) {
                    *normal += turned(view_from_scene, lane(&found.normal, k)) * e.mask.count_ones() as f32;
                }
                if e.leads {
                    self.put(at, &found, k, draw.object);
                }
            }
            rest = &rest[n..];
        }
        for e in &entries {
            let at = self.at(area, e.place);
            if let Some(normal) = self.normals.get_mut(at) {
                *normal = normal.normalize_or(Vec3::Z);
            }
        }
        self.entries = entries;
    }

    /// What does not mix.
    fn put(&mut self, at: usize, found: &Found, k: usize, object: &Object) {
        if let Some(label) = self.labels.get_mut(at) {
            let b = found.b.map(|b| b.0[k]);
            let nearest = if b[0] >= b[1].max(b[2]) { 0 } else { 1 + usize::from(b[2] > b[1]) };
            *label = object.label(found.corner[nearest][k]);
        }
        if let Some(position) = self.positions.get_mut(at) {
            *position = lane(&found.position, k);
        }
        if let Some(uv) = self.uvs.get_mut(at) {
            *uv = Vec2::new(found.uv[0].0[k], found.uv[1].0[k]);
        }
    }
}

fn lane(v: &V8, k: usize) -> Vec3 {
    Vec3::new(v.x.0[k], v.y.0[k], v.z.0[k])
}

fn turned(by: Mat3A, v: Vec3) -> Vec3 {
    if v.is_finite() { by * v } else { Vec3::ZERO }
}
