//! Sheets: nothing overlaps, what is cut out again is what was drawn, and the files beside it say so.

use crate::cli::{fails, folder, path, sinew, text};
use crate::rng::Rng;
use image::RgbaImage;
use serde_json::Value;
use sinew::frames::{FramingDesc, Moment, Pivot, Shot, ShotDesc, Turns, View, Worker, ground_point};
use sinew::image::Rgba8;
use sinew::io::{self, Import, Options};
use sinew::render::Settings;
use sinew::sheet::{
    Canvas, Layout, Limits, Margins, Packing, Rect, SheetError, directions, grid, pack, visible,
};
use std::collections::BTreeSet;
use std::path::Path;

fn rig(name: &str) -> Import {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs").join(name);
    io::import(&file, &Options { textures: true }).expect("a shipped rig")
}

fn rig_path(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs").join(name).to_str().expect("UTF-8").into()
}

/// Run and expect success.
fn does(args: &[&str]) {
    let out = sinew(args);
    assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
}

fn picture(path: &str) -> RgbaImage {
    image::open(path).unwrap_or_else(|e| panic!("{path}: {e}")).to_rgba8()
}

fn json(path: &str) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap_or_else(|e| panic!("{path}: {e}"))).expect("JSON")
}

fn rect(v: &Value) -> Rect {
    let n = |k: &str| v[k].as_u64().unwrap_or_else(|| panic!("{v}: {k}")) as usize;
    Rect { x: n("x"), y: n("y"), w: n("w"), h: n("h") }
}

/// A place with all that belongs to it, everything moved on so that nothing is below zero.
fn grown(r: &Rect, by: usize) -> Rect {
    Rect { x: r.x + 100 - by, y: r.y + 100 - by, w: r.w + 2 * by, h: r.h + 2 * by }
}

fn check_layout(layout: &Layout, sizes: &[[usize; 2]], m: Margins) {
    assert_eq!(layout.places.len(), sizes.len());
    for (i, a) in layout.places.iter().enumerate() {
        assert_eq!(a.size(), sizes[i]);
        let clear = m.extrude + m.around;
        assert!(a.x >= clear && a.x + a.w + clear <= layout.size[0], "{a:?} in {:?}", layout.size);
        assert!(a.y >= clear && a.y + a.h + clear <= layout.size[1], "{a:?} in {:?}", layout.size);
        for b in &layout.places[..i] {
            // With its own extrusion and the gap, a frame keeps off the other's extrusion.
            let (a, b) = (grown(a, m.extrude + m.between), grown(b, m.extrude));
            assert!(!a.overlaps(&b), "{a:?} {b:?}");
        }
    }
}

#[test]
fn packed_frames_do_not_overlap_and_the_sheet_is_not_much_larger_than_they_are() {
    let mut rng = Rng::new(3);
    for k in 0..24 {
        let count = [1, 2, 7, 60, 200][k % 5];
        let most = [4, 40, 120][k % 3];
        let mut side = || 1 + (rng.next() % most) as usize;
        let sizes: Vec<[usize; 2]> = (0..count).map(|_| [side(), side()]).collect();
        let margins = Margins { between: k % 3, around: k % 4, extrude: (k / 2) % 3 };
        for power_of_two in [false, true] {
            let packing = Packing { margins, power_of_two, limits: Limits::default() };
            let layout = pack(&sizes, packing).unwrap();
            check_layout(&layout, &sizes, margins);
            assert_eq!(pack(&sizes, packing).unwrap(), layout);
            if power_of_two {
                assert!(layout.size.iter().all(|s| s.is_power_of_two()), "{:?}", layout.size);
            } else if count >= 60 && most >= 40 && margins == Margins::default() {
                let area: usize = sizes.iter().map(|s| s[0] * s[1]).sum();
                let share = area as f64 / (layout.size[0] * layout.size[1]) as f64;
                assert!(share > 0.85, "{count} frames fill {share}");
            }
        }
    }
}

#[test]
fn thousands_of_frames_are_packed() {
    let sizes: Vec<[usize; 2]> = (0..2000).map(|i| [1 + i % 3, 1 + i % 2 * 9]).collect();
    let layout = pack(&sizes, Packing::default()).unwrap();
    let area: usize = sizes.iter().map(|s| s[0] * s[1]).sum();
    assert!(area as f64 > 0.9 * (layout.size[0] * layout.size[1]) as f64, "{:?}", layout.size);
}

#[test]
fn a_grid_has_its_frames_in_rows() {
    let margins = Margins { between: 3, around: 2, extrude: 1 };
    let layout = grid(10, [8, 5], 4, margins, Limits::default()).unwrap();
    check_layout(&layout, &[[8, 5]; 10], margins);
    assert_eq!(layout.size, [2 * 2 + 4 * 10 + 3 * 3, 2 * 2 + 3 * 7 + 2 * 3]);
    assert!(layout.places.is_sorted_by_key(|r| (r.y, r.x)));
}

#[test]
fn what_is_too_large_is_refused_with_its_size() {
    let error = grid(1000, [512, 512], 1000, Margins::default(), Limits::default()).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("512000 × 512") && message.contains("16384"), "{message}");
    let many = vec![[100, 100]; 20];
    let limits = Limits { side: 300, pixels: 1 << 20 };
    let full = pack(&many, Packing { limits, ..Default::default() });
    assert!(matches!(full, Err(SheetError::TooFull { found: 200_000, .. })), "{full:?}");
    assert!(matches!(
        pack(&vec![[1, 1]; 5000], Packing::default()),
        Err(SheetError::TooMany { found: 5000, .. })
    ));
    assert!(pack(&[[0, 3]], Packing::default()).is_err());
    assert!(grid(usize::MAX, [usize::MAX; 2], 7, Margins::default(), Limits::default()).is_err());
}

#[test]
fn extruded_edges_repeat_the_last_pixels() {
    let layout = grid(1, [2, 2], 1, Margins { extrude: 1, ..Default::default() }, Limits::default()).unwrap();
    let mut canvas = Canvas::new(&layout, 0);
    canvas.put(layout.places[0], &[1, 2, 3, 4], 1);
    assert_eq!(canvas.pixels, [1, 1, 2, 2, 1, 1, 2, 2, 3, 3, 4, 4, 3, 3, 4, 4]);
}

/// The shot that the program sets up for `--directions 8 --camera yaw=0,pitch=30,ortho --size 56x64`.
fn eight_sides(import: &Import, yaw: f32) -> Shot<'_> {
    let clip = Some(0);
    let framing = FramingDesc {
        turns: Turns::Each(8),
        pivot: Pivot::At(ground_point(&import.asset, clip)),
        ..Default::default()
    };
    let settings = Settings { width: 56, height: 64, samples: 4, threads: 1 };
    let view = View::Orbit { yaw: yaw.to_radians(), pitch: 30f32.to_radians(), fov_y: 0.0 };
    Shot::new(&import.asset, ShotDesc { clip, view, framing, settings, ..Default::default() }).unwrap()
}

const SIDES: [&str; 12] = [
    "--directions",
    "8",
    "--camera",
    "yaw=0,pitch=30,ortho",
    "--size",
    "56x64",
    "--fps",
    "5",
    "--padding",
    "2",
    "--extrude",
    "1",
];

#[test]
fn pivots_of_a_crop_count_from_its_corner() {
    let dir = tempfile::tempdir().unwrap();
    let input = rig_path("pip.json");
    let pivot = |name: &str, more: &[&str]| {
        let out = path(&dir, &format!("{name}.png"));
        let fixed =
            ["render", &input, "-o", &out, "--sheet", "grid", "--size", "64", "--fps", "2", "--clip", "walk"];
        does(&[&fixed[..], more].concat());
        let json = json(&path(&dir, &format!("{name}.json")));
        let first = json["frames"].as_object().unwrap().values().next().unwrap()["pivot"].clone();
        ["x", "y"].map(|axis| first[axis].as_f64().unwrap())
    };
    let ([x, y], part) = (pivot("whole", &[]), pivot("part", &["--crop", "10,12,40,30"]));
    let want = [(x * 64.0 - 10.0) / 40.0, (y * 64.0 - 12.0) / 30.0];
    assert!((0..2).all(|i| (part[i] - want[i]).abs() < 1e-5), "{part:?} {want:?}");
}

/// A frame as it was, put together again from the sheet.
fn restored(sheet: &RgbaImage, frame: &Value) -> Rgba8 {
    let (place, trim) = (rect(&frame["frame"]), rect(&frame["spriteSourceSize"]));
    let n = |k: &str| frame["sourceSize"][k].as_u64().unwrap() as usize;
    let (width, height) = (n("w"), n("h"));
    let mut data = vec![0; 4 * width * height];
    for (x, y) in (0..place.h).flat_map(|y| (0..place.w).map(move |x| (x, y))) {
        let pixel = sheet.get_pixel((place.x + x) as u32, (place.y + y) as u32).0;
        let at = 4 * ((trim.y + y) * width + trim.x + x);
        data[at..at + 4].copy_from_slice(&pixel);
    }
    Rgba8 { width, height, data }
}

#[test]
fn frames_cut_out_of_a_sheet_are_the_frames_drawn_one_by_one() {
    let dir = tempfile::tempdir().unwrap();
    let import = rig("pip.json");
    let shot = eight_sides(&import, 0.0);
    for (kind, style) in [("trimmed", "texturepacker"), ("grid", "texturepacker-array")] {
        let out = path(&dir, &format!("{kind}.png"));
        let fixed = ["render", &rig_path("pip.json"), "-o", &out, "--sheet", kind, "--sheet-json", style];
        does(&[&fixed[..], &SIDES].concat());
        let (sheet, json) = (picture(&out), json(&out.replace(".png", ".json")));
        let meta = &json["meta"];
        assert_eq!(
            [&meta["app"], &meta["image"], &meta["format"]],
            ["sinew", &*format!("{kind}.png"), "RGBA8888"]
        );
        assert_eq!(
            (meta["size"]["w"].as_u64(), meta["scale"].as_str()),
            (Some(sheet.width().into()), Some("1"))
        );
        let per_side =
            json["frames"].as_object().map_or_else(|| json["frames"].as_array().unwrap().len(), |f| f.len())
                / 8;
        assert!(per_side >= 3);
        let mut drawn = Rgba8::default();
        let (mut worker, mut trimmed) = (Worker::default(), 0);
        for (k, side) in directions(8).iter().enumerate() {
            for n in 1..=per_side {
                let name = format!("walk/{}/{n:04}", side.name);
                let frame = match style {
                    "texturepacker" => json["frames"][&name].clone(),
                    _ => json["frames"][k * per_side + n - 1].clone(),
                };
                if style == "texturepacker-array" {
                    assert_eq!(frame["filename"], *name);
                }
                let time = shot.range().start + (n - 1) as f64 / 5.0;
                shot.draw(Moment { time, turn: side.turn }, &mut worker, &mut drawn);
                assert!(restored(&sheet, &frame) == drawn, "{kind}: {name} is another picture");
                assert_eq!(frame["rotated"], false);
                let whole = rect(&frame["spriteSourceSize"]) == Rect::whole([56, 64]);
                assert_eq!(frame["trimmed"].as_bool(), Some(!whole), "{name}");
                trimmed += usize::from(!whole);
                let want =
                    shot.project(Moment { time, turn: side.turn }, shot.ground_point(), &mut worker).unwrap();
                for (axis, want) in ["x", "y"].iter().zip(want) {
                    assert!((frame["pivot"][axis].as_f64().unwrap() - want).abs() < 1e-6, "{name}");
                }
            }
        }
        assert_eq!(trimmed > 0, kind == "trimmed");
        if style == "texturepacker" {
            assert_eq!(json["animations"]["walk/sw"].as_array().unwrap().len(), per_side);
            assert_eq!(json["animations"]["walk/sw"][1], "walk/sw/0002");
        }
    }
}

#[test]
fn a_direction_is_the_view_from_there_and_its_name_says_where_the_character_looks() {
    let import = rig("fox.json");
    let (front, mut worker) = (eight_sides(&import, 0.0), Worker::default());
    let ahead = front.ground_point() + glam::DVec3::Z * 0.3;
    let stand = front.project(0.0, front.ground_point(), &mut worker).unwrap();
    for (k, side) in directions(8).iter().enumerate() {
        let moment = Moment { time: 0.1, turn: side.turn };
        let (mut turned, mut there) = (Rgba8::default(), Rgba8::default());
        front.draw(moment, &mut worker, &mut turned);
        eight_sides(&import, 45.0 * k as f32).draw(0.1, &mut worker, &mut there);
        let close = |(a, b): (&u8, &u8)| a.abs_diff(*b) <= 4;
        let same = turned.data.iter().zip(&there.data).filter(|p| close(*p)).count();
        assert!(same as f64 > 0.99 * turned.data.len() as f64, "{}: {same}", side.name);

        // The point before the character is where the name says; the map's bottom is near the viewer.
        let p = front.project(moment, ahead, &mut worker).unwrap();
        let (right, down) = (p[0] - stand[0], p[1] - stand[1]);
        let said = |c: char| side.name.contains(c);
        assert!(right > 0.01 || !said('e'), "{}: {right}", side.name);
        assert!(right < -0.01 || !said('w'), "{}: {right}", side.name);
        assert!(down > 0.01 || !said('s'), "{}: {down}", side.name);
        assert!(down < -0.01 || !said('n'), "{}: {down}", side.name);
        // The pivot is the same from all sides.
        let pivot = front.project(moment, front.ground_point(), &mut worker).unwrap();
        assert!((0..2).all(|i| (pivot[i] - stand[i]).abs() < 1e-5), "{}: {pivot:?} {stand:?}", side.name);
    }
}

#[test]
fn aseprite_files_have_tags_durations_and_a_pivot() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir, "sheet.png");
    let fixed =
        ["render", &rig_path("pip.json"), "-o", &out, "--sheet", "trimmed", "--sheet-json", "aseprite"];
    does(&[&fixed[..], &["--pivot", "0.25,0.75"], &SIDES].concat());
    let json = json(&path(&dir, "sheet.json"));
    let (frames, tags) = (json["frames"].as_array().unwrap(), json["meta"]["frameTags"].as_array().unwrap());
    let names: Vec<&str> = tags.iter().map(|t| t["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["s", "sw", "w", "nw", "n", "ne", "e", "se"].map(|d| format!("walk/{d}")));
    let mut next = 0;
    for tag in tags {
        assert_eq!((tag["from"].as_u64(), tag["direction"].as_str()), (Some(next), Some("forward")));
        next = tag["to"].as_u64().unwrap() + 1;
    }
    assert_eq!(next, frames.len() as u64);
    for (i, frame) in frames.iter().enumerate() {
        assert_eq!(
            (frame["filename"].as_str(), frame["duration"].as_u64()),
            (Some(&*i.to_string()), Some(200))
        );
    }
    let keys = json["meta"]["slices"][0]["keys"].as_array().unwrap();
    assert_eq!(keys.len(), 1);
    assert_eq!([&keys[0]["pivot"]["x"], &keys[0]["pivot"]["y"], &keys[0]["frame"]], [14, 48, 0]);
}

#[test]
fn equal_frames_are_stored_once() {
    let (dir, input) = folder();
    let out = path(&dir, "still.png");
    does(&["render", &input, "-o", &out, "--sheet", "trimmed", "--rest", "--frames", "1-5", "--size", "40"]);
    let json = json(&path(&dir, "still.json"));
    let frames: Vec<&Value> = json["frames"].as_object().unwrap().values().collect();
    assert_eq!(frames.len(), 5);
    assert!(frames.iter().all(|f| f["frame"] == frames[0]["frame"]));
    let place = rect(&frames[0]["frame"]);
    let sheet = picture(&out);
    assert_eq!([sheet.width(), sheet.height()], [place.w as u32 + 2, place.h as u32 + 2]);
}

#[test]
fn threads_do_not_change_a_byte_of_a_sheet_or_of_what_lies_beside_it() {
    let dir = tempfile::tempdir().unwrap();
    let files = |threads: &str, more: &[&str]| {
        let out = path(&dir, "t.png");
        let fixed = ["render", &rig_path("fox.json"), "-o", &out, "-f", "--threads", threads, "--size", "48"];
        does(&[&fixed[..], more].concat());
        ["t.png", "t.json", "t.normal.png", "t.depth.png", "t.id.png"]
            .map(|f| std::fs::read(path(&dir, f)).ok())
    };
    for more in [
        &["--sheet", "trimmed", "--directions", "3", "--fps", "6", "--maps", "normal,depth,id"][..],
        &["--sheet", "grid", "--pixel-art", "--pixel-outline", "--maps", "id,normal,depth", "--fps", "6"],
        &["--contact", "3x2", "--pixel-art", "--colors", "8"],
    ] {
        let one = files("1", more);
        assert!(one[0].is_some() && files("2", more) == one && files("3", more) == one, "{more:?}");
    }
}

#[test]
fn maps_say_something_wherever_the_sheet_is_visible() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir, "m.png");
    for more in [&[][..], &["--pixel-art", "--pixel-scale", "2", "--pixel-outline"]] {
        let fixed = ["render", &rig_path("koi.json"), "-o", &out, "-f", "--sheet", "trimmed", "--fps", "4"];
        does(&[&fixed[..], &["--size", "64", "--maps", "normal,depth,id"], more].concat());
        let map = |name: &str| image::open(path(&dir, &format!("m.{name}.png"))).unwrap();
        let (color, normal) = (picture(&out), map("normal").to_rgba8());
        let (depth, id) = (map("depth").to_luma16(), map("id").to_rgba8());
        let (mut seen, mut leaning) = (0, 0);
        for (x, y, p) in color.enumerate_pixels() {
            let n = normal.get_pixel(x, y).0;
            assert_eq!(n[3], p[3], "alpha at {x}, {y}");
            assert_eq!(
                (depth.get_pixel(x, y)[0] > 0, id.get_pixel(x, y)[3] > 0),
                (p[3] > 0, p[3] > 0),
                "{x}, {y}"
            );
            if p[3] > 0 {
                let v = [0, 1, 2].map(|i| f64::from(n[i]) / 127.5 - 1.0);
                let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
                assert!((length - 1.0).abs() < 0.02 && v[2] > -0.4, "{v:?} at {x}, {y}");
                seen += 1;
                leaning += usize::from(v[2] < 0.7);
            }
        }
        assert!(seen > 500 && leaning > seen / 20, "{leaning} of {seen}");
        let json = json(&path(&dir, "m.json"));
        let maps = &json["meta"]["sinew"]["maps"];
        assert!(maps["depth"]["near"].as_f64().unwrap() < maps["depth"]["far"].as_f64().unwrap());
        assert_eq!(maps["normal"]["image"], "m.normal.png");
        let objects = rig("koi.json").asset.character.instances().len();
        assert_eq!(maps["id"]["objects"].as_array().unwrap().len(), objects);
        // White is nearest, and something is.
        assert_eq!(depth.pixels().map(|p| p[0]).max(), Some(u16::MAX));
    }
}

#[test]
fn contact_sheets_show_the_clip_from_end_to_end() {
    let (dir, input) = folder();
    let there =
        std::fs::read_to_string(path(&dir, "flag.poses.json")).unwrap().replace("[1, 0,0,0]", "[1, 0,80,0]");
    std::fs::write(path(&dir, "away.json"), there).unwrap();
    let import = io::import(Path::new(&input), &Options::default()).unwrap();
    for (poses, steps) in [("flag.poses.json", 6.0), ("away.json", 5.0)] {
        let out = path(&dir, "c.png");
        let fixed = ["render", &input, "-o", &out, "-f", "--poses", &path(&dir, poses), "--contact", "3x2"];
        does(&[&fixed[..], &["--size", "40x30", "--background", "transparent"]].concat());
        let sheet = picture(&out);
        assert_eq!([sheet.width(), sheet.height()], [3 * 40 + 4 * 2, 2 * 30 + 3 * 2]);
        let mut posed = import.clone();
        let clips = io::rig_json::poses_from_bytes(
            &std::fs::read(path(&dir, poses)).unwrap(),
            &import.asset.character,
        );
        posed.asset.character = import.asset.character.clone().with_clips(clips.unwrap()).unwrap();
        let settings = Settings { width: 40, height: 30, ..Default::default() };
        let shot =
            Shot::new(&posed.asset, ShotDesc { clip: Some(0), settings, ..Default::default() }).unwrap();
        let mut drawn = Rgba8::default();
        for k in 0..6 {
            shot.draw(k as f64 / steps, &mut Worker::default(), &mut drawn);
            let (left, top) = (2 + k % 3 * 42, 2 + k / 3 * 32);
            let cell = image::imageops::crop_imm(&sheet, left as u32, top as u32, 40, 30).to_image();
            assert!(cell.into_raw() == drawn.data, "{poses}: cell {k}");
        }
    }
}

/// Colours of the visible pixels.
fn colors(picture: &RgbaImage) -> BTreeSet<[u8; 3]> {
    picture.pixels().filter(|p| p[3] > 0).map(|p| [p[0], p[1], p[2]]).collect()
}

#[test]
fn pixel_art_has_few_colors_no_partial_alpha_and_square_pixels() {
    let dir = tempfile::tempdir().unwrap();
    let fixed = |out: &str, more: &[&str]| {
        let input = rig_path("fox.json");
        let args =
            ["render", &input, "-o", out, "--pixel-art", "--size", "96", "--pixel-scale", "3", "--fps", "8"];
        does(&[&args[..], more].concat());
    };
    // A sequence: each file with the palette, transparent.
    let sequence = path(&dir, "p.##.png");
    fixed(&sequence, &["--colors", "7", "--pixel-outline", "#102030", "--background", "transparent"]);
    let mut all = BTreeSet::new();
    for n in 1..=2 {
        let file = path(&dir, &format!("p.{n:02}.png"));
        let bytes = std::fs::read(&file).unwrap();
        let info = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        assert_eq!(info.info().color_type, png::ColorType::Indexed);
        assert!(info.info().palette.as_ref().unwrap().len() <= 3 * 8);
        let picture = picture(&file);
        assert!(picture.pixels().all(|p| p[3] == 0 || p[3] == 255));
        assert!(picture.enumerate_pixels().all(|(x, y, p)| picture.get_pixel(x / 3 * 3, y / 3 * 3) == p));
        all.extend(colors(&picture));
    }
    assert!(all.len() <= 7 && all.contains(&[0x10, 0x20, 0x30]), "{all:?}");

    // A film over a background, in the colours of a file.
    let palette = path(&dir, "four.hex");
    std::fs::write(&palette, "000000\nffffff\nff8800\n884400\n").unwrap();
    let film = path(&dir, "p.gif");
    fixed(&film, &["--palette", &palette, "--palette-dither", "floyd-steinberg"]);
    let bytes = std::fs::read(&film).unwrap();
    let first = io::picture::frames_of(&bytes).unwrap().next().expect("a frame").unwrap().pixels.into_codes();
    let (width, height) = (first.width as u32, first.height as u32);
    let first = RgbaImage::from_raw(width, height, first.data).expect("all of it");
    assert!(first.pixels().all(|p| p[3] == 255) && colors(&first).len() <= 4, "{:?}", colors(&first));
    assert_eq!([first.width(), first.height()], [96, 96]);
}

#[test]
fn what_cannot_be_meant_is_refused_before_anything_is_written() {
    let (dir, input) = folder();
    let out = path(&dir, "a.png");
    let before = crate::cli::files(dir.path()).len();
    let gif = path(&dir, "a.gif");
    for (args, code, says) in [
        (vec!["-o", &gif, "--sheet", "grid"], 2, "a sheet is one picture"),
        (vec!["-o", &out, "--directions", "8"], 2, "--sheet"),
        (vec!["-o", &out, "--sheet", "grid", "--directions", "65"], 2, "64"),
        (vec!["-o", &out, "--sheet", "round"], 2, "grid or trimmed"),
        (vec!["-o", &out, "--columns", "3"], 2, "--sheet"),
        (vec!["-o", &out, "--sheet", "grid", "--pivot", "a"], 2, "0.5,1"),
        (vec!["-o", &out, "--sheet", "grid", "--maps", "light"], 2, "normal, depth or id"),
        (vec!["-o", &out, "--contact", "0x4"], 2, "6x4"),
        (vec!["-o", &out, "--contact", "2x2", "--sheet", "grid"], 2, "cannot be used with"),
        (vec!["-o", &out, "--pixel-art", "--size", "64", "--pixel-scale", "5"], 2, "65x65"),
        (vec!["-o", &out, "--colors", "8"], 2, "--pixel-art"),
        (vec!["-o", &out, "--sheet", "grid", "--power-of-two"], 2, "--sheet trimmed"),
        (vec!["-o", &out, "--sheet", "grid", "--size", "4096", "--columns", "9"], 1, "36864 ×"),
        (vec!["-o", &path(&dir, "flag.png"), "--sheet", "grid", "--force"], 2, "this is an input"),
    ] {
        let args = [&["render", &input][..], &args].concat();
        let (got, message) = fails(&args);
        assert_eq!(got, code, "{args:?}: {message}");
        assert!(message.contains(says), "{args:?}: {message}");
    }
    assert_eq!(crate::cli::files(dir.path()).len(), before, "nothing was written");
}

#[test]
fn visible_parts_are_found_in_every_corner() {
    for (x, y) in [(0, 0), (6, 0), (0, 4), (6, 4), (3, 2)] {
        let mut pixels = [0u8; 35];
        pixels[y * 7 + x] = 1;
        assert_eq!(visible(&pixels, 7, |p| *p > 0), Rect { x, y, w: 1, h: 1 });
    }
    assert_eq!(visible(&[0u8; 35], 7, |p| *p > 0).size(), [1, 1]);
}
