//! Vertices in integers: where they are is within what is stated, and nothing else notices.

use crate::cli::{path, sinew, text};
use crate::edits::File;
use glam::DVec3;
use serde_json::{Value, json};
use sinew::bake::{BakeDesc, vertices};
use sinew::fk;
use sinew::io::gltf::{self, MeshForm, NewClip, Rewritten};
use sinew::io::{Import, Options};
use std::collections::BTreeMap;

/// Two dice that share a mesh of two primitives with a sparse morph target, one of them carrying a camera, and two tubes that share a mesh with
/// a skin each, one of which has no matrices. All of it moves for a second.
fn troupe() -> Vec<u8> {
    let mut f = File::default();
    let wave =
        |k: usize| [(k as f32 * 2.4).sin(), (k as f32 * 1.1).cos() * 0.3 + 4.0, (k as f32 * 0.7).sin() * 0.5];
    let die = f.floats(&(0..24).flat_map(wave).collect::<Vec<f32>>(), "VEC3");
    let normal = |k: usize| glam::Vec3::from(wave(k)).normalize().to_array();
    let normals = f.floats(&(0..24).flat_map(normal).collect::<Vec<f32>>(), "VEC3");
    let swell = f.floats(&[0.4, 0.0, -0.1, 0.0, 1.7, 0.0], "VEC3");
    f.bin.extend([3, 9, 0, 0]);
    f.views.push(json!({"buffer": 0, "byteOffset": f.bin.len() - 4, "byteLength": 2}));
    let values = f.accessors[swell]["bufferView"].take();
    f.accessors[swell] = json!({"componentType": 5126, "count": 24, "type": "VEC3", "min": [0, 0, -0.1], "max": [0.4, 1.7, 0],
        "sparse": {"count": 2, "indices": {"bufferView": f.views.len() - 1, "componentType": 5121}, "values": {"bufferView": values}}});
    let ring = |k: usize| {
        let (s, c) = (k as f32 * 0.8).sin_cos();
        [0.2 * c, k as f32 / 40.0, 0.2 * s]
    };
    let tube = f.floats(&(0..80).flat_map(ring).collect::<Vec<f32>>(), "VEC3");
    let part = |k: usize| (k as f32 / 79.0 - 0.013).clamp(0.0, 1.0);
    let weights =
        f.floats(&(0..80).flat_map(|k| [1.0 - part(k), part(k), 0.0, 0.0]).collect::<Vec<f32>>(), "VEC4");
    let bytes = |f: &mut File, bytes: Vec<u8>, accessor: Value| {
        f.views.push(json!({"buffer": 0, "byteOffset": f.bin.len(), "byteLength": bytes.len()}));
        f.bin.extend(bytes);
        f.accessors.push(accessor);
        let view = f.views.len() - 1;
        f.accessors.last_mut().unwrap()["bufferView"] = view.into();
        f.accessors.len() - 1
    };
    let joints: Vec<u8> = (0..80).flat_map(|_| [0u16, 1, 0, 0]).flat_map(u16::to_le_bytes).collect();
    let joints = bytes(&mut f, joints, json!({"componentType": 5123, "count": 80, "type": "VEC4"}));
    let fan = |f: &mut File, n: u32| {
        let all: Vec<u8> = (1..n - 1).flat_map(|k| [0, k, k + 1]).flat_map(u32::to_le_bytes).collect();
        bytes(f, all, json!({"componentType": 5125, "count": 3 * (n - 2), "type": "SCALAR"}))
    };
    let (few, some, many) = (fan(&mut f, 12), fan(&mut f, 24), fan(&mut f, 80));
    let bind = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 1.0];
    let mut unmoved = bind;
    unmoved[13] = 0.0;
    f.accessors.push(json!({"componentType": 5126, "count": 2, "type": "MAT4", "bufferView": f.views.len()}));
    let matrices = f.accessors.len() - 1;
    f.views.push(json!({"buffer": 0, "byteOffset": f.bin.len(), "byteLength": 128}));
    f.bin.extend([unmoved, bind].concat().iter().flat_map(|v: &f32| v.to_le_bytes()));
    let times = f.floats(&[0.0, 0.4, 1.0], "SCALAR");
    let turn = f.floats(&[0.0, 0.0, 0.0, 1.0, 0.6, 0.0, 0.0, 0.8, 0.0, 0.6, 0.0, 0.8], "VEC4");
    let swells = f.floats(&[0.0, 1.0, 0.3], "SCALAR");
    let primitive = |indices: usize| json!({"attributes": {"POSITION": die, "NORMAL": normals}, "targets": [{"POSITION": swell}], "indices": indices});
    let channel = |sampler: usize, node: usize, path: &str| json!({"sampler": sampler, "target": {"node": node, "path": path}});
    f.done(json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 3, 4, 7]}],
        "scene": 0,
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "nodes": [
            {"name": "die", "mesh": 0, "weights": [0.2], "children": [1, 2], "scale": [1, 2, 1]},
            {"name": "camera", "camera": 0, "translation": [0, 1, 5]},
            {"name": "other", "mesh": 0, "translation": [3, 0, 0]},
            {"name": "tube", "mesh": 1, "skin": 0},
            {"name": "upper", "children": [5]},
            {"name": "lower", "translation": [0, 1, 0]},
            {"name": "twin", "mesh": 1, "skin": 1},
            {"name": "stage", "translation": [0, 0, -4], "children": [6]},
        ],
        "skins": [{"joints": [4, 5], "inverseBindMatrices": matrices}, {"joints": [0, 5]}],
        "meshes": [{"primitives": [primitive(few), primitive(some)], "weights": [0.7]},
            {"primitives": [{"attributes": {"POSITION": tube, "JOINTS_0": joints, "WEIGHTS_0": weights}, "indices": many}]}],
        "animations": [{"name": "all",
            "samplers": [{"input": times, "output": turn}, {"input": times, "output": swells}],
            "channels": [channel(0, 0, "rotation"), channel(0, 5, "rotation"), channel(1, 0, "weights"), channel(1, 2, "weights")]}],
    }))
}

fn import(bytes: &[u8]) -> Import {
    gltf::import_bytes(bytes, None, &Options::default()).unwrap()
}

/// All vertices at a time, by the name of the node of old that carries them and by mesh and primitive.
fn places(import: &Import, t: f64) -> BTreeMap<(String, u32, u32), Vec<DVec3>> {
    let c = &import.asset.character;
    let mut pose = c.rest_pose();
    c.clips()[0].sample(c.skeleton(), t, &mut pose);
    let bones = fk::forward_f64(c.skeleton(), &pose);
    let node = |p: u32| import.nodes.iter().position(|n| *n == p).unwrap();
    let each = import.primitives.iter().enumerate().map(|(i, p)| {
        let bone = c.skeleton().ids().nth(node(p.node)).unwrap();
        let name = c.skeleton().name(bone);
        let carrier = if name.starts_with("node_") { c.skeleton().parent(bone).unwrap() } else { bone };
        ((c.skeleton().name(carrier).to_owned(), p.mesh, p.primitive), c.positions_f64(i, &pose, &bones))
    });
    each.collect()
}

/// The farthest that a vertex of one is from the same of the other, at any of many times.
fn apart(a: &Import, b: &Import) -> f64 {
    let one = |t: f64| {
        let (a, b) = (places(a, t), places(b, t));
        assert!(a.keys().eq(b.keys()), "{:?} {:?}", a.keys(), b.keys());
        let pairs = a.values().flatten().zip(b.values().flatten());
        pairs.map(|(p, q)| p.distance(*q)).fold(0.0, f64::max)
    };
    (0..=400).map(|k| one(k as f64 / 400.0)).fold(0.0, f64::max)
}

/// The file with its own clips, and vertices of these forms; the groups of its meshes.
fn quantized(bytes: &[u8], form: MeshForm) -> (Rewritten, Vec<usize>) {
    let import = import(bytes);
    let clips = import.asset.character.clips();
    let new = NewClip { clip: &clips[0], short: &[], replaces: Some(0), carried: None };
    let mut out =
        gltf::changed(bytes, None, &import, gltf::Change { clips: &[new], ..Default::default() }).unwrap();
    let groups = out.quantize(&[0, 1].map(|g| (g, form)).into()).unwrap();
    (out, groups)
}

#[test]
fn vertices_in_integers_are_where_the_stated_cost_allows() {
    let bytes = troupe();
    let source = import(&bytes);
    let c = &source.asset.character;
    let desc = BakeDesc { tolerance: 1.0, ..BakeDesc::default() };
    let mut last = f64::INFINITY;
    for (positions, weights, least, most) in [
        (true, 8, 1e-4, 1e-2),
        (true, 16, 1e-6, 1e-3),
        (true, 32, 1e-6, 1e-3),
        (false, 8, 1e-4, 1e-2),
        (false, 32, 0.0, 1e-9),
    ] {
        let (out, groups) = quantized(&bytes, MeshForm { positions, weights });
        assert_eq!(groups, [0, 1]);
        let again = import(&out.glb());
        assert!(again.warnings.is_empty(), "{:?}", again.warnings);
        let changed = gltf::vertices_of(&source, &again).unwrap();
        let cost = vertices::changed(c, &changed, &c.clips()[0], &desc);
        let off = apart(&source, &again);
        assert!(
            off <= cost.ceiling + 1e-6 && off > 0.9 * cost.worst.distance - 1e-6,
            "{positions} {weights}: {off} {cost:?}"
        );
        assert!((least..=most).contains(&cost.ceiling), "{positions} {weights}: {cost:?}");
        assert!(cost.ceiling <= 1.05 * cost.worst.distance + 1e-7, "{cost:?}");
        if positions {
            assert!(cost.ceiling <= last);
            last = cost.ceiling;
        }
    }
}

#[test]
fn what_undoes_the_grid_is_seen_by_the_mesh_alone() {
    let bytes = troupe();
    let (out, _) = quantized(&bytes, MeshForm::default());
    let (a, b) = (import(&bytes), import(&out.glb()));
    // Whatever hangs on the nodes is where it was, to the bit.
    for name in ["die", "camera", "other", "upper", "lower", "stage"] {
        let at = |i: &Import, t: f64| {
            let c = &i.asset.character;
            let mut pose = c.rest_pose();
            c.clips()[0].sample(c.skeleton(), t, &mut pose);
            fk::forward_f64(c.skeleton(), &pose)[c.skeleton().find(name).unwrap().index()]
        };
        (0..=20).for_each(|k| assert_eq!(at(&a, k as f64 / 20.0), at(&b, k as f64 / 20.0), "{name}"));
    }
    let json = &out.json;
    assert_eq!(
        (&json["extensionsRequired"], &json["extensionsUsed"]),
        (&json!(["KHR_mesh_quantization"]), &json!(["KHR_mesh_quantization"]))
    );
    let accessor = |i: &Value| &json["accessors"][i.as_u64().unwrap() as usize];
    let die = &json["meshes"][0]["primitives"];
    assert_eq!(die[0]["attributes"], die[1]["attributes"]);
    assert_eq!(accessor(&die[0]["attributes"]["POSITION"])["componentType"], 5122);
    assert_eq!(accessor(&die[0]["attributes"]["NORMAL"])["componentType"], 5120);
    // Two of 24 differences stay two.
    assert_eq!(accessor(&die[0]["targets"][0]["POSITION"])["sparse"]["count"], 2);
    let tube = &json["meshes"][1]["primitives"][0];
    assert_eq!(
        ["JOINTS_0", "WEIGHTS_0"].map(|k| &accessor(&tube["attributes"][k])["componentType"]),
        [5121, 5121]
    );
    assert_eq!(accessor(&tube["indices"])["componentType"], 5123);
    let view = &json["bufferViews"]
        [accessor(&tube["attributes"]["WEIGHTS_0"])["bufferView"].as_u64().unwrap() as usize];
    assert_eq!(view["byteStride"], 4);
    let offset = |v: &Value| v["byteOffset"].as_u64().unwrap_or(0) as usize;
    let from = offset(view) + offset(accessor(&tube["attributes"]["WEIGHTS_0"]));
    for row in out.bin[from..from + 320].chunks(4) {
        assert_eq!(row.iter().map(|w| *w as u32).sum::<u32>(), 255);
    }
    // What was floats is gone, and a second time there is nothing left to do.
    assert!(out.bin.len() < bytes.len() / 3, "{} {}", out.bin.len(), bytes.len());
    let (mut twice, glb) = (out.clone(), out.glb());
    twice.quantize(&BTreeMap::new()).unwrap();
    assert_eq!(twice.glb(), glb);
    twice.compress().unwrap();
    assert_eq!(apart(&b, &import(&twice.glb())), 0.0);
}

/// Bake into a folder; the file that came out.
fn baked(dir: &tempfile::TempDir, input: &str, options: &[&str]) -> Result<Vec<u8>, (Option<i32>, String)> {
    let out = path(dir, "out.glb");
    let run = sinew(&[&["bake", input, "-o", &out, "-f", "-q"], options].concat());
    match run.status.success() {
        true => Ok(std::fs::read(out).unwrap()),
        false => Err((run.status.code(), text(&run.stderr))),
    }
}

#[test]
fn integers_and_clips_share_one_tolerance() {
    let dir = tempfile::tempdir().unwrap();
    let input = path(&dir, "in.glb");
    std::fs::write(&input, troupe()).unwrap();
    let source = import(&troupe());
    let mut sizes = vec![];
    for tolerance in [1e-1, 1e-3, 1e-5] {
        for more in [None, Some("--meshopt")] {
            let asked = tolerance.to_string();
            let options: Vec<&str> =
                ["--quantize-mesh", "--tolerance", &asked].into_iter().chain(more).collect();
            let bytes = baked(&dir, &input, &options).unwrap();
            let again = import(&bytes);
            let off = apart(&source, &again);
            assert!(off <= tolerance, "{off} of {tolerance}");
            sizes.push(bytes.len());
            let told = &serde_json::from_slice::<Value>(
                &bytes[20..20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize],
            )
            .unwrap()["asset"]["extras"]["sinew"];
            let stated = told["clips"][0]["error"].as_f64().unwrap();
            assert!(
                off <= stated
                    && stated <= tolerance
                    && told["mesh"]["error"].as_f64().unwrap() <= tolerance / 3.0,
                "{told}"
            );
        }
    }
    assert!(sizes[0] < sizes[4], "{sizes:?}");
    // Without a clip the rest counts.
    let mut still = source.clone();
    still.asset.character = still.asset.character.with_clips(vec![]).unwrap();
    let file = gltf::changed(&troupe(), None, &still, Default::default()).unwrap();
    std::fs::write(&input, file.glb()).unwrap();
    assert!(baked(&dir, &input, &["--quantize-mesh"]).unwrap().len() < file.glb().len());
    // A rig of ours is no glTF.
    let (code, said) = baked(&dir, "rigs/pip.json", &["--quantize-mesh"]).unwrap_err();
    assert!(code == Some(2) && said.contains("bake to a .glb first"), "{said}");
}

/// A triangle that swells for a second, by weights of so many bits.
fn swelling(bits: usize) -> Vec<u8> {
    let mut f = File::default();
    let triangle = f.floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], "VEC3");
    let shift = f.floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0], "VEC3");
    let times = f.floats(&(0..=40).map(|k| k as f32 / 40.0).collect::<Vec<f32>>(), "SCALAR");
    let unit = ((1u32 << bits) - 1) as f32;
    let value = |k: usize| ((k as f32 * 0.37).sin().abs() * unit).round() as u32;
    let bytes: Vec<u8> = (0..=40).flat_map(|k| value(k).to_le_bytes()[..bits / 8].to_vec()).collect();
    f.views.push(json!({"buffer": 0, "byteOffset": f.bin.len(), "byteLength": bytes.len()}));
    f.bin.extend(bytes);
    f.bin.resize(f.bin.len().next_multiple_of(4), 0);
    let code = if bits == 8 { 5121 } else { 5123 };
    f.accessors.push(json!({"componentType": code, "normalized": true, "count": 41, "type": "SCALAR", "bufferView": f.views.len() - 1}));
    let weights = f.accessors.len() - 1;
    f.done(json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "flag", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": triangle}, "targets": [{"POSITION": shift}]}]}],
        "animations": [{"name": "swell", "samplers": [{"input": times, "output": weights}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}],
    }))
}

#[test]
fn weights_that_were_integers_stay_integers() {
    let dir = tempfile::tempdir().unwrap();
    let input = path(&dir, "in.glb");
    for bits in [8, 16] {
        std::fs::write(&input, swelling(bits)).unwrap();
        // So little that every key is needed.
        for (tolerance, same) in [("0.000000001", true), ("5%", false)] {
            let bytes = baked(&dir, &input, &["--tolerance", tolerance]).unwrap();
            let json: Value = serde_json::from_slice(
                &bytes[20..20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize],
            )
            .unwrap();
            let output = json["animations"][0]["samplers"][0]["output"].as_u64().unwrap() as usize;
            let accessor = &json["accessors"][output];
            let code = if bits == 8 || !same { 5121 } else { 5123 };
            assert_eq!(
                (&accessor["componentType"], &accessor["normalized"]),
                (&json!(code), &json!(true)),
                "{bits} {tolerance}"
            );
            assert!(accessor["count"].as_u64().unwrap() <= 41);
            let (a, b) = (import(&swelling(bits)), import(&bytes));
            let off = apart(&a, &b);
            assert!(if same { off < 1e-9 } else { off < 0.08 }, "{off}");
        }
    }
}
