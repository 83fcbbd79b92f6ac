//! Forms other than keys in glTF: packed clips, stills, moving points, fewer influences.

use crate::rng::Rng;
use glam::{Affine3A, Quat, Vec3};
use sinew::asset::Asset;
use sinew::bake::{BakeDesc, bake, pack, vertices};
use sinew::character::{Binding, Character, Instance, MeshId};
use sinew::clip::{Clip, Curve, Interpolation, Packed, Target, Track};
use sinew::fk;
use sinew::io::still::{self, Stance};
use sinew::io::{Options, gltf, obj, pc2, ply, sinew_clip, stl};
use sinew::math::Trs;
use sinew::mesh::topology::HalfEdges;
use sinew::mesh::{Mesh, MeshData, MorphTarget};
use sinew::pose::Pose;
use sinew::skeleton::{BoneDesc, BoneId, Skeleton};
use sinew::skin::Weights;

/// A closed square tube along +x over five bones of half a metre, cut open along all its edges, and a morph target that swells it. Every vertex
/// follows all bones, those that are near most.
fn tube() -> (Character, Vec<BoneId>) {
    let bone = |i: usize| BoneDesc {
        parent: i.checked_sub(1),
        rest: Trs { translation: if i > 0 { Vec3::X * 0.5 } else { Vec3::ZERO }, ..Trs::IDENTITY },
        ..BoneDesc::new(format!("b{i}"))
    };
    let (skeleton, bones) = Skeleton::new((0..5).map(bone).collect()).unwrap();
    let ring = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]];
    let at = |k: usize, c: usize| Vec3::new(k as f32 * 0.25, ring[c % 4][0], ring[c % 4][1]);
    let mut m = MeshData { name: "tube".into(), ..MeshData::default() };
    let mut quad = |corners: [Vec3; 4]| {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let first = m.positions.len() as u32;
        m.positions.extend(corners);
        m.normals.extend([normal; 4]);
        m.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    };
    for k in 0..8 {
        (0..4).for_each(|c| quad([at(k, c), at(k, c + 1), at(k + 1, c + 1), at(k + 1, c)]));
    }
    quad([at(0, 0), at(0, 3), at(0, 2), at(0, 1)]);
    quad([at(8, 0), at(8, 1), at(8, 2), at(8, 3)]);
    m.targets = vec![MorphTarget {
        positions: m.positions.iter().map(|p| Vec3::new(0.0, p.y, p.z)).collect(),
        ..Default::default()
    }];
    let mut of = vec![];
    for p in &m.positions {
        of.extend((0..5).map(|b| 1.0 / (0.02 + (p.x - (b as f32 * 0.5 + 0.25)).powi(2))));
    }
    of.chunks_mut(5).for_each(|w| {
        let sum: f32 = w.iter().sum();
        w.iter_mut().for_each(|w| *w /= sum);
    });
    let index: Vec<u32> = (0..m.positions.len()).flat_map(|_| 0..5).collect();
    let (weights, _) = Weights::new(5, &index, &of, 5, 0).unwrap();
    let palette =
        (0..5).map(|b| (bones[b], Affine3A::from_translation(Vec3::X * (-0.5 * b as f32)))).collect();
    let instance = Instance { mesh: MeshId(0), binding: Binding::Skin { palette, weights }, first_weight: 0 };
    (Character::new(skeleton, vec![Mesh::new(m).unwrap()], vec![instance], vec![0.0], vec![]).unwrap(), bones)
}

/// Smooth bends, a spin of three turns, steps, a walk in straight pieces and a weight that rises.
fn dance(bones: &[BoneId]) -> Clip {
    let times: Vec<f64> = (0..=90).map(|k| k as f64 / 30.0).collect();
    let turn = |b: usize, of: &dyn Fn(f64) -> Quat| {
        let values = times.iter().flat_map(|t| of(*t).to_array()).collect();
        Track {
            target: Target::Rotation(bones[b]),
            curve: Curve::new(times.clone(), values, 4, Interpolation::Linear).unwrap(),
        }
    };
    let curve = |t: Vec<f64>, v: Vec<f32>, w, i| Curve::new(t, v, w, i).unwrap();
    let steps = [0.0, 0.4, 0.4].map(|a: f32| Quat::from_rotation_y(a).to_array()).concat();
    let walk = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 2.0];
    let tracks = vec![
        turn(1, &|t| {
            Quat::from_rotation_z((3.0 * t).sin() as f32 * 0.6)
                * Quat::from_rotation_x((1.7 * t).cos() as f32 * 0.3)
        }),
        turn(2, &|t| Quat::from_rotation_x((2.0 * std::f64::consts::TAU / 2.0 * t) as f32)),
        Track {
            target: Target::Rotation(bones[3]),
            curve: curve(vec![0.0, 0.7, 1.5], steps, 4, Interpolation::Hold),
        },
        Track {
            target: Target::Translation(bones[0]),
            curve: curve(vec![0.0, 1.234, 2.5], walk, 3, Interpolation::Linear),
        },
        Track {
            target: Target::Weights { first: 0 },
            curve: curve(vec![0.5, 1.0, 3.0], vec![0.0, 1.0, 0.2], 1, Interpolation::Linear),
        },
    ];
    Clip { name: "dance".into(), tracks }
}

fn desc(tolerance: f64) -> BakeDesc {
    BakeDesc { tolerance, ..BakeDesc::default() }
}

fn moments() -> impl Iterator<Item = f64> {
    (0..=1500).map(|k| k as f64 * 2e-3 + 1.37e-5)
}

type Motion<'a> = &'a dyn Fn(f64, &mut Pose);

/// The farthest that any vertex of two motions is apart, in f64.
fn apart(c: [&Character; 2], motions: [Motion; 2]) -> f64 {
    let positions = |k: usize, t: f64| {
        let mut pose = c[k].rest_pose();
        motions[k](t, &mut pose);
        c[k].positions_f64(0, &pose, &fk::forward_f64(c[k].skeleton(), &pose))
    };
    let each = moments().flat_map(|t| positions(0, t).into_iter().zip(positions(1, t)));
    each.map(|(p, q)| p.distance(q)).fold(0.0, f64::max)
}

#[test]
fn packed_clips_play_within_their_tolerance_from_few_bytes() {
    let (c, bones) = tube();
    let clip = dance(&bones);
    let s = c.skeleton();
    let mut bytes = usize::MAX;
    for tolerance in [1e-4, 1e-3, 1e-2] {
        let done = pack(&c, &clip, &desc(tolerance)).unwrap();
        let packed = Packed::from_bytes(done.packed.bytes()).unwrap();
        let off = apart([&c, &c], [&|t, p| clip.sample(s, t, p), &|t, p| packed.sample(s, t, p)]);
        assert!(off <= tolerance && off > 0.3 * tolerance, "{off} of {tolerance}");
        // As keys it is the same motion.
        let keys = packed.to_clip("dance");
        let same = apart([&c, &c], [&|t, p| keys.sample(s, t, p), &|t, p| packed.sample(s, t, p)]);
        assert!(same < 2e-6, "{same}");
        assert_eq!(keys.range(), clip.range());
        let plain = bake(&c, &clip, &desc(tolerance)).unwrap().report.bytes[1];
        assert!(
            packed.bytes().len() < bytes && 2 * packed.bytes().len() < plain,
            "{} {plain}",
            packed.bytes().len()
        );
        bytes = packed.bytes().len();
    }
    assert!(bytes < 400, "{bytes}");
}

#[test]
fn no_bytes_break_a_packed_clip() {
    let (c, bones) = tube();
    let packed = pack(&c, &dance(&bones), &desc(1e-3)).unwrap().packed;
    let file = sinew_clip::write(&c, &[("dance", &packed)]);
    let read = sinew_clip::read(&file).unwrap();
    assert_eq!(read.clips, [("dance".to_owned(), packed.clone())]);
    assert_eq!(read.clips(&c, &mut vec![])[0], packed.to_clip("dance"));
    for n in 0..file.len() {
        assert!(sinew_clip::read(&file[..n]).is_err(), "{n}");
    }
    let mut rng = Rng::new(11);
    let mut played = 0;
    for _ in 0..1000 {
        let mut bad = file.clone();
        for _ in 0..1 + rng.next() % 4 {
            let at = (rng.next() % bad.len() as u64) as usize;
            bad[at] = rng.next() as u8;
        }
        let Ok(read) = sinew_clip::read(&bad) else { continue };
        for (_, p) in read.onto(&c, &mut vec![]) {
            played += 1;
            for t in [-1.0, 0.0, 0.77, 1e30, f64::NAN] {
                p.sample(c.skeleton(), t, &mut c.rest_pose());
            }
            p.to_clip("");
        }
    }
    assert!(played > 30, "{played}");
}

#[test]
fn packed_clips_find_their_bones_by_name() {
    let (c, bones) = tube();
    let clip = dance(&bones);
    let packed = pack(&c, &clip, &desc(1e-3)).unwrap().packed;
    let file = sinew_clip::read(&sinew_clip::write(&c, &[("dance", &packed)])).unwrap();
    // Another skeleton: one bone less, others in other places, no morph weights.
    let names = ["tail", "b3", "b2", "b1"];
    let (other, of) = Skeleton::new(names.map(BoneDesc::new).to_vec()).unwrap();
    let other = Character::new(other, vec![], vec![], vec![], vec![]).unwrap();
    let mut warnings = vec![];
    let clips = file.clips(&other, &mut warnings);
    assert_eq!(clips[0].tracks.iter().filter(|t| t.target == Target::Rotation(of[2])).count(), 1);
    assert_eq!((clips[0].tracks.len(), warnings.len()), (3, 2), "{warnings:?}");
}

#[test]
fn stills_stay_closed_and_stand_where_the_vertices_are() {
    let (c, bones) = tube();
    let clip = dance(&bones);
    let mut pose = c.rest_pose();
    clip.sample(c.skeleton(), 1.1, &mut pose);
    let still = Stance::new(&c, &[]).at(&pose);
    assert_eq!((still.points.len(), c.meshes()[0].positions.len()), (36, 136));
    let truth = c.positions_f64(0, &pose, &fk::forward_f64(c.skeleton(), &pose));
    for (v, p) in truth.iter().enumerate() {
        assert!(still.points[still.surfaces[0].point[v] as usize].as_dvec3().distance(*p) < 1e-6);
    }
    let bytes = ply::write(&still);
    let read = ply::parse(&bytes).unwrap();
    assert!(HalfEdges::new(&read.triangles).summary(&read.triangles).closed());
    let triangles = stl::parse(&stl::write(&still)).unwrap();
    assert_eq!(triangles.len(), read.triangles.len());
    let volume: f32 = triangles.iter().map(|[a, b, c]| a.dot(b.cross(*c)) / 6.0).sum();
    assert!(volume > 0.05, "inside out: {volume}");
    // Numbers of text are as exact as those of bytes.
    let text = obj::write(&still, &Asset::default(), None);
    let numbers = |l: &str| l.split(' ').skip(1).map(|n| n.parse().unwrap()).collect::<Vec<f32>>();
    let points: Vec<Vec3> =
        text.lines().filter(|l| l.starts_with("v ")).map(|l| Vec3::from_slice(&numbers(l))).collect();
    assert_eq!(points, still.points);
    assert_eq!(text.lines().filter(|l| l.starts_with("f ")).count(), triangles.len());
    assert_eq!(pc2::head(3, 2).len(), 32);
}

#[test]
fn frozen_characters_show_every_frame() {
    let (c, bones) = tube();
    let clip = dance(&bones);
    let pose = |t: f64| {
        let mut pose = c.rest_pose();
        clip.sample(c.skeleton(), t, &mut pose);
        pose
    };
    let poses: Vec<Pose> = (0..=6).map(|k| pose(k as f64 / 2.0)).collect();
    let frozen = still::frozen(&c, &poses, 2.0, "dance");
    let asset = Asset { character: frozen.clone(), ..Asset::default() };
    let new = gltf::NewClip { clip: &frozen.clips()[0], short: &[], replaces: None, carried: None };
    let (file, warnings) = gltf::write(&asset, &[], &[new], Default::default()).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let again = gltf::import_bytes(&file.glb(), None, &Options::default()).unwrap();
    let again = again.asset.character;
    for (k, source) in poses.iter().enumerate() {
        let shown = again.pose(Some(0), k as f64 / 2.0);
        let shown = again.positions_f64(0, &shown, &fk::forward_f64(again.skeleton(), &shown));
        let truth = c.positions_f64(0, source, &fk::forward_f64(c.skeleton(), source));
        assert!(shown.iter().zip(&truth).all(|(a, b)| a.distance(*b) < 2e-6), "{k}");
    }
}

#[test]
fn fewer_influences_cost_what_is_stated() {
    let (c, bones) = tube();
    let clip = dance(&bones);
    let mut last = f64::INFINITY;
    let play = |t: f64, p: &mut Pose| clip.sample(c.skeleton(), t, p);
    for k in [1, 2, 4] {
        let less = c.with_influences(k);
        let cost = vertices::changed(&c, &less, &clip, &desc(1e6));
        let off = apart([&c, &less], [&play, &play]);
        let found = cost.worst.distance;
        assert!(
            off <= cost.ceiling && found <= cost.ceiling && cost.ceiling < 1.03 * found,
            "{off} {cost:?}"
        );
        assert!(off > 0.99 * found && found < last, "{off} {cost:?}");
        assert_eq!(vertices::dropped(&c, &less).0, 136);
        last = found;
        let Binding::Skin { weights, .. } = &less.instances()[0].binding else { panic!() };
        assert!((0..136).all(|v| (weights.of(v).map(|w| w.1).sum::<f32>() - 1.0).abs() < 1e-6));
    }
    let all = c.with_influences(5);
    let cost = vertices::changed(&c, &all, &clip, &desc(1e6));
    assert!(vertices::dropped(&c, &all).0 == 0 && cost.ceiling < 1e-6, "{cost:?}");
}

#[test]
fn straight_ways_between_frames_are_no_farther_off_than_is_stated() {
    let (c, bones) = tube();
    let clip = dance(&bones);
    for fps in [5.0, 30.0, 120.0] {
        let frames: Vec<f64> = (0..=(3.0 * fps) as usize).map(|k| k as f64 / fps).collect();
        let cost = vertices::straight(&c, &clip, &frames, &desc(1e6));
        let pose = |t: f64| {
            let mut pose = c.rest_pose();
            clip.sample(c.skeleton(), t, &mut pose);
            c.positions_f64(0, &pose, &fk::forward_f64(c.skeleton(), &pose))
        };
        let off = moments().filter(|t| *t < 3.0).map(|t| {
            let k = (t * fps) as usize;
            let part = t * fps - k as f64;
            let (a, b) = (pose(frames[k]), pose(frames[k + 1]));
            let ways = pose(t).into_iter().zip(a.into_iter().zip(b));
            ways.map(|(p, (a, b))| p.distance(a.lerp(b, part))).fold(0.0, f64::max)
        });
        let off = off.fold(0.0, f64::max);
        let found = cost.worst.distance;
        // Moments from the outside miss the end of a step.
        assert!(off <= cost.ceiling && off > 0.7 * found && found <= cost.ceiling, "{fps} {off} {cost:?}");
        assert!(cost.ceiling < 1.1 * found, "{fps} {cost:?}");
    }
}

#[test]
fn files_carry_their_fewer_influences() {
    let (c, _) = tube();
    let asset = Asset { character: c, ..Asset::default() };
    let (file, _) = gltf::write(&asset, &[], &[], Default::default()).unwrap();
    let bytes = file.glb();
    let mut import = gltf::import_bytes(&bytes, None, &Options::default()).unwrap();
    assert!(file.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_1"].is_u64());
    import.asset.character = import.asset.character.with_influences(3);
    let fewer = gltf::Change { influences: true, ..Default::default() };
    let out = gltf::changed(&bytes, None, &import, fewer).unwrap();
    let attributes = out.json["meshes"][0]["primitives"][0]["attributes"].as_object().unwrap().clone();
    assert!(!attributes.contains_key("JOINTS_1") && !attributes.contains_key("WEIGHTS_1"));
    // What nobody needs any more is gone: a set of four, 16 bytes of weights and 4 of joints a vertex.
    assert_eq!(file.bin.len() - out.bin.len(), 136 * 20);
    let again = gltf::import_bytes(&out.glb(), None, &Options::default()).unwrap();
    assert_eq!(again.asset.character.instances(), import.asset.character.instances());
}

#[test]
fn packed_buffers_hold_the_same_character_in_fewer_bytes() {
    let (c, bones) = tube();
    let clip = dance(&bones);
    let asset = Asset { character: c, ..Asset::default() };
    let new = gltf::NewClip { clip: &clip, short: &[], replaces: None, carried: None };
    let (mut file, _) = gltf::write(&asset, &[], &[new], Default::default()).unwrap();
    let import = |f: &gltf::Rewritten| gltf::import_bytes(&f.glb(), None, &Options::default()).unwrap();
    let plain = (import(&file), file.glb().len());
    file.compress().unwrap();
    let short = (import(&file), file.glb().len());
    assert!(
        file.json["extensionsRequired"][0] == "EXT_meshopt_compression" && file.bin.len() < plain.1 / 2,
        "{}",
        file.bin.len()
    );
    let [a, b] = [&plain.0, &short.0].map(|i| &i.asset.character);
    assert!(short.0.warnings.is_empty(), "{:?}", short.0.warnings);
    assert_eq!((a.instances(), a.clips()), (b.instances(), b.clips()));
    assert_eq!(a.meshes()[0].positions, b.meshes()[0].positions);
    // A second time there is nothing left to pack.
    let once = file.bin.len();
    file.compress().unwrap();
    assert_eq!(file.bin.len(), once);
}
