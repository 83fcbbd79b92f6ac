//! The shipped characters: every file in `rigs/` and `poses/`, found when the test runs.

#[path = "../rigs/maker/characters/mod.rs"]
mod maker;

use crate::rng::Rng;
use glam::{DVec3, Vec3};
use sinew::asset::Asset;
use sinew::character::{Binding, Character, Scratch};
use sinew::io::{Import, Options, rig_json};
use sinew::mesh::topology::HalfEdges;
use sinew::skin::Deformed;
use std::path::{Path, PathBuf};

fn files(folder: &str, ending: &str) -> Vec<PathBuf> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(&dir).unwrap().map(|e| e.unwrap().path());
    let mut list: Vec<PathBuf> = entries.filter(|p| p.extension().is_some_and(|e| e == ending)).collect();
    list.sort();
    assert!(!list.is_empty(), "no *.{ending} in {}", dir.display());
    list
}

fn load(path: &Path) -> Import {
    rig_json::import(path, &Options { textures: true }).unwrap_or_else(|e| panic!("{e}"))
}

fn rigs() -> Vec<(String, Asset)> {
    let name = |p: &Path| p.file_stem().unwrap().to_string_lossy().into_owned();
    files("rigs", "json").iter().map(|p| (name(p), load(p).asset)).collect()
}

/// All instances at one moment, near the world's origin.
fn deformed(c: &Character, clip: Option<usize>, t: f64) -> Vec<Deformed> {
    let pose = c.pose(clip, t);
    let posed = c.posed(&pose);
    let mut scratch = Scratch::default();
    let one = |i: usize| {
        let mut out = Deformed::default();
        c.deform(i, &pose, &posed, DVec3::ZERO, &mut scratch, &mut out);
        out
    };
    (0..c.instances().len()).map(one).collect()
}

fn size(c: &Character) -> f32 {
    let all = deformed(c, None, 0.0);
    let points = || all.iter().flat_map(|d| &d.positions);
    let lo = points().fold(Vec3::MAX, |a, p| a.min(*p));
    let hi = points().fold(Vec3::MIN, |a, p| a.max(*p));
    lo.distance(hi)
}

#[test]
fn every_rig_loads_with_its_poses_and_without_warnings() {
    for path in files("rigs", "json") {
        let import = load(&path);
        assert_eq!(import.warnings, [], "{}", path.display());
        assert!(!import.asset.character.clips().is_empty(), "{} has no poses", path.display());
        assert!(!import.asset.character.instances().is_empty(), "{} has no meshes", path.display());
        assert!(std::fs::metadata(&path).unwrap().len() < 600_000, "{} is too large", path.display());
    }
    for path in files("poses", "json") {
        let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs").join(path.file_name().unwrap());
        assert!(rig.is_file(), "{} belongs to no rig", path.display());
    }
}

#[test]
fn the_maker_makes_what_is_committed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let made = maker::all();
    for file in &made {
        let there = std::fs::read(root.join(&file.path)).unwrap_or_default();
        // No assert_eq: a failure would print half a megabyte.
        assert!(there == file.bytes, "{} differs; run `cargo run --example make-rigs`", file.path);
    }
    let known = |p: &Path| made.iter().any(|f| p.ends_with(&f.path));
    for path in [files("rigs", "json"), files("poses", "json")].concat() {
        assert!(known(&path), "nothing makes {}", path.display());
    }
}

#[test]
fn every_rig_and_its_poses_survive_writing_and_reading() {
    for (name, asset) in rigs() {
        let textures: Vec<String> = asset.textures.iter().map(|_| format!("{name}.png")).collect();
        let rig = rig_json::export(&name, &asset, &textures);
        let c = &asset.character;
        let poses = rig_json::export_poses(c, c.clips());
        assert!(rig.warnings.is_empty() && poses.warnings.is_empty(), "{name}: {:?}", rig.warnings);

        // The same values from the text, and the same text from the values.
        let (rig, poses) = (rig.document.to_text(), poses.document.to_text());
        let png = std::fs::read(format!("{}/rigs/{name}.png", env!("CARGO_MANIFEST_DIR")));
        let fetch = |_: &str| png.as_ref().map(Clone::clone).map_err(|e| e.kind().into());
        let again =
            rig_json::import_bytes(rig.as_bytes(), &Options { textures: true }, &fetch).unwrap().asset;
        let clips = rig_json::poses_from_bytes(poses.as_bytes(), c).unwrap();
        assert!(again.character.skeleton() == c.skeleton(), "{name}: skeleton");
        assert!(again.character.meshes() == c.meshes(), "{name}: meshes");
        assert!(again.character.instances() == c.instances(), "{name}: bindings");
        assert!(again.materials == asset.materials && again.textures == asset.textures, "{name}: look");
        assert!(clips == c.clips(), "{name}: clips");
        assert!(rig_json::export(&name, &again, &textures).document.to_text() == rig, "{name}: text");
        assert!(rig_json::export_poses(c, &clips).document.to_text() == poses, "{name}: poses");
    }
}

#[test]
fn at_rest_nothing_moves() {
    for (name, asset) in rigs() {
        let c = &asset.character;
        let bound = 4.0 * f32::EPSILON * size(c);
        for (instance, now) in c.instances().iter().zip(deformed(c, None, 0.0)) {
            let mesh = c.mesh(instance);
            let Binding::Skin { .. } = instance.binding else { continue };
            let worst = mesh.positions.iter().zip(&now.positions).map(|(a, b)| a.distance(*b));
            let worst = worst.fold(0.0, f32::max);
            assert!(worst <= bound, "{name}, {}: {worst} m at rest, bound {bound}", mesh.name);
        }
    }
}

#[test]
fn every_frame_is_finite_and_loops_close() {
    for (name, asset) in rigs() {
        let c = &asset.character;
        let size = size(c);
        for (k, clip) in c.clips().iter().enumerate() {
            let range = clip.playback();
            assert!(range.duration() > 0.0, "{name}, {}", clip.name);
            let at = |u: f64| deformed(c, Some(k), range.start + u * range.duration());
            let (first, last) = (at(0.0), at(1.0));
            for (a, b) in first.iter().zip(&last) {
                let gap =
                    a.positions.iter().zip(&b.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
                assert!(gap <= 1e-5 * size, "{name}, {}: {gap} m over the seam", clip.name);
            }
            let mut previous = first;
            let frames = (range.duration() * 60.0).ceil() as usize;
            for f in 1..=frames {
                let now = at(f as f64 / frames as f64);
                for (a, b) in now.iter().zip(&previous) {
                    assert!(
                        a.positions.iter().chain(&a.normals).all(|p| p.is_finite()),
                        "{name}, {}",
                        clip.name
                    );
                    // Nothing jumps: 15 m/s is faster than any paw or wing tip here.
                    let step = a.positions.iter().zip(&b.positions).map(|(a, b)| a.distance(*b));
                    let step = step.fold(0.0, f32::max);
                    assert!(step < 15.0 / 60.0, "{name}, {}: {step} m in frame {f}", clip.name);
                }
                previous = now;
            }
        }
    }
}

#[test]
fn weights_are_smooth_along_the_surface() {
    for (name, asset) in rigs() {
        let c = &asset.character;
        for instance in c.instances() {
            let Binding::Skin { weights, .. } = &instance.binding else { continue };
            let mesh = c.mesh(instance);
            assert!(weights.per_vertex() <= 4, "{name}, {}", mesh.name);
            let apart = |a: u32, b: u32| {
                let of = |v: u32, bone: usize| -> f32 {
                    weights.of(v as usize).filter(|w| w.0 == bone && w.1 > 0.0).map(|w| w.1).sum()
                };
                let bones = weights.of(a as usize).chain(weights.of(b as usize)).map(|w| w.0);
                bones.map(|bone| (of(a, bone) - of(b, bone)).abs()).fold(0.0, f32::max)
            };
            let edges = mesh.triangles.iter().flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]);
            let worst = edges.map(|(a, b)| apart(a, b)).fold(0.0, f32::max);
            assert!(worst < 0.5, "{name}, {}: a weight jumps by {worst} along one edge", mesh.name);
        }
    }
}

#[test]
fn bodies_are_watertight() {
    for (name, asset) in rigs() {
        for mesh in asset.character.meshes() {
            // Creases split vertices and fins are sheets; bodies are neither.
            if mesh.name == "body" {
                let s = HalfEdges::new(&mesh.triangles).summary(&mesh.triangles);
                assert!(s.closed() && s.components == 1, "{name}: {s:?}");
            }
        }
    }
}

#[test]
fn bodies_do_not_fold_over_themselves_at_rest() {
    for (name, asset) in rigs() {
        for mesh in asset.character.meshes().iter().filter(|m| m.name == "body") {
            let leans = |t: &[u32; 3]| {
                let n = sinew::mesh::normals::face(t.map(|i| mesh.positions[i as usize]));
                t.iter().map(|i| n.dot(mesh.normals[*i as usize])).fold(1.0, f32::min)
            };
            let folded = mesh.triangles.iter().filter(|t| leans(t) < 0.0).count();
            assert_eq!(folded, 0, "{name}: triangles that face away from their vertices' normals");
        }
    }
}

#[test]
fn feet_stay_above_the_ground() {
    for (name, clips) in [("pip", 3), ("fox", 3), ("robot-arm", 2), ("octopus", 2)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("rigs/{name}.json"));
        let c = load(&path).asset.character;
        assert_eq!(c.clips().len(), clips, "{name}");
        for (k, clip) in c.clips().iter().enumerate() {
            let end = clip.playback().end;
            let low = (0..60).flat_map(|f| deformed(&c, Some(k), end * f as f64 / 60.0));
            let low = low.flat_map(|d| d.positions).map(|p| p.y).fold(f32::MAX, f32::min);
            assert!(low > -0.01, "{name}, {}: {low} m", clip.name);
        }
    }
}

#[test]
fn a_planted_foot_runs_backwards_at_the_grounds_speed() {
    // Between landing and lifting its heel a foot must not slide: share of the cycle in which it stands flat.
    for (name, clip, foot, flat) in [
        ("pip", "walk", "foot.L", 0.16..0.29),
        ("pip", "run", "foot.L", 0.09..0.16),
        ("fox", "walk", "hind paw.L", 0.1..0.31),
        ("fox", "gallop", "hind paw.L", 0.07..0.13),
    ] {
        let c =
            load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("rigs/{name}.json"))).asset.character;
        let k = c.clips().iter().position(|c| c.name == clip).unwrap();
        let bone = c.skeleton().find(foot).unwrap();
        let end = c.clips()[k].playback().end;
        let place = |u: f64| c.posed(&c.pose(Some(k), u * end)).origin(bone);
        let whole = (place(flat.end) - place(flat.start)) / (flat.end - flat.start);
        assert!(whole.z < -0.2, "{name}, {clip}: {whole} m a cycle");
        // A millimetre off the line that the ground takes cannot be seen to slide.
        for f in 0..=20 {
            let u = flat.start + (flat.end - flat.start) * f as f64 / 20.0;
            let off = place(u) - (place(flat.start) + whole * (u - flat.start));
            assert!(off.length() < 1e-3, "{name}, {clip} at {u}: {off} m off the ground's way");
        }
    }
}

#[test]
fn broken_files_give_errors_and_never_panic() {
    let mut dice = Rng::new(41);
    let nothing = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    let options = Options { textures: false };
    for path in files("rigs", "json") {
        let bytes = std::fs::read(&path).unwrap();
        for _ in 0..6 {
            let cut = dice.below(bytes.len() - 2);
            assert!(rig_json::import_bytes(&bytes[..cut], &options, &nothing).is_err(), "cut at {cut}");
            let mut changed = bytes.clone();
            (0..4).for_each(|_| changed[dice.below(bytes.len())] = b' ' + dice.below(95) as u8);
            let _ = rig_json::import_bytes(&changed, &options, &nothing);
        }
    }
    for path in files("poses", "json") {
        let bytes = std::fs::read(&path).unwrap();
        let rig = files("rigs", "json").into_iter().find(|p| p.file_name() == path.file_name()).unwrap();
        let character = load(&rig).asset.character;
        for _ in 0..20 {
            let cut = dice.below(bytes.len() - 2);
            assert!(rig_json::poses_from_bytes(&bytes[..cut], &character).is_err(), "cut at {cut}");
            let mut changed = bytes.clone();
            (0..4).for_each(|_| changed[dice.below(bytes.len())] = b' ' + dice.below(95) as u8);
            let _ = rig_json::poses_from_bytes(&changed, &character);
        }
    }
}
