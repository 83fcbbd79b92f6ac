//! What the library promises, a module a subject.

mod architecture;
mod deform;
mod rng;
