//! Clips to clips, before they are baked: pure functions, one idea a file.

mod additive;
mod arrange;
mod cycle;
mod in_place;
mod keys;
mod resample;

pub use additive::{Reference, added, additive, reference_pose};
pub use arrange::{concat, reverse, speed, trim};
pub use cycle::{blend, close};
pub use in_place::{RootMotion, in_place, motion_root};
pub use resample::resample;
pub(super) use resample::spacing;

/// Why a clip cannot be edited so.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// More keys than anybody can mean.
    #[error(
        "clip `{clip}`: {fps} keys a second of {tracks} tracks over {seconds:.3e} s are {keys:.3e} keys, more than the limit of {limit}; \
         choose a lower rate, or cut the clip (`--trim`)"
    )]
    TooManyKeys {
        /// Which clip.
        clip: String,
        /// Keys a second.
        fps: f64,
        /// Tracks that move.
        tracks: usize,
        /// How long it lasts.
        seconds: f64,
        /// Keys that would be.
        keys: f64,
        /// The most.
        limit: usize,
    },
    /// Single precision does not tell neighbouring frames apart.
    #[error(
        "clip `{clip}`: a key at {time:.3e} s; single precision tells times there {step:.3e} s apart, which {fps} keys a second are finer \
         than; cut the clip (`--trim`) or ask for a lower rate"
    )]
    Times {
        /// Which clip.
        clip: String,
        /// Its last key, seconds.
        time: f64,
        /// From one time to the next in f32 there, seconds.
        step: f64,
        /// Keys a second.
        fps: f64,
    },
    /// Angles that have no difference.
    #[error(
        "clip `{clip}`: bone {bone} is moved by angles about its aim; make them quaternions first (`--to quat`)"
    )]
    Angles {
        /// Which clip.
        clip: String,
        /// Which bone.
        bone: u32,
    },
    /// Nothing travels.
    #[error(
        "clip `{clip}`: no bone that carries the skin is moved by a translation; there is no motion to take out"
    )]
    NoRoot {
        /// Which clip.
        clip: String,
    },
}
