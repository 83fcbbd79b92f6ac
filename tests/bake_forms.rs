//! `sinew bake` into other forms than curves, an option each: what comes out shows what went in, or nothing does and the message says why.

use crate::cli::{fails, path, sinew, text};
use glam::{DVec3, Vec3};
use serde_json::Value;
use sinew::fk;
use sinew::io::{self, Import, Options, ply, stl};
use std::path::Path;
use std::sync::OnceLock;
use tempfile::TempDir;

const TOLERANCE: f64 = 1e-3;

/// A folder with a glTF file of a rig: skinned, walking.
fn folder() -> &'static (TempDir, String) {
    static FOLDER: OnceLock<(TempDir, String)> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let file = path(&dir, "pip.glb");
        let run =
            sinew(&["bake", "rigs/pip.json", "-o", &file, "-q", "--clip", "walk", "--tolerance", "0.1mm"]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        (dir, file)
    })
}

fn import(file: &str) -> Import {
    io::import(Path::new(file), &Options { textures: false }).unwrap()
}

/// Bake the walk into a file of this name; where it is, and the report.
fn baked(name: &str, options: &[&str]) -> (String, Value) {
    let (dir, file) = folder();
    let out = path(dir, name);
    let run = sinew(&[&["bake", file, "-o", &out, "-f", "-q", "--json", "--clip", "walk"], options].concat());
    assert!(run.status.success(), "{options:?}: {}", text(&run.stderr));
    (out, serde_json::from_slice(&run.stdout).unwrap())
}

fn size(file: &str) -> u64 {
    std::fs::metadata(file).unwrap().len()
}

/// All vertices in a clip's pose, instance by instance or mesh by mesh.
fn placed(import: &Import, clip: usize, t: f64, by_mesh: bool) -> Vec<DVec3> {
    let c = &import.asset.character;
    let pose = c.pose(Some(clip), t);
    let bones = fk::forward_f64(c.skeleton(), &pose);
    let mut order: Vec<usize> = (0..c.instances().len()).collect();
    order.sort_by_key(|i| by_mesh.then(|| (import.primitives[*i].mesh, import.primitives[*i].primitive)));
    order.into_iter().flat_map(|i| c.positions_f64(i, &pose, &bones)).collect()
}

fn places(import: &Import, clip: usize, t: f64) -> Vec<DVec3> {
    placed(import, clip, t, false)
}

fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

/// The farthest over the walk.
fn over_time(a: &Import, b: &Import) -> f64 {
    let clip = |i: &Import| i.asset.character.clips().iter().position(|c| c.name == "walk").unwrap();
    let times = (0..60).map(|k| k as f64 * 0.96 / 60.0);
    times.map(|t| apart(&placed(a, clip(a), t, true), &placed(b, clip(b), t, true))).fold(0.0, f64::max)
}

/// The farthest that any of `points` is from the nearest of `places`.
fn strays(points: &[Vec3], places: &[DVec3]) -> f64 {
    let nearest = |p: &Vec3| places.iter().map(|q| q.distance(p.as_dvec3())).fold(f64::INFINITY, f64::min);
    points.iter().step_by(17).map(nearest).fold(0.0, f64::max)
}

#[test]
fn a_rig_that_stands_still_keeps_its_picture() {
    let dir = tempfile::tempdir().unwrap();
    let read = |file: &str| io::import(Path::new(file), &Options { textures: true }).unwrap().asset;
    let rig = read("rigs/koi.json");
    for form in [&["--pose-at", "0.5"][..], &["--vertices", "--clip", "swim"]] {
        let out = path(&dir, "koi.glb");
        let run = sinew(&[&["bake", "rigs/koi.json", "-o", &out, "-f", "-q"], form].concat());
        assert!(run.status.success(), "{form:?}: {}", text(&run.stderr));
        let still = read(&out);
        assert_eq!((still.textures.len(), rig.textures.len()), (1, 1));
        assert!(still.textures[0].rgba() == rig.textures[0].rgba());
        assert!(still.materials.iter().any(|m| m.diffuse_map.is_some()));
    }
}

#[test]
fn pose_at_writes_the_character_as_it_stands_then() {
    let source = import(&folder().1);
    let truth = places(&source, 0, 0.4);
    let at = ["--pose-at", "0.4"];
    let glb = import(&baked("still.glb", &at).0);
    assert!(glb.asset.character.clips().is_empty());
    let pose = glb.asset.character.rest_pose();
    let bones = fk::forward_f64(glb.asset.character.skeleton(), &pose);
    let still: Vec<DVec3> = (0..glb.asset.character.instances().len())
        .flat_map(|i| glb.asset.character.positions_f64(i, &pose, &bones))
        .collect();
    assert!(apart(&still, &truth) < 1e-6);
    let bytes = |name: &str| std::fs::read(baked(name, &at).0).unwrap();
    let points = ply::parse(&bytes("still.ply")).unwrap().positions;
    let points: Vec<Vec3> = points.iter().map(|p| p.as_vec3()).collect();
    assert!(!points.is_empty() && strays(&points, &truth) < 1e-6);
    let corners: Vec<Vec3> = stl::parse(&bytes("still.stl")).unwrap().concat();
    assert!(!corners.is_empty() && strays(&corners, &truth) < 1e-6);
    let lines = String::from_utf8(bytes("still.obj")).unwrap();
    let number = |l: &str| l.split(' ').skip(1).map(|n| n.parse().unwrap()).collect::<Vec<f32>>();
    let points: Vec<Vec3> =
        lines.lines().filter(|l| l.starts_with("v ")).map(|l| Vec3::from_slice(&number(l))).collect();
    assert!(!points.is_empty() && strays(&points, &truth) < 1e-6);
}

#[test]
fn vertices_stand_where_they_do_at_frames_and_stray_no_farther_between_than_is_said() {
    let source = import(&folder().1);
    let (file, told) = baked("points.glb", &["--vertices", "--vertices-fps", "25"]);
    let points = import(&file);
    let said = told["between_frames"].as_f64().unwrap();
    for k in 0..72 {
        let t = k as f64 * 0.96 / 72.0;
        let off = apart(&places(&source, 0, t), &places(&points, 0, t));
        assert!(off <= if k % 3 == 0 { 2e-6 } else { said + 2e-6 }, "{t}: {off} of {said}");
    }
    assert!(said < 0.02, "{said}");
    let (cache, _) = baked("points.pc2", &["--vertices", "--vertices-fps", "25"]);
    let count = std::fs::read_to_string(cache.replace(".pc2", ".obj")).unwrap();
    let count = count.lines().filter(|l| l.starts_with("v ")).count() as u64;
    assert_eq!(size(&cache), 32 + 25 * 12 * count);
}

#[test]
fn influences_leave_few_and_cost_what_is_said() {
    let (file, told) = baked("two.glb", &["--influences", "2", "--tolerance", "1mm"]);
    let (plain, _) = baked("plain.glb", &["--tolerance", "1mm"]);
    let bound = told["influences"]["bound"].as_f64().unwrap();
    let off = over_time(&import(&folder().1), &import(&file));
    assert!(off <= bound + TOLERANCE && bound > 0.0, "{off} of {bound}");
    assert!(bound < 1.05 * told["influences"]["measured"].as_f64().unwrap());
    // What nobody uses any more is not in the file.
    assert!(size(&file) <= size(&plain) + 2000, "{} {}", size(&file), size(&plain));
}

#[test]
fn meshopt_and_quantize_mesh_make_files_smaller_and_keep_the_tolerance() {
    let source = import(&folder().1);
    let (plain, _) = baked("plain.glb", &["--tolerance", "1mm"]);
    let mut last = size(&plain);
    for options in [&["--meshopt"][..], &["--quantize-mesh"], &["--quantize-mesh", "--meshopt"]] {
        let (file, _) = baked("packed.glb", &[&["--tolerance", "1mm"], options].concat());
        let again = import(&file);
        assert!(over_time(&source, &again) <= TOLERANCE, "{options:?}");
        assert!(size(&file) < last, "{options:?}: {} {last}", size(&file));
        last = if options.len() > 1 || options[0] == "--meshopt" { last } else { size(&file) };
        for name in options {
            let extension =
                if *name == "--meshopt" { "EXT_meshopt_compression" } else { "KHR_mesh_quantization" };
            assert!(again.extensions.iter().any(|e| e == extension), "{options:?}");
        }
    }
}

#[test]
fn packed_clips_play_on_the_file_that_they_were_made_of() {
    let (clips, told) = baked("walk.sinew", &["--tolerance", "1mm"]);
    let (again, _) = baked("again.glb", &["--motion", &clips, "--tolerance", "0.01mm"]);
    let off = over_time(&import(&folder().1), &import(&again));
    assert!(off <= TOLERANCE + 2e-5 && off > 0.1 * TOLERANCE, "{off}");
    assert!(told["clips"][0]["bytes"][1].as_u64().is_some_and(|b| b < size(&clips)));
}

#[test]
fn what_a_form_has_no_place_for_is_refused() {
    let (dir, file) = folder();
    for (name, options, says) in [
        ("a.sinew", &["--meshopt"][..], "--meshopt: .sinew files hold packed clips alone"),
        ("a.sinew", &["--quantize-mesh"], "name a .glb"),
        ("a.sinew", &["--influences", "2"], "--influences"),
        ("a.sinew", &["--keep-keys"], "--keep-keys"),
        ("a.json", &["--meshopt"], "name a .glb"),
        ("a.json", &["--to", "xzx", "--quantize-mesh"], "name a .glb"),
        ("a.glb", &["--to", "xzx"], "name a .json"),
        ("a.glb", &["--vertices", "--pin", "head=1mm"], "cannot be used with"),
        ("a.glb", &["--vertices", "--quantize-mesh"], "cannot be used with"),
        ("a.glb", &["--pose-at", "0.5", "--fps", "30"], "cannot be used with"),
        ("a.glb", &["--pose-at", "nan"], "expected a time in seconds"),
        ("a.stl", &[], "ends in one of"),
        ("{clip}.glb", &["--concat", "All"], "--concat makes one clip of all"),
    ] {
        let out = path(dir, name);
        let (code, said) = fails(&[&["bake", file, "-o", &out], options].concat());
        assert!(code == 2 && said.contains(says), "{name} {options:?}: {code} {said}");
        assert!(!Path::new(&out).exists());
    }
}
