//! Edits of selected keys. Each leaves the keys that it touched selected, since indices change under it.

use super::{Keys, Refused, Spans, State, TrackKeys};
use sinew::clip::{Curve, Interpolation, Retime, Track};
use std::sync::Arc;

impl State {
    pub(super) fn set_curve(&mut self, track: usize, curve: Curve) {
        let slot = &mut self.active_mut().tracks[track];
        *slot = Arc::new(Track { target: slot.target.clone(), curve });
    }

    /// The selected keys, to be replaced by what became of them.
    fn take_keys(&mut self) -> Result<Keys, Refused> {
        self.trim_selection();
        let keys = std::mem::take(&mut self.selected().keys);
        if keys.is_empty() { Err(Refused::NoKeys) } else { Ok(keys) }
    }

    fn curve(&self, track: u32) -> &Curve {
        &self.active().tracks[track as usize].curve
    }

    fn reselect(&mut self, track: u32, places: Vec<usize>, mask: u8) {
        self.selected().keys.insert(track, TrackKeys { spans: Spans::from_indices(places), mask });
    }

    pub(super) fn delete_keys(&mut self) -> Result<(), Refused> {
        // From the last track, so that those ahead of one that goes keep their places.
        for (track, TrackKeys { spans, .. }) in self.take_keys()?.into_iter().rev() {
            match self.curve(track).without(|k| spans.contains(k)) {
                Some(curve) => self.set_curve(track as usize, curve),
                None => drop(self.active_mut().tracks.remove(track as usize)),
            }
        }
        Ok(())
    }

    pub(super) fn move_keys(&mut self, seconds: f64, value: f32) -> Result<(), Refused> {
        self.retime(1.0, seconds, value)
    }

    pub(super) fn scale_keys(&mut self, factor: f64, about: f64) -> Result<(), Refused> {
        self.retime(factor, about * (1.0 - factor), 0.0)
    }

    fn retime(&mut self, scale: f64, offset: f64, value: f32) -> Result<(), Refused> {
        check(scale * offset * f64::from(value))?;
        let snapping = Snap::of(self);
        for (track, TrackKeys { spans, mask }) in self.take_keys()? {
            let mut curve = self.curve(track).clone();
            if value != 0.0 {
                curve = curve.with_values(|k, numbers| {
                    for (c, v) in numbers.iter_mut().enumerate() {
                        *v += if spans.contains(k) && mask >> c.min(7) & 1 == 1 { value } else { 0.0 };
                    }
                })?;
            }
            let mut places: Vec<usize> = spans.iter().collect();
            if (scale, offset) != (1.0, 0.0) {
                let by = Retime { scale, offset, snap: &|t| snapping.time(t) };
                (curve, places) = curve.retimed(|k| spans.contains(k), &by)?;
            }
            self.set_curve(track as usize, curve);
            self.reselect(track, places, mask);
        }
        Ok(())
    }

    pub(super) fn duplicate_keys(&mut self, seconds: f64) -> Result<(), Refused> {
        check(seconds)?;
        let snapping = Snap::of(self);
        for (track, TrackKeys { spans, mask }) in self.take_keys()? {
            let curve = self.curve(track);
            let Some(copy) = curve.without(|k| !spans.contains(k)) else { continue };
            let by = Retime { scale: 1.0, offset: seconds, snap: &|t| snapping.time(t) };
            let (curve, places) = curve.joined(&copy.retimed(|_| true, &by)?.0)?;
            self.set_curve(track as usize, curve);
            self.reselect(track, places, mask);
        }
        Ok(())
    }

    pub(super) fn copy_keys(&mut self) -> Result<(), Refused> {
        let copy = |(&track, keys): (&u32, &TrackKeys)| {
            let of = self.active().tracks.get(track as usize)?;
            let curve = of.curve.without(|k| !keys.spans.contains(k))?;
            Some(Track { target: of.target.clone(), curve })
        };
        let keys: Vec<Track> = self.selection.keys.iter().filter_map(copy).collect();
        if keys.is_empty() {
            return Err(Refused::NoKeys);
        }
        self.clipboard.keys = keys;
        Ok(())
    }

    pub(super) fn paste_keys(&mut self) -> Result<(), Refused> {
        let copied = self.clipboard.keys.clone();
        let first =
            copied.iter().map(|t| t.curve.times()[0]).reduce(f64::min).ok_or(Refused::NothingCopied)?;
        let offset = self.key_time(self.time) - first;
        let snapping = Snap::of(self);
        self.selected().keys.clear();
        for Track { target, curve } in copied {
            let by = Retime { scale: 1.0, offset, snap: &|t| snapping.time(t) };
            let moved = curve.retimed(|_| true, &by)?.0;
            match self.active().tracks.iter().position(|t| t.target == target) {
                Some(track) => {
                    let (curve, places) = self.curve(track as u32).joined(&moved)?;
                    self.set_curve(track, curve);
                    self.reselect(track as u32, places, u8::MAX);
                }
                None => {
                    let places = (0..moved.times().len()).collect();
                    self.active_mut().tracks.push(Arc::new(Track { target, curve: moved }));
                    self.reselect(self.active().tracks.len() as u32 - 1, places, u8::MAX);
                }
            }
        }
        Ok(())
    }

    pub(super) fn set_interpolation(&mut self, to: Interpolation) -> Result<(), Refused> {
        self.trim_selection();
        let mut tracks: Vec<usize> = self.selection.keys.keys().map(|&t| t as usize).collect();
        if tracks.is_empty() {
            let bones = self.chosen_bones();
            let of = |t: &Arc<Track>| t.target.bone().is_some_and(|b| bones.contains(&b));
            tracks = (0..self.active().tracks.len()).filter(|&i| of(&self.active().tracks[i])).collect();
        }
        for track in tracks {
            let curve = self.curve(track as u32).with_interpolation(to);
            self.set_curve(track, curve);
        }
        Ok(())
    }
}

/// Where keys may stand; apart from the state, which is changed while it is asked.
struct Snap(Option<(f64, f64)>);

impl Snap {
    fn of(state: &State) -> Self {
        let rate = state.document.rate;
        Self(state.snap.then(|| (f64::from(rate.frames()), f64::from(rate.seconds()))))
    }

    fn time(&self, t: f64) -> f64 {
        let t = t.clamp(-86_400.0, 86_400.0);
        self.0.map_or(t, |(frames, seconds)| (t * (frames / seconds)).round() * seconds / frames)
    }
}

fn check(number: f64) -> Result<(), Refused> {
    if number.is_finite() { Ok(()) } else { Err(Refused::Bad("a number that is not finite".into())) }
}
