//! Posing: a bone's channel becomes a key, or stays loose until it is keyed.

use super::{Change, Keys, Mirror, Refused, Spans, State, TrackKeys};
use glam::{Quat, Vec3};
use sinew::clip::{Curve, Interpolation, Target, Track};
use sinew::math::{Trs, euler};
use sinew::pose::Pose;
use sinew::skeleton::BoneId;
use std::sync::Arc;

/// A bone that is posed and not keyed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loose {
    /// `parent_from_bone`.
    pub local: Trs,
    /// The angles that made its rotation, where somebody chose angles: at small bends they are not unique.
    pub theta: Option<Vec3>,
}

impl State {
    /// The angles of a bone as it stands: loose, keyed, or computed from its rotation.
    pub fn theta(&self, bone: BoneId) -> Vec3 {
        let loose = self.loose.get(&bone).and_then(|l| l.theta);
        loose.unwrap_or_else(|| match self.track_of(&Target::Xzx(bone)) {
            Some(track) if !self.loose.contains_key(&bone) => self.sampled3(track),
            _ => self.pose_of_bone(bone).xzx(self.document.skeleton(), bone, self.keyed_theta(bone)),
        })
    }

    /// The rest pose but for one bone, as it stands: a window that asks each frame must not pay for all tracks.
    pub fn pose_of_bone(&self, bone: BoneId) -> Pose {
        let (skeleton, mut pose) = (self.document.skeleton(), self.document.asset.character.rest_pose());
        let own = self.active().tracks.iter().filter(|t| t.target.bone() == Some(bone));
        own.for_each(|t| t.sample(skeleton, self.time, &mut pose));
        if let Some(loose) = self.loose.get(&bone) {
            pose.locals[bone.index()] = loose.local;
        }
        pose
    }

    /// The angles that the bone's track has now.
    fn keyed_theta(&self, bone: BoneId) -> Option<Vec3> {
        self.track_of(&Target::Xzx(bone)).map(|t| self.sampled3(t))
    }

    fn sampled3(&self, track: usize) -> Vec3 {
        let mut v = [0.0; 3];
        self.active().tracks[track].curve.sample(self.time, &mut v);
        Vec3::from(v)
    }

    /// The last track of a target: the one that wins.
    pub fn track_of(&self, target: &Target) -> Option<usize> {
        self.active().tracks.iter().rposition(|t| t.target == *target)
    }

    /// Channels of bones as they stand: every rotation, and a translation where it is not at rest.
    pub(super) fn pose_of(&self, bones: &[BoneId]) -> Vec<(BoneId, Change)> {
        let (pose, skeleton) = (self.pose(), self.document.skeleton());
        let mut out = Vec::new();
        for &bone in bones {
            let local = pose.locals[bone.index()];
            out.push((bone, Change::Rotation(local.rotation)));
            if local.translation != skeleton.rest(bone).translation {
                out.push((bone, Change::Translation(local.translation)));
            }
        }
        out
    }

    /// What was posed and not keyed is given up.
    pub(super) fn loosen_none(&mut self) {
        self.loose.clear();
        self.loose_weights.clear();
    }

    /// Weights of shapes as they stand.
    pub fn weights(&self) -> Vec<f32> {
        let (skeleton, mut pose) = (self.document.skeleton(), self.document.asset.character.rest_pose());
        let own = self.active().tracks.iter().filter(|t| matches!(t.target, Target::Weights { .. }));
        own.for_each(|t| t.sample(skeleton, self.time, &mut pose));
        self.loose_weights.iter().for_each(|(&i, &weight)| pose.weights[i] = weight);
        pose.weights
    }

    pub(super) fn set_weight(&mut self, i: usize, weight: f32) -> Result<(), Refused> {
        let count = self.document.asset.character.rest_pose().weights.len();
        if i >= count || !weight.is_finite() {
            return Err(Refused::Bad(format!("weight {weight} of shape {i} of {count}")));
        }
        self.loose_weights.insert(i, weight);
        if self.auto_key {
            self.selected().keys = Keys::new();
            self.key_weights(false)?;
        }
        Ok(())
    }

    /// Key shapes as they stand: those that are loose and, if `all`, those that have keys.
    fn key_weights(&mut self, all: bool) -> Result<(), Refused> {
        let weights = self.weights();
        for (first, width) in self.document.asset.character.weight_runs() {
            let run = first..first + width;
            let loose = self.loose_weights.range(run.clone()).next().is_some();
            if loose || all {
                self.key_channel(Target::Weights { first }, &weights[run.clone()], loose)?;
            }
            self.loose_weights.retain(|i, _| !run.contains(i));
        }
        Ok(())
    }

    pub(super) fn apply_pose(&mut self, changes: &[(BoneId, Change)]) -> Result<(), Refused> {
        let count = self.document.skeleton().len();
        for (bone, change) in changes {
            let finite = match change {
                Change::Xzx(v) | Change::Translation(v) | Change::Scale(v) => v.is_finite(),
                Change::Rotation(q) => q.is_finite() && q.length_squared() > 1e-12,
            };
            if bone.index() >= count || !finite {
                return Err(Refused::Bad(format!("bone {} of {count}: {change:?}", bone.0)));
            }
        }
        let pose = self.pose();
        for &(bone, change) in changes {
            self.loosen(&pose, bone, change);
        }
        if self.auto_key {
            let bones: Vec<BoneId> = changes.iter().map(|c| c.0).collect();
            self.key_bones(&bones, &|_, loose| loose)?;
        }
        Ok(())
    }

    fn loosen(&mut self, pose: &Pose, bone: BoneId, change: Change) {
        let skeleton = self.document.skeleton();
        let old = self.theta(bone);
        let mut loose =
            self.loose.get(&bone).copied().unwrap_or(Loose { local: pose.locals[bone.index()], theta: None });
        let theta = match change {
            Change::Translation(v) => {
                loose.local.translation = v;
                None
            }
            Change::Scale(v) => {
                loose.local.scale = v;
                None
            }
            Change::Xzx(theta) => Some(theta),
            Change::Rotation(q) => {
                loose.local.rotation = q.normalize();
                let mut turned = Pose::rest(skeleton);
                turned.locals[bone.index()].rotation = loose.local.rotation;
                Some(near(turned.xzx(skeleton, bone, Some(old)), old))
            }
        };
        if let Some(theta) = theta {
            // A bone's limits hold for whoever poses it; a free bone keeps its rotation to the bit.
            let kept = skeleton.limits(bone).map_or(theta, |l| theta.clamp(l.min.min(l.max), l.max));
            if kept != theta || matches!(change, Change::Xzx(_)) {
                let mut turned = Pose::rest(skeleton);
                turned.set_xzx(skeleton, bone, kept);
                loose.local.rotation = turned.locals[bone.index()].rotation;
            }
            loose.theta = Some(kept);
        }
        self.loose.insert(bone, loose);
    }

    pub(super) fn reset_rotations(&mut self) -> Result<(), Refused> {
        let pose = self.pose();
        let skeleton = self.document.skeleton();
        let turned = |b: &BoneId| {
            !self.selection.bones.is_empty() || pose.locals[b.index()].rotation != skeleton.rest(*b).rotation
        };
        let changes: Vec<_> =
            self.chosen_bones().into_iter().filter(turned).map(|b| (b, Change::Xzx(Vec3::ZERO))).collect();
        self.apply_pose(&changes)
    }

    pub(super) fn paste_pose(&mut self, mirror: Mirror) -> Result<(), Refused> {
        if self.clipboard.pose.is_empty() {
            return Err(Refused::NothingCopied);
        }
        let changes = self.clipboard.pose.clone();
        match mirror {
            Mirror::No => self.apply_pose(&changes),
            Mirror::ByName => {
                let mirror = self.document.asset.character.mirror();
                let image = |(b, c): (BoneId, Change)| {
                    let change = match c {
                        Change::Rotation(q) => Change::Rotation(mirror.rotation(b, q)),
                        Change::Translation(v) => Change::Translation(mirror.translation(b, v)),
                        Change::Scale(v) => Change::Scale(mirror.scale(b, v)),
                        Change::Xzx(theta) => Change::Xzx(mirror.xzx(b, theta, None)),
                    };
                    (mirror.pair(b), change)
                };
                self.apply_pose(&changes.into_iter().map(image).collect::<Vec<_>>())
            }
        }
    }

    /// Keys at the playhead: of the selected bones, or of all tracks and everything loose where none is selected.
    pub(super) fn insert_keys(&mut self) -> Result<(), Refused> {
        if !self.selection.bones.is_empty() {
            self.key_bones(&self.selection.bones.clone(), &|fresh, _| fresh)?;
            return self.key_weights(false);
        }
        let tracked = self.active().tracks.iter().filter_map(|t| t.target.bone());
        let mut bones: Vec<BoneId> = tracked.chain(self.loose.keys().copied()).collect();
        bones.sort_unstable();
        bones.dedup();
        if bones.is_empty() && self.active().tracks.is_empty() && self.loose_weights.is_empty() {
            return Err(Refused::Bad("nothing is keyed yet; select the bones to key".into()));
        }
        self.key_bones(&bones, &|_, _| false)?;
        self.key_weights(true)
    }

    /// Key bones as they stand. A channel without a track gets one if it is loose, or if `fresh(wanted, loose)` says so, where
    /// `wanted` is true of rotations, and of translations of roots.
    fn key_bones(&mut self, bones: &[BoneId], fresh: &dyn Fn(bool, bool) -> bool) -> Result<(), Refused> {
        let (pose, keyed) = (self.pose(), self.pose_at(self.time));
        self.selected().keys = Keys::new();
        for &bone in bones {
            let local = pose.locals[bone.index()];
            let (theta, root) = (self.theta(bone), self.document.skeleton().parent(bone).is_none());
            let loose = self.loose.get(&bone).copied();
            let keyed = keyed.locals[bone.index()];
            let moved = loose.is_some_and(|l| l.local.translation != keyed.translation);
            let scaled = loose.is_some_and(|l| l.local.scale != keyed.scale);
            let turned = loose.is_some_and(|l| l.theta.is_some());
            self.key_rotation(bone, theta, local.rotation, fresh(true, turned) || turned)?;
            let make = fresh(root, moved) || moved;
            self.key_channel(Target::Translation(bone), &local.translation.to_array(), make)?;
            self.key_channel(Target::Scale(bone), &local.scale.to_array(), scaled)?;
            self.loose.remove(&bone);
        }
        Ok(())
    }

    fn key_rotation(&mut self, bone: BoneId, theta: Vec3, q: Quat, make: bool) -> Result<(), Refused> {
        // A clip that knows quaternions alone stays so.
        let quaternions = |c: &super::EditClip| {
            let any = |f: fn(&Target) -> bool| c.tracks.iter().any(|t| f(&t.target));
            any(|t| matches!(t, Target::Rotation(_))) && !any(|t| matches!(t, Target::Xzx(_)))
        };
        let (angles, free) = (Target::Xzx(bone), Target::Rotation(bone));
        let (xzx, rotation) = (self.track_of(&angles), self.track_of(&free));
        if rotation > xzx || (xzx.is_none() && make && quaternions(self.active())) {
            let old = rotation.map_or(q, |t| self.active().tracks[t].curve.sample_rotation(self.time));
            let q = if q.dot(old) < 0.0 { -q } else { q };
            return self.key_channel(free, &q.to_array(), make);
        }
        self.key_channel(angles, &theta.to_array(), make)
    }

    /// A key of one channel at the playhead; where there is no track, `make` one.
    fn key_channel(&mut self, target: Target, value: &[f32], make: bool) -> Result<(), Refused> {
        if let Some(track) = self.track_of(&target) {
            return self.key_track(track, value);
        }
        if make {
            let rule = Interpolation::Linear;
            let curve = Curve::new(vec![self.key_time(self.time)], value.to_vec(), value.len(), rule)?;
            self.active_mut().tracks.push(Arc::new(Track { target, curve }));
            let track = self.active().tracks.len() as u32 - 1;
            let keys = TrackKeys { spans: Spans::one(0..1), mask: u8::MAX };
            self.selected().keys.insert(track, keys);
        }
        Ok(())
    }

    fn key_track(&mut self, track: usize, value: &[f32]) -> Result<(), Refused> {
        let at = self.key_time(self.time);
        let curve = self.active().tracks[track].curve.with_key(at, value)?;
        let keys = TrackKeys { spans: Spans::from_indices(curve.key_at(at)), mask: u8::MAX };
        self.set_curve(track, curve);
        self.selected().keys.insert(track as u32, keys);
        Ok(())
    }
}

/// The triple of the same rotation nearest to `old`.
fn near(theta: Vec3, old: Vec3) -> Vec3 {
    let wide = |v: Vec3| [f64::from(v.x), f64::from(v.y), f64::from(v.z)];
    Vec3::from(euler::unwrap_xzx(wide(theta), wide(old)).map(|a| a as f32))
}
