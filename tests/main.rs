//! What the library promises, a module a subject.

mod architecture;
#[cfg(feature = "io")]
mod bake;
#[cfg(feature = "cli")]
mod bake_forms;
#[cfg(feature = "cli")]
mod batch;
mod channels;
#[cfg(feature = "cli")]
mod cli;
#[cfg(feature = "cli")]
mod compare;
#[cfg(all(feature = "io", feature = "pictures"))]
mod corpus;
mod deform;
#[cfg(feature = "cli")]
mod edits;
#[cfg(feature = "io")]
mod forms;
#[cfg(feature = "io")]
mod gltf;
#[cfg(feature = "cli")]
mod golden;
#[cfg(feature = "io")]
mod looks;
#[cfg(feature = "pictures")]
mod picture;
#[cfg(feature = "cli")]
mod quantize;
mod raster;
mod ray;
#[cfg(feature = "io")]
mod retarget;
#[path = "../src/test_rng.rs"]
mod rng;
#[cfg(feature = "cli")]
mod scenes;
#[cfg(feature = "cli")]
mod sheet;
#[cfg(all(feature = "io", feature = "pictures"))]
mod shots;
#[cfg(all(feature = "io", feature = "pictures"))]
mod views;
#[cfg(all(feature = "io", feature = "pictures"))]
mod xzx;
