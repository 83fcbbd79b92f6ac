//! Cameras and overlays: what they hold, where they put things, and that parts and wholes agree.

use glam::{DVec3, Vec3};
use sinew::frames::{
    BonesDesc, Foresight, FramingDesc, Look, Moment, Onion, Overlays, PathDesc, Pivot, Shot, ShotDesc, Turns,
    View, ViewError, Worker,
};
use sinew::image::composite::Operator;
use sinew::image::{Image, Rgba8};
use sinew::io::{self, Import, Options};
use sinew::render::raster::IdImage;
use sinew::render::{Settings, Window};
use sinew::skeleton::BoneId;
use sinew::time::Wrap;
use std::path::PathBuf;

const SIDE: usize = 200;

fn rig(name: &str) -> Import {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("rigs").join(name).with_extension("json");
    io::import(&file, &Options { textures: true }).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}

fn settings(samples: u8, threads: usize) -> Settings {
    Settings { width: SIDE, height: SIDE, samples, threads }
}

/// The first clip from half the front, repeated.
fn desc() -> ShotDesc {
    let settings = settings(1, 1);
    ShotDesc { clip: Some(0), wrap: Wrap::Loop, settings, ..Default::default() }
}

fn shot(import: &Import, desc: ShotDesc) -> Shot<'_> {
    Shot::new(&import.asset, desc).unwrap()
}

fn picture(shot: &Shot, moment: impl Into<Moment>) -> Rgba8 {
    let mut out = Rgba8::default();
    shot.draw(moment, &mut Worker::default(), &mut out);
    out
}

fn linear(shot: &Shot, time: f64) -> Image {
    let mut out = Image::default();
    shot.draw_linear(time, &mut Worker::default(), &mut out);
    out
}

fn path(bone: BoneId) -> PathDesc {
    PathDesc { bone, head: true, step: 1.0 / 24.0, width_px: 2.0 }
}

/// Pixels from the picture's sides to the nearest one that shows something.
fn free(shot: &Shot, moments: impl IntoIterator<Item = Moment>) -> usize {
    let (mut ids, mut worker) = (IdImage::default(), Worker::default());
    let mut least = usize::MAX;
    for m in moments {
        shot.draw_ids(m, &mut worker, &mut ids);
        for (i, _) in ids.objects.iter().enumerate().filter(|(_, o)| **o > 0) {
            let (x, y) = (i % ids.width, i / ids.width);
            least = least.min(x).min(y).min(ids.width - 1 - x).min(ids.height - 1 - y);
        }
    }
    least
}

/// The margin of 4 % is kept, and no more than that: points are looked at each 24th of a second, pixels are whole.
fn check_margin(what: &str, free: usize) {
    let margin = SIDE * 4 / 100;
    assert!((margin - 1..=margin + 2).contains(&free), "{what}: {free} pixels are free, {margin} asked for");
}

#[test]
fn what_was_foreseen_changes_no_picture() {
    let import = rig("pip");
    let (clip, view, framing) = (Some(0), View::default(), FramingDesc::default());
    let foresee = |clip, view: &View, framing| Foresight::new(&import.asset, clip, view, framing, 1.0);
    let seen = foresee(clip, &view, &framing).expect("an orbit can be foreseen");
    let elsewhere = View::Orbit { yaw: 2.0, pitch: 0.1, fov_y: 0.3 };
    let wrong = [foresee(None, &view, &framing), foresee(clip, &elsewhere, &framing)];
    for desc in [desc(), ShotDesc { view: elsewhere, ..desc() }, ShotDesc { clip: None, ..desc() }] {
        let plain = picture(&shot(&import, desc.clone()), 0.2);
        for foresight in wrong.iter().flatten().chain([&seen]) {
            let foreseen = Shot::foreseen(&import.asset, desc.clone(), Some(foresight)).unwrap();
            assert!(picture(&foreseen, 0.2) == plain);
        }
    }
    // Cameras that move, turn or have a place of their own are left to the shot.
    let look_at = View::LookAt { eye: DVec3::Z, target: DVec3::ZERO, up: Vec3::Y, fov_y: 0.5 };
    let turning = FramingDesc { turns: Turns::All, ..framing };
    let each = FramingDesc { each_frame: true, ..framing };
    assert!(foresee(clip, &look_at, &framing).is_none() && foresee(clip, &view, &turning).is_none());
    assert!(foresee(clip, &view, &each).is_none());
}

#[test]
fn a_turntable_is_held_over_the_whole_turn_and_no_wider() {
    for name in ["pip", "fox", "koi"] {
        let import = rig(name);
        let end = import.asset.character.clips()[0].playback().end;
        for (pitch, fov_y) in [(0.2, 0.5), (1.2, 0.0)] {
            let framing = FramingDesc { turns: Turns::All, pivot: Pivot::Middle, ..Default::default() };
            let view = View::Orbit { yaw: 0.4, pitch, fov_y };
            let shot = shot(&import, ShotDesc { view, framing, ..desc() });
            let turns = (0..40).flat_map(|k| {
                let turn = std::f32::consts::TAU * k as f32 / 40.0;
                [0.0, 0.25, 0.5, 0.75].map(|t| Moment { time: t * end, turn })
            });
            let free = free(&shot, turns);
            // Whatever reaches farthest need not do so at one of the moments drawn.
            assert!((7..=14).contains(&free), "{name}, pitch {pitch}: {free}");
        }
    }
}

#[test]
fn directions_of_a_sheet_are_held() {
    let import = rig("fox");
    let framing = FramingDesc { turns: Turns::Each(4), ..Default::default() };
    let shot = shot(&import, ShotDesc { clip: None, framing, ..desc() });
    let quarter = std::f32::consts::FRAC_PI_2;
    check_margin("fox", free(&shot, (0..4).map(|k| Moment { time: 0.0, turn: quarter * k as f32 })));
}

#[test]
fn each_frame_is_framed_by_itself_if_asked_for() {
    let import = rig("pip");
    let framing = FramingDesc { each_frame: true, ..Default::default() };
    let straight_down = View::Orbit { yaw: 0.0, pitch: std::f32::consts::FRAC_PI_2, fov_y: 0.4 };
    for view in [View::default(), straight_down] {
        let shot = shot(&import, ShotDesc { view, framing, ..desc() });
        for (time, turn) in [(0.1, 0.0), (0.3, 1.0), (0.5, 4.0)] {
            check_margin(&format!("{time} s"), free(&shot, [Moment { time, turn }]));
        }
    }
}

#[test]
fn a_part_of_a_picture_has_the_bytes_of_the_whole() {
    let import = rig("koi");
    let overlays = Overlays {
        onion: Some(Onion { before: 1, after: 1, step: 0.1, opacity: 0.5, tint: 0.5 }),
        paths: vec![path(BoneId(3))],
        bones: Some(BonesDesc::default()),
        ..Default::default()
    };
    for (samples, overlays) in [(1, Overlays::default()), (4, Overlays::default()), (4, overlays)] {
        let look = Look { background: [0.1, 0.2, 0.3, 1.0], ..Default::default() };
        let desc = ShotDesc { settings: settings(samples, 1), overlays, look, ..desc() };
        let whole = picture(&shot(&import, desc.clone()), 0.2);
        for [x, y, width, height] in
            [[0, 0, 200, 200], [64, 64, 64, 64], [37, 81, 91, 50], [199, 0, 1, 200], [70, 130, 130, 70]]
        {
            for threads in [1, 2] {
                let crop = Some(Window { x, y, width, height });
                let desc = ShotDesc { crop, settings: settings(samples, threads), ..desc.clone() };
                let shot = shot(&import, desc);
                let part = picture(&shot, 0.2);
                assert_eq!((shot.size(), [part.width, part.height]), ([width, height], [width, height]));
                for row in 0..height {
                    let from = 4 * ((y + row) * SIDE + x);
                    let want = &whole.data[from..from + 4 * width];
                    assert!(part.data[4 * row * width..][..4 * width] == *want, "{crop:?}, row {row}");
                }
            }
        }
    }
}

#[test]
fn ids_and_light_of_a_part_are_those_of_the_whole() {
    let import = rig("pip");
    let crop = Window { x: 61, y: 30, width: 90, height: 111 };
    let (whole, part) = (shot(&import, desc()), shot(&import, ShotDesc { crop: Some(crop), ..desc() }));
    let ids = |shot: &Shot| {
        let mut out = IdImage::default();
        shot.draw_ids(0.3, &mut Worker::default(), &mut out);
        out
    };
    let ((a, b), (light, of_part)) = ((ids(&whole), ids(&part)), (linear(&whole, 0.3), linear(&part, 0.3)));
    assert_eq!((b.width, b.height, b.depth.len()), (90, 111, 90 * 111));
    for i in 0..90 * 111 {
        let of = (crop.y + i / 90) * SIDE + crop.x + i % 90;
        assert_eq!((a.objects[of], a.triangles[of], a.depth[of]), (b.objects[i], b.triangles[i], b.depth[i]));
        assert_eq!(light.pixels[of], of_part.pixels[i]);
    }
    let outside = ShotDesc { crop: Some(Window { x: 500, y: 0, width: 9, height: 9 }), ..desc() };
    assert_eq!(shot(&import, outside.clone()).size(), [0, 9]);
    assert!(picture(&shot(&import, outside), 0.0).data.is_empty());
}

#[test]
fn what_cannot_be_looked_at_is_said() {
    let import = rig("pip");
    let fails = |desc: ShotDesc| Shot::new(&import.asset, desc).map(|_| ()).unwrap_err();
    let look_at = |eye, target| View::LookAt { eye, target, up: Vec3::Y, fov_y: 0.5 };
    for view in [look_at(DVec3::ONE, DVec3::ONE), look_at(DVec3::new(0.0, 7.0, 0.0), DVec3::ZERO)] {
        let e = fails(ShotDesc { view, ..desc() });
        assert!(matches!(e, ViewError::Direction(_)), "{e}");
        assert!(e.to_string().contains("no picture plane"), "{e}");
    }
    let e = fails(ShotDesc { view: look_at(DVec3::new(0.0, 7.0, 0.0), DVec3::ZERO), ..desc() });
    assert!(e.to_string().contains("[0, 7, 0]"), "in the world's metres: {e}");
    let framing = |framing| fails(ShotDesc { framing, ..desc() });
    let e = framing(FramingDesc { follow: Some(BoneId(99)), ..Default::default() });
    assert!(matches!(e, ViewError::Bone { bone: 99, count: 33, .. }), "{e}");
    for bad in [
        FramingDesc { margin: 0.5, ..Default::default() },
        FramingDesc { zoom: 0.0, ..Default::default() },
        FramingDesc { roll: f32::NAN, ..Default::default() },
    ] {
        let e = framing(bad);
        assert!(matches!(e, ViewError::Number { .. }), "{e}");
    }
    let overlays = |overlays| fails(ShotDesc { overlays, ..desc() });
    let e = overlays(Overlays { paths: vec![path(BoneId(33))], ..Default::default() });
    assert!(matches!(e, ViewError::Bone { .. }), "{e}");
    let step = Onion { before: 1, after: 1, step: 0.0, opacity: 0.5, tint: 0.5 };
    let e = overlays(Overlays { onion: Some(step), ..Default::default() });
    assert!(e.to_string().contains("step of ghosts is 0"), "{e}");
    assert!(matches!(fails(ShotDesc { view: View::Mounted(0), ..desc() }), ViewError::Camera { .. }));
}

#[test]
fn ghosts_are_the_pictures_of_their_moments_put_below() {
    let import = rig("pip");
    let onion = |before, after, opacity, tint| Overlays {
        onion: Some(Onion { before, after, step: 0.1, opacity, tint }),
        ..Default::default()
    };
    let background = [0.2, 0.3, 0.4, 1.0];
    let look = Look { background, ..Default::default() };
    // A place of its own, so that the camera of each moment is the same.
    let plain = ShotDesc { settings: settings(4, 1), ..desc() };

    // Two ghosts of the past, without a tint, by hand.
    let mut want = Image::filled(SIDE, SIDE, background);
    for (t, opacity) in [(0.1, 0.25), (0.2, 0.5), (0.3, 1.0)] {
        Operator::OVER.apply(&linear(&shot(&import, plain.clone()), t), opacity, &mut want);
    }
    let with =
        |overlays| linear(&shot(&import, ShotDesc { overlays, look: look.clone(), ..plain.clone() }), 0.3);
    let near = |a: &Image, b: &Image| {
        let far = a.pixels.iter().zip(&b.pixels).flat_map(|(a, b)| (0..4).map(move |c| (a[c] - b[c]).abs()));
        far.fold(0.0, f32::max)
    };
    assert!(near(&with(onion(2, 0, 0.5, 0.0)), &want) < 1e-5);
    assert!(near(&with(onion(2, 0, 0.5, 0.5)), &want) > 0.05, "a tint shows");

    // Ghosts of no coverage are not there.
    let alone = linear(&shot(&import, ShotDesc { look: look.clone(), ..plain.clone() }), 0.3);
    assert!(near(&with(onion(2, 2, 0.0, 1.0)), &alone) < 1e-6);

    // A clip that is not repeated has nothing before its start.
    let clamped = ShotDesc { overlays: onion(3, 0, 0.5, 0.5), wrap: Wrap::Clamp, look, ..plain };
    let alone = ShotDesc { overlays: Overlays::default(), ..clamped.clone() };
    let (found, want) = (linear(&shot(&import, clamped), 0.0), linear(&shot(&import, alone), 0.0));
    assert!(near(&found, &want) < 1e-6);
}

/// The middle of the white dot, of which there is nothing else in the picture.
fn white(image: &Image) -> [f64; 2] {
    let (mut sum, mut n) = ([0.0; 2], 0.0);
    for (i, _) in image.pixels.iter().enumerate().filter(|(_, p)| p[..3] == [1.0; 3]) {
        sum = [sum[0] + (i % image.width) as f64 + 0.5, sum[1] + (i / image.width) as f64 + 0.5];
        n += 1.0;
    }
    assert!(n > 4.0, "there is no dot");
    sum.map(|s| s / n)
}

#[test]
fn paths_run_where_the_bone_is() {
    let import = rig("octopus");
    let character = &import.asset.character;
    let (eye, target, fov_y) = (DVec3::new(1.0, 2.0, 4.0), DVec3::new(0.1, 0.3, 0.0), 0.6_f64);
    let view = View::LookAt { eye, target, up: Vec3::Y, fov_y: fov_y as f32 };
    for (bone, head) in [(BoneId(9), true), (BoneId(9), false), (BoneId(30), false)] {
        let paths = vec![PathDesc { head, ..path(bone) }];
        let overlays = Overlays { paths, xray: Some(0.0), ..Default::default() };
        let shot = shot(&import, ShotDesc { view, overlays, ..desc() });
        for t in [0.0, 0.4, 1.1] {
            let posed = character.posed(&character.pose(Some(0), t));
            let tip = if head { Vec3::ZERO } else { character.skeleton().tip(bone) };
            let p = posed.world_from_bone(bone).transform_point3(tip.as_dvec3()) - eye;
            // The pinhole camera, anew and in f64.
            let ahead = (target - eye).normalize();
            let right = ahead.cross(DVec3::Y).normalize();
            let scale = 0.5 * SIDE as f64 / ((0.5 * fov_y).tan() * p.dot(ahead));
            let middle = 0.5 * SIDE as f64;
            let want = [middle + scale * p.dot(right), middle - scale * p.dot(right.cross(ahead))];
            let found = white(&linear(&shot, t));
            let off = (found[0] - want[0]).hypot(found[1] - want[1]);
            assert!(off < 0.6, "{bone:?} at {t} s: {found:?}, expected {want:?}");
        }
    }
}

#[test]
fn a_bone_that_is_followed_stays_where_it_is_in_the_picture() {
    let import = rig("octopus");
    let bone = BoneId(20);
    let overlays = Overlays { paths: vec![path(bone)], xray: Some(0.0), ..Default::default() };
    let at = |follow: Option<BoneId>, time: f64| {
        let framing = FramingDesc { follow, ..Default::default() };
        white(&linear(&shot(&import, ShotDesc { framing, overlays: overlays.clone(), ..desc() }), time))
    };
    let moved = |follow| {
        let (a, b) = (at(follow, 0.0), at(follow, 0.8));
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    assert!(moved(None) > 2.0, "{}", moved(None));
    assert!(moved(Some(bone)) < 0.2, "{}", moved(Some(bone)));
}

#[test]
fn every_bone_is_drawn_with_six_triangles_or_marked_with_eight() {
    for name in ["octopus", "robot-arm"] {
        let import = rig(name);
        let triangles = |overlays| {
            let shot = shot(&import, ShotDesc { overlays, ..desc() });
            shot.draw(0.1, &mut Worker::default(), &mut Rgba8::default()).raster.triangles
        };
        let skeleton = import.asset.character.skeleton();
        let want: u64 = skeleton.ids().map(|b| if skeleton.length(b) > 0.0 { 6 } else { 8 }).sum();
        let bones = Some(BonesDesc::default());
        let plain = triangles(Overlays::default());
        assert_eq!(
            triangles(Overlays { bones: bones.clone(), ..Default::default() }) - plain,
            want,
            "{name}"
        );
        assert_eq!(triangles(Overlays { bones, xray: Some(0.3), ..Default::default() }) - plain, want);
    }
}

#[test]
fn an_x_ray_covers_as_much_as_it_says() {
    let import = rig("pip");
    let desc = ShotDesc { overlays: Overlays { xray: Some(0.25), ..Default::default() }, ..desc() };
    let (thin, full) =
        (linear(&shot(&import, desc.clone()), 0.2), ShotDesc { overlays: Overlays::default(), ..desc });
    let full = linear(&shot(&import, full), 0.2);
    for (t, f) in thin.pixels.iter().zip(&full.pixels) {
        assert!((0..4).all(|c| (t[c] - 0.25 * f[c]).abs() < 1e-6), "{t:?} {f:?}");
    }
}

#[test]
fn threads_and_used_workers_change_no_byte_of_overlays() {
    let import = rig("fox");
    let overlays = Overlays {
        onion: Some(Onion { before: 2, after: 1, step: 0.05, opacity: 0.6, tint: 0.7 }),
        paths: vec![path(BoneId(5)), path(BoneId(12))],
        bones: Some(BonesDesc { selected: vec![BoneId(4)] }),
        xray: Some(0.4),
        ..Default::default()
    };
    let draw = |threads, worker: &mut Worker| {
        let desc = ShotDesc { settings: settings(4, threads), overlays: overlays.clone(), ..desc() };
        let mut out = Rgba8::default();
        shot(&import, desc).draw(Moment { time: 0.2, turn: 0.3 }, worker, &mut out);
        out
    };
    let mut used = Worker::default();
    let one = draw(1, &mut used);
    assert!([1, 2, 3].iter().all(|&n| draw(n, &mut used) == one && draw(n, &mut Worker::default()) == one));
    assert_eq!(one.data[..4], [0; 4], "nothing is in the corner");
}
