//! What the library promises, a module a subject.

#[cfg(all(feature = "io", feature = "pictures"))]
mod corpus;
