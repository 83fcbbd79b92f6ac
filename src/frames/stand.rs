//! Where the camera stands at each moment: set up once for a shot, then a small matter a frame.

use super::Moment;
use super::fit::{self, Span};
use super::foresight::Foresight;
use super::framing::{Framing, Turns, orbit_axes};
use super::view::{FramingDesc, Pivot, View, ViewError};
use super::worker::Worker;
use crate::asset::{Asset, MountedCamera};
use crate::fk::Posed;
use crate::scene::{Camera, CameraError, Projection};
use crate::skeleton::BoneId;
use crate::skin::Deformed;
use glam::{Affine3A, DVec3, Mat3A, Vec3};

/// A camera that is ready for any moment of its shot.
#[derive(Clone, Debug)]
pub(super) struct Stand<'a> {
    base: Base<'a>,
    framing: FramingDesc,
    /// A point of the axis that turns go around, scene space.
    axis: Vec3,
    /// Where the followed bone is in the picture that was framed.
    anchor: Option<(BoneId, DVec3)>,
    center: DVec3,
}

#[derive(Clone, Debug)]
enum Base<'a> {
    /// The same for all moments.
    Fixed(Camera),
    /// Framed anew for what is seen.
    Each { axes: Mat3A, fov_y: f32, aspect: f32 },
    /// Rides on a bone.
    Mounted(&'a MountedCamera),
}

impl<'a> Stand<'a> {
    /// Look at the clip as far as the view needs it.
    pub fn new(
        span: &Span<'a>,
        view: &View,
        framing: FramingDesc,
        aspect: f32,
        foresight: Option<&Foresight>,
        worker: &mut Worker,
    ) -> Result<Self, ViewError> {
        check(span.asset, &framing)?;
        let center = span.center;
        worker.evaluate(span.asset, span.clip, span.range().start);
        let anchor = framing.follow.map(|bone| (bone, worker.posed.origin(bone)));
        let axis = axis(span, view, &framing, worker);
        let local = |p: DVec3| (p - center).as_vec3();
        let mut fitted = |axes: Mat3A, fov_y: f32| {
            let f = Framing::along(axes, fov_y, aspect, framing.fill()).turning(framing.turns, axis);
            let seen = foresight.filter(|_| anchor.is_none()).and_then(|s| s.of(span, &f));
            seen.unwrap_or_else(|| fit::each_moment(span, anchor, worker, f))
        };
        let base = match *view {
            View::Orbit { yaw, pitch, fov_y } => {
                let axes = orbit_axes(yaw, pitch, framing.roll);
                if framing.each_frame {
                    Base::Each { axes, fov_y, aspect }
                } else {
                    Base::Fixed(fitted(axes, fov_y).camera())
                }
            }
            View::LookAt { eye, target, up, fov_y } => {
                let camera = look_at([eye, target], center, up, fov_y, framing.roll)?;
                Base::Fixed(match fov_y > 0.0 {
                    true => camera,
                    false => fitted(camera.scene_from_view.matrix3, 0.0).parallel_from(local(eye)),
                })
            }
            View::Mounted(index) => {
                let count = span.asset.cameras.len();
                let camera = span.asset.cameras.get(index);
                Base::Mounted(camera.ok_or(ViewError::Camera { camera: index, count })?)
            }
        };
        Ok(Self { base, framing, axis, anchor, center })
    }

    /// A point of the axis that the camera walks around, if it does.
    pub fn turns(&self) -> Option<Vec3> {
        (self.framing.turns != Turns::None).then_some(self.axis)
    }

    /// The camera of a moment that poses the bones so and the meshes so.
    pub fn camera(&self, moment: Moment, posed: &Posed, deformed: &[Deformed]) -> Camera {
        let mut camera = match self.base {
            Base::Fixed(camera) => turned(camera, moment.turn, self.axis),
            Base::Each { axes, fov_y, aspect } => {
                let axes = Mat3A::from_rotation_y(moment.turn) * axes;
                let mut f = Framing::along(axes, fov_y, aspect, self.framing.fill());
                deformed.iter().for_each(|d| f.include(&d.positions));
                f.camera()
            }
            Base::Mounted(mounted) => turned(ride(mounted, posed, self.center), moment.turn, self.axis),
        };
        if let (Base::Fixed(_), Some((bone, anchor))) = (&self.base, self.anchor) {
            camera.scene_from_view.translation += (posed.origin(bone) - anchor).as_vec3a();
        }
        zoomed(camera, self.framing.zoom)
    }
}

/// Refuse bones and numbers that mean nothing.
fn check(asset: &Asset, framing: &FramingDesc) -> Result<(), ViewError> {
    let count = asset.character.skeleton().len();
    if let Some(bone) = framing.follow.filter(|b| b.index() >= count) {
        return Err(ViewError::Bone { bone: bone.0, purpose: "follow", count });
    }
    let FramingDesc { margin, zoom, roll, .. } = *framing;
    for (what, found, fine, expected) in [
        ("the margin", margin, (0.0..=FramingDesc::MAX_MARGIN).contains(&margin), "0 to 0.45 of the picture"),
        ("the zoom", zoom, zoom > 0.0 && zoom.is_finite(), "a factor above 0"),
        ("the roll", roll, roll.is_finite(), "an angle"),
    ] {
        if !fine {
            return Err(ViewError::Number { what, found, expected });
        }
    }
    Ok(())
}

/// A point of the axis that turns go around.
fn axis(span: &Span, view: &View, framing: &FramingDesc, worker: &mut Worker) -> Vec3 {
    match (framing.pivot, view) {
        (Pivot::Origin, _) => Vec3::ZERO,
        (Pivot::At(p), _) => (p - span.center).as_vec3(),
        (Pivot::Middle, View::LookAt { target, .. }) => (*target - span.center).as_vec3(),
        (Pivot::Middle, _) => {
            let anchor = framing.follow.map(|bone| (bone, worker.posed.origin(bone)));
            let [low, high] = fit::bounds(span, anchor, worker);
            let middle = (low + high) * 0.5;
            if middle.is_finite() { middle } else { Vec3::ZERO }
        }
    }
}

/// A camera of the world in the scene's frame; its error speaks of the world.
fn look_at(
    [eye, target]: [DVec3; 2],
    center: DVec3,
    up: Vec3,
    fov_y: f32,
    roll: f32,
) -> Result<Camera, CameraError> {
    let projection = match fov_y > 0.0 {
        true => Projection::Perspective { fov_y },
        false => Projection::Orthographic { height: 1.0 },
    };
    let local = |p: DVec3| (p - center).as_vec3();
    let mut camera = Camera::look_at(local(eye), local(target), up, projection)
        .map_err(|_| CameraError::Degenerate { eye: eye.as_vec3(), target: target.as_vec3(), up })?;
    if roll != 0.0 {
        camera.scene_from_view.matrix3 *= Mat3A::from_rotation_z(-roll);
    }
    Ok(camera)
}

/// The asset's camera where its bone is.
fn ride(mounted: &MountedCamera, posed: &Posed, center: DVec3) -> Camera {
    // A scaled bone carries its camera, but does not distort it.
    let (_, rotation, translation) = posed.near(mounted.bone, center).to_scale_rotation_translation();
    Camera {
        scene_from_view: Affine3A::from_rotation_translation(rotation, translation),
        projection: mounted.projection,
        near: mounted.near,
        far: mounted.near * 1e6,
    }
}

/// The camera after a walk of `turn` radians around the vertical axis through `axis`.
pub(super) fn turned(camera: Camera, turn: f32, axis: Vec3) -> Camera {
    if turn == 0.0 {
        return camera;
    }
    let walk = Affine3A::from_translation(axis)
        * Affine3A::from_rotation_y(turn)
        * Affine3A::from_translation(-axis);
    Camera { scene_from_view: walk * camera.scene_from_view, ..camera }
}

/// The same camera with a narrower picture.
fn zoomed(camera: Camera, zoom: f32) -> Camera {
    if zoom == 1.0 {
        return camera;
    }
    let projection = match camera.projection {
        Projection::Perspective { fov_y } => {
            Projection::Perspective { fov_y: 2.0 * ((0.5 * fov_y).tan() / zoom).atan() }
        }
        Projection::Orthographic { height } => Projection::Orthographic { height: height / zoom },
    };
    Camera { projection, ..camera }
}
