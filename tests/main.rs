//! What the library promises, a module a subject.

mod architecture;
#[cfg(feature = "cli")]
mod cli;
mod deform;
#[cfg(feature = "pictures")]
mod picture;
mod rng;
