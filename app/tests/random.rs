//! Commands in any order: no panic, every invariant, and undo to the start exactly.

use super::keys::face;
use super::pip;
use glam::{Quat, Vec3};
use sinew::clip::Interpolation;
use sinew::math::spline::Tangents;
use sinew::skeleton::BoneId;
use sinew::time::{Marker, Range, Rate};
use sinew_app::state::{Change, Command, Edit, LoopMode, Mirror, Mode, Playback, Spans, State, TrackKeys};

/// SplitMix64.
struct Rng(u64);

impl Rng {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn real(&mut self, lo: f64, hi: f64) -> f64 {
        // Now and then what no person would type.
        match self.below(200) {
            0 => f64::NAN,
            1 => 1e300,
            2 => -0.0,
            _ => lo + (hi - lo) * (self.next() >> 11) as f64 / (1u64 << 53) as f64,
        }
    }

    fn vec3(&mut self) -> Vec3 {
        Vec3::from([0; 3].map(|_| self.real(-4.0, 4.0) as f32))
    }
}

fn edit(r: &mut Rng, s: &State) -> Edit {
    let bones = s.document.skeleton().len() + r.below(2);
    match r.below(26) {
        0 | 1 => Edit::InsertKeys,
        2 => Edit::DeleteKeys,
        3..=5 => Edit::MoveKeys {
            seconds: r.real(-1.0, 1.0),
            value: if r.below(2) == 0 { 0.0 } else { r.real(-1.0, 1.0) as f32 },
        },
        6 => Edit::ScaleKeys { factor: r.real(-2.0, 2.0), about: s.time },
        7 => Edit::DuplicateKeys { seconds: r.real(-1.0, 1.0) },
        8 => Edit::PasteKeys,
        9 => Edit::SetInterpolation(
            [
                Interpolation::Hold,
                Interpolation::Linear,
                Interpolation::Hermite,
                Interpolation::CatmullRom(Tangents::Notes),
                Interpolation::CatmullRom(Tangents::Monotone),
            ][r.below(5)],
        ),
        10..=13 => {
            let change = |r: &mut Rng| match r.below(4) {
                0 => Change::Xzx(r.vec3()),
                1 => Change::Rotation(Quat::from_xyzw(r.real(-1.0, 1.0) as f32, 0.1, 0.2, 0.3)),
                2 => Change::Translation(r.vec3()),
                _ => Change::Scale(r.vec3()),
            };
            Edit::Pose((0..1 + r.below(3)).map(|_| (BoneId(r.below(bones) as u32), change(r))).collect())
        }
        14 => Edit::ResetRotations,
        15 => Edit::PastePose(if r.below(2) == 0 { Mirror::No } else { Mirror::ByName }),
        16 => Edit::SetMarker(Marker { time: r.real(0.0, 3.0), name: "here".into() }),
        17 => Edit::RemoveMarker(s.active().markers.first().map_or(0.0, |m| m.time)),
        18 => Edit::SetRate(
            [Rate::new(30, 1), Rate::new(24, 1), Rate::new(24000, 1001)][r.below(3)].clone().unwrap(),
        ),
        19 => Edit::SetRange(Range { start: r.real(-1.0, 1.0), end: r.real(0.0, 3.0) }),
        20 if s.document.clips.len() < 4 => Edit::NewClip("another".into()),
        21 => Edit::RenameClip(format!("clip {}", r.below(9))),
        22 if r.below(8) == 0 => Edit::DeleteClip,
        24 if r.below(4) == 0 => Edit::MirrorClip,
        23 if r.below(8) == 0 => Edit::ReplaceClips("Bake", s.document.to_clips()),
        25 => Edit::Weight(r.below(3), r.real(-1.0, 2.0) as f32),
        _ => Edit::InsertKeys,
    }
}

fn command(r: &mut Rng, s: &State) -> Command {
    let mode = [Mode::Replace, Mode::Add, Mode::Toggle][r.below(3)];
    match r.below(32) {
        0..=11 => Command::Do(edit(r, s)),
        12 => Command::Begin("Drag"),
        13..=15 => Command::Preview(edit(r, s)),
        16 => Command::Commit,
        17 => Command::Cancel,
        18 | 19 => Command::Undo,
        20 => Command::Redo,
        21 | 22 => Command::SetTime(r.real(-1.0, 4.0)),
        23 => Command::Tick(r.real(0.0, 0.2)),
        24 => Command::Play(r.below(2) == 0),
        25 => Command::SetPlayback(Playback {
            mode: [LoopMode::Loop, LoopMode::Once, LoopMode::PingPong][r.below(3)],
            speed: r.real(0.0, 3.0),
            every_frame: r.below(2) == 0,
            range: Range { start: r.real(-1.0, 2.0), end: r.real(-1.0, 3.0) },
            ..s.playback
        }),
        26 => Command::SelectBones(vec![BoneId(r.below(40) as u32), BoneId(r.below(40) as u32)], mode),
        27..=29 => {
            let key = |r: &mut Rng| {
                let spans = Spans::from_indices((0..r.below(4)).map(|_| r.below(20)));
                (r.below(s.active().tracks.len() + 1) as u32, TrackKeys { spans, mask: r.next() as u8 })
            };
            Command::SelectKeys((0..r.below(5)).map(|_| key(r)).collect(), mode)
        }
        30 => [
            Command::SelectClip(r.below(4)),
            Command::SetAutoKey(r.below(2) == 0),
            Command::SetSnap(r.below(8) != 0),
        ][r.below(3)]
        .clone(),
        _ => [Command::CopyKeys, Command::CopyPose][r.below(2)].clone(),
    }
}

fn check(s: &State) {
    assert!(s.clip < s.document.clips.len() && s.time.is_finite());
    let p = s.playback;
    assert!((0.25..=2.0).contains(&p.speed) && p.range.start <= p.range.end && p.range.end.is_finite());
    for clip in &s.document.clips {
        assert!(clip.markers.is_sorted_by(|a, b| a.time < b.time));
        for t in &clip.tracks {
            let times = t.curve.times();
            assert!(!times.is_empty() && times.is_sorted() && times.iter().all(|t| t.is_finite()));
            assert!(t.curve.values().iter().all(|v| v.is_finite()));
        }
    }
    for (&track, keys) in &s.selection.keys {
        let count = s.active().tracks[track as usize].curve.times().len();
        assert!(
            !keys.spans.is_empty() && keys.spans.iter().all(|k| k < count),
            "track {track}: {keys:?} of {count}"
        );
        assert!(keys.spans.runs().windows(2).all(|w| w[0].end < w[1].start));
    }
    assert!(s.selection.bones.iter().all(|b| b.index() < s.document.skeleton().len()));
}

#[test]
fn a_hundred_thousand_commands_keep_every_promise_and_undo_to_the_start() {
    commands(State::open(pip()), 100_000);
}

/// A face has shapes and no bones to speak of.
#[test]
fn commands_on_shapes_keep_every_promise() {
    commands(face(), 20_000);
}

fn commands(mut s: State, count: usize) {
    let mut r = Rng(6);
    let start = s.document.clone();
    let (mut done, mut refused) = (0, 0);
    for _ in 0..count {
        let c = command(&mut r, &s);
        let (before, text) = (s.document.clone(), format!("{c:?}"));
        let mut keys_move = matches!(&c, Command::Do(Edit::MoveKeys { seconds, .. }) if *seconds != 0.0);
        match s.update(c) {
            Ok(()) => done += 1,
            Err(_) => {
                keys_move = false;
                refused += 1;
                let preview = text.starts_with("Preview");
                assert!(preview || s.document.same_bits(&before), "{text} was refused and left a trace");
            }
        }
        if keys_move && s.snap && s.selection.key_count() > 0 {
            let on = |(t, k): (&u32, &TrackKeys)| {
                let times = s.active().tracks[*t as usize].curve.times();
                k.spans.iter().all(|k| s.snapped(times[k]).to_bits() == times[k].to_bits())
            };
            assert!(s.selection.keys.iter().all(on), "{text}: a key off its frame");
        }
        check(&s);
    }
    assert!(2 * done > count && 100 * refused > count, "{done} done, {refused} refused");

    // Back to the start, and forth to the end.
    s.update(Command::Commit).unwrap();
    let end = s.document.clone();
    let mut steps = 0;
    while s.update(Command::Undo).is_ok() {
        steps += 1;
        check(&s);
    }
    assert!(steps > 100 && s.document.same_bits(&start), "{steps} steps");
    for _ in 0..steps {
        s.update(Command::Redo).unwrap();
    }
    assert!(s.document.same_bits(&end));
}

#[test]
fn a_cancelled_drag_leaves_no_trace() {
    let mut s = State::open(pip());
    let start = s.document.clone();
    let keys = [(0, TrackKeys { spans: Spans::one(0..2), mask: 1 })].into();
    s.update(Command::SelectKeys(keys, Mode::Replace)).unwrap();
    let selected = s.selection.clone();
    s.update(Command::Begin("Move keys")).unwrap();
    for step in 1..5 {
        let by = Edit::MoveKeys { seconds: f64::from(step) * 0.25, value: 0.5 };
        s.update(Command::Preview(by)).unwrap();
        assert!(!s.document.same_bits(&start));
    }
    s.update(Command::Cancel).unwrap();
    assert!(s.document.same_bits(&start) && s.selection == selected && s.undo_name().is_none());
}
