//! Frames of the shipped characters: whole, in the picture, and the same on any number of threads.

use sinew::frames::{Look, Shot, ShotDesc, View, Worker};
use sinew::image::Rgba8;
use sinew::io::{self, Import, Options};
use sinew::render::Settings;
use sinew::render::channel::{Channel, Channels};
use sinew::render::raster::IdImage;
use std::path::PathBuf;

const VIEW: View = View::Orbit { yaw: 0.5, pitch: 0.2, fov_y: 0.5 };

fn rigs() -> Vec<(String, Import)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("rigs");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("rigs/").map(|e| e.expect("rigs/").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "json"));
    files.sort();
    let load = |f: &PathBuf| {
        let import =
            io::import(f, &Options { textures: true }).unwrap_or_else(|e| panic!("{}: {e}", f.display()));
        (f.file_stem().expect("a name").to_string_lossy().into_owned(), import)
    };
    files.iter().map(load).collect()
}

/// A shot of a clip before a colour.
fn shot(import: &Import, clip: usize, background: [f32; 4], settings: Settings) -> Shot<'_> {
    let look = Look { background, ..Default::default() };
    let desc = ShotDesc { clip: Some(clip), view: VIEW, look, settings, ..Default::default() };
    Shot::new(&import.asset, desc).unwrap()
}

fn settings(samples: u8, threads: usize) -> Settings {
    Settings { width: 160, height: 120, samples, threads }
}

#[test]
fn every_character_has_at_least_one_clip_and_all_are_drawn_whole_and_inside() {
    let rigs = rigs();
    assert!(rigs.len() >= 6, "six characters are promised, {} are there", rigs.len());
    let (mut worker, mut picture, mut ids) = (Worker::default(), Rgba8::default(), IdImage::default());
    for (name, import) in &rigs {
        let clips = import.asset.character.clips();
        assert!(!clips.is_empty(), "{name} does not move");
        for (c, clip) in clips.iter().enumerate() {
            let shot = shot(import, c, [0.0; 4], settings(1, 1));
            for k in 0..5 {
                let t = clip.playback().duration() * k as f64 / 5.0;
                shot.draw(t, &mut worker, &mut picture);
                shot.draw_ids(t, &mut worker, &mut ids);
                check(&format!("{name}, {}, {t:.3} s", clip.name), &picture, &ids);
            }
        }
    }
}

/// A pixel has colour exactly where a surface is; none is at the picture's edge, and there are enough.
fn check(what: &str, picture: &Rgba8, ids: &IdImage) {
    let mut covered = 0;
    for (i, object) in ids.objects.iter().enumerate() {
        let alpha = picture.data[4 * i + 3];
        assert_eq!(alpha > 0, *object > 0, "{what}: pixel {i} of object {object} has alpha {alpha}");
        let (x, y) = (i % ids.width, i / ids.width);
        let edge = x == 0 || y == 0 || x == ids.width - 1 || y == ids.height - 1;
        assert!(!(edge && *object > 0), "{what}: {x}, {y} is cut off");
        covered += usize::from(*object > 0);
    }
    assert!(covered > 500, "{what}: {covered} pixels");
}

#[test]
fn threads_do_not_change_a_byte() {
    for (name, import) in &rigs() {
        let picture = |samples, threads| {
            let shot = shot(import, 0, [0.1, 0.2, 0.3, 1.0], settings(samples, threads));
            let mut out = Rgba8::default();
            shot.draw(0.3, &mut Worker::default(), &mut out);
            out
        };
        for samples in [1, 4] {
            let one = picture(samples, 1);
            assert!([2, 3].iter().all(|&n| picture(samples, n) == one), "{name}, {samples} samples");
        }
    }
}

#[test]
fn what_does_not_move_is_not_deformed_again() {
    let rigs = rigs();
    let (mut worker, mut out) = (Worker::default(), Rgba8::default());
    for (name, import) in &rigs {
        let desc = ShotDesc { view: VIEW, settings: settings(1, 1), ..Default::default() };
        let rest = Shot::new(&import.asset, desc).unwrap();
        let first = rest.draw(0.0, &mut worker, &mut out);
        let before = out.clone();
        let second = rest.draw(1.0, &mut worker, &mut out);
        assert!(first.vertices > 0 && second.vertices == 0, "{name}: {} vertices", second.vertices);
        assert!(before == out, "{name}");
        let moving = shot(import, 0, [0.0; 4], settings(1, 1));
        moving.draw(0.0, &mut worker, &mut out);
        assert!(moving.draw(0.3, &mut worker, &mut out).vertices > 0, "{name}");
    }
}

#[test]
fn a_worker_that_drew_something_else_draws_the_same() {
    let rigs = rigs();
    let mut used = Worker::default();
    for (name, import) in &rigs {
        let shot = shot(import, 0, [0.0; 4], settings(4, 1));
        let (mut fresh, mut again) = (Rgba8::default(), Rgba8::default());
        shot.draw(0.2, &mut Worker::default(), &mut fresh);
        shot.draw(0.2, &mut used, &mut again);
        assert!(fresh == again, "{name}");
    }
}

#[test]
fn a_pixel_has_a_surface_exactly_where_it_has_alpha() {
    let (mut worker, mut picture, mut seen) = (Worker::default(), Rgba8::default(), Channels::default());
    for (name, import) in &rigs() {
        for samples in [1, 4] {
            let shot = shot(import, 0, [0.0; 4], settings(samples, 1));
            shot.draw(0.2, &mut worker, &mut picture);
            shot.draw_channels(0.2, &mut worker, &Channel::ALL, &mut seen);
            for (i, p) in picture.data.as_chunks::<4>().0.iter().enumerate() {
                let named = seen.objects[i] > 0 && seen.labels[i] > 0;
                let there = (named, seen.depth[i].is_finite(), seen.normals[i].length() > 0.9);
                let alpha = p[3] > 0;
                assert_eq!(there, (alpha, alpha, alpha), "{name}, {samples} samples, pixel {i}");
            }
        }
    }
}
