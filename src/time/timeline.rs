//! What people keep beside keys: frames a second, what is played, named moments.

use super::{Range, Rate};

/// A named moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// Seconds.
    pub time: f64,
    /// What people call it.
    pub name: String,
}

/// Of one clip.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ClipTimeline {
    /// What it plays, where that is not from its first key to its last.
    pub range: Option<Range>,
    /// A part of it that is looked at.
    pub preview: Option<Range>,
    /// Ascending in time.
    pub markers: Vec<Marker>,
}

/// Of all clips of a file; empty where it says nothing.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Timeline {
    /// Frames a second that keys were set by.
    pub rate: Option<Rate>,
    /// In the clips' order.
    pub clips: Vec<ClipTimeline>,
}
