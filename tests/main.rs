//! What the library promises, a module a subject.

mod architecture;
#[cfg(feature = "cli")]
mod cli;
#[cfg(feature = "io")]
mod corpus;
mod deform;
#[cfg(feature = "io")]
mod gltf;
#[cfg(feature = "pictures")]
mod picture;
mod rng;
#[cfg(feature = "pictures")]
mod shots;
