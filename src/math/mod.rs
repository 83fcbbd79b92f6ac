//! Rotations, transforms and curves: the only arithmetic that every other room shares.

pub mod euler;
pub mod lanes;
pub mod power;
pub mod rotation;
pub mod simd;
pub mod spline;
mod transform;

pub use transform::{Trs, normal_from, transform_normal, transform_point, transform_vector};

pub(crate) use transform::{unit_or, unit_or_any};
