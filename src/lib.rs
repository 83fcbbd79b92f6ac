//! Character animation and skinning: skeletons, clips, deformation and pictures of them, with every error stated.
//!
//! # The way data flows
//!
//! ```text
//! time ──► clip ──► pose ──► fk ──► skin (deform) ──► scene ──► render ──► image ──► frames
//!           ▲                        ▲
//!           io{glTF, our rigs, …}    morph
//! ```
//!
//! The modules below are declared in that order; reading them from top to bottom walks the same way.
//!
//! **Everything that moves is a bone.** A node of a glTF file, a joint of a robot and a finger are bones of one tree. Built by
//! hand, with a bone that bends:
//!
//! ```
//! use glam::{DVec3, Vec3};
//! use sinew::{fk, pose::Pose, skeleton::{BoneDesc, BoneId, Skeleton}};
//!
//! let mut forearm = BoneDesc { parent: Some(0), length: 0.25, ..BoneDesc::new("forearm") };
//! forearm.rest.translation = Vec3::new(0.3, 0.0, 0.0);
//! let upper = BoneDesc { length: 0.3, ..BoneDesc::new("upper arm") };
//! let (skeleton, _) = Skeleton::new(vec![upper, forearm])?;
//!
//! // Twist, bend, twist (radians): XZX Euler angles about the bone's own +x.
//! let mut pose = Pose::rest(&skeleton);
//! pose.set_xzx(&skeleton, BoneId(1), Vec3::new(0.0, std::f32::consts::FRAC_PI_2, 0.0));
//!
//! let mut posed = fk::Posed::default();
//! fk::forward(&skeleton, &pose, &mut posed);
//! let hand = posed.world_from_bone(BoneId(1)).transform_point3(skeleton.tip(BoneId(1)).as_dvec3());
//! assert!((hand - DVec3::new(0.3, 0.25, 0.0)).length() < 1e-6);
//! # Ok::<(), sinew::skeleton::SkeletonError>(())
//! ```
//!
//! **Dragged to a place**, a hand pulls its arm along ([`ik`]): bones turn within their limits until a point of the body is where it is
//! wanted; [`pose::mirror`] gives the other hand the same.
//!
//! **A clip turns a time into a pose.** Its curves hold, run straight or follow Catmull-Rom; seconds are `f64`:
//!
//! ```
//! use sinew::clip::{Curve, Interpolation};
//! use sinew::math::spline::Tangents;
//! let swing = Interpolation::CatmullRom(Tangents::Monotone);
//! let curve = Curve::new(vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 0.0], 1, swing)?;
//! let mut angle = [0.0];
//! curve.sample(0.5, &mut angle);
//! assert_eq!(angle, [0.625]);
//! # Ok::<(), sinew::clip::CurveError>(())
//! ```
//!
//! **A palette of matrices deforms a mesh**, rigidly or blended; the deformer knows neither bones nor poses:
//!
//! ```
//! use glam::{Affine3A, Vec3};
//! use sinew::skin::{Deformed, Method, Rest, Weights, deform};
//! let (weights, _) = Weights::new(2, &[0, 1], &[0.5, 0.5], 2, 0)?;
//! let palette = [Affine3A::IDENTITY, Affine3A::from_translation(Vec3::Y)];
//! let mut out = Deformed::default();
//! deform(Method::Linear(&weights), Rest { positions: &[Vec3::X], normals: &[], tangents: &[] }, &palette, &mut out);
//! assert_eq!(out.positions, [Vec3::new(1.0, 0.5, 0.0)]);
//! # Ok::<(), sinew::skin::WeightsError>(())
//! ```
//!
//! **A file becomes frames** in three lines: import, set up a shot, draw a moment.
//!
//! ```
//! # #[cfg(feature = "io")] {
//! use sinew::frames::{Shot, ShotDesc, View, Worker};
//! use sinew::{image::Rgba8, io, render::Settings};
//! let rig = br##"{
//!   "sinew_rig": 1,
//!   "bones": [{"name": "flag", "head": [0,0,0], "tail": [1,0,0]}],
//!   "meshes": [{"name": "cloth", "bind": "closest", "positions": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2]]}]
//! }"##;
//! let import = io::rig_json::import_bytes(rig, &io::Options::default(), &|_| Err(std::io::ErrorKind::NotFound.into())).unwrap();
//! let settings = Settings { width: 32, height: 32, ..Settings::default() };
//! let view = View::Orbit { yaw: 0.0, pitch: 0.0, fov_y: 0.5 };
//! let shot = Shot::new(&import.asset, ShotDesc { view, settings, ..Default::default() }).unwrap();
//! let mut picture = Rgba8::default();
//! shot.draw(0.0, &mut Worker::default(), &mut picture);
//! let covered = picture.data.chunks(4).filter(|p| p[3] > 0).count();
//! assert!((300..500).contains(&covered), "{covered}");
//! # }
//! ```
//!
//! # Spaces and units
//!
//! Metres, seconds, radians; a name that ends in `_deg`, `_ms` or `_px` says otherwise. Matrices read target-from-source, so
//! neighbours cancel: `world_from_bone · bone_from_mesh`. World space is +y up; a character faces +z.
//!
//! # Features
//!
//! `default-features = false` leaves the mathematics, skinning and drawing, with `glam` and `thiserror` alone. `io` adds importers,
//! `pictures` texture decoding and picture files, `cli` the program.
#![deny(rustdoc::broken_intra_doc_links)]

pub mod math;

pub mod time;

pub mod skeleton;

pub mod pose;

pub mod clip;

pub mod fk;

pub mod ik;

pub mod mesh;

pub mod skin;

pub mod morph;

pub mod character;

pub mod image;

pub mod scene;

pub mod asset;

pub mod render;

pub mod frames;

pub mod measure;

pub mod bake;

#[cfg(feature = "pictures")]
pub mod sheet;

#[cfg(any(feature = "io", feature = "pictures"))]
pub mod io;

#[cfg(test)]
mod test_rng;

/// The examples of the README, run with the others.
#[cfg(all(doctest, feature = "pictures", feature = "io"))]
#[doc = include_str!("../README.md")]
mod readme {}
