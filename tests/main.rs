//! What the library promises, a module a subject.

#[cfg(feature = "pictures")]
mod picture;
