//! What the library promises, a module a subject.

#[cfg(feature = "io")]
mod gltf;
