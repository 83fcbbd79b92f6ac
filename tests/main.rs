//! What the library promises, a module a subject.

mod architecture;
#[cfg(feature = "io")]
mod corpus;
mod deform;
#[cfg(feature = "pictures")]
mod picture;
mod rng;
