//! How far two results are from each other, in numbers and in pictures.

pub mod picture;
mod ssim;

pub use ssim::ssim;
