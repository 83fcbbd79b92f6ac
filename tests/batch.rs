//! Runs over many inputs, clips and machines: nothing is lost, nothing is half written, shares add up.

use crate::cli::{fails, files, folder, path, sinew, text};
use crate::rng::Rng;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Names and bytes of a folder.
fn contents(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let name = |p: &Path| p.file_name().unwrap().to_string_lossy().into_owned();
    files(dir).iter().map(|p| (name(p), std::fs::read(p).unwrap())).collect()
}

fn succeeds(args: &[&str]) -> String {
    let out = sinew(args);
    assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
    text(&out.stdout)
}

#[test]
fn a_killed_export_leaves_whole_files_and_is_finished_to_the_same_bytes() {
    let (dir, input) = folder();
    let (whole, parts) = (path(&dir, "whole/f.####.png"), path(&dir, "parts/f.####.png"));
    let args = |out: &str| {
        ["render", &input, "-o", out, "--size", "128", "--fps", "200", "-q", "--skip-existing"]
            .map(String::from)
    };
    let run = |out: &str| Command::new(env!("CARGO_BIN_EXE_sinew")).args(args(out)).spawn().unwrap();
    let start = Instant::now();
    assert!(run(&whole).wait().unwrap().success());
    let took = start.elapsed();
    let want = contents(&dir.path().join("whole"));
    assert_eq!(want.len(), 200);

    let mut rng = Rng::new(20);
    let mut interrupted = 0;
    for round in 0..20 {
        let mut child = run(&parts);
        std::thread::sleep(took.mul_f64(rng.range(0.02, 0.6)));
        let _ = child.kill();
        interrupted += usize::from(!child.wait().unwrap().success());
        if !dir.path().join("parts").exists() {
            continue;
        }
        let got = contents(&dir.path().join("parts"));
        for file in &got {
            assert!(want.contains(file), "round {round}: {} is not whole", file.0);
        }
        // There must be something left to do for the next one.
        for (name, _) in got.iter().filter(|_| rng.range(0.0, 1.0) < 0.7) {
            std::fs::remove_file(dir.path().join("parts").join(name)).unwrap();
        }
    }
    assert!(interrupted >= 10, "{interrupted} of 20 were killed while they worked");
    assert!(run(&parts).wait().unwrap().success());
    assert!(contents(&dir.path().join("parts")) == want);
}

#[test]
fn shares_are_the_whole() {
    let (dir, input) = folder();
    let make = |out: &str, shard: &str, manifest: &str| {
        let (out, manifest) = (path(&dir, out), path(&dir, manifest));
        succeeds(&["render", &input, "-o", &out, "--size", "40", "--shard", shard, "--manifest", &manifest])
    };
    make("a/f.##.png", "1/1", "whole.json");
    let whole = contents(&dir.path().join("a"));
    assert_eq!(whole.len(), 24);
    std::fs::rename(dir.path().join("a"), dir.path().join("b")).unwrap();
    for k in ["3/4", "1/4", "4/4", "2/4"] {
        make("a/f.##.png", k, &format!("part{}.json", &k[..1]));
    }
    assert!(contents(&dir.path().join("a")) == whole);

    // Their lists add up to the list of the whole, and the files are as it says.
    let parts: Vec<String> = (1..=4).rev().map(|k| path(&dir, &format!("part{k}.json"))).collect();
    let sum = path(&dir, "sum.json");
    succeeds(&["manifest", "merge", &parts[0], &parts[1], &parts[2], &parts[3], "-o", &sum]);
    assert!(std::fs::read(&sum).unwrap() == std::fs::read(path(&dir, "whole.json")).unwrap());
    succeeds(&["manifest", "check", &sum]);
    std::fs::write(dir.path().join("a/f.07.png"), "changed").unwrap();
    let (code, message) = fails(&["manifest", "check", &sum]);
    assert_eq!(code, 4);
    assert!(
        message.contains("f.07.png: expected sha256") && message.contains("1 faults among 24 files"),
        "{message}"
    );
}

#[test]
fn shares_of_pixel_art_have_the_colors_of_the_whole() {
    let (dir, input) = folder();
    let make = |out: &str, more: &[&str]| {
        let out = path(&dir, out);
        let all =
            ["render", &input, "-o", &out, "--size", "32", "--fps", "8", "--pixel-art", "--colors", "5"];
        succeeds(&[&all[..], more].concat());
    };
    make("a/f.##.png", &[]);
    let whole = contents(&dir.path().join("a"));
    make("b/f.##.png", &["--shard", "2/2"]);
    make("b/f.##.png", &["--skip-existing"]);
    assert!(contents(&dir.path().join("b")) == whole);
}

#[test]
fn a_manifest_lists_every_frame_whether_it_was_drawn_or_there() {
    let (dir, input) = folder();
    let (out, list) = (path(&dir, "f.##.png"), path(&dir, "list.json"));
    let args =
        ["render", &input, "-o", &out, "--size", "24", "--fps", "6", "--manifest", &list, "--skip-existing"];
    succeeds(&args);
    let first = std::fs::read(&list).unwrap();
    std::fs::remove_file(path(&dir, "f.03.png")).unwrap();
    succeeds(&args);
    assert!(std::fs::read(&list).unwrap() == first);
    let v: serde_json::Value = serde_json::from_slice(&first).unwrap();
    let frames = v["outputs"][0]["frames"].as_array().unwrap();
    assert_eq!((frames.len(), &frames[2]["frame"], frames[3]["seconds"].as_f64()), (6, &3.into(), Some(0.5)));
    assert_eq!(v["outputs"][0]["clip"], "wave");

    // Of a film there is a hash of its file, and one of each frame's pixels: equal pictures have equal ones.
    let (film, list) = (path(&dir, "f.gif"), path(&dir, "film.json"));
    succeeds(&["render", &input, "-o", &film, "--size", "24", "--fps", "6", "--manifest", &list]);
    let v: serde_json::Value = serde_json::from_slice(&std::fs::read(&list).unwrap()).unwrap();
    let film = &v["outputs"][0];
    let hash = |i: usize| film["frames"][i]["sha256"].as_str().unwrap();
    assert_eq!((film["frames"].as_array().unwrap().len(), hash(0).len()), (6, 64));
    assert!(hash(1) == hash(5) && hash(1) != hash(2), "there and back");
    succeeds(&["manifest", "check", &list]);
}

#[test]
fn one_bad_input_does_not_stop_the_others() {
    let (dir, input) = folder();
    let (bad, second) = (path(&dir, "bad.json"), path(&dir, "second.json"));
    std::fs::write(&bad, "{\"sinew_rig\": 1,").unwrap();
    std::fs::copy(&input, &second).unwrap();
    let (out, list) = (path(&dir, "out/{name}-{clip}.##.png"), path(&dir, "list.json"));
    let args = [
        "render",
        &input,
        &bad,
        &second,
        "--all-clips",
        "-o",
        &out,
        "--size",
        "16",
        "--fps",
        "2",
        "--manifest",
        &list,
    ];
    let (code, message) = fails(&args);
    assert_eq!(code, 3, "{message}");
    assert!(
        message.contains("bad.json: ") && message.contains("line 1") && message.contains("1 of 3"),
        "{message}"
    );
    let names: Vec<String> = contents(&dir.path().join("out")).into_iter().map(|(n, _)| n).collect();
    assert_eq!(names, ["flag-wave.01.png", "flag-wave.02.png", "second-wave.01.png", "second-wave.02.png"]);
    let v: serde_json::Value = serde_json::from_slice(&std::fs::read(&list).unwrap()).unwrap();
    assert_eq!(v["outputs"].as_array().unwrap().len(), 2);
    assert!(v["failed"][0]["input"].as_str().unwrap().ends_with("bad.json"));
}

#[test]
fn a_manifest_never_takes_the_place_of_what_it_is_about() {
    let (dir, input) = folder();
    let out = |name: &str| path(&dir, name);
    let (png, json) = (out("s.png"), out("s.json"));
    for args in [
        vec!["-o", &png, "--at", "0", "--manifest", &png],
        vec!["-o", &png, "--sheet", "grid", "--fps", "2", "--manifest", &json],
    ] {
        let mut all = vec!["render", &input, "--size", "16"];
        all.extend(args);
        let (code, message) = fails(&all);
        assert!(code == 2 && message.contains("an output has this name"), "{message}");
    }
    assert!(!dir.path().join("s.png").exists());

    // A sheet's manifest knows what lies beside it, and a part that is missing is drawn again.
    let list = out("list.json");
    let args = [
        "render",
        &input,
        "--size",
        "16",
        "-o",
        &png,
        "--sheet",
        "grid",
        "--fps",
        "2",
        "--maps",
        "normal",
        "--skip-existing",
        "--manifest",
        &list,
    ];
    succeeds(&args);
    assert!(succeeds(&["manifest", "check", &list]).is_empty());
    for name in ["s.normal.png", "s.json"] {
        let before = std::fs::read(out(name)).unwrap();
        std::fs::remove_file(out(name)).unwrap();
        assert_eq!(fails(&["manifest", "check", &list]).0, 4, "{name} is missed");
        succeeds(&args);
        assert!(std::fs::read(out(name)).unwrap() == before, "{name}");
    }

    // What was not drawn is a fault of the whole.
    let failed = out("failed.json");
    assert_eq!(fails(&["render", "nowhere.glb", "-o", &out("n.png"), "--manifest", &failed]).0, 3);
    assert_eq!(fails(&["manifest", "check", &failed]).0, 4);
}

#[test]
fn names_that_would_meet_are_refused() {
    let (dir, input) = folder();
    let other = dir.path().join("other");
    std::fs::create_dir(&other).unwrap();
    for name in ["flag.json", "flag.poses.json"] {
        std::fs::copy(dir.path().join(name), other.join(name)).unwrap();
    }
    let second = other.join("flag.json").to_str().unwrap().to_string();
    let says = |args: &[&str], code: i32, part: &str| {
        let (got, message) = fails(args);
        assert_eq!(got, code, "{args:?}: {message}");
        assert!(message.contains(part), "{args:?}: {message}");
    };
    let out = |name: &str| path(&dir, name);
    says(&["render", &input, &second, "-o", &out("a.gif")], 2, "{name}");
    says(&["render", &input, "--all-clips", "-o", &out("{name}.gif")], 2, "{clip}");
    says(&["render", &input, "-o", &out("{nmae}.gif")], 2, "expected {name}, {folder}, {clip} or {index}");
    says(&["render", &input, &second, "-o", &out("{name}.gif"), "--size", "16"], 2, "{folder}");
    assert!(dir.path().join("flag.gif").exists(), "the first of the two was drawn");
    succeeds(&["render", &second, "-o", &out("{folder}-{name}.gif"), "--size", "16"]);
    assert!(dir.path().join("other-flag.gif").exists());
    says(&["render", &input, "-o", &out("f.#.png"), "--shard", "5/4"], 2, "share");
}

#[test]
fn a_dry_run_says_what_would_be_written_and_writes_nothing() {
    let (dir, input) = folder();
    let out = path(&dir, "f.##.png");
    let before = files(dir.path());
    let said = succeeds(&["render", &input, "-o", &out, "--dry-run", "--shard", "2/3"]);
    assert!(said.contains("f.##.png: 8 of 8 frames of 512x512, wave of"), "{said}");
    let sheet = path(&dir, "s.png");
    let said =
        succeeds(&["render", &input, "-o", &sheet, "--dry-run", "--sheet", "grid", "--directions", "4"]);
    assert!(
        said.contains("s.png: 96 of 96 frames") && said.contains("with ") && said.contains("s.json"),
        "{said}"
    );
    let said = succeeds(&["render", &input, "-o", &sheet, "--dry-run", "--contact", "4x2"]);
    assert!(said.contains("s.png: 8 of 8 frames"), "{said}");
    assert_eq!(files(dir.path()), before);

    // What would fail does.
    let says = |out: &str, more: &[&str], part: &str| {
        let (code, message) = fails(&[&["render", &input, "-o", out, "--dry-run"], more].concat());
        assert!(code == 1 && message.contains(part), "{message}");
    };
    says(&path(&dir, "none/s.png"), &[], "none does not exist; create it first");
    std::fs::write(path(&dir, "s.json"), "kept").unwrap();
    says(&sheet, &["--sheet", "grid"], "s.json: the file exists; --force overwrites it");
}
