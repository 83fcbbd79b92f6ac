//! The program as its users meet it: exit codes, messages, files.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub fn sinew(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sinew")).args(args).output().expect("the program starts")
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Exit code and standard error.
pub fn fails(args: &[&str]) -> (i32, String) {
    let out = sinew(args);
    (out.status.code().expect("it exits by itself"), text(&out.stderr))
}

/// A folder with a rig of one bone and one triangle, waving for a second.
pub fn folder() -> (tempfile::TempDir, String) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let rig = r##"{
  "sinew_rig": 1,
  "bones": [{"name": "flag", "head": [0,0,0], "tail": [1,0,0]}],
  "meshes": [{"name": "cloth", "bind": "closest", "positions": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2]]}],
  "poses": ["flag.poses.json"]
}"##;
    let poses = r##"{"sinew_poses": 1, "clips": [{"name": "wave", "tracks": [
  {"bone": "flag", "xzx_deg": [[0, 0,0,0], [0.5, 0,40,0], [1, 0,0,0]]}]}]}"##;
    std::fs::write(dir.path().join("flag.json"), rig).expect("written");
    std::fs::write(dir.path().join("flag.poses.json"), poses).expect("written");
    let input = path(&dir, "flag.json");
    (dir, input)
}

pub fn path(dir: &tempfile::TempDir, name: &str) -> String {
    dir.path().join(name).to_str().expect("UTF-8").to_string()
}

pub fn files(dir: &Path) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> =
        std::fs::read_dir(dir).expect("readable").map(|e| e.expect("readable").path()).collect();
    all.sort();
    all
}

#[test]
fn every_subcommand_explains_itself_with_examples() {
    for command in ["render", "info", "eval"] {
        let out = sinew(&[command, "--help"]);
        assert!(out.status.success() && text(&out.stdout).contains("Examples:"), "{command}");
    }
    assert!(text(&sinew(&["completions", "bash"]).stdout).contains("_sinew"));
    assert!(text(&sinew(&["man"]).stdout).contains(".TH sinew"));
}

#[test]
fn wrong_usage_is_2_and_bad_input_is_3() {
    let (dir, input) = folder();
    let out = path(&dir, "a.png");
    for (args, code, says) in [
        (vec!["render"], 2, "required"),
        (vec!["render", &input, "-o", "a.jpg"], 2, ".png"),
        (vec!["render", &input, "-o", &out, "--size", "0"], 2, "16384"),
        (vec!["render", &input, "-o", &out, "--camera", "yaw=x"], 2, "expected yaw=DEG"),
        (vec!["render", &input, "-o", &out, "--camera", "front,sideways"], 2, "`sideways` is not understood"),
        (vec!["render", &input, "-o", &out, "--eye", "0,1,2"], 2, "--look-at"),
        (vec!["render", &input, "-o", &out, "--eye", "0,2,0", "--look-at", "0,1,0"], 2, "no picture plane"),
        (vec!["render", &input, "-o", &out, "--crop", "500,0,20,1"], 2, "512x512"),
        (vec!["render", &input, "-o", &out, "--turntable", "0"], 2, "seconds"),
        (vec!["render", &input, "-o", &out, "--path", "flog"], 2, "near names: flag"),
        (vec!["render", &input, "-o", &out, "--follow", "7"], 2, "near names: flag"),
        (vec!["render", &input, "-o", &out, "--onion", "3,0"], 2, "ghosts"),
        (vec!["render", &input, "-o", &out, "--clip", "dance"], 2, "the file has: 0 wave"),
        (vec!["render", &input, "-o", &out, "--frames", "1-48x0"], 2, "step"),
        (vec!["render", &input, "-o", &out, "--frames", "1-2"], 2, "####"),
        (vec!["render", &input, "-o", &out, "--background", "red"], 2, "#rrggbb"),
        (vec!["render", "nowhere.glb", "-o", &out], 3, "nowhere.glb"),
        (vec!["info", dir.path().to_str().unwrap()], 3, "folder"),
        (vec!["info", "/dev/null"], 3, "expected a file"),
        (vec!["eval", &input, "--times", "nan"], 2, "seconds"),
    ] {
        let (got, message) = fails(&args);
        assert_eq!(got, code, "{args:?}: {message}");
        assert!(message.contains(says), "{args:?}: {message}");
    }
    assert_eq!(files(dir.path()).len(), 2, "nothing was written");
}

#[test]
fn a_file_that_is_none_is_named_with_what_was_found() {
    let (dir, _) = folder();
    for (name, bytes, says) in [
        ("empty.glb", &b""[..], "empty"),
        ("noise.bin", &b"\x00\x01\x02"[..], "found bytes"),
        ("other.json", &b"{\"a\": 1}"[..], "sinew_rig"),
        ("half.json", &b"{\"sinew_rig\": 1,"[..], "line 1"),
        ("half.glb", &b"glTF\x02\x00\x00\x00"[..], "GLB"),
    ] {
        let file = path(&dir, name);
        std::fs::write(&file, bytes).unwrap();
        let (code, message) = fails(&["info", &file]);
        assert_eq!(code, 3, "{name}: {message}");
        assert!(message.contains(name) && message.contains(says), "{name}: {message}");
    }
}

#[test]
fn stills_sequences_and_films_are_written_whole_and_never_over_what_exists() {
    let (dir, input) = folder();
    let out = |name: &str| path(&dir, name);
    let run = |name: &str, more: &[&str]| {
        let target = out(name);
        let mut args = vec!["render", &input, "-o", &target, "--size", "48"];
        args.extend(more);
        let o = sinew(&args);
        assert!(o.status.success(), "{}", text(&o.stderr));
    };
    run("still.png", &["--at", "0.5"]);
    run("seq/f.####.png", &["--fps", "8"]);
    run("seq/g.%03d.png", &["--frames", "1-5x2,9"]);
    run("film.gif", &[]);
    run("film.apng", &["--background", "transparent"]);
    let names: Vec<String> = files(&dir.path().join("seq"))
        .iter()
        .map(|p| p.file_name().unwrap().to_str().unwrap().into())
        .collect();
    let mut want: Vec<String> = (1..=8).map(|n| format!("f.{n:04}.png")).collect();
    want.extend(["g.001.png", "g.003.png", "g.005.png", "g.009.png"].map(String::from));
    assert_eq!(names, want);
    assert_eq!(files(dir.path()).len(), 6, "no temporary is left");

    let before = std::fs::read(out("still.png")).unwrap();
    let (code, message) = fails(&["render", &input, "-o", &out("still.png")]);
    assert_eq!(code, 1);
    assert!(message.contains("--force"), "{message}");
    assert_eq!(std::fs::read(out("still.png")).unwrap(), before);
    run("still.png", &["--force"]);
    assert_ne!(std::fs::read(out("still.png")).unwrap(), before);
}

#[test]
fn what_a_rig_lacks_or_loses_is_said() {
    let (dir, input) = folder();
    let said = |args: &[&str]| {
        let out = sinew(args);
        assert!(out.status.success(), "{}", text(&out.stderr));
        text(&out.stderr)
    };
    // Its poses have times of their own beside the keys.
    let poses = r##"{"sinew_poses": 1, "rate": [30, 1], "clips": [{"name": "wave", "range": [0, 1], "tracks": [
  {"bone": "flag", "xzx_deg": [[0, 0,0,0], [1, 0,40,0]]}]}]}"##;
    std::fs::write(path(&dir, "flag.poses.json"), poses).unwrap();
    let warned = said(&["bake", &input, "-o", &path(&dir, "baked.json")]);
    assert!(warned.contains("left out, since bakes may change times: frame rate, ranges\n"), "{warned}");
    assert!(said(&["render", &input, "-o", &path(&dir, "moves.webp"), "--size", "16"]).contains("wrote"));

    // What is wrong with either is said by its name, once.
    let broken = path(&dir, "broken.json");
    std::fs::write(&broken, r#"{"sinew_rig": 1, "bones": 3}"#).unwrap();
    let (code, wrong) = fails(&["info", &broken]);
    assert!(code == 3 && wrong.matches("broken.json").count() == 1 && wrong.contains("column 27"), "{wrong}");
    let cut = path(&dir, "cut.glb");
    std::fs::write(&cut, b"glTF\x02\0\0\0\xff\0\0\0").unwrap();
    let (code, wrong) = fails(&["bake", &cut, "-o", &path(&dir, "out.glb")]);
    assert!(code == 3 && wrong.matches("cut.glb").count() == 1, "{wrong}");
    assert!(wrong.contains("byte 8: expected 255 bytes, as the header says, found 12"), "{wrong}");

    // A rig that was copied without its poses.
    let rig = std::fs::read_to_string(&input).unwrap().replace(",\n  \"poses\": [\"flag.poses.json\"]", "");
    std::fs::write(&input, rig).unwrap();
    let film = said(&["render", &input, "-o", &path(&dir, "rests.webp"), "--size", "16"]);
    assert!(film.contains("there is no clip") && film.contains("../poses/"), "{film}");
    let still = said(&["render", &input, "-o", &path(&dir, "rests.png"), "--size", "16"]);
    assert!(!still.contains("no clip"), "{still}");
}

#[test]
fn a_turntable_is_one_turn_long_and_says_where_the_clip_is_cut() {
    let (dir, input) = folder();
    let run = |folder: &str, more: &[&str]| {
        let target = path(&dir, &format!("{folder}/f.##.png"));
        let mut args = vec!["render", &input, "-o", &target, "--size", "40", "--fps", "4"];
        args.extend(more);
        let o = sinew(&args);
        assert!(o.status.success(), "{}", text(&o.stderr));
        let read = |p: &PathBuf| std::fs::read(p).unwrap();
        (files(&dir.path().join(folder)).iter().map(read).collect::<Vec<_>>(), text(&o.stderr))
    };
    let (frames, note) = run("clip", &["--turntable", "1.5"]);
    assert_eq!(frames.len(), 6);
    assert!(note.contains("--turntable 2 shows it 2 times"), "{note}");
    let (frames, note) = run("fits", &["--turntable", "2"]);
    assert!(frames.len() == 8 && !note.contains("is cut"), "{note}");

    // At rest the frame after the last is the first, and none before it.
    let (frames, _) = run("rest", &["--turntable", "1.5", "--rest", "--frames", "1-7"]);
    assert!(frames[6] == frames[0] && (1..6).all(|k| frames[k] != frames[0]));
    let (default, _) = run("default", &["--turntable", "--rest"]);
    assert_eq!(default.len(), 16, "four seconds");
}

#[test]
fn the_same_command_gives_the_same_bytes_on_any_number_of_threads() {
    let (dir, input) = folder();
    for name in ["a.png", "a.gif", "a.apng"] {
        let bytes: Vec<Vec<u8>> = ["1", "2", "7"]
            .iter()
            .map(|threads| {
                let target = path(&dir, name);
                let o =
                    sinew(&["render", &input, "-o", &target, "--size", "200x90", "--threads", threads, "-f"]);
                assert!(o.status.success(), "{}", text(&o.stderr));
                std::fs::read(target).unwrap()
            })
            .collect();
        assert!(bytes[0] == bytes[1] && bytes[1] == bytes[2], "{name}");
    }
}

#[test]
fn eval_and_info_speak_json() {
    let (_dir, input) = folder();
    let out = sinew(&["eval", &input, "--times", "-1,0.5,9", "--json"]);
    let v: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert_eq!(v["schema"], 1);
    let samples = v["samples"].as_array().unwrap();
    assert_eq!(samples.len(), 3);
    let tip = |i: usize| samples[i]["bones"]["0"]["tip"][0].as_f64().unwrap();
    assert!((tip(0) - 1.0).abs() < 1e-6 && (tip(2) - 1.0).abs() < 1e-6, "times outside hold the ends");
    assert!((tip(1) - 40_f64.to_radians().cos()).abs() < 1e-6);
    assert_eq!(samples[0]["prims"][0]["count"], 3);

    let out = sinew(&["info", &input, "--json"]);
    let v: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert_eq!((&v["meshes"][0]["V"], &v["meshes"][0]["closed"]), (&3.into(), &false.into()));
    assert_eq!(v["clips"][0]["name"], "wave");

    let out = sinew(&["info", &input, "--intersections", "--at", "0.5", "--clip", "wave", "--json"]);
    let v: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert_eq!(v["intersections"], serde_json::json!({ "clip": 0, "t": 0.5, "count": 0, "pairs": [] }));
}

#[test]
fn a_skeleton_without_triangles_is_drawn_empty_with_a_warning() {
    let (dir, _) = folder();
    let bare = path(&dir, "bare.json");
    std::fs::write(&bare, r#"{"sinew_rig": 1, "bones": [{"name": "a", "head": [0,0,0], "tail": [1,0,0]}]}"#)
        .unwrap();
    let out = sinew(&["render", &bare, "-o", &path(&dir, "bare.png"), "--size", "16"]);
    assert!(out.status.success());
    assert!(text(&out.stderr).contains("no triangles"), "{}", text(&out.stderr));
}

#[test]
fn a_loop_goes_on_beyond_its_end() {
    let (dir, input) = folder();
    let draw = |set: &str, wrap: &str| {
        let target = path(&dir, "f.png");
        let o = sinew(&[
            "render", &input, "-o", &target, "--frames", set, "--fps", "8", "--wrap", wrap, "--size", "48",
            "-f",
        ]);
        assert!(o.status.success(), "{}", text(&o.stderr));
        std::fs::read(target).unwrap()
    };
    // A second at 8 a second: frame 11 is frame 3 again, or 7 on the way back, or the end.
    assert!(draw("11", "loop") == draw("3", "clamp") && draw("11", "loop") != draw("11", "clamp"));
    assert!(draw("12", "ping-pong") == draw("6", "clamp"));
}

#[test]
fn the_input_is_never_overwritten() {
    let (dir, input) = folder();
    let disguised = path(&dir, "flag.gif");
    std::fs::copy(&input, &disguised).unwrap();
    let (code, message) = fails(&["render", &disguised, "-o", &disguised, "--force"]);
    assert_eq!(code, 2);
    assert!(message.contains("this is an input"), "{message}");
    assert!(std::fs::read(&disguised).unwrap() == std::fs::read(&input).unwrap());
}

#[test]
fn nobody_listening_on_standard_error_is_no_failure() {
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full");
    let run = |args: &[&str]| {
        let mut c = Command::new(env!("CARGO_BIN_EXE_sinew"));
        c.args(args).stderr(full()).stdout(std::process::Stdio::null()).status().expect("it starts").code()
    };
    let (dir, input) = folder();
    assert_eq!(run(&["info", "nowhere.glb"]), Some(3));
    assert_eq!(run(&["render", &input, "-v", "-o", &path(&dir, "a.gif"), "--size", "32"]), Some(0));
}

#[test]
fn names_from_files_do_not_steer_the_terminal() {
    let (dir, input) = folder();
    let rig =
        std::fs::read_to_string(&input).unwrap().replace("\"cloth\"", "\"\\u001b[31mred\\nclip 9: forged\"");
    let evil = path(&dir, "evil.json");
    std::fs::write(&evil, rig).unwrap();
    let out = sinew(&["info", &evil]);
    let said = text(&out.stdout);
    assert!(out.status.success() && !said.contains('\x1b') && !said.contains("\nclip 9"), "{said}");
}

#[test]
fn interrupting_leaves_no_half_file() {
    for signal in ["-INT", "-TERM"] {
        let (dir, input) = folder();
        let target = path(&dir, "long.apng");
        let mut child = Command::new(env!("CARGO_BIN_EXE_sinew"))
            .args(["render", &input, "-o", &target, "--size", "1024", "--frames", "1-5000", "-q"])
            .spawn()
            .expect("the program starts");
        // Until it has begun to write; a file that is not complete may have no name yet.
        std::thread::sleep(std::time::Duration::from_millis(300));
        assert!(child.try_wait().expect("it runs").is_none(), "5000 frames take longer");
        let kill = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill runs");
        assert!(kill.success());
        assert_eq!(child.wait().expect("it ends").code(), Some(130));
        assert_eq!(files(dir.path()).len(), 2, "{signal}: {:?}", files(dir.path()));
    }
}
