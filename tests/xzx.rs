//! Quaternions and angles: nothing flips, and files of either kind show the same.

use crate::rng::Rng;
use glam::{Affine3A, DQuat, DVec3, Quat, Vec2, Vec3};
use sinew::asset::Asset;
use sinew::bake::{BakeDesc, Gauge, xzx};
use sinew::character::{Binding, Character, Instance, MeshId};
use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
use sinew::io::{Options, gltf, rig_json};
use sinew::math::{Trs, euler};
use sinew::mesh::{MaterialId, Mesh, MeshData, MorphTarget};
use sinew::scene::{Content, Filter, Material, Texture, TextureId, TextureRef, WrapMode};
use sinew::skeleton::{BoneDesc, BoneId, Skeleton};
use sinew::skin::Weights;
use std::f64::consts::TAU;

fn angle(a: DQuat, b: DQuat) -> f64 {
    let d = a.conjugate() * b;
    2.0 * d.xyz().length().atan2(d.w.abs())
}

#[test]
fn nothing_flips_in_a_hundred_thousand_sequences_about_rest() {
    let mut rng = Rng::new(51);
    let mut flips = [0; 2];
    // Each angle by whole turns on its own: what must not be done.
    let alone = |q: DQuat, p: [f64; 3]| {
        let t = euler::xzx_from_rotation_f64(q, None);
        [0, 1, 2].map(|k| t[k] - TAU * ((t[k] - p[k]) / TAU).round())
    };
    for _ in 0..100_000 {
        let size = 10_f64.powf(rng.range(-4.0, -0.5));
        let mut last = [([0.0; 3], DQuat::IDENTITY); 2];
        for _ in 0..5 {
            let axis = DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
            let q = DQuat::from_axis_angle(axis.normalize_or(DVec3::X), rng.range(-size, size));
            for (way, (p, before)) in last.iter_mut().enumerate() {
                let t = if way == 0 { euler::nearest_xzx(q, *p, 1e-9)[0] } else { alone(q, *p) };
                // Bends below 1e-7 have no direction.
                assert!(angle(euler::rotation_from_xzx_f64(t), q) < 5e-7);
                // Halfway between two rotations that are both within `size` of rest, nothing is farther from it than both together.
                let mid = euler::rotation_from_xzx_f64([0, 1, 2].map(|k| 0.5 * (t[k] + p[k])));
                flips[way] += usize::from(angle(mid, before.slerp(q, 0.5)) > 3.0 * size);
                (*p, *before) = (t, q);
            }
        }
    }
    assert_eq!(flips[0], 0);
    assert!(flips[1] > 1000, "angles unwrapped alone flip: {}", flips[1]);
}

/// A skinned tube of two bones with a blend shape and a picture, a box on the tip, and a clip that moves all of it.
fn puppet() -> Asset {
    let mut bones = vec![BoneDesc { length: 1.0, ..BoneDesc::new("root") }];
    for k in 1..3 {
        let rest = Trs { translation: Vec3::Y, rotation: Quat::from_rotation_x(0.3), ..Trs::IDENTITY };
        let aim = Quat::from_rotation_z(1.5);
        bones.push(BoneDesc {
            parent: Some(k - 1),
            rest,
            aim,
            length: 1.0,
            ..BoneDesc::new(format!("b{k}"))
        });
    }
    let (skeleton, of) = Skeleton::new(bones).unwrap();
    let ring = |y: f32| [[0.2, 0.0], [-0.1, 0.15], [-0.1, -0.15]].map(|[x, z]: [f32; 2]| Vec3::new(x, y, z));
    let positions: Vec<Vec3> = [0.0, 0.7, 1.4, 2.0].into_iter().flat_map(ring).collect();
    let v = positions.len();
    let side = |i: u32| {
        let (row, k) = (3 * (i / 3), i % 3);
        let [a, b] = [row + k, row + (k + 1) % 3];
        [[a, b, b + 3], [a, b + 3, a + 3]]
    };
    let swell = positions.iter().map(|p| Vec3::new(p.x, 0.0, p.z)).collect();
    let data = MeshData {
        name: "tube".into(),
        normals: positions.iter().map(|p| Vec3::new(p.x, 0.0, p.z).normalize()).collect(),
        uvs: [positions.iter().map(|p| Vec2::new(p.x + 0.5, 0.4 * p.y)).collect(), vec![]],
        triangles: (0..9).flat_map(side).collect(),
        targets: vec![MorphTarget { positions: swell, ..Default::default() }],
        material: Some(MaterialId(0)),
        positions,
        ..Default::default()
    };
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let flag = MeshData {
        name: "flag".into(),
        positions: corners,
        triangles: vec![[0, 1, 2]],
        ..Default::default()
    };
    let row = |i: usize| [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.0, 0.0, 1.0]][i / 3];
    let weights: Vec<f32> = (0..v).flat_map(row).collect();
    let (weights, _) = Weights::new(3, &[0, 1, 2].repeat(v), &weights, 3, 0).unwrap();
    let bare = Character::new(skeleton.clone(), vec![], vec![], vec![], vec![]).unwrap();
    let rest = bare.posed(&bare.rest_pose());
    let inverse = |b: &BoneId| (*b, rest.near(*b, DVec3::ZERO).inverse());
    let palette: Vec<(BoneId, Affine3A)> = of.iter().map(inverse).collect();
    let instances = vec![
        Instance { mesh: MeshId(0), binding: Binding::Skin { palette, weights }, first_weight: 0 },
        Instance { mesh: MeshId(1), binding: Binding::Bone(of[2]), first_weight: 0 },
    ];
    let meshes = vec![Mesh::new(data).unwrap(), Mesh::new(flag).unwrap()];
    let clips = vec![wave(&of)];
    let character = Character::new(skeleton, meshes, instances, vec![0.25], clips).unwrap();
    let wrap = [WrapMode::Repeat; 2];
    let texture = Texture::new(1, 1, vec![9, 8, 7, 255], Content::Color, wrap, Filter::Trilinear).unwrap();
    let map = TextureRef { texture: TextureId(0), uv_set: 0, transform: glam::Affine2::IDENTITY };
    let paint = Material { name: "paint".into(), diffuse_map: Some(map), ..Material::default() };
    Asset { character, materials: vec![paint], textures: vec![texture], ..Asset::default() }
}

fn wave(of: &[BoneId]) -> Clip {
    let mut rng = Rng::new(52);
    let times: Vec<f64> = (0..9).map(|k| k as f64 * 0.25).collect();
    let mut curve = |width: usize, kind, value: &mut dyn FnMut(&mut Rng) -> Vec<f32>| {
        let values = times.iter().flat_map(|_| value(&mut rng)).collect();
        Curve::new(times.clone(), values, width, kind).unwrap()
    };
    let turn = |rng: &mut Rng| {
        let axis = rng.point(1.0).normalize_or(Vec3::X);
        (Quat::from_rotation_x(0.3) * Quat::from_axis_angle(axis, rng.span(-1.5, 1.5))).to_array().to_vec()
    };
    let tracks = vec![
        Track { target: Target::Rotation(of[1]), curve: curve(4, Interpolation::Linear, &mut { turn }) },
        Track { target: Target::Rotation(of[2]), curve: curve(4, Interpolation::Hold, &mut { turn }) },
        Track {
            target: Target::Translation(of[0]),
            curve: curve(3, Interpolation::Linear, &mut |r| r.point(0.5).to_array().to_vec()),
        },
        Track {
            target: Target::Weights { first: 0 },
            curve: curve(1, Interpolation::Linear, &mut |r| vec![r.span(0.0, 1.0)]),
        },
    ];
    Clip { name: "wave".into(), tracks }
}

/// Where all vertices stand, all through the clip.
fn film(c: &Character, clip: &Clip) -> Vec<DVec3> {
    // By name: a file may list what it draws in another order.
    let mut order: Vec<usize> = (0..c.instances().len()).collect();
    order.sort_by_key(|i| c.mesh(&c.instances()[*i]).name.clone());
    let at = |k: usize| {
        let mut pose = c.rest_pose();
        clip.sample(c.skeleton(), k as f64 * 2.0 / 240.0 + 1e-3, &mut pose);
        let bones = sinew::fk::forward_f64(c.skeleton(), &pose);
        order.iter().flat_map(|i| c.positions_f64(*i, &pose, &bones)).collect::<Vec<_>>()
    };
    (0..240).flat_map(at).collect()
}

fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max)
}

#[test]
fn a_rig_of_angles_becomes_gltf_and_comes_back() {
    let asset = puppet();
    let c = &asset.character;
    let clip = &c.clips()[0];
    let truth = film(c, clip);
    let desc = BakeDesc { tolerance: 1e-3, ..BakeDesc::default() };
    let angles = xzx::to_xzx(c, clip, &desc).unwrap();
    assert!(!angles.clip.tracks.iter().any(|t| matches!(t.target, Target::Rotation(_))));
    assert!(angles.clip.tracks.iter().any(|t| t.curve.interpolation() == Interpolation::Hold));
    assert!(apart(&truth, &film(c, &angles.clip)) <= 1e-3);

    // Our own files hold all of it.
    let rig = rig_json::export("puppet", &asset, &["p.png".into()]);
    let poses = rig_json::export_poses(c, std::slice::from_ref(&angles.clip));
    assert!(rig.warnings.is_empty() && poses.warnings.is_empty(), "{:?} {:?}", rig.warnings, poses.warnings);
    let mut rig = rig.document;
    rig.poses = Some(vec!["p.json".into()]);
    let text = poses.document.to_text();
    let fetch = |_: &str| Ok(text.clone().into_bytes());
    let again = rig_json::import_bytes(rig.to_text().as_bytes(), &Options::default(), &fetch)
        .unwrap()
        .asset
        .character;
    assert!(apart(&film(c, &angles.clip), &film(&again, &again.clips()[0])) < 1e-5);

    // glTF of it, read again.
    let back = xzx::to_quat(&again, &again.clips()[0], &desc).unwrap();
    let new = gltf::NewClip { clip: &back.clip, short: &back.short, replaces: None, carried: None };
    let png = sinew::io::picture::encode_png(
        &sinew::image::Rgba8 { width: 1, height: 1, data: vec![9, 8, 7, 255] },
        Default::default(),
    );
    let asset = Asset { character: again, ..asset };
    let (file, warnings) = gltf::write(&asset, &[png.unwrap()], &[new], Default::default()).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let read = gltf::import_bytes(&file.glb(), None, &Options { textures: true }).unwrap();
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
    let c = &read.asset.character;
    assert!(apart(&truth, &film(c, &c.clips()[0])) <= 2e-3);
    assert_eq!(read.asset.textures[0].rgba(), [9, 8, 7, 255]);
    assert_eq!((c.rest_pose().weights, c.meshes().iter().map(|m| m.uvs[0].len()).sum()), (vec![0.25], 12));
    assert_eq!(c.skeleton().name(BoneId(2)), "b2");
}

#[test]
fn aims_of_a_plain_skeleton_run_along_its_bones_and_move_nothing() {
    let asset = puppet();
    let c = &asset.character;
    let mut descs: Vec<BoneDesc> = c.skeleton().ids().map(|b| c.skeleton().desc(b)).collect();
    descs.iter_mut().for_each(|d| (d.aim, d.length) = (Quat::IDENTITY, 0.0));
    let (plain, _) = Skeleton::new(descs).unwrap();
    let parts = (c.meshes().to_vec(), c.instances().to_vec());
    let plain = Character::new(plain, parts.0, parts.1, vec![0.25], c.clips().to_vec()).unwrap();
    let aimed = xzx::with_aims(&plain);
    let tip = aimed.skeleton().tip(BoneId(1));
    assert!(tip.distance(Vec3::Y) < 1e-6 && aimed.skeleton().length(BoneId(2)) > 0.9, "{tip}");
    assert_eq!(apart(&film(&plain, &plain.clips()[0]), &film(&aimed, &aimed.clips()[0])), 0.0);
    assert_eq!(Gauge::new(&aimed, 1).diagonal(), Gauge::new(c, 1).diagonal());
}
