//! What the library promises, a module a subject.

mod architecture;
#[cfg(feature = "cli")]
mod cli;
mod deform;
#[cfg(feature = "io")]
mod gltf;
#[cfg(feature = "pictures")]
mod picture;
mod raster;
mod rng;
