//! What the library promises, a module a subject.

mod architecture;
mod deform;
#[cfg(feature = "pictures")]
mod picture;
mod rng;
