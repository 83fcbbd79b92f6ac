//! Scene files and the channels of pictures, as users meet them.

use crate::cli::{fails, folder, path, sinew, text};
use glam::Vec3;
use sinew::io::scene::{Setting, notes, ours};
use sinew::io::{self, Options, stl};
use sinew::scene::{Geometry, Source};
use std::path::Path;

const HEAD: &str = r#""camera": {"focal_length": 3, "eye": [0,0,5], "up": [0,1,0], "look": [0,0,-1], "height": 1, "width": 1}"#;

fn of_notes(text: &str) -> Result<sinew::scene::ShapeScene, String> {
    notes::from_bytes(text.as_bytes(), Path::new(".")).map_err(|e| e.to_string())
}

#[test]
fn scenes_of_the_notes_get_what_they_leave_out() {
    let objects = r#""objects": [{"type": "sphere", "center": [0,0,0], "radius": 0.5}]"#;
    let scene = of_notes(&format!("{{{HEAD}, {objects}}}")).unwrap();
    assert_eq!(scene.lights.len(), 1);
    assert_eq!(scene.lights[0].source, Source::Point(glam::DVec3::Z * 5.0));
    assert_eq!(scene.materials[scene.shapes[0].material].diffuse, glam::DVec3::splat(0.8));
    assert_eq!(scene.ambient, glam::DVec3::splat(0.1));
}

#[test]
fn broken_scenes_of_the_notes_say_what_is_wrong() {
    let object = |o: &str| format!("{{{HEAD}, \"objects\": [{o}]}}");
    let camera = |from: &str, to: &str| format!("{{{}, \"objects\": []}}", HEAD.replace(from, to));
    for (text, message) in [
        ("{".into(), "EOF while parsing"),
        (camera("look", "looks"), "unknown field `looks`"),
        (camera("[0,1,0]", "[0,0,2]"), "camera: `look` [0, 0, -1] and `up` [0, 0, 2] leave no picture plane"),
        (camera("\"look\": [0,0,-1]", "\"look\": [0,0,0]"), "`look` has no length"),
        (camera("\"height\": 1", "\"height\": -1"), "`height` must be above 0, found -1"),
        (object(r#"{"type": "cone"}"#), "unknown variant `cone`"),
        (
            object(r#"{"type": "sphere", "center": [0,0,0], "radius": 0}"#),
            "objects[0]: `radius` must be above 0",
        ),
        (
            object(r#"{"type": "sphere", "center": [0,0,0], "radius": 1, "material": "x"}"#),
            "objects[0]: no material is called `x`",
        ),
        (object(r#"{"type": "plane", "point": [0,0,0], "normal": [0,0,0]}"#), "`normal` has no length"),
        (object(r#"{"type": "soup", "stl": "../a.stl"}"#), "`../a.stl` leaves the scene's folder"),
        (object(r#"{"type": "soup", "stl": "there-is-none.stl"}"#), "objects[0]: ./there-is-none.stl: "),
    ] {
        let found = of_notes(&text).expect_err(&text);
        assert!(found.contains(message), "{text}: {found}");
    }
}

#[test]
fn broken_scenes_of_ours_say_what_is_wrong() {
    let shape = |s: &str| format!(r#"{{"sinew_scene": 1, "materials": [{{"name": "a"}}], "shapes": [{s}]}}"#);
    let camera = |c: &str| format!(r#"{{"sinew_scene": 1, "camera": {c}}}"#);
    for (text, message) in [
        (r#"{"sinew_scene": 2}"#.into(), "`sinew_scene` is 2; this version reads 1"),
        (
            r#"{"sinew_scene": 1, "lights": []}"#.into(),
            "unknown field `lights`, expected one of `sinew_scene`",
        ),
        (r#"{"sinew_scene": 1, "samples": 0}"#.into(), "samples: expected a number from 1"),
        (
            r#"{"sinew_scene": 1, "look": {"lamps": [{"kind": "point"}]}}"#.into(),
            "look.lamps[0]: `position` is missing",
        ),
        (
            r#"{"sinew_scene": 1, "materials": [{"name": "a"}, {"name": "a"}]}"#.into(),
            "materials[1]: `a` is there already",
        ),
        (
            r#"{"sinew_scene": 1, "materials": [{"name": "a", "ior": 0}]}"#.into(),
            "`ior` must be a number from 0.1",
        ),
        (shape(r#"{"material": "a"}"#), "shapes[0]: expected one of `sphere`, `plane` and `triangle`"),
        (shape(r#"{"sphere": {"center": [0,0,0], "radius": -1}}"#), "`radius` must be above 0, found -1"),
        (
            shape(r#"{"plane": {"point": [0,0,0], "normal": [0,1,0]}, "material": "b"}"#),
            "shapes[0]: no material is called `b`; `materials` has: a",
        ),
        (camera(r#"{"eye": [0,0,1]}"#), "expected `eye` and `target`, or `yaw_deg` and `pitch_deg`"),
        (camera(r#"{"fov_deg": 170}"#), "`fov_deg` must be a number from 0 to 160"),
    ] {
        let found = ours::from_bytes(text.as_bytes()).expect_err(&text).to_string();
        assert!(found.contains(message), "{text}: {found}");
    }
}

#[test]
fn characters_of_scenes_lie_near_them() {
    let (dir, _) = folder();
    let scenes = dir.path().join("scenes");
    std::fs::create_dir(&scenes).unwrap();
    let write = |character: &str| {
        let text = format!(r#"{{"sinew_scene": 1, "character": "{character}"}}"#);
        std::fs::write(scenes.join("a.json"), text).unwrap();
        io::import(&scenes.join("a.json"), &Options::default()).map_err(|e| e.to_string())
    };
    let import = write("../flag.json").unwrap();
    assert_eq!(import.format, "sinew scene of a sinew rig");
    assert_eq!(import.asset.character.clips().len(), 1);
    for (name, message) in [
        ("../../etc/passwd", "character: "),
        ("/etc/passwd", "`/etc/passwd` leaves the folder above the scene's"),
        ("a.json", "this is a scene; expected a character"),
        ("../no.json", "No such file"),
    ] {
        let found = write(name).expect_err(name);
        assert!(found.contains(message), "{name}: {found}");
    }
}

#[test]
fn every_shipped_scene_is_read_and_no_part_of_one_panics() {
    let home = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/scenes");
    let mut count = 0;
    for file in std::fs::read_dir(home).unwrap().map(|e| e.unwrap().path()) {
        if file.extension().is_none_or(|e| e != "json") {
            continue;
        }
        let import =
            io::import(&file, &Options::default()).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let Some(Setting::Ours(scene)) = &import.setting else { panic!("{}", file.display()) };
        assert!(!scene.shapes.is_empty() && scene.camera.is_some());
        count += 1;
        let text = std::fs::read(&file).unwrap();
        for at in 0..text.len() - 2 {
            assert!(ours::from_bytes(&text[..at]).is_err(), "{at} bytes of {}", file.display());
            let mut broken = text.clone();
            broken[at] = broken[at].wrapping_add(1);
            let _ = ours::from_bytes(&broken);
        }
    }
    assert!(count >= 2);
}

/// Two triangles as binary STL under a head that begins like text.
fn binary_stl(corners: &[[Vec3; 3]]) -> Vec<u8> {
    let mut bytes = b"solid, or so it seems".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((corners.len() as u32).to_le_bytes());
    for t in corners {
        bytes.extend([0; 12]);
        t.iter().flat_map(|p| p.to_array()).for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([7, 7]);
    }
    bytes
}

#[test]
fn both_kinds_of_stl_give_the_same_triangles() {
    let corners = [[Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::new(1.5, -2e-3, 1e10), Vec3::Y, Vec3::Z]];
    let mut text = "SOLID my facet normal\r\n".to_string();
    for t in corners {
        text += "  facet normal 0 0 1\r\n outer loop\n";
        t.iter().for_each(|p| text += &format!("vertex {:e} {} {}\n", p.x, p.y, p.z));
        text += "endloop endfacet\n";
    }
    text += "endsolid my\n solid another\nendsolid another";
    let binary = binary_stl(&corners);
    assert_eq!(stl::parse(&binary).unwrap(), corners);
    assert_eq!(stl::parse(text.as_bytes()).unwrap(), corners);

    // Cut and changed bytes give errors and never panic; what is announced is not allocated.
    for at in 0..binary.len() {
        assert!(stl::parse(&binary[..at]).is_err(), "{at}");
        let mut broken = binary.clone();
        broken[at] ^= 0x7f;
        let _ = stl::parse(&broken);
    }
    (0..text.len()).for_each(|at| drop(stl::parse(&text.as_bytes()[..at])));
    let mut lie = vec![0; 84];
    lie[80..].fill(0xff);
    let message = stl::parse(&lie).unwrap_err().to_string();
    assert!(
        message.contains("announce 4294967295 triangles, so 214748364834 bytes were expected, found 84"),
        "{message}"
    );
    let words = |text: &str| stl::parse(text.as_bytes()).unwrap_err().to_string();
    assert_eq!(words("solid\nfacet normal 0 0 x"), "STL text, line 2: expected a number, found `x`");
    assert_eq!(words("solid\nquad"), "STL text, line 2: expected `facet normal` or `endsolid`, found `quad`");
    assert!(
        words(
            "solid\nfacet normal 0 0 0 outer loop vertex nan 0 0 vertex 0 0 0 vertex 0 0 0 endloop endfacet\nendsolid"
        )
        .contains("finite")
    );
}

/// All channels of a PNG file, as numbers from its codes.
fn codes(path: &str) -> image::DynamicImage {
    image::open(path).unwrap_or_else(|e| panic!("{path}: {e}"))
}

#[test]
fn channels_stand_beside_pictures_and_within_exr() {
    use exr::prelude::*;
    let (dir, input) = folder();
    let (png, exr) = (path(&dir, "a.png"), path(&dir, "a.exr"));
    let names = "id,bone,depth,normal,position,uv";
    let more = ["--size", "48", "--background", "transparent", "--at", "0.3", "--camera", "front"];
    for out in [&png, &exr] {
        let args = ["render", &input, "-o", out, "--channels", names];
        let done = sinew(&[&args[..], &more].concat());
        assert!(done.status.success(), "{}", text(&done.stderr));
    }
    let (code, message) =
        fails(&[&["render", &input, "-o", &path(&dir, "b.gif"), "--channels", "id"], &more[..]].concat());
    assert!(code == 2 && message.contains("channels stand beside single pictures"), "{message}");
    let file = |name: &str| codes(&path(&dir, &format!("a.{name}.png")));
    let picture = codes(&png).to_rgba8();
    let (id, bone) = (file("id").to_rgba8(), file("bone").to_rgba8());
    let (depth, normal) = (file("depth").to_luma16(), file("normal").to_rgba8());
    let (position, uv) = (file("position").to_rgba16(), file("uv").to_rgba16());

    let read = read_all_flat_layers_from_file(&exr).unwrap();
    let channel = |name: &str| {
        let list = &read.layer_data[0].channel_data.list;
        let found = list.iter().find(|c| c.name.to_string() == name).unwrap_or_else(|| panic!("no {name}"));
        found.sample_data.values_as_f32().collect::<Vec<f32>>()
    };
    let mut covered = 0;
    let low_high = |list: &[f32]| list.iter().fold([f32::MAX, f32::MIN], |[l, h], v| [l.min(*v), h.max(*v)]);
    let (ids, depths, alpha) = (channel("id.X"), channel("depth.Z"), channel("A"));
    for (i, (x, y, p)) in picture.enumerate_pixels().enumerate() {
        let there = p[3] > 0;
        covered += usize::from(there);
        assert_eq!((there, there), (alpha[i] > 0.0, ids[i] == 1.0));
        for a in [id.get_pixel(x, y)[3], bone.get_pixel(x, y)[3], normal.get_pixel(x, y)[3]] {
            assert_eq!(a > 0, there, "{x} {y}");
        }
        assert_eq!(depth.get_pixel(x, y)[0] > 0, there);
        assert_eq!(depths[i].is_finite(), there);
        assert_eq!([position.get_pixel(x, y)[3] > 0, uv.get_pixel(x, y)[3] > 0], [there; 2]);
    }
    assert!(covered > 100);
    // The flag is one bone's, at z = 0 by the hinge, and the camera looks along −z.
    let (z, distance) = (
        channel("position.Z"),
        low_high(&depths.iter().copied().filter(|d| d.is_finite()).collect::<Vec<_>>()),
    );
    let sum: Vec<f32> = depths.iter().zip(&z).filter(|d| d.0.is_finite()).map(|(d, z)| d + z).collect();
    let [low, high] = low_high(&sum);
    assert!(high - low < 1e-4 * distance[1] + 0.05 * distance[1], "{low} {high}");
    assert!(channel("bone.X").iter().all(|b| *b == 0.0 || *b == 1.0));
    let unit =
        |i: usize| Vec3::new(channel("normal.X")[i], channel("normal.Y")[i], channel("normal.Z")[i]).length();
    let middle = alpha.iter().position(|a| *a == 1.0).unwrap();
    assert!((unit(middle) - 1.0).abs() < 1e-5);
}

#[test]
fn channels_of_shards_are_those_of_the_whole() {
    let (dir, input) = folder();
    let args = |out: &str| {
        vec![
            "render".to_string(),
            input.clone(),
            "-o".into(),
            path(&dir, out),
            "--size".into(),
            "24".into(),
            "--frames".into(),
            "1-4".into(),
            "--channels".into(),
            "depth,position".into(),
        ]
    };
    let run = |list: Vec<String>| {
        let out = sinew(&list.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(out.status.success(), "{}", text(&out.stderr));
    };
    let manifest = path(&dir, "all.json");
    run([args("w.#.png"), vec!["--manifest".into(), manifest.clone(), "--threads".into(), "1".into()]]
        .concat());
    let parts = ["1/2", "2/2"].map(|shard| {
        let part = path(&dir, &format!("part{}.json", &shard[..1]));
        let shard = ["--shard", shard, "--manifest", &part].map(String::from).to_vec();
        run([args("s.#.png"), shard].concat());
        part
    });
    let bytes = |name: String| std::fs::read(path(&dir, &name)).unwrap();
    for (n, kind) in (1..5).flat_map(|n| ["", ".depth", ".position"].map(|k| (n, k))) {
        assert!(bytes(format!("w.{n}{kind}.png")) == bytes(format!("s.{n}{kind}.png")), "{n}{kind}");
    }
    let list = text(&bytes("all.json".into()));
    assert!(list.contains("w.3.position.png"), "{list}");
    assert!(sinew(&["manifest", "check", &manifest]).status.success());

    // The united manifest knows every file, and what is gone is drawn again.
    let united = path(&dir, "united.json");
    run(["manifest", "merge", &parts[0], &parts[1], "-o", &united].map(String::from).to_vec());
    std::fs::remove_file(path(&dir, "s.2.depth.png")).unwrap();
    assert_eq!(sinew(&["manifest", "check", &united]).status.code(), Some(4));
    run([args("s.#.png"), vec!["--skip-existing".into()]].concat());
    assert!(sinew(&["manifest", "check", &united]).status.success());
}

#[test]
fn a_scene_without_a_camera_holds_its_shapes() {
    let (dir, _) = folder();
    for center in ["[0, 0, 0]", "[30, -2, 5]"] {
        let (scene, out) = (path(&dir, "ball.json"), path(&dir, "ball.png"));
        let text =
            format!(r#"{{"sinew_scene": 1, "shapes": [{{"sphere": {{"center": {center}, "radius": 1}}}}]}}"#);
        std::fs::write(&scene, text).unwrap();
        does(&[
            "render",
            &scene,
            "-o",
            &out,
            "-f",
            "--size",
            "64",
            "--samples",
            "1",
            "--background",
            "transparent",
        ]);
        let bytes = std::fs::read(&out).unwrap();
        let first = sinew::io::picture::frames_of(&bytes).unwrap().next().unwrap().unwrap();
        let picture = first.pixels.into_codes();
        let covered = picture.data.iter().skip(3).step_by(4).filter(|a| **a > 0).count();
        // A ball that fills most of the picture without touching its edge.
        assert!((64 * 64 / 3..64 * 64 * 8 / 10).contains(&covered), "{center}: {covered}");
    }
}

fn shipped(name: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/scenes").join(name);
    file.to_str().expect("UTF-8").into()
}

/// Run and expect success; what was said.
fn does(args: &[&str]) -> String {
    let out = sinew(args);
    assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
    text(&out.stderr)
}

#[test]
fn options_that_do_not_go_together_say_so() {
    let (dir, input) = folder();
    let (out, scene) = (path(&dir, "a.png"), path(&dir, "notes.json"));
    std::fs::write(&scene, format!("{{{HEAD}, \"objects\": []}}")).unwrap();
    for (input, more, message) in [
        (
            &input,
            "--precision f64",
            "--precision is for rays, and the rasterizer draws this; add --renderer ray",
        ),
        (&input, "--renderer raster --budget 2s", "--budget is for rays"),
        (&input, "--samples 9", "--samples 9: the rasterizer takes 1 or 4"),
        (&input, "--renderer ray --budget soon", "expected a time as in 2s, 500ms or 1.5min"),
        (&input, "--renderer ray --adaptive 2", "expected a share of white"),
        (&input, "--renderer ray --samples 0", "1..=65536"),
        (&input, "--channels id --sheet grid", "sheets have --maps"),
        (&scene, "--renderer hybrid", "scenes of the notes are drawn by rays alone"),
        (&scene, "--camera front", "has its own camera"),
        (&scene, "--light sun", "has its own light and materials"),
        (&scene, "--contact 2x2", "does not move"),
    ] {
        let words: Vec<&str> = more.split(' ').collect();
        let (code, found) = fails(&[&["render", input, "-o", &out], &words[..]].concat());
        assert!(code == 2 && found.contains(message), "{more}: {code} {found}");
    }
    assert!(!Path::new(&out).exists());
}

#[test]
fn rays_give_the_same_bytes_whatever_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    let draw = |name: &str, scene: &str, more: &[&str]| {
        let out = path(&dir, name);
        does(&[&["render", &shipped(scene), "-o", &out, "-f", "--size", "64x48"], more].concat());
        std::fs::read(out).unwrap()
    };
    let glass = |more: &[&str]| draw("a.png", "glass.json", more);
    let one = glass(&["--samples", "4", "--threads", "1"]);
    assert!(glass(&["--samples", "4", "--threads", "2"]) == one);
    assert!(glass(&["--samples", "4", "--seed", "1"]) != one);
    assert!(glass(&["--samples", "4", "--ray-depth", "0"]) != one);
    assert!(glass(&["--samples", "4", "--shadow", "none"]) != one);
    let few = ["--adaptive", "0.05", "--samples", "32"];
    let adaptive = glass(&[&few[..], &["--threads", "1"]].concat());
    assert!(glass(&[&few[..], &["--threads", "2"]].concat()) == adaptive);
    // Films draw many pictures at a time.
    let film = |threads: &str| {
        let more = ["--samples", "1", "--frames", "1-3", "--threads", threads];
        draw("a.gif", "mirror-floor.json", &more)
    };
    assert!(film("1") == film("2"));
}

#[test]
fn a_budget_ends_a_picture_that_would_take_hours() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir, "a.png");
    let said = does(&["render", &shipped("glass.json"), "-o", &out, "--size", "32", "--budget", "50ms"]);
    let (_, mean) = said.split_once("a.png\n").expect(&said);
    let mean: f64 = mean.split(' ').next().and_then(|n| n.parse().ok()).expect(&said);
    assert!((1.0..60000.0).contains(&mean), "{said}");
    assert_eq!(codes(&out).to_rgba8().dimensions(), (32, 32));
}

#[test]
fn rays_cover_what_their_channels_say() {
    let dir = tempfile::tempdir().unwrap();
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/fox.json");
    let out = path(&dir, "a.png");
    let args =
        ["render", rig.to_str().unwrap(), "-o", &out, "--size", "96", "--background", "transparent", "-f"];
    for samples in ["1", "4", "9"] {
        let more = ["--renderer", "ray", "--samples", samples, "--channels", "id,bone,depth,normal"];
        does(&[&args[..], &more].concat());
        let file = |name: &str| codes(&path(&dir, &format!("a.{name}.png")));
        let (picture, depth) = (codes(&out).to_rgba8(), file("depth").to_luma16());
        let clear = ["id", "bone", "normal"].map(|name| file(name).to_rgba8());
        let mut covered = 0;
        for (x, y, p) in picture.enumerate_pixels() {
            let there = p[3] > 0;
            covered += usize::from(there);
            assert_eq!(clear.each_ref().map(|c| c.get_pixel(x, y)[3] > 0), [there; 3], "{samples}: {x} {y}");
            assert_eq!(depth.get_pixel(x, y)[0] > 0, there);
        }
        assert!(covered > 1000);
    }
}

#[test]
fn planes_are_moved_with_everything_else() {
    let by = glam::DVec3::new(1.0, -2.0, 3.0);
    let plane = Geometry::Plane { point: by, normal: glam::DVec3::Y };
    assert_eq!(plane.moved(-by), Geometry::Plane { point: glam::DVec3::ZERO, normal: glam::DVec3::Y });
}
