//! What a run did and where its time went.

use super::film::Written;
use crate::cli::say::Say;
use sinew::frames::FrameStats;
use std::time::{Duration, Instant};

/// How `--stats` is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Form {
    /// A line each.
    Text,
    /// One JSON object.
    Json,
}

/// Sums over all frames of a run; times of workers add up, so that together they may exceed the wall clock's.
#[derive(Default)]
pub struct Totals {
    /// Outputs finished.
    pub outputs: usize,
    /// Frames written.
    pub frames: usize,
    /// Bytes of pictures and films.
    pub bytes: u64,
    /// Reading and decoding inputs.
    pub import: Duration,
    /// Looking where the character goes, to place the camera.
    pub framing: Duration,
    /// Pictures to bytes.
    pub encode: Duration,
    /// Bytes to files.
    pub write: Duration,
    /// Poses, skins, pixels.
    pub drawn: FrameStats,
}

impl Totals {
    /// Take in an output.
    pub fn add(&mut self, written: &Written, frames: usize) {
        self.outputs += 1;
        self.frames += frames;
        self.bytes += written.bytes;
        self.encode += written.encode;
        self.write += written.write;
        self.drawn += written.drawn;
    }

    /// Print what was counted since `start`.
    pub fn print(&self, form: Form, start: Instant, say: &Say) {
        let wall = start.elapsed();
        let d = &self.drawn;
        let counts = [
            ("outputs", self.outputs as u64),
            ("frames", self.frames as u64),
            ("bones evaluated", d.bones as u64),
            ("vertices skinned", d.vertices as u64),
            ("triangles submitted", d.raster.triangles),
            ("triangles culled", d.raster.culled),
            ("triangles clipped", d.raster.clipped),
            ("triangles binned", d.raster.drawn),
            ("samples covered", d.raster.samples),
            ("pixels shaded", d.raster.shaded),
            ("rays from the eye", d.rays.count.primary),
            ("rays to lamps", d.rays.count.shadow),
            ("rays sent on", d.rays.count.secondary),
            ("hits shaded", d.rays.count.shaded),
            ("bytes encoded", self.bytes),
        ];
        let times = [
            ("import", self.import),
            ("framing", self.framing),
            ("pose", d.times.pose),
            ("skin", d.times.deform),
            ("draw", d.times.draw),
            ("encode", self.encode),
            ("write", self.write),
            ("wall", wall),
        ];
        match form {
            Form::Text => {
                counts.iter().for_each(|(name, n)| say.report(&format!("{name:<20}{n:>14}")));
                let ms = |t: &Duration| 1e3 * t.as_secs_f64();
                times.iter().for_each(|(name, t)| {
                    say.report(&format!("{:<20}{:>14.3}", format!("ms {name}"), ms(t)))
                });
            }
            Form::Json => {
                let key = |name: &str| name.replace(' ', "_");
                let ms = |t: &Duration| (1e6 * t.as_secs_f64()).round() / 1e3;
                let mut object = serde_json::Map::new();
                counts.iter().for_each(|(name, n)| drop(object.insert(key(name), (*n).into())));
                times.iter().for_each(|(name, t)| drop(object.insert(format!("ms_{name}"), ms(t).into())));
                say.report(&serde_json::Value::from(object).to_string());
            }
        }
    }
}
