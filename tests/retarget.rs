//! Clips onto other skeletons.

use crate::rng::Rng;
use glam::{DQuat, DVec3, Quat, Vec3};
use sinew::bake::retarget::{Map, retarget};
use sinew::character::Character;
use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
use sinew::fk;
use sinew::math::Trs;
use sinew::skeleton::{BoneDesc, BoneId, Skeleton};

/// Name, parent, and where it stands in the world at rest.
const BODY: [(&str, Option<usize>, [f32; 3]); 9] = [
    ("Hips", None, [0.0, 1.0, 0.0]),
    ("Spine", Some(0), [0.0, 1.3, 0.0]),
    ("LeftArm", Some(1), [0.2, 1.5, 0.0]),
    ("LeftForeArm", Some(2), [0.5, 1.5, 0.0]),
    ("LeftHand", Some(3), [0.8, 1.5, 0.0]),
    ("Head", Some(1), [0.0, 1.7, 0.0]),
    ("LeftLeg", Some(0), [0.1, 0.9, 0.0]),
    ("LeftShin", Some(6), [0.1, 0.5, 0.05]),
    ("LeftFoot", Some(7), [0.1, 0.1, 0.0]),
];

/// A body of this size whose bones have any frames whatever; `turn` is that of each at rest in the world, `arm` the forearm's way down.
fn body(size: f32, turn: impl Fn(usize) -> Quat, hanging: bool) -> Character {
    let place = |i: usize| {
        let p = Vec3::from_array(BODY[i].2);
        let swung = Quat::from_rotation_z(-1.0) * (p - Vec3::new(0.2, 1.5, 0.0)) + Vec3::new(0.2, 1.5, 0.0);
        size * if hanging && (3..5).contains(&i) { swung } else { p }
    };
    let bone = |i: usize| {
        let (name, parent, _) = BODY[i];
        let rest = match parent {
            None => Trs { translation: place(i), rotation: turn(i), ..Trs::IDENTITY },
            Some(p) => Trs {
                translation: turn(p).conjugate() * (place(i) - place(p)),
                rotation: (turn(p).conjugate() * turn(i)).normalize(),
                ..Trs::IDENTITY
            },
        };
        BoneDesc { parent, rest, ..BoneDesc::new(name) }
    };
    let (skeleton, _) = Skeleton::new((0..BODY.len()).map(bone).collect()).unwrap();
    Character::new(skeleton, vec![], vec![], vec![], vec![]).unwrap()
}

fn dance(c: &Character) -> Clip {
    let mut rng = Rng::new(61);
    let times: Vec<f64> = (0..7).map(|k| k as f64 * 0.3).collect();
    let mut tracks = vec![];
    for b in c.skeleton().ids() {
        let rest = c.skeleton().rest(b);
        let mut turn =
            || rest.rotation * Quat::from_axis_angle(rng.point(1.0).normalize_or(Vec3::X), rng.unit());
        let values = times.iter().flat_map(|_| turn().to_array()).collect();
        let curve = Curve::new(times.clone(), values, 4, Interpolation::Linear).unwrap();
        tracks.push(Track { target: Target::Rotation(b), curve });
    }
    let hips = BoneId(0);
    let values = times.iter().flat_map(|_| (c.skeleton().rest(hips).translation + rng.point(0.3)).to_array());
    let curve = Curve::new(times.clone(), values.collect(), 3, Interpolation::Linear).unwrap();
    tracks.push(Track { target: Target::Translation(hips), curve });
    Clip { name: "dance".into(), tracks }
}

fn origins(c: &Character, clip: &Clip, t: f64) -> Vec<DVec3> {
    let mut pose = c.rest_pose();
    clip.sample(c.skeleton(), t, &mut pose);
    fk::forward_f64(c.skeleton(), &pose).iter().map(|m| m.translation).collect()
}

/// The largest angle between a bone's way from its parent in one dance and the other.
fn ways_apart(a: (&Character, &Clip), b: (&Character, &Clip), moments: impl Iterator<Item = f64>) -> f64 {
    let mut worst = 0.0_f64;
    for t in moments {
        let (p, q) = (origins(a.0, a.1, t), origins(b.0, b.1, t));
        for bone in a.0.skeleton().ids() {
            let Some(up) = a.0.skeleton().parent(bone) else { continue };
            let way = |o: &[DVec3]| (o[bone.index()] - o[up.index()]).normalize();
            worst = worst.max(way(&p).distance(way(&q)));
        }
    }
    worst
}

fn any_turns() -> impl Fn(usize) -> Quat {
    |i| {
        let mut rng = Rng::new(70 + i as u64);
        Quat::from_axis_angle(rng.point(1.0).normalize_or(Vec3::X), rng.span(-3.0, 3.0))
    }
}

fn keys() -> impl Iterator<Item = f64> {
    (0..7).map(|k| k as f64 * 0.3)
}

#[test]
fn onto_itself_nothing_changes() {
    for c in [body(1.0, |_| Quat::IDENTITY, false), body(1.0, any_turns(), true)] {
        let clip = dance(&c);
        let map = Map::by_names(c.skeleton(), c.skeleton(), &[]);
        for directions in [false, true] {
            let done = retarget(&c, &clip, &c, &Map { directions, ..map.clone() });
            assert!(done.unmatched_source.is_empty() && done.unmatched_target.is_empty());
            assert_eq!((done.scale, done.left_out), (1.0, 0));
            for t in (0..=180).map(|k| k as f64 * 0.01) {
                let (p, q) = (origins(&c, &clip, t), origins(&c, &done.clip, t));
                let worst = p.iter().zip(&q).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max);
                // Between keys arcs that are 1e-4 rad apart are taken for equal.
                assert!(worst < 3e-4, "{worst} at {t}");
            }
            let at_keys =
                keys().flat_map(|t| origins(&c, &clip, t).into_iter().zip(origins(&c, &done.clip, t)));
            assert!(at_keys.map(|(p, q)| p.distance(q)).fold(0.0, f64::max) < 1e-5);
        }
    }
}

#[test]
fn onto_a_larger_body_with_other_frames_bones_point_the_same_way() {
    let (small, large) = (body(1.0, |_| Quat::IDENTITY, false), body(2.5, any_turns(), false));
    let clip = dance(&small);
    let map = Map::by_names(small.skeleton(), large.skeleton(), &[]);
    let done = retarget(&small, &clip, &large, &map);
    assert!((done.scale - 2.5).abs() < 1e-6, "{}", done.scale);
    assert!(ways_apart((&small, &clip), (&large, &done.clip), keys()) < 1e-5);
    let hips = |c: &Character, clip: &Clip, t: f64| origins(c, clip, t)[0];
    assert!(keys().all(|t| hips(&large, &done.clip, t).distance(2.5 * hips(&small, &clip, t)) < 1e-5));
    // Frames that differ are what the correction is for.
    let plain = Clip { tracks: clip.tracks.clone(), ..Clip::default() };
    assert!(ways_apart((&small, &clip), (&large, &plain), keys()) > 0.5);
}

#[test]
fn arms_that_hang_at_rest_are_spread_where_directions_are_asked_for() {
    let (spread, hanging) = (body(1.0, |_| Quat::IDENTITY, false), body(1.0, any_turns(), true));
    let clip = dance(&spread);
    let map = Map::by_names(spread.skeleton(), hanging.skeleton(), &[]);
    let off = |directions| {
        let done = retarget(&spread, &clip, &hanging, &Map { directions, ..map.clone() });
        ways_apart((&spread, &clip), (&hanging, &done.clip), keys())
    };
    assert!(off(true) < 1e-5 && off(false) > 0.5, "{} {}", off(true), off(false));
}

#[test]
fn captures_with_their_rest_at_the_origin_stand_on_the_ground() {
    let c = body(1.0, |_| Quat::IDENTITY, false);
    let text = "HIERARCHY ROOT Hips { OFFSET 0 0 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
        JOINT LeftLeg { OFFSET 10 -10 0 CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT LeftShin { OFFSET 0 -40 0 CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT LeftFoot { OFFSET 0 -40 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 0 10 } } } } }
        MOTION Frames: 2 Frame Time: .5\n 0 100 0 0 0 0 0 0 0 0 0 0 0 0 0\n 20 90 0 0 0 0 0 0 0 0 0 0 0 0 0";
    let capture = sinew::io::bvh::import_bytes(text.as_bytes(), "walk").unwrap().asset.character;
    let map = Map::by_names(capture.skeleton(), c.skeleton(), &[]);
    let done = retarget(&capture, &capture.clips()[0], &c, &map);
    // Its legs are 94 long, these 0.95 m: the capture's are in centimetres.
    assert!((done.scale - 0.01).abs() < 2e-4, "{}", done.scale);
    let hips = [0.0, 0.5].map(|t| origins(&c, &done.clip, t)[0]);
    assert!(hips[0].y > 0.95 && hips[0].y < 1.1, "{}", hips[0]);
    assert!((hips[1] - hips[0] - DVec3::new(0.2, -0.1, 0.0)).length() < 5e-3, "{hips:?}");
    let names: Vec<&str> = done.unmatched_target.iter().map(|b| c.skeleton().name(*b)).collect();
    assert_eq!(names, ["Spine", "LeftArm", "LeftForeArm", "LeftHand", "Head"]);
}

#[test]
fn turns_that_one_arc_cannot_hold_get_keys_between() {
    // The source has a bone in between that the target has not.
    let c = body(1.0, |_| Quat::IDENTITY, false);
    let about = |b: u32, axis: Vec3| {
        let values = [0.0, 2.0].map(|a| Quat::from_axis_angle(axis, a).to_array()).concat();
        let curve = Curve::new(vec![0.0, 1.0], values, 4, Interpolation::Linear).unwrap();
        Track { target: Target::Rotation(BoneId(b)), curve }
    };
    let clip = Clip { name: "twist".into(), tracks: vec![about(2, Vec3::X), about(3, Vec3::Z)] };
    let skip = Map::by_names(c.skeleton(), c.skeleton(), &[(BoneId(2), None)]);
    let done = retarget(&c, &clip, &c, &skip);
    let forearm = |clip: &Clip, t: f64| {
        let mut pose = c.rest_pose();
        clip.sample(c.skeleton(), t, &mut pose);
        DQuat::from_mat3(&fk::forward_f64(c.skeleton(), &pose)[3].matrix3)
    };
    for t in (0..=100).map(|k| k as f64 * 0.01) {
        let d = forearm(&clip, t).conjugate() * forearm(&done.clip, t);
        assert!(2.0 * d.xyz().length() < 2e-4, "at {t}");
    }
    assert_eq!(done.unmatched_source, [BoneId(2)]);
}

#[cfg(feature = "cli")]
#[test]
fn the_program_carries_a_capture_onto_a_rig_and_says_what_nothing_follows() {
    use crate::cli::{fails, folder, path, sinew, text};
    let (dir, rig) = folder();
    let bvh = path(&dir, "wave.bvh");
    let capture = "HIERARCHY ROOT Pole { OFFSET 0 0 0 CHANNELS 1 Zrotation JOINT Knob { OFFSET 0 1 0 CHANNELS 1 Xrotation } }
        MOTION Frames: 3 Frame Time: .5\n 0 0\n 40 10\n 0 0";
    std::fs::write(&bvh, capture).unwrap();
    let (glb, map) = (path(&dir, "out.glb"), path(&dir, "map.json"));
    let (code, said) = fails(&["bake", &rig, "--motion", &bvh, "-o", &glb]);
    assert!(code == 2 && said.contains("none of its bones is one of the input's"), "{said}");
    std::fs::write(&map, r#"{"bones": {"Pole": "mast"}}"#).unwrap();
    let with_map = ["bake", &rig, "--motion", &bvh, "--retarget", &map, "-o", &glb, "--json"];
    let (code, said) = fails(&with_map);
    assert!(code == 2 && said.contains("`mast` is no bone of the input"), "{said}");
    std::fs::write(&map, r#"{"bones": {"Pole": "flag", "Pole": null}}"#).unwrap();
    let (code, said) = fails(&with_map);
    assert!(code == 3 && said.contains("map.json") && said.contains("`Pole` is there twice"), "{said}");
    std::fs::write(&map, r#"{"bones": {"Pole": "flag"}, "scale": 1}"#).unwrap();
    let out = sinew(&with_map);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let told: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(told["motions"][0]["unmatched_source"], serde_json::json!(["Knob"]));
    assert!(text(&out.stderr).contains("Knob"));

    // The flag's tip goes where the pole's does; and the file is a rig again.
    let at = |file: &str| {
        let c = sinew::io::import(std::path::Path::new(file), &Default::default()).unwrap().asset.character;
        let pose = c.pose(Some(0), 0.5);
        c.posed(&pose).world_from_bone(c.skeleton().find("flag").unwrap()).transform_vector3(DVec3::X)
    };
    let forty = 40_f64.to_radians();
    assert!(at(&glb).distance(DVec3::new(forty.cos(), forty.sin(), 0.0)) < 1e-3, "{}", at(&glb));
    let again = path(&dir, "again.json");
    assert!(sinew(&["bake", &glb, "-o", &again]).status.success());
    assert!(at(&again).distance(at(&glb)) < 1e-3);
    let poses = std::fs::read_to_string(path(&dir, "again.poses.json")).unwrap();
    assert!(poses.contains("xzx_deg") && !poses.contains("rotation"), "{poses}");
    let (code, said) = fails(&["bake", &glb, "--to", "xzx", "-o", &path(&dir, "b.glb")]);
    assert!(code == 2 && said.contains("glTF has no place for angles"), "{said}");
    let (code, said) = fails(&["bake", &glb, "--to", "xzx", "-o", &path(&dir, "b.sinew")]);
    assert!(code == 2 && said.contains("packed clips has no place for angles"), "{said}");
}
