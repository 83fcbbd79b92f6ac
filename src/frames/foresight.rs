//! What a camera has to hold, found while something else of the asset is still to come.

use super::fit::{self, Span};
use super::framing::{Framing, orbit_axes};
use super::view::{FramingDesc, View};
use super::worker::Worker;
use crate::asset::Asset;
use glam::{DVec3, Vec3};

/// What a camera that orbits a character must hold over a clip: it needs neither materials nor textures, so that it can be found while
/// pictures are decoded (`io::import_while`). A [`Shot`](super::Shot) that frames the same takes it from here;
/// any other looks for itself, so that no picture depends on it.
#[derive(Clone, Debug)]
pub struct Foresight {
    clip: Option<usize>,
    center: DVec3,
    asked: Framing,
    seen: Framing,
}

/// Vertices of all moments, at most: beyond, a shot looks at them by several threads.
const MOST: usize = 1 << 18;

impl Foresight {
    /// Look at a clip of an asset as a shot of such a view, framing and aspect (width over height) will. `None` where that is
    /// nothing that can be foreseen: where the camera moves or is the asset's own, or where there is too much to see.
    ///
    /// # Panics
    /// If the asset has no such clip.
    pub fn new(
        asset: &Asset,
        clip: Option<usize>,
        view: &View,
        framing: &FramingDesc,
        aspect: f32,
    ) -> Option<Self> {
        let View::Orbit { yaw, pitch, fov_y } = *view else { return None };
        let plain = FramingDesc {
            margin: framing.margin,
            zoom: framing.zoom,
            roll: framing.roll,
            ..FramingDesc::default()
        };
        if *framing != plain {
            return None;
        }
        let mut worker = Worker::default();
        let mut span = Span { asset, clip, center: DVec3::ZERO, shapes: None };
        worker.evaluate(asset, clip, span.range().start);
        span.center = asset.character.center(&worker.posed);
        let (times, vertices) = fit::times(&span);
        if times.len().saturating_mul(vertices) > MOST {
            return None;
        }
        let asked = Framing::along(orbit_axes(yaw, pitch, framing.roll), fov_y, aspect, framing.fill());
        let asked = asked.turning(framing.turns, Vec3::ZERO);
        let mut seen = asked.clone();
        fit::look(&span, None, &mut worker, &times, &mut seen);
        let center = span.center;
        (vertices > 0).then_some(Self { clip, center, asked, seen })
    }

    /// What was seen by a camera that stands still, if it is this that is asked for.
    pub(super) fn of(&self, span: &Span, asked: &Framing) -> Option<Framing> {
        let same = self.clip == span.clip && self.center == span.center && self.asked == *asked;
        same.then(|| self.seen.clone())
    }
}
