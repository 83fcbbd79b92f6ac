//! How far two results are from each other, in numbers and in pictures.

pub mod picture;
mod sequence;
mod ssim;

pub use sequence::{Compared, Past, Summary, Tolerance};
pub use ssim::ssim;
