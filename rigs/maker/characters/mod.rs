//! The shipped characters. Each is a function from nothing to files.

mod biped;
mod fox;
mod kit;
mod octopus;
mod robot_arm;

/// A file to be written.
pub struct File {
    /// From the root of the repository.
    pub path: String,
    /// All of it.
    pub bytes: Vec<u8>,
}

/// Every file in `rigs/` and `poses/` that the maker builds.
pub fn all() -> Vec<File> {
    [robot_arm::files(), octopus::files(), biped::files(), fox::files()].into_iter().flatten().collect()
}
