//! Clips edited before they are baked, and bakes of many files: what the options of `sinew bake` promise.

use crate::cli::{path, sinew, text};
use glam::{Affine3A, DAffine3, DQuat, DVec3, Quat, Vec3};
use serde_json::{Value, json};
use sinew::bake::edit::{self, Reference};
use sinew::bake::{BakeDesc, BakeError, Gauge, bake};
use sinew::character::{Binding, Character, Instance, MeshId};
use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
use sinew::fk;
use sinew::io::gltf::{self, Rewritten};
use sinew::io::{Import, Options};
use sinew::math::Trs;
use sinew::mesh::{Mesh, MeshData};
use sinew::pose::Pose;
use sinew::skeleton::{BoneDesc, BoneId, Skeleton};
use sinew::skin::Weights;

/// A glTF file in the making.
#[derive(Default)]
pub struct File {
    pub bin: Vec<u8>,
    pub accessors: Vec<Value>,
    pub views: Vec<Value>,
}

impl File {
    pub fn floats(&mut self, values: &[f32], kind: &str) -> usize {
        let each = [("SCALAR", 1), ("VEC3", 3), ("VEC4", 4)].iter().find(|k| k.0 == kind).unwrap().1;
        let (lo, hi) = values.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": 4 * values.len()});
        self.views.push(view);
        self.bin.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        let mut accessor = json!({"bufferView": self.views.len() - 1, "componentType": 5126, "count": values.len() / each, "type": kind});
        if kind == "SCALAR" {
            (accessor["min"], accessor["max"]) = (json!([lo]), json!([hi]));
        }
        if kind == "VEC3" {
            let end = |f: fn(f32, f32) -> f32| {
                (0..3).map(|c| values.chunks(3).map(|v| v[c]).reduce(f).unwrap()).collect::<Vec<_>>()
            };
            (accessor["min"], accessor["max"]) = (json!(end(f32::min)), json!(end(f32::max)));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    pub fn done(self, mut json: Value) -> Vec<u8> {
        let mut map = json.as_object_mut().unwrap().clone();
        map.insert("accessors".into(), self.accessors.into());
        map.insert("bufferViews".into(), self.views.into());
        map.insert("buffers".into(), json!([{"byteLength": self.bin.len()}]));
        Rewritten { json: map, bin: self.bin, ..Default::default() }.glb()
    }
}

pub const SECONDS: f32 = 1.0;

/// A body of three parts that walks in a bow while its left arm waves: below a node that is turned and scaled, as some programs write it.
pub fn walker(end: f32) -> Vec<u8> {
    let mut f = File::default();
    let mesh = f.floats(&[0.0, 0.0, 0.0, 30.0, 0.0, 0.0, 0.0, 20.0, 10.0], "VEC3");
    let times: Vec<f32> = (0..=30).map(|k| k as f32 / 30.0 * SECONDS).collect();
    let keyed: Vec<f32> = times[..30].iter().copied().chain([end]).collect();
    let t = f.floats(&keyed, "SCALAR");
    let phase = |t: &f32| (t / SECONDS * std::f32::consts::TAU, *t);
    // z is up below the turned node, and its unit is a centimetre.
    let way: Vec<f32> =
        times.iter().map(phase).flat_map(|(p, t)| [40.0 * t, -100.0 * t * t, 90.0 + 3.0 * p.sin()]).collect();
    let turn: Vec<f32> = times
        .iter()
        .map(phase)
        .flat_map(|(p, t)| (Quat::from_rotation_z(1.2 * t) * Quat::from_rotation_x(0.2 * p.sin())).to_array())
        .collect();
    let wave: Vec<f32> =
        times.iter().map(phase).flat_map(|(p, _)| Quat::from_rotation_y(0.7 * p.sin()).to_array()).collect();
    let (way, turn, wave) = (f.floats(&way, "VEC3"), f.floats(&turn, "VEC4"), f.floats(&wave, "VEC4"));
    let color = f.floats(&[1.0, 1.0, 1.0, 0.0, 0.0, 0.0], "VEC3");
    let two = f.floats(&[0.0, 1.0], "SCALAR");
    let sampler = |output: usize| json!({"input": t, "output": output});
    let channel = |sampler: usize, node: usize, path: &str| json!({"sampler": sampler, "target": {"node": node, "path": path}});
    let mut noted = channel(2, 2, "rotation");
    (noted["extras"], noted["target"]["extras"]) = (json!({"by": "hand"}), json!(7));
    f.done(json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_animation_pointer"],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        "nodes": [
            {"name": "armature", "rotation": [-std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2], "scale": [0.01, 0.01, 0.01], "children": [1]},
            {"name": "hip", "children": [2, 3], "mesh": 0, "translation": [0, 0, 90]},
            {"name": "arm.L", "mesh": 0, "translation": [20, 0, 10]},
            {"name": "arm.R", "mesh": 0, "translation": [-20, 0, 10]},
        ],
        "materials": [{}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": mesh}, "material": 0}]}],
        "animations": [{
            "name": "walk",
            "samplers": [sampler(way), sampler(turn),
                {"input": t, "output": wave, "extras": ["kept"]},
                {"input": two, "output": color, "interpolation": "STEP"}],
            "channels": [channel(0, 1, "translation"), channel(1, 1, "rotation"), noted,
                {"sampler": 3, "extras": 1, "target": {"path": "pointer", "extensions":
                    {"KHR_animation_pointer": {"pointer": "/materials/0/pbrMetallicRoughness/baseColorFactor"}}}}],
        }],
    }))
}

fn import(bytes: &[u8]) -> Import {
    gltf::import_bytes(bytes, None, &Options::default()).unwrap()
}

fn pose(character: &Character, clip: &Clip, t: f64) -> Pose {
    let mut pose = character.rest_pose();
    clip.sample(character.skeleton(), t, &mut pose);
    pose
}

/// World positions of all vertices, in f64.
fn vertices(character: &Character, pose: &Pose) -> Vec<DVec3> {
    let bones = fk::forward_f64(character.skeleton(), pose);
    (0..character.instances().len()).flat_map(|i| character.positions_f64(i, pose, &bones)).collect()
}

fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

fn moments(clip: &Clip) -> Vec<f64> {
    let r = clip.range();
    (0..=500).map(|k| r.start + r.duration() * k as f64 / 500.0).collect()
}

fn desc(tolerance: f64) -> BakeDesc {
    BakeDesc { tolerance, ..BakeDesc::default() }
}

#[test]
fn what_is_left_in_place_and_the_way_are_the_source() {
    let import = import(&walker(SECONDS));
    let c = &import.asset.character;
    let clip = &c.clips()[0];
    let hip = c.skeleton().find("hip").unwrap();
    for heading in [false, true] {
        let (still, way) = edit::in_place(c, clip, heading).unwrap();
        assert_eq!(
            (way.bone, still.range(), way.translations[0], way.yaw[0]),
            (hip, clip.range(), DVec3::ZERO, 0.0)
        );
        let mut far = 0.0_f64;
        for t in moments(clip) {
            // The motion is straight between its keys.
            let k = way.times.partition_point(|k| *k <= t).clamp(1, way.times.len() - 1);
            let u = ((t - way.times[k - 1]) / (way.times[k] - way.times[k - 1])).clamp(0.0, 1.0);
            let at = way.translations[k - 1].lerp(way.translations[k], u);
            let yaw = way.yaw[k - 1] + (way.yaw[k] - way.yaw[k - 1]) * u;
            let placement = DAffine3::from_rotation_translation(DQuat::from_rotation_y(yaw), at);
            let back = Pose { placement, ..pose(c, &still, t) };
            let error = apart(&vertices(c, &back), &vertices(c, &pose(c, clip, t)));
            assert!(error < 1e-5, "{heading} at {t}: {error}");
            // On the spot: over the ground the hip stays.
            let origin = fk::forward_f64(c.skeleton(), &pose(c, &still, t))[hip.index()].translation;
            far = far.max(DVec3::new(origin.x, 0.0, origin.z).length());
            assert!(at.y == 0.0 && (heading || yaw == 0.0));
        }
        assert!(far < 1e-5, "{far}");
        assert!((way.translations.last().unwrap().length() - 1.077).abs() < 0.05 || heading);
        assert!(!heading || (way.yaw.last().unwrap() - 1.2).abs() < 1e-3, "{:?}", way.yaw.last());
    }
    let wave = Clip { tracks: vec![clip.tracks[2].clone()], ..clip.clone() };
    assert!(matches!(edit::in_place(c, &wave, false), Err(edit::EditError::NoRoot { .. })));
}

#[test]
fn differences_added_to_what_they_are_from_are_the_source() {
    let import = import(&walker(SECONDS));
    let c = &import.asset.character;
    let clip = &c.clips()[0];
    for reference in [Reference::Rest, Reference::First] {
        let base = edit::reference_pose(c, clip, reference);
        let delta = edit::additive(clip, &base).unwrap();
        let baked = bake(c, &delta, &BakeDesc { over: Some(base.clone()), ..desc(1e-3) }).unwrap();
        assert!(baked.report.keys[1] < baked.report.keys[0], "{:?}", baked.report);
        let mut most = 0.0_f64;
        for t in moments(clip) {
            let want = vertices(c, &pose(c, clip, t));
            assert!(apart(&want, &vertices(c, &edit::added(&base, &delta, t))) < 1e-6);
            most = most.max(apart(&want, &vertices(c, &edit::added(&base, &baked.clip, t))));
        }
        assert!(most <= 1e-3 && most > 2e-4, "{reference:?}: {most}");
    }
}

#[test]
fn frames_only_hold_against_the_source_or_say_which_rate_would() {
    let import = import(&walker(SECONDS));
    let c = &import.asset.character;
    let clip = &c.clips()[0];
    let at = |fps: f64, tolerance: f64| bake(c, clip, &BakeDesc { fps: Some(fps), ..desc(tolerance) });
    let baked = at(30.0, 1e-3).unwrap().clip;
    for t in baked.tracks.iter().flat_map(|t| t.curve.times()) {
        assert!((t * 30.0 - (t * 30.0).round()).abs() < 1e-4, "{t}");
    }
    let most = moments(clip)
        .iter()
        .map(|t| apart(&vertices(c, &pose(c, clip, *t)), &vertices(c, &pose(c, &baked, *t))))
        .fold(0.0, f64::max);
    assert!(most <= 1e-3, "{most}");
    let Err(BakeError::Frames { better, .. }) = at(5.0, 1e-3) else { panic!() };
    let fps = better.0.expect("some rate would");
    assert!(fps > 5.0 && at(fps, 1e-3).is_ok(), "{fps}");
    // A wide tolerance takes few frames.
    assert!(at(5.0, 0.1).is_ok());
}

#[test]
fn kept_keys_stay_where_they_are() {
    let import = import(&walker(SECONDS));
    let c = &import.asset.character;
    let mut clip = c.clips()[0].clone();
    let rest = c.rest_pose().locals[2].translation;
    let still =
        Curve::new(vec![0.0, 0.5, 1.0], [rest.to_array(); 3].concat(), 3, Interpolation::Linear).unwrap();
    clip.tracks.push(Track { target: Target::Translation(BoneId(2)), curve: still });
    let baked = bake(c, &clip, &BakeDesc { keep_keys: true, ..desc(1e-2) }).unwrap();
    assert_eq!(baked.clip.tracks.len(), 3);
    assert!(baked.short.contains(&true));
    for (new, old) in baked.clip.tracks.iter().zip(&clip.tracks) {
        assert_eq!((&new.target, new.curve.times()), (&old.target, old.curve.times()));
    }
}

#[test]
fn loops_end_as_they_begin_bit_for_bit() {
    let import = import(&walker(SECONDS));
    let c = &import.asset.character;
    let cycle = edit::blend(&c.clips()[0], 0.3);
    assert!(Gauge::new(c, 1).seam(&cycle).distance < 1e-6);
    for tolerance in [1e-4, 1e-2] {
        let baked = bake(c, &cycle, &BakeDesc { cycle: true, ..desc(tolerance) }).unwrap().clip;
        for t in &baked.tracks {
            let n = t.curve.times().len();
            assert!(n < 2 || t.curve.value(0) == t.curve.value(n - 1), "{:?}", t.target);
        }
        assert_eq!(baked.range(), cycle.range());
    }
}

/// Five bones of a metre and a skin of 700 vertices around them, each moved by two; beside it a part fixed to the last.
fn tube() -> Character {
    let bone = |i: usize| {
        let rest = Trs { translation: if i > 0 { Vec3::X } else { Vec3::ZERO }, ..Trs::IDENTITY };
        BoneDesc { parent: i.checked_sub(1), rest, ..BoneDesc::new(format!("b{i}")) }
    };
    let (skeleton, bones) = Skeleton::new((0..5).map(bone).collect()).unwrap();
    let along = |v: usize| v as f32 / 700.0 * 5.0;
    let around = |v: usize| (v as f32 * 0.7).sin_cos();
    let positions = (0..700).map(|v| Vec3::new(along(v), 0.2 * around(v).0, 0.2 * around(v).1)).collect();
    let mesh = Mesh::new(MeshData { positions, triangles: vec![[0, 1, 2]], ..Default::default() }).unwrap();
    let pair = |v: usize| [along(v) as u32, (along(v) as u32 + 1).min(4)];
    let part = |v: usize| [1.0 - along(v).fract(), along(v).fract()];
    let ids: Vec<u32> = (0..700).flat_map(pair).collect();
    let (weights, _) = Weights::new(2, &ids, &(0..700).flat_map(part).collect::<Vec<_>>(), 5, 0).unwrap();
    let palette =
        bones.iter().enumerate().map(|(i, b)| (*b, Affine3A::from_translation(-Vec3::X * i as f32)));
    let skin = Binding::Skin { palette: palette.collect(), weights };
    let instance = |binding| Instance { mesh: MeshId(0), binding, first_weight: 0 };
    let instances = vec![instance(skin), instance(Binding::Bone(bones[4]))];
    Character::new(skeleton, vec![mesh], instances, vec![], vec![]).unwrap()
}

#[test]
fn boxes_of_vertices_find_the_same_worst_vertex_as_all_of_them() {
    let c = &tube();
    let turn = |amount: f32| {
        let track = |(i, b): (usize, BoneId)| {
            let times: Vec<f64> = (0..8).map(|k| k as f64 / 7.0).collect();
            let value = |t: &f64| {
                Quat::from_euler(glam::EulerRot::XYZ, amount * (i as f32 + *t as f32), 0.3 * *t as f32, 0.1)
                    .to_array()
            };
            let values = times.iter().flat_map(value).collect();
            Track {
                target: Target::Rotation(b),
                curve: Curve::new(times, values, 4, Interpolation::Linear).unwrap(),
            }
        };
        Clip { name: "turn".into(), tracks: c.skeleton().ids().enumerate().map(track).collect() }
    };
    let times: Vec<f64> = (0..50).map(|k| k as f64 / 49.0).collect();
    for amount in [0.2, 0.2001, 0.7] {
        let (a, b) = (turn(0.2), turn(amount));
        let each =
            times.iter().map(|t| apart(&vertices(c, &pose(c, &a, *t)), &vertices(c, &pose(c, &b, *t))));
        let want = each.fold(0.0, f64::max);
        let got = Gauge::new(c, 2).worst(&a, &b, &times);
        assert!(
            (got.distance - want).abs() <= 1e-5 * want + 2e-6 * f64::from(amount != 0.2),
            "{got:?} {want}"
        );
        let profile = Gauge::new(c, 1)
            .profile(&a, &b, &times, 0.0)
            .into_iter()
            .fold(Default::default(), sinew::bake::Worst::worse);
        assert_eq!(profile, got);
    }
}

/// A folder with the walker, a file that is none, and another walker.
fn folder() -> (tempfile::TempDir, [String; 3]) {
    let dir = tempfile::tempdir().unwrap();
    let names = ["a.glb", "b.glb", "c.glb"].map(|n| path(&dir, n));
    std::fs::write(&names[0], walker(SECONDS)).unwrap();
    std::fs::write(&names[1], "no file").unwrap();
    std::fs::write(&names[2], walker(SECONDS)).unwrap();
    (dir, names)
}

#[test]
fn one_file_that_fails_does_not_stop_the_others() {
    let (dir, [a, b, c]) = folder();
    let out = path(&dir, "out/{name}.glb");
    let run = sinew(&["bake", &a, &b, &c, "-o", &out, "--json", "-q"]);
    assert_eq!(run.status.code(), Some(3), "{}", text(&run.stderr));
    let told: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(
        told.as_array().unwrap().iter().map(|t| t["error"].is_string()).collect::<Vec<_>>(),
        [false, true, false]
    );
    assert_eq!((&told[1]["input"], &told[1]["exit"]), (&json!(b), &json!(3)));
    assert!(told[2]["clips"][0]["error"].as_f64().unwrap() > 0.0);
    let written = |n: &str| std::fs::read(path(&dir, n)).unwrap();
    assert_eq!(written("out/a.glb"), written("out/c.glb"));
    assert!(text(&run.stderr).contains("1 of 3 outputs failed"), "{}", text(&run.stderr));
    // Names that do not tell inputs apart, and inputs themselves, are refused before any work.
    for (args, says) in [
        (vec!["bake", &a, &c, "-o", "one.glb"], "{name}"),
        (vec!["bake", &a, "-o", &a, "-f"], "this is an input"),
        (vec!["bake", &a, "-o", &out, "--loop", "-f"], "--loop-blend"),
    ] {
        let run = sinew(&args);
        assert!(text(&run.stderr).contains(says), "{args:?}: {}", text(&run.stderr));
    }
    // A seam that is longer than the clip.
    let run = sinew(&["bake", &a, "-o", &path(&dir, "bent.glb"), "--loop-blend", "99s"]);
    assert!(run.status.success() && text(&run.stderr).contains("all of it is bent"), "{}", text(&run.stderr));
    // A file a clip.
    let each = path(&dir, "clips/{name}-{clip}.gltf");
    assert!(sinew(&["bake", &a, "-o", &each, "-q"]).status.success());
    assert!(dir.path().join("clips/a-walk.bin").exists());
}

/// Bake the walker with these options.
fn baked(options: &[&str]) -> Import {
    let (dir, [a, ..]) = folder();
    let out = path(&dir, "out.glb");
    let run = sinew(&[&["bake", &a, "-o", &out, "-q", "--tolerance", "0.1mm"], options].concat());
    assert!(run.status.success(), "{}", text(&run.stderr));
    import(&std::fs::read(&out).unwrap())
}

#[test]
fn mirrored_twice_is_the_source() {
    let source = import(&walker(SECONDS));
    let c = &source.asset.character;
    let once = baked(&["--mirror"]);
    let clip = &once.asset.character.clips()[0];
    let mirror = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
    let [hip, left, right] = ["hip", "arm.L", "arm.R"].map(|n| c.skeleton().find(n).unwrap());
    let origin = |clip: &Clip, b: BoneId, t: f64| {
        fk::forward_f64(c.skeleton(), &pose(c, clip, t))[b.index()].translation
    };
    let twice = clip.mirrored(c.skeleton(), &c.mirror());
    for t in moments(clip) {
        let walk = &c.clips()[0];
        // The right arm goes where the left one went, on the other side of the world.
        for (a, b) in [(hip, hip), (left, right), (right, left)] {
            assert!(origin(clip, b, t).distance(mirror(origin(walk, a, t))) < 1.1e-4, "{t}");
        }
        let error = apart(&vertices(c, &pose(c, walk, t)), &vertices(c, &pose(c, &twice, t)));
        assert!(error < 1.2e-4, "{error}");
    }
}

#[test]
fn channels_keep_what_is_said_of_them_and_those_of_others_stay() {
    let (dir, [a, ..]) = folder();
    let out = path(&dir, "out.gltf");
    assert!(
        sinew(&["bake", &a, "-o", &out, "-q", "--in-place=heading", "--tolerance", "5mm"]).status.success()
    );
    let json: Value = serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap();
    let animation = &json["animations"][0];
    let channels = animation["channels"].as_array().unwrap();
    let arm = channels.iter().find(|c| c["target"]["node"] == 2).unwrap();
    assert_eq!((&arm["extras"], &arm["target"]["extras"]), (&json!({"by": "hand"}), &json!(7)));
    assert_eq!(animation["samplers"][arm["sampler"].as_u64().unwrap() as usize]["extras"], json!(["kept"]));
    let pointer = channels.iter().find(|c| c["target"]["path"] == "pointer").unwrap();
    assert_eq!(pointer["extras"], 1);
    assert_eq!(
        pointer["target"]["extensions"]["KHR_animation_pointer"]["pointer"],
        "/materials/0/pbrMetallicRoughness/baseColorFactor"
    );
    // Its keys are those that it had.
    let bin = std::fs::read(path(&dir, "out.bin")).unwrap();
    let floats = |accessor: &Value| {
        let a = &json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &json["bufferViews"][a["bufferView"].as_u64().unwrap() as usize];
        let at = view["byteOffset"].as_u64().unwrap_or(0) + a["byteOffset"].as_u64().unwrap_or(0);
        let n = a["count"].as_u64().unwrap() * if a["type"] == "VEC3" { 3 } else { 1 };
        (0..n)
            .map(|i| f32::from_le_bytes(bin[(at + 4 * i) as usize..][..4].try_into().unwrap()))
            .collect::<Vec<_>>()
    };
    let sampler = &animation["samplers"][pointer["sampler"].as_u64().unwrap() as usize];
    assert_eq!((floats(&sampler["input"]), &sampler["interpolation"]), (vec![0.0, 1.0], &json!("STEP")));
    assert_eq!(floats(&sampler["output"]), [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);

    // The way is a node that moves, and notes.
    let node = json["nodes"].as_array().unwrap().iter().position(|n| n["name"] == "root motion").unwrap();
    assert!(json["scenes"][0]["nodes"].as_array().unwrap().contains(&node.into()));
    let of = channels
        .iter()
        .find(|c| c["target"]["node"] == node && c["target"]["path"] == "translation")
        .unwrap();
    let sampler = &animation["samplers"][of["sampler"].as_u64().unwrap() as usize];
    let noted = &animation["extras"]["sinew"]["rootMotion"];
    let way = noted["translations"].as_array().unwrap();
    let [x, _, z] = floats(&sampler["output"])[3 * (way.len() - 1)..] else { panic!() };
    assert!(
        Vec3::new(x, 0.0, z).length() > 0.5
            && (way.last().unwrap()[0].as_f64().unwrap() - x as f64).abs() < 1e-6
    );
}

#[test]
fn what_moves_no_bone_is_cut_turned_and_joined_with_the_rest() {
    let (dir, [a, ..]) = folder();
    let out = path(&dir, "out.glb");
    let of = |options: &[&str]| {
        let run = sinew(&[&["bake", &a, "-o", &out, "-q", "-f", "--tolerance", "5mm"], options].concat());
        assert!(run.status.success(), "{}", text(&run.stderr));
        let all = gltf::carried(&std::fs::read(&out).unwrap(), None).unwrap();
        assert_eq!((all.len(), all[0].len()), (1, 1));
        let curve = &all[0][0].curve;
        let at = |t: f64| {
            let mut v = [0.0; 3];
            curve.sample(t, &mut v);
            v[0]
        };
        (curve.times().to_vec(), curve.interpolation(), [0.1, 0.4, 0.6, 1.4, 1.6].map(at))
    };
    let hold = Interpolation::Hold;
    assert_eq!(of(&[]), (vec![0.0, 1.0], hold, [1.0, 1.0, 1.0, 0.0, 0.0]));
    assert_eq!(of(&["--speed", "2"]), (vec![0.0, 0.5], hold, [1.0, 1.0, 0.0, 0.0, 0.0]));
    assert_eq!(of(&["--trim", "0.75.."]).2, [1.0, 0.0, 0.0, 0.0, 0.0].map(|v: f32| v));
    assert_eq!(of(&["--reverse"]).2[1], 1.0);
    let joined = of(&["--concat", "both"]);
    assert_eq!(joined.2, [1.0, 1.0, 1.0, 0.0, 0.0]);
}

#[test]
fn a_last_key_that_nobody_can_mean_is_told_and_costs_nothing() {
    let (dir, _) = folder();
    let far = path(&dir, "far.glb");
    std::fs::write(&far, walker(1e30)).unwrap();
    let out = path(&dir, "out.glb");
    for more in [&["--fps", "30"][..], &[]] {
        let run = sinew(&[&["bake", &far, "-o", &out], more].concat());
        assert_eq!(run.status.code(), Some(3), "{}", text(&run.stderr));
        assert!(
            text(&run.stderr).contains("1.000e30 s") && text(&run.stderr).contains("--trim"),
            "{}",
            text(&run.stderr)
        );
    }
    let run = sinew(&["bake", &far, "-o", &out, "--trim", "..0.9"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
}
