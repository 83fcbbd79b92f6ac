//! glTF files built here: what the specification allows is read as it means, anything else is an error with a place.

use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use sinew::character::{Binding, Scratch};
use sinew::io::gltf::{GltfError, import_bytes};
use sinew::io::{Import, Options};
use sinew::scene::{LightKind, Projection};
use sinew::skin::Deformed;

/// A GLB with binary data that accessors share: f32 positions of 5 vertices, drawn as a strip, and what else a test appends.
struct File {
    json: Value,
    bin: Vec<u8>,
}

impl File {
    fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }], "meshes": [{ "primitives": [{ "attributes": {}, "mode": 5 }] }],
            "buffers": [], "bufferViews": [], "accessors": []
        });
        let mut file = Self { json, bin: Vec::new() };
        let p = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., 0., 0., 1.];
        let positions = file.floats("VEC3", &p);
        file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(positions);
        file
    }

    fn accessor(&mut self, bytes: &[u8], kind: u32, shape: &str, count: usize) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() }));
        let view = views.len() - 1;
        self.bin.extend(bytes);
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(json!({ "bufferView": view, "componentType": kind, "type": shape, "count": count }));
        accessors.len() - 1
    }

    fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, shape, values.len() / width)
    }

    fn indices(&mut self, values: &[u16]) {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let i = self.accessor(&bytes, 5123, "SCALAR", values.len());
        self.primitive()["indices"] = json!(i);
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend((28 + text.len() as u32 + bin.len() as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bin)] {
            out.extend((chunk.len() as u32).to_le_bytes());
            out.extend(kind);
            out.extend(chunk);
        }
        out
    }

    fn import(&self) -> Import {
        self.result().unwrap()
    }

    fn result(&self) -> Result<Import, GltfError> {
        import_bytes(&self.bytes(), None, &Options::default())
    }

    fn error(&self) -> String {
        self.result().expect_err("an error").to_string()
    }
}

fn positions(import: &Import, clip: Option<usize>, t: f64, instance: usize) -> Vec<Vec3> {
    let c = &import.asset.character;
    let pose = c.pose(clip, t);
    let posed = c.posed(&pose);
    let mut out = Deformed::default();
    c.deform(instance, &pose, &posed, DVec3::ZERO, &mut Scratch::default(), &mut out);
    out.positions
}

#[test]
fn every_mode_becomes_triangles() {
    let cases: [(u32, &[[u32; 3]]); 7] = [
        (0, &[]),
        (1, &[]),
        (2, &[]),
        (3, &[]),
        (4, &[[0, 1, 2]]),
        (5, &[[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, &[[1, 2, 0], [2, 3, 0], [3, 4, 0]]),
    ];
    for (mode, expected) in cases {
        let mut file = File::new();
        file.primitive()["mode"] = json!(mode);
        let import = file.import();
        let mesh = &import.asset.character.meshes()[0];
        assert_eq!(mesh.triangles, expected, "mode {mode}");
        assert_eq!(mesh.positions.len(), 5);
        assert_eq!(import.warnings.is_empty(), mode >= 5, "mode {mode}: {:?}", import.warnings);
    }
}

#[test]
fn indices_out_of_range_are_named() {
    let mut file = File::new();
    file.indices(&[0, 1, 5]);
    assert_eq!(file.error(), "meshes[0].primitives[0].indices[2]: vertex 5 does not exist; there are 5");
}

#[test]
fn accessors_reach_no_further_than_their_bytes() {
    let mut file = File::new();
    file.json["accessors"][0]["count"] = json!(6);
    assert_eq!(file.error(), "accessors[0]: needs bytes up to 72, but bufferViews[0] has 60");
    file.json["accessors"][0]["count"] = json!(u64::MAX);
    assert!(matches!(file.result(), Err(GltfError::Bytes { .. })));
    file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert!(matches!(file.result(), Err(GltfError::TooLarge { .. })));
    file.json["accessors"][0]["count"] = json!(4);
    assert_eq!(positions(&file.import(), None, 0.0, 0), [Vec3::ZERO; 4]);
}

#[test]
fn integers_normalise_as_the_specification_says() {
    let mut file = File::new();
    let bytes = [0x80u8, 0x81, 0x00, 0x00, 0x7f, 0x40, 0x00, 0x00, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    let a = file.accessor(&bytes, 5120, "VEC3", 5);
    file.json["accessors"][a]["normalized"] = json!(true);
    let view = file.json["accessors"][a]["bufferView"].as_u64().unwrap() as usize;
    file.json["bufferViews"][view]["byteStride"] = json!(4);
    file.primitive()["attributes"]["POSITION"] = json!(a);
    let p = positions(&file.import(), None, 0.0, 0);
    assert_eq!(p[0], Vec3::new(-1.0, -1.0, 0.0));
    assert_eq!(p[1], Vec3::new(1.0, 64.0 / 127.0, 0.0));
}

#[test]
fn a_sheared_matrix_is_kept_and_a_plain_one_is_taken_apart() {
    let mut file = File::new();
    file.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 7, 0, 0, 1]);
    let import = file.import();
    assert!(import.asset.character.skeleton().fixed(sinew::skeleton::BoneId(0)).is_some());
    assert_eq!(positions(&import, None, 0.0, 0)[3], Vec3::new(7.5, 1.0, 0.0));

    file.json["nodes"][0]["matrix"] = json!([0, 2, 0, 0, 3, 0, 0, 0, 0, 0, 1, 0, 7, 0, 0, 1]);
    let import = file.import();
    assert!(import.asset.character.skeleton().fixed(sinew::skeleton::BoneId(0)).is_none());
    assert!((positions(&import, None, 0.0, 0)[2] - Vec3::new(10.0, 2.0, 0.0)).length() < 1e-5);
}

#[test]
fn bones_point_to_their_children() {
    let mut file = File::new();
    file.json["nodes"] = json!([
        { "mesh": 0, "children": [1] }, { "translation": [0, 2, 0], "name": "a" }, { "name": "a" }
    ]);
    let import = file.import();
    let s = import.asset.character.skeleton();
    assert_eq!(import.nodes, [0, 1, 2]);
    assert!((s.tip(s.ids().next().unwrap()) - Vec3::Y * 2.0).length() < 1e-6);
    assert!((s.tip(s.find("a").unwrap()) - Vec3::Y * 2.0).length() < 1e-6, "a leaf goes on");
    assert!(s.find("a_2").is_some() && import.warnings.len() == 1);
}

#[test]
fn nodes_must_be_a_tree() {
    let mut file = File::new();
    file.json["nodes"] = json!([{ "mesh": 0, "children": [0] }]);
    assert!(file.error().contains("own ancestor"), "{}", file.error());
    file.json["nodes"] = json!([{ "children": [2] }, { "children": [2] }, {}]);
    assert!(file.error().starts_with("nodes[1].children[0]: "), "{}", file.error());
    file.json["nodes"] = json!([{ "children": [9] }]);
    assert_eq!(file.error(), "nodes[0].children[0]: node 9 does not exist; there are 1");

    // Not taken for what 32 bits of it say.
    let cases = [
        ("/nodes/0/mesh", "nodes[0].mesh"),
        ("/meshes/0/primitives/0/attributes/POSITION", "meshes[0].primitives[0].attributes.POSITION"),
    ];
    for (pointer, place) in cases {
        let mut file = File::new();
        *file.json.pointer_mut(pointer).unwrap() = json!(1u64 << 32);
        assert_eq!(file.error(), format!("{place}: expected an index below 2³², found 4294967296"));
    }
}

fn skinned() -> File {
    let mut file = File::new();
    let joints = [1u8, 0, 0, 0].repeat(5);
    let weights = [1.0, 0.0, 0.0, 0.0].repeat(5);
    let (j, w) = (file.accessor(&joints, 5121, "VEC4", 5), file.floats("VEC4", &weights));
    file.primitive()["attributes"]["JOINTS_0"] = json!(j);
    file.primitive()["attributes"]["WEIGHTS_0"] = json!(w);
    file.json["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0], "children": [1, 2] },
        { "translation": [1, 0, 0] }, { "translation": [0, 1, 0] }
    ]);
    file.json["skins"] = json!([{ "joints": [1, 2] }]);
    file
}

#[test]
fn a_skin_ignores_its_nodes_transform_and_reads_every_set() {
    let mut file = skinned();
    assert_eq!(positions(&file.import(), None, 0.0, 0)[0], Vec3::new(100.0, 1.0, 0.0));

    // A second set of joints, half of the weight each.
    let (half, joints) = ([0.5, 0.0, 0.0, 0.0].repeat(5), [0u8; 20]);
    let (j, w) = (file.accessor(&joints, 5121, "VEC4", 5), file.floats("VEC4", &half));
    file.primitive()["attributes"]["WEIGHTS_0"] = json!(w);
    file.primitive()["attributes"]["JOINTS_1"] = json!(j);
    file.primitive()["attributes"]["WEIGHTS_1"] = json!(w);
    assert_eq!(positions(&file.import(), None, 0.0, 0)[0], Vec3::new(100.5, 0.5, 0.0));
}

#[test]
fn skins_that_do_not_hold_are_named() {
    let mut file = skinned();
    file.json["skins"][0]["joints"] = json!([1]);
    assert!(file.error().contains("names bone 1, but the skin has 1"), "{}", file.error());
    file.json["skins"][0]["joints"] = json!([1, 77]);
    assert_eq!(file.error(), "skins[0].joints[1]: node 77 does not exist; there are 3");
    let mut file = skinned();
    file.primitive()["attributes"].as_object_mut().unwrap().remove("JOINTS_0");
    let import = file.import();
    assert!(matches!(import.asset.character.instances()[0].binding, Binding::Bone(_)));
    assert!(import.warnings[0].message.contains("no joints"), "{:?}", import.warnings);
}

#[test]
fn keys_are_sorted_and_bad_ones_named() {
    let mut file = File::new();
    let times = file.floats("SCALAR", &[1.0, 0.0, 2.0]);
    let values = file.floats("VEC3", &[1., 0., 0., 0., 0., 0., 5., 0., 0.]);
    file.json["animations"] = json!([{
        "samplers": [{ "input": times, "output": values }],
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } },
                     { "sampler": 0, "target": { "path": "pointer" } }]
    }]);
    let import = file.import();
    assert_eq!(positions(&import, Some(0), 0.5, 0)[0], Vec3::new(0.5, 0.0, 0.0));
    assert_eq!(import.warnings.len(), 2, "{:?}", import.warnings);
    let channels = file.json["animations"][0]["channels"].as_array_mut().unwrap();
    channels.swap(0, 1);
    assert_eq!(file.import().warnings[1].place, "animations[0].channels[1]");
    let bad = file.floats("VEC3", &[0., 0., 0., 0., f32::NAN, 0., 5., 0., 0.]);
    file.json["animations"][0]["samplers"][0]["output"] = json!(bad);
    let e = file.error();
    assert!(e.starts_with("animations[0].channels[1]: key 0: its value is not finite"), "{e}");
}

#[test]
fn rotations_that_are_none_are_said_and_do_no_harm() {
    let mut file = File::new();
    let times = file.floats("SCALAR", &[0.0, 1.0, 2.0]);
    // None at all, one of twice the length, and one as far off as bytes make it.
    let values = file.floats("VEC4", &[0., 0., 0., 0., 0., 0., 2., 0., 0., 0., 0., 1.005]);
    file.json["animations"] = json!([{
        "samplers": [{ "input": times, "output": values }],
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "rotation" } }]
    }]);
    let import = file.import();
    let said = &import.warnings[0];
    assert_eq!((import.warnings.len(), &*said.place), (1, "animations[0].channels[0]"));
    let says = "its key at 0 s is a quaternion of length 0; no rotation is taken (1 more like it)";
    assert_eq!(said.message, says);
    assert_eq!(positions(&import, Some(0), 0.0, 0), positions(&import, None, 0.0, 0));
    let half_turned = positions(&import, Some(0), 1.0, 0);
    assert!(half_turned[1].distance(Vec3::new(-1.0, 0.0, 0.0)) < 1e-6, "{half_turned:?}");
}

#[test]
fn morph_weights_rest_and_move() {
    let mut file = File::new();
    let delta = file.floats("VEC3", &[0., 0., 1.].repeat(5));
    file.primitive()["targets"] = json!([{ "POSITION": delta }, {}]);
    file.json["meshes"][0]["weights"] = json!([0.25, 0.0]);
    let times = file.floats("SCALAR", &[0.0, 1.0]);
    let values = file.floats("SCALAR", &[0.0, 0.0, 1.0, 0.0]);
    file.json["animations"] = json!([{
        "samplers": [{ "input": times, "output": values }],
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }]
    }]);
    let import = file.import();
    assert_eq!(positions(&import, None, 0.0, 0)[0].z, 0.25);
    assert_eq!(positions(&import, Some(0), 0.5, 0)[0].z, 0.5);
}

#[test]
fn required_extensions_must_be_known() {
    let mut file = File::new();
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization", "KHR_materials_sheen"]);
    assert_eq!(file.import().warnings.len(), 1);
    file.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    assert!(file.error().contains("`EXT_mesh_gpu_instancing` is not supported"), "{}", file.error());
}

#[test]
fn cameras_and_lamps_ride_on_bones() {
    let mut file = File::new();
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 5000.0, "spot": { "outerConeAngle": 0.5 } }, { "type": "directional" } ] } });
    file.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }]);
    let lamp = json!({ "KHR_lights_punctual": { "light": 0 } });
    file.json["nodes"] = json!([{ "mesh": 0, "camera": 0, "name": "eye", "extensions": lamp }]);
    let import = file.import();
    let camera = &import.asset.cameras[0];
    assert_eq!((camera.name.as_str(), camera.projection), ("eye", Projection::Perspective { fov_y: 0.7 }));
    let light = &import.asset.lights[0].light;
    assert!(matches!(light.kind, LightKind::Spot { cos_inner: 1.0, .. }));
    assert!(light.color.x > 0.0 && light.color.x < 3.0, "{}", light.color);
}

#[test]
fn uris_stay_in_their_folder() {
    let folder = std::env::temp_dir().join(format!("sinew-uri-{}", std::process::id()));
    let inner = folder.join("in ❤");
    std::fs::create_dir_all(&inner).unwrap();
    std::fs::write(folder.join("secret.bin"), [0u8; 60]).unwrap();
    std::fs::write(inner.join("ü 1.bin"), File::new().bin).unwrap();
    let try_uri = |uri: &str| {
        let mut json = File::new().json;
        json["buffers"] = json!([{ "byteLength": 60, "uri": uri }]);
        let text = format!("\u{feff}{json}");
        import_bytes(text.as_bytes(), Some(&inner), &Options::default()).map_err(|e| e.to_string())
    };
    assert!(
        try_uri("ü%201.bin").is_ok() && try_uri("%C3%BC 1.bin").is_ok() && try_uri("x/../ü 1.bin").is_err()
    );
    for uri in
        ["../secret.bin", "%2e%2e/secret.bin", "..\\secret.bin", "/etc/hostname", "file:///etc/hostname"]
    {
        let e = try_uri(uri).unwrap_err();
        assert!(e.starts_with("buffers[0].uri: the URI"), "{e}");
    }
    assert!(try_uri("gone.bin").unwrap_err().contains("cannot read"));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(folder.join("secret.bin"), inner.join("link.bin")).unwrap();
        assert!(try_uri("link.bin").unwrap_err().contains("through a link"));
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn cut_off_anywhere_is_an_error() {
    let whole = skinned().bytes();
    for end in 0..whole.len() {
        let e = import_bytes(&whole[..end], None, &Options::default()).expect_err("cut off");
        assert!(!e.to_string().is_empty());
    }
}

#[test]
fn many_nodes_with_large_meshes_do_not_eat_memory() {
    let mut file = File::new();
    file.json["meshes"][0]["primitives"] = json!(vec![file.json["meshes"][0]["primitives"][0].clone(); 1000]);
    file.json["nodes"] = json!(vec![json!({ "mesh": 0 }); 20_000]);
    file.json["scenes"] = json!([]);
    file.json.as_object_mut().unwrap().remove("scene");
    assert!(matches!(file.result(), Err(GltfError::TooLarge { .. })));
}

#[test]
fn every_instance_counts_its_deformed_vertices() {
    let mut file = File::new();
    let p = file.floats("VEC3", &[0.5; 60_000]);
    file.primitive()["attributes"]["POSITION"] = json!(p);
    file.json["nodes"] = json!(vec![json!({ "mesh": 0 }); 2000]);
    file.json["scenes"] = json!([]);
    file.json.as_object_mut().unwrap().remove("scene");
    let e = file.error();
    assert!(e.contains("20000 vertices of meshes[0].primitives[0]") && e.contains("bytes allowed"), "{e}");
}

#[test]
fn a_file_behind_many_buffers_is_read_once_and_a_huge_one_never() {
    let folder = std::env::temp_dir().join(format!("sinew-buffers-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let sparse = |name: &str, size: u64| {
        std::fs::File::create(folder.join(name)).unwrap().set_len(size).unwrap();
    };
    sparse("a.bin", 8 << 20);
    sparse("huge.bin", 3 << 30);
    let read = |uri: &str| {
        let mut json = File::new().json;
        json["buffers"] = json!(vec![json!({ "byteLength": 60, "uri": uri }); 1000]);
        import_bytes(json.to_string().as_bytes(), Some(&folder), &Options::default())
    };
    let (many, huge) = (read("a.bin"), read("huge.bin"));
    std::fs::remove_dir_all(&folder).unwrap();
    many.unwrap();
    let e = huge.unwrap_err().to_string();
    assert!(e.starts_with("buffers[0].uri: asks for 3221225472 bytes"), "{e}");
}

/// Pictures of one grey, as data: 4×4, 8192×1, 1×8192, and the beginning of one of 16384×16384.
#[cfg(feature = "pictures")]
const PICTURES: [&str; 4] = [
    "iVBORw0KGgoAAAANSUhEUgAAAAQAAAAECAAAAACMmsGiAAAADklEQVR42mNoAAIGVAIAUBQIAW1N4EkAAAAASUVORK5CYII=",
    "iVBORw0KGgoAAAANSUhEUgAAIAAAAAABCAAAAABTIH+8AAAAH0lEQVR42u3BAQkAAAACoKY3vR2BmgIAAAAAAAAA9wYhWgDxR8gH0QAAAABJRU5ErkJggg==",
    "iVBORw0KGgoAAAANSUhEUgAAAAEAACAACAAAAAA+n3FsAAAAKElEQVR42u3CMQ0AAAACIKMb3Rg+DNIAAAAAAAAAAAAAAAAAAAAAZwNBwgDxrGlb9QAAAABJRU5ErkJggg==",
    "iVBORw0KGgoAAAANSUhEUgAAQAAAAEAACAAAAACMo09YAAAAAElEQVQ1rwYeAAAAAElFTkSuQmCC",
];

/// As many primitives, materials, textures and images as there are places in `pictures`, material `i` with what `look` says.
#[cfg(feature = "pictures")]
fn pictured(pictures: &[usize], look: impl Fn(usize) -> Value) -> Import {
    let mut file = File::new();
    let primitive = file.primitive().clone();
    let mut primitives = vec![primitive; pictures.len()];
    primitives.iter_mut().enumerate().for_each(|(i, p)| p["material"] = json!(i));
    file.json["meshes"][0]["primitives"] = json!(primitives);
    let data = |&k: &usize| json!({ "uri": format!("data:image/png;base64,{}", PICTURES[k]) });
    file.json["images"] = json!(pictures.iter().map(data).collect::<Vec<_>>());
    let count = 0..pictures.len();
    file.json["textures"] = json!(count.clone().map(|i| json!({ "source": i })).collect::<Vec<_>>());
    file.json["materials"] = json!(count.map(look).collect::<Vec<_>>());
    import_bytes(&file.bytes(), None, &Options { textures: true }).unwrap()
}

#[cfg(feature = "pictures")]
#[test]
fn materials_share_what_has_the_same_inputs() {
    let import = pictured(&[0; 2000], |i| {
        let pbr = json!({ "baseColorTexture": { "index": i }, "metallicRoughnessTexture": { "index": 0 } });
        json!({ "pbrMetallicRoughness": pbr, "emissiveTexture": { "index": i } })
    });
    assert_eq!(import.asset.textures.len(), 3, "{:?}", import.warnings);
    let maps = |m: &sinew::scene::Material| {
        [m.diffuse_map, m.specular_map, m.emissive_map].map(|t| t.unwrap().texture)
    };
    let all: Vec<_> = import.asset.materials.iter().map(maps).collect();
    assert!(all.len() == 2000 && all.iter().all(|m| *m == all[0]) && all[0][0] != all[0][1]);
}

#[cfg(feature = "pictures")]
#[test]
fn materials_that_nothing_drawn_uses_go_without_maps() {
    let look = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    let mut file = File::new();
    file.json["images"] = json!([{ "uri": format!("data:image/png;base64,{}", PICTURES[0]) }]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file.json["materials"] = json!([look, look]);
    file.primitive()["material"] = json!(1);
    let import = import_bytes(&file.bytes(), None, &Options { textures: true }).unwrap();
    let maps: Vec<bool> = import.asset.materials.iter().map(|m| m.diffuse_map.is_some()).collect();
    assert_eq!((maps, import.asset.textures.len()), (vec![false, true], 2));
}

#[cfg(feature = "pictures")]
#[test]
fn maps_without_room_are_left_out() {
    // A wide picture and a tall one would meet in a grid of 8192×8192.
    let import = pictured(&[1, 2], |_| {
        json!({ "pbrMetallicRoughness": {
            "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 1 } } })
    });
    assert!(import.warnings[0].message.contains("more than 256 MiB"), "{:?}", import.warnings);
    assert!(import.asset.materials[0].specular_map.is_none() && import.asset.textures.len() == 1);

    // A picture beyond the limit is white.
    let import = pictured(&[3], |_| json!({ "emissiveTexture": { "index": 0 } }));
    assert_eq!(import.warnings[0].place, "images[0]");
    assert!(import.warnings[0].message.contains("256 MiB"), "{:?}", import.warnings);
    assert_eq!(import.asset.textures[0].levels(), [vec![255; 3]]);
}

#[test]
fn a_normal_map_without_normals_leaves_a_surface_flat() {
    let mut file = File::new();
    let (uvs, n) = (file.floats("VEC2", &[0., 0., 1., 0., 1., 1., 0., 1., 0., 0.]), [0., 0., 1.].repeat(5));
    let (normals, t) = (file.floats("VEC3", &n), file.floats("VEC4", &[1., 0., 0., 1.].repeat(5)));
    file.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
    file.primitive()["attributes"]["TANGENT"] = json!(t);
    file.primitive()["material"] = json!(0);
    file.json["materials"] = json!([{ "normalTexture": { "index": 0 } }]);
    let counts = |file: &File| {
        let import = file.import();
        let mesh = &import.asset.character.meshes()[0];
        (mesh.normals.len(), mesh.tangents.len())
    };
    assert_eq!(counts(&file), (0, 0));
    file.primitive()["attributes"].as_object_mut().unwrap().remove("TANGENT");
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    assert_eq!(counts(&file), (5, 5));
    let turned = json!({ "KHR_texture_transform": { "rotation": 1.0 } });
    file.json["materials"][0]["normalTexture"]["extensions"] = turned;
    assert_eq!(counts(&file), (5, 0));
}

#[test]
fn what_is_left_out_is_said() {
    let mut file = skinned();
    let uvs = file.floats("VEC2", &[0.0; 10]);
    let (colors, joints) =
        (file.floats("VEC4", &[1.0; 20]), file.primitive()["attributes"]["JOINTS_0"].clone());
    file.primitive()["attributes"]["TEXCOORD_2"] = json!(uvs);
    file.primitive()["attributes"]["COLOR_1"] = json!(colors);
    file.primitive()["attributes"]["JOINTS_1"] = joints;
    file.json["cameras"] = json!([
        { "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1, "aspectRatio": 1.5 } },
        { "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 1, "znear": 0.1, "zfar": 9 } }
    ]);
    file.json["nodes"][1]["camera"] = json!(0);
    file.json["nodes"][2]["camera"] = json!(1);
    let warnings: Vec<String> = file.import().warnings.iter().map(|w| w.to_string()).collect();
    for word in [
        "COLOR_0",
        "TEXCOORD_1",
        "joints but no weights",
        "cameras[0]: its aspectRatio",
        "cameras[1]: its xmag",
    ] {
        assert!(warnings.iter().any(|w| w.contains(word)), "{word}: {warnings:?}");
    }
}

#[test]
fn chains_of_small_scales_have_finite_bones() {
    let mut file = File::new();
    let leaf = |k: usize| json!({ "scale": [1e-8, 1e-8, 1e-8], "children": [k + 1] });
    let mut nodes =
        vec![json!({ "mesh": 0, "children": [1] }), json!({ "translation": [1, 0, 0], "children": [2] })];
    nodes.extend((2..12).map(leaf));
    nodes.push(json!({}));
    file.json["nodes"] = json!(nodes);
    let import = file.import();
    let s = import.asset.character.skeleton();
    assert!(s.ids().all(|b| s.tip(b).is_finite()));
}
