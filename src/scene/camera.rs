//! The eye: where it stands and how it projects.

use glam::{Affine3A, Mat3A, Mat4, Vec3, Vec4};

/// How view space becomes a picture. View space: x right, y up, looking along −z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Vanishing points.
    Perspective {
        /// Vertical field of view, radians.
        fov_y: f32,
    },
    /// Parallel.
    Orthographic {
        /// Metres from the picture's top to its bottom.
        height: f32,
    },
}

/// A camera in the scene's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// `scene_from_view`; rotation and translation only.
    pub scene_from_view: Affine3A,
    /// Perspective or parallel.
    pub projection: Projection,
    /// Nearest visible distance along −z, metres.
    pub near: f32,
    /// Farthest distance, metres; only scales depth pictures, nothing is clipped by it.
    pub far: f32,
}

/// Why a camera cannot look.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// Eye and target at one place, or the up direction along the view.
    #[error("the camera at {eye} cannot look at {target} with up {up}: the three leave no picture plane")]
    Degenerate {
        /// Where it stands.
        eye: Vec3,
        /// What it looks at.
        target: Vec3,
        /// Which way is up.
        up: Vec3,
    },
}

impl Camera {
    /// A camera at `eye` that looks at `target`: `w = −V/‖V‖`, `u = V̂ × up` normalised, `v = w × u` (notes §2.3).
    ///
    /// ```
    /// use glam::Vec3;
    /// use sinew::scene::{Camera, Projection};
    /// let c = Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, Projection::Perspective { fov_y: 1.0 }).unwrap();
    /// assert!(Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::Y, c.projection).is_err());
    /// ```
    ///
    /// # Errors
    /// [`CameraError::Degenerate`] where the view direction is zero or parallel to `up`.
    pub fn look_at(eye: Vec3, target: Vec3, up: Vec3, projection: Projection) -> Result<Self, CameraError> {
        let error = CameraError::Degenerate { eye, target, up };
        let view = (target - eye).try_normalize().ok_or(error.clone())?;
        let u = view.cross(up.normalize_or_zero());
        if u.length() < 1e-6 {
            return Err(error);
        }
        let (u, w) = (u.normalize(), -view);
        let axes = Mat3A::from_cols(u.into(), w.cross(u).into(), w.into());
        let distance = eye.distance(target);
        Ok(Self {
            scene_from_view: Affine3A { matrix3: axes, translation: eye.into() },
            projection,
            near: distance * 1e-3,
            far: distance * 1e3,
        })
    }

    /// Where the eye stands, scene space.
    pub fn eye(&self) -> Vec3 {
        self.scene_from_view.translation.into()
    }

    /// `clip_from_scene` for a picture of that `aspect` (width over height). Clip space: `w > 0` in front; x and y run over
    /// ±w inside the picture, y up. The z row is `near/w` reversed: after division 1 at the near plane, 0 at infinity
    /// (perspective), and linear from 1 at near to 0 at far (orthographic).
    pub fn clip_from_scene(&self, aspect: f32) -> Mat4 {
        let view = Mat4::from(self.scene_from_view.inverse());
        let clip_from_view = match self.projection {
            Projection::Perspective { fov_y } => {
                let f = 1.0 / (0.5 * fov_y).tan();
                Mat4::from_cols(
                    Vec4::new(f / aspect, 0.0, 0.0, 0.0),
                    Vec4::new(0.0, f, 0.0, 0.0),
                    Vec4::new(0.0, 0.0, 0.0, -1.0),
                    Vec4::new(0.0, 0.0, self.near, 0.0),
                )
            }
            Projection::Orthographic { height } => {
                let depth = (self.far - self.near).max(f32::MIN_POSITIVE);
                Mat4::from_cols(
                    Vec4::new(2.0 / (height * aspect), 0.0, 0.0, 0.0),
                    Vec4::new(0.0, 2.0 / height, 0.0, 0.0),
                    Vec4::new(0.0, 0.0, 1.0 / depth, 0.0),
                    Vec4::new(0.0, 0.0, self.far / depth, 1.0),
                )
            }
        };
        clip_from_view * view
    }
}
