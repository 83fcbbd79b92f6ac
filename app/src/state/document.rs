//! What is edited: clips of one asset. Everything behind an `Arc` is shared between the steps of undo.

use sinew::asset::Asset;
use sinew::character::Instance;
use sinew::clip::{Clip, Track};
use sinew::pose::Pose;
use sinew::skeleton::Skeleton;
use sinew::time::{ClipTimeline, Marker, Range, Rate, Timeline};
use std::sync::Arc;

/// A clip with its tracks shared.
#[derive(Clone, Debug, PartialEq)]
pub struct EditClip {
    /// For people and files.
    pub name: String,
    /// Later tracks win where two move one channel.
    pub tracks: Vec<Arc<Track>>,
    /// What is played.
    pub range: Range,
    /// Ascending in time.
    pub markers: Vec<Marker>,
}

impl EditClip {
    /// Without tracks, two seconds long.
    pub fn empty(name: &str) -> Self {
        Self {
            name: name.into(),
            tracks: Vec::new(),
            range: Range { start: 0.0, end: 2.0 },
            markers: Vec::new(),
        }
    }

    /// A clip of the library, to be edited.
    pub fn from_clip(clip: &Clip) -> Self {
        let range = clip.playback();
        let range = if range.duration() > 0.0 { range } else { Range { start: 0.0, end: 2.0 } };
        let tracks = clip.tracks.iter().cloned().map(Arc::new).collect();
        Self { name: clip.name.clone(), tracks, range, markers: Vec::new() }
    }

    /// As the library has it.
    pub fn to_clip(&self) -> Clip {
        Clip { name: self.name.clone(), tracks: self.tracks.iter().map(|t| (**t).clone()).collect() }
    }

    /// Write every track at `t` over `pose`.
    pub fn sample(&self, skeleton: &Skeleton, t: f64, pose: &mut Pose) {
        self.tracks.iter().for_each(|track| track.sample(skeleton, t, pose));
    }
}

/// Clips of one asset.
#[derive(Clone, Debug)]
pub struct Document {
    /// Skeleton, meshes and look; its own clips are not looked at again.
    pub asset: Arc<Asset>,
    /// At least one.
    pub clips: Vec<Arc<EditClip>>,
    /// Frames a second: what times snap to.
    pub rate: Rate,
}

impl Document {
    /// An asset with its clips; an empty one where it has none.
    pub fn new(asset: Arc<Asset>) -> Self {
        let mut clips: Vec<_> =
            asset.character.clips().iter().map(|c| Arc::new(EditClip::from_clip(c))).collect();
        if clips.is_empty() {
            clips.push(Arc::new(EditClip::empty("clip")));
        }
        Self { asset, clips, rate: Rate::default() }
    }

    /// The tree of bones.
    pub fn skeleton(&self) -> &Skeleton {
        self.asset.character.skeleton()
    }

    /// What a weight of a pose is called: by the file, or `w3`.
    pub fn shape(&self, i: usize) -> String {
        let c = &self.asset.character;
        let of = |own: &Instance| c.mesh(own).targets.get(i.checked_sub(own.first_weight)?);
        let name = c.instances().iter().find_map(of).map(|t| t.name.clone());
        name.filter(|n| !n.is_empty()).unwrap_or_else(|| format!("w{i}"))
    }

    /// All clips as the library has them.
    pub fn to_clips(&self) -> Vec<Clip> {
        self.clips.iter().map(|c| c.to_clip()).collect()
    }

    /// What a file keeps beside the keys.
    pub fn timeline(&self) -> Timeline {
        let of = |c: &Arc<EditClip>| ClipTimeline {
            range: Some(c.range),
            preview: None,
            markers: c.markers.clone(),
        };
        Timeline { rate: Some(self.rate), clips: self.clips.iter().map(of).collect() }
    }

    /// Take what a file kept beside the keys.
    pub fn set_timeline(&mut self, timeline: &Timeline) {
        self.rate = timeline.rate.unwrap_or(self.rate);
        for (clip, of) in self.clips.iter_mut().zip(&timeline.clips) {
            let clip = Arc::make_mut(clip);
            (clip.range, clip.markers) = (of.range.unwrap_or(clip.range), of.markers.clone());
        }
    }

    /// Equal to the last bit: what undo promises. Shared parts are not looked into.
    pub fn same_bits(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.asset, &other.asset)
            && self.rate == other.rate
            && self.clips.len() == other.clips.len()
            && self.clips.iter().zip(&other.clips).all(|(a, b)| Arc::ptr_eq(a, b) || same_clip(a, b))
    }
}

fn same_clip(a: &EditClip, b: &EditClip) -> bool {
    let ends = |c: &EditClip| [c.range.start.to_bits(), c.range.end.to_bits()];
    a.name == b.name
        && ends(a) == ends(b)
        && a.tracks.len() == b.tracks.len()
        && a.markers.len() == b.markers.len()
        && a.tracks.iter().zip(&b.tracks).all(|(a, b)| Arc::ptr_eq(a, b) || same_track(a, b))
        && a.markers
            .iter()
            .zip(&b.markers)
            .all(|(a, b)| a.name == b.name && a.time.to_bits() == b.time.to_bits())
}

fn same_track(a: &Track, b: &Track) -> bool {
    let (c, d) = (&a.curve, &b.curve);
    a.target == b.target
        && (c.width(), c.interpolation()) == (d.width(), d.interpolation())
        && c.times().len() == d.times().len()
        && c.times().iter().zip(d.times()).all(|(a, b)| a.to_bits() == b.to_bits())
        && c.values().iter().zip(d.values()).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Names of a track's numbers, as rows and key nodes say them.
pub fn components(document: &Document, track: &Track) -> Vec<String> {
    use sinew::clip::Target::{Rotation, Scale, Translation, Weights, Xzx};
    let names: &[&str] = match track.target {
        Xzx(_) => &["θ1", "θ2", "θ3"],
        Rotation(_) => &["qx", "qy", "qz", "qw"],
        Translation(_) => &["x", "y", "z"],
        Scale(_) => &["sx", "sy", "sz"],
        Weights { first } => {
            return (first..first + track.curve.width()).map(|i| document.shape(i)).collect();
        }
    };
    names.iter().map(|n| n.to_string()).collect()
}

/// `LKnee.θ`: bone and channel of a track.
pub fn track_name(skeleton: &Skeleton, track: &Track) -> String {
    use sinew::clip::Target::{Rotation, Scale, Translation, Weights, Xzx};
    let channel = match track.target {
        Xzx(_) => "θ",
        Rotation(_) => "q",
        Translation(_) => "move",
        Scale(_) => "scale",
        Weights { first } => return format!("weights from {first}"),
    };
    let bone = track.target.bone().map_or("", |b| skeleton.name(b));
    format!("{bone}.{channel}")
}
