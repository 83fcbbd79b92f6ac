//! The house's arrows: a room uses only what this table allows.
//!
//! Changing an arrow means changing it here first, with the reason.

use std::path::{Path, PathBuf};

/// Rooms in reading order, and what each may use. A room always may use itself.
const ROOMS: &[(&str, &[&str])] = &[
    ("math", &[]),
    ("time", &[]),
    ("skeleton", &["math"]),
    ("pose", &["math", "skeleton"]),
    ("clip", &["math", "time", "skeleton", "pose"]),
    ("fk", &["math", "skeleton", "pose"]),
    // Goals to poses: asks where bones stand, and knows nothing of what hangs on them.
    ("ik", &["math", "skeleton", "pose", "fk"]),
    ("mesh", &["math"]),
    // Neither skeleton nor pose: whatever has matrices can drive a mesh.
    ("skin", &["math", "mesh"]),
    // Hands its result to a deformer, so it speaks the deformer's `Rest`.
    ("morph", &["mesh", "skin"]),
    ("character", &["math", "skeleton", "pose", "clip", "fk", "mesh", "skin", "morph"]),
    ("image", &[]),
    // Never character: a scene is what is drawn, wherever it came from.
    ("scene", &["mesh", "image", "math"]),
    // Where motion and look meet, so that character stays free of materials and importers can return both.
    ("asset", &["character", "scene", "skeleton"]),
    ("render", &["scene", "image", "mesh", "math"]),
    // A clip's keys are marked on the paths of bones; bones are drawn as meshes.
    (
        "frames",
        &[
            "time",
            "skeleton",
            "pose",
            "clip",
            "fk",
            "mesh",
            "skin",
            "character",
            "image",
            "scene",
            "asset",
            "render",
        ],
    ),
    ("measure", &["image"]),
    // Curves to curves, measured on the skin, whose weights bound what must be looked at: never a file, never a picture.
    ("bake", &["math", "time", "skeleton", "pose", "clip", "fk", "mesh", "skin", "character"]),
    // Frames side by side, wherever they came from: it cuts and copies, and never draws.
    ("sheet", &["time", "image"]),
    // Formats: data rooms only, never frames or render.
    (
        "io",
        &[
            "math",
            "time",
            "skeleton",
            "pose",
            "clip",
            "fk",
            "mesh",
            "skin",
            "character",
            "image",
            "scene",
            "asset",
            "sheet",
        ],
    ),
];

/// Files below one room that must not know each other.
const STRANGERS: &[(&str, &[&str])] = &[
    ("skin", &["linear", "rigid"]),
    ("render", &["raster", "ray"]),
    ("io", &["gltf", "notes", "picture", "rig_json", "sheet_json"]),
];

#[test]
fn arrows_go_one_way() {
    let mut faults = Vec::new();
    for file in sources(&root().join("src")) {
        let place = file.strip_prefix(root().join("src")).expect("below src").to_owned();
        let room = room_of(&place);
        if ["lib", "main", "cli", "test_rng"].contains(&room.as_str()) {
            continue;
        }
        let Some((_, allowed)) = ROOMS.iter().find(|(r, _)| *r == room) else {
            faults.push(format!("{}: `{room}` is not in the table of rooms", place.display()));
            continue;
        };
        for (line, used) in uses(&read(&file)) {
            let fine = used == room || used == "test_rng" || allowed.contains(&used.as_str());
            if !fine {
                faults.push(format!("{}:{line}: `{room}` must not use `{used}`", place.display()));
            }
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn siblings_do_not_know_each_other() {
    let mut faults = Vec::new();
    for (room, strangers) in STRANGERS {
        for one in *strangers {
            let folder = root().join("src").join(room).join(one);
            let mut files = sources(&folder);
            files.extend(Some(folder.with_extension("rs")).filter(|f| f.is_file()));
            assert!(!files.is_empty(), "`{room}/{one}` is gone: mend the table");
            for file in files {
                let text = read(&file);
                for other in strangers.iter().filter(|o| *o != one) {
                    let paths = [format!("{room}::{other}::"), format!("super::{other}::")];
                    if paths.iter().any(|p| text.contains(p.as_str())) {
                        faults.push(format!("{}: uses `{room}::{other}`", file.display()));
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_table_is_the_reading_order_of_the_library() {
    let lib = read(&root().join("src/lib.rs"));
    let declared: Vec<&str> =
        lib.lines().filter_map(|l| l.trim().strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    let table: Vec<&str> = ROOMS.iter().map(|(r, _)| *r).collect();
    assert_eq!(declared, table);
    for (i, (room, allowed)) in ROOMS.iter().enumerate() {
        for used in *allowed {
            let at = ROOMS.iter().position(|(r, _)| r == used);
            assert!(at.is_some_and(|at| at < i), "`{room}` is declared before `{used}`, which it uses");
        }
    }
}

#[test]
fn the_check_sees_what_it_should() {
    let found =
        uses("use crate::{pose::{Pose, X}, fk};\n// crate::no\nlet x = crate::mesh::Mesh;\nuse crate::skin;");
    let want = [(1, "pose"), (1, "fk"), (3, "mesh"), (4, "skin")];
    assert_eq!(found, want.map(|(l, n)| (l, n.to_string())));
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(file: &Path) -> String {
    std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}

fn room_of(place: &Path) -> String {
    let first = place.components().next().expect("a file has a name").as_os_str().to_string_lossy();
    first.trim_end_matches(".rs").to_string()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries
        .flat_map(|e| {
            let path = e.expect("folder is readable").path();
            if path.is_dir() { sources(&path) } else { vec![path] }
        })
        .filter(|p| p.extension().is_some_and(|e| e == "rs"))
        .collect();
    files.sort();
    files
}

/// Every room named behind `crate::`, groups in braces included, with its line; comments do not count.
fn uses(text: &str) -> Vec<(usize, String)> {
    let code: Vec<&str> = text.lines().map(|l| l.split("//").next().unwrap_or("")).collect();
    let code = code.join("\n");
    let mut found = Vec::new();
    for (at, path) in code.match_indices("crate::") {
        let line = code[..at].matches('\n').count() + 1;
        let rest = &code[at + path.len()..];
        let names = rest.strip_prefix('{').map_or_else(|| vec![head(rest)], heads);
        found.extend(names.into_iter().filter(|n| !n.is_empty()).map(|n| (line, n)));
    }
    found
}

/// First names of the items of a brace group that was opened just before `group`.
fn heads(group: &str) -> Vec<String> {
    let (mut depth, mut names, mut start) = (0, Vec::new(), 0);
    for (i, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                names.push(head(&group[start..i]));
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                names.push(head(&group[start..i]));
                start = i + 1;
            }
            _ => {}
        }
    }
    names
}

fn head(path: &str) -> String {
    path.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}
