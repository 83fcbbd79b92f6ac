//! Builds every file in rigs/ and poses/.
fn main() {}
