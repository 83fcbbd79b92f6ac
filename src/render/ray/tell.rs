//! What pixels show beside their colour.

use super::ShapeCast;
use super::stage::{Hit, Real, Stage};
use super::wave::Path;
use crate::render::channel::{Channel, Channels};
use crate::render::{ROTATED, Settings, Window};
use crate::scene::Scene;
use glam::DVec3;

/// What the rays through the centres of a window's pixels meet first.
pub(super) fn cast<R: Real>(stage: &Stage<R>, window: Window, focal: f64, out: &mut ShapeCast) {
    let n = window.width * window.height;
    (out.width, out.height) = (window.width, window.height);
    out.objects = vec![0; n];
    out.distances = vec![f64::INFINITY; n];
    out.normals = vec![DVec3::ZERO; n];
    let shapes = stage.solids.len() as u32;
    for at in 0..n {
        let pixel = [window.x + at % window.width, window.y + at / window.width];
        let path = stage.eye.path(pixel.map(|x| x as f64 + 0.5), at as u32);
        let Some(hit) = stage.nearest(&path, f64::INFINITY, true) else { continue };
        // Bodies come first here, shapes there.
        let bodies = stage.bodies.len() as u32;
        out.objects[at] = 1 + if hit.object < bodies { hit.object + shapes } else { hit.object - bodies };
        out.distances[at] = hit.t * path.direction.length() / focal;
        out.normals[at] = stage.spot(&path, &hit).face;
    }
}

pub(super) fn tell<R: Real>(
    stage: &Stage<R>,
    scene: &Scene,
    settings: &Settings,
    window: Window,
    wanted: &[Channel],
    out: &mut Channels,
) {
    out.reset(window.width, window.height, wanted);
    let _ = (stage, scene, settings, ROTATED);
    let _: Option<(Hit, Path)> = None;
}
