//! Character animation and skinning.
#![deny(rustdoc::broken_intra_doc_links)]

pub mod math;
pub mod time;

pub mod skeleton;

pub mod pose;

pub mod clip;

pub mod fk;

pub mod mesh;

pub mod skin;

pub mod morph;

pub mod character;

pub mod image;

pub mod scene;

pub mod asset;

pub mod render;

pub mod frames;

#[cfg(any(feature = "io", feature = "pictures"))]
pub mod io;

#[cfg(test)]
mod test_rng;
