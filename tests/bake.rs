//! Baking: bounds that hold, steps that stay steps, files that stay whole.

use glam::{Quat, Vec3};
use sinew::bake::{BakeDesc, BakeError, Gauge, Goal, Metric, bake, edit};
use sinew::character::{Binding, Character, Instance, MeshId};
use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
use sinew::fk;
use sinew::io::gltf::{self, NewClip};
use sinew::io::{Import, Options};
use sinew::math::Trs;
use sinew::math::spline::Tangents;
use sinew::mesh::{Mesh, MeshData};
use sinew::skeleton::{BoneDesc, BoneId, Skeleton};

/// Three bones of a metre, each with a triangle at its end.
fn arm() -> (Character, Vec<BoneId>) {
    let rest = Trs { translation: Vec3::X, ..Trs::IDENTITY };
    let bone = |i: usize| BoneDesc { parent: i.checked_sub(1), rest, ..BoneDesc::new(format!("b{i}")) };
    let (skeleton, bones) = Skeleton::new((0..3).map(bone).collect()).unwrap();
    let positions = vec![Vec3::X, Vec3::new(1.0, 0.2, 0.0), Vec3::new(1.0, 0.0, 0.2)];
    let mesh = Mesh::new(MeshData { positions, triangles: vec![[0, 1, 2]], ..Default::default() }).unwrap();
    let instance = |b: &BoneId| Instance { mesh: MeshId(0), binding: Binding::Bone(*b), first_weight: 0 };
    let instances = bones.iter().map(instance).collect();
    (Character::new(skeleton, vec![mesh], instances, vec![], vec![]).unwrap(), bones)
}

/// Every bone swings, two seconds at 60 keys a second.
fn swing(bones: &[BoneId]) -> Clip {
    swing_at(bones, 60.0)
}

fn swing_at(bones: &[BoneId], rate: f64) -> Clip {
    let track = |(i, b): (usize, &BoneId)| {
        let times: Vec<f64> =
            (0..=(2.0 * rate) as u32).map(|k| f64::from((k as f64 / rate) as f32)).collect();
        let angle = |t: f64| ((2.0 + i as f64) * t).sin() * 0.8;
        let value = |t: &f64| Quat::from_rotation_z(angle(*t) as f32).to_array();
        let values = times.iter().flat_map(value).collect();
        Track {
            target: Target::Rotation(*b),
            curve: Curve::new(times, values, 4, Interpolation::Linear).unwrap(),
        }
    };
    Clip { name: "swing".into(), tracks: bones.iter().enumerate().map(track).collect() }
}

fn desc(tolerance: f64) -> BakeDesc {
    BakeDesc { tolerance, ..BakeDesc::default() }
}

/// The worst vertex by the f64 reference, which shares nothing with the gauge but the meaning of a clip.
fn measured(character: &Character, a: &Clip, b: &Clip, times: impl Iterator<Item = f64>) -> f64 {
    let positions = |clip: &Clip, t: f64| {
        let mut pose = character.rest_pose();
        clip.sample(character.skeleton(), t, &mut pose);
        let bones = fk::forward_f64(character.skeleton(), &pose);
        (0..character.instances().len())
            .flat_map(move |i| character.positions_f64(i, &pose, &bones))
            .collect::<Vec<_>>()
    };
    times
        .flat_map(|t| positions(a, t).into_iter().zip(positions(b, t)))
        .map(|(p, q)| p.distance(q))
        .fold(0.0, f64::max)
}

#[test]
fn no_vertex_leaves_its_tolerance_at_keys_frames_or_between() {
    let (character, bones) = arm();
    let clip = swing(&bones);
    let mut bytes = usize::MAX;
    for tolerance in [1e-4, 1e-2, 1e-1] {
        let baked = bake(&character, &clip, &desc(tolerance)).unwrap();
        let error = measured(&character, &clip, &baked.clip, (0..=20_000).map(|k| k as f64 * 1e-4));
        assert!(
            error <= baked.report.ceiling * tolerance && baked.report.ceiling <= 1.0,
            "{error} {:?}",
            baked.report
        );
        // Where keys can be spared, most of the tolerance is made use of.
        let report = baked.report;
        assert!(error > 0.5 * tolerance || report.keys[1] == report.keys[0], "{error} {report:?}");
        assert!(baked.report.bytes[1] < bytes, "{:?}", baked.report);
        bytes = baked.report.bytes[1];
        assert_eq!(baked.clip.range(), clip.range());
    }
    assert!(bytes < 720, "{bytes}");
}

#[test]
fn cubic_curves_are_taken_where_they_need_fewer_keys() {
    let (character, bones) = arm();
    let clip = swing_at(&bones, 480.0);
    let wanted = |tolerance, goal| BakeDesc { goal, quantize: false, ..desc(tolerance) };
    for tolerance in [1e-4, 1e-3, 1e-2] {
        let [few, small] =
            [Goal::Keys, Goal::Bytes].map(|g| bake(&character, &clip, &wanted(tolerance, g)).unwrap());
        assert!(few.report.keys[1] <= small.report.keys[1], "{:?} {:?}", few.report, small.report);
        // A straight piece of length h errs by h²/8 · ω² · 0.8 rad alone: some hundred keys a bone at the finest.
        assert!(few.report.keys[1] < 60, "{:?}", few.report);
        assert!(small.report.bytes[1] <= few.report.bytes[1], "{:?} {:?}", few.report, small.report);
        let error = measured(&character, &clip, &few.clip, (0..=20_000).map(|k| k as f64 * 1e-4));
        assert!(error <= few.report.ceiling * tolerance, "{error} {:?}", few.report);
    }
    // Nothing is smoothed over a jump.
    let times = (0..60).flat_map(|k| [f64::from(k as f32 / 60.0); 2]).skip(1).take(90).collect::<Vec<_>>();
    let value = |k: usize| Quat::from_rotation_z((k as f32 * 0.1).sin() + if k >= 41 { 1.0 } else { 0.0 });
    let values = (0..90).flat_map(|k| value(k).to_array()).collect();
    let curve = Curve::new(times, values, 4, Interpolation::Linear).unwrap();
    let clip = Clip { name: "cut".into(), tracks: vec![Track { target: Target::Rotation(bones[1]), curve }] };
    let cut = bake(&character, &clip, &wanted(1e-3, Goal::Keys)).unwrap();
    let error = measured(&character, &clip, &cut.clip, (0..=20_000).map(|k| k as f64 * 5e-5));
    assert!(error <= cut.report.ceiling * 1e-3, "{error} {:?}", cut.report);
}

#[test]
fn pinned_bones_and_shells_have_bounds_of_their_own() {
    let (character, bones) = arm();
    let clip = swing(&bones);
    let origin = |clip: &Clip, b: BoneId, t: f64| {
        let mut pose = character.rest_pose();
        clip.sample(character.skeleton(), t, &mut pose);
        fk::forward_f64(character.skeleton(), &pose)[b.index()].translation
    };
    let off = |a: &Clip, b: BoneId| {
        let times = (0..=2000).map(|k| k as f64 * 1e-3);
        times.map(|t| origin(&clip, b, t).distance(origin(a, b, t))).fold(0.0, f64::max)
    };
    let loose = bake(&character, &clip, &desc(1e-2)).unwrap();
    assert!(off(&loose.clip, bones[2]) > 1e-4);
    let pinned = bake(&character, &clip, &BakeDesc { pins: vec![(bones[2], 1e-4)], ..desc(1e-2) }).unwrap();
    assert!(off(&pinned.clip, bones[2]) <= 1e-4 && pinned.report.keys[1] > loose.report.keys[1]);

    // A larger shell is harder to keep; neither asks for a skin.
    let bare = Character::new(character.skeleton().clone(), vec![], vec![], vec![], vec![]).unwrap();
    let keys = |radius: f64| {
        let desc = BakeDesc { metric: Metric::Shell(radius), ..desc(1e-3) };
        let baked = bake(&bare, &clip, &desc).unwrap();
        assert!(bones.iter().all(|b| off(&baked.clip, *b) <= 1e-3));
        baked.report.keys[1]
    };
    assert!(keys(1.0) > keys(0.01));
}

#[test]
fn the_result_does_not_depend_on_threads() {
    let (character, bones) = arm();
    let clip = swing(&bones);
    let [one, two] =
        [1, 2].map(|threads| bake(&character, &clip, &BakeDesc { threads, ..desc(1e-3) }).unwrap());
    assert_eq!((one.clip, one.report), (two.clip, two.report));
}

#[test]
fn steps_stay_steps_and_what_rests_is_left_out() {
    let (character, bones) = arm();
    let rest = character.rest_pose().locals[1];
    let values = [0.0, 0.0, 1.0, 1.0].map(|a: f32| Quat::from_rotation_z(a).to_array()).concat();
    let curve = Curve::new(vec![0.0, 0.5, 1.0, 2.0], values, 4, Interpolation::Hold).unwrap();
    let still =
        Curve::new(vec![0.0, 2.0], [rest.translation.to_array(); 2].concat(), 3, Interpolation::Linear);
    let tracks = vec![
        Track { target: Target::Rotation(bones[0]), curve },
        Track { target: Target::Translation(bones[1]), curve: still.unwrap() },
    ];
    let clip = Clip { name: "step".into(), tracks };
    let baked = bake(&character, &clip, &desc(1e-3)).unwrap();
    let [track] = &baked.clip.tracks[..] else { panic!("{:?}", baked.clip) };
    assert_eq!(track.curve.interpolation(), Interpolation::Hold);
    // The last key says how long the clip lasts.
    assert_eq!(track.curve.times(), [0.0, 1.0, 2.0]);
}

#[test]
fn a_bound_that_cannot_be_kept_is_an_error() {
    let (character, bones) = arm();
    let clip = swing(&bones);
    assert!(matches!(bake(&character, &clip, &desc(0.0)), Err(BakeError::Tolerance { .. })));
    assert!(matches!(bake(&character, &clip, &desc(f64::NAN)), Err(BakeError::Tolerance { .. })));
    // A tolerance of nothing to speak of: the clip as it was.
    let baked = bake(&character, &clip, &desc(1e-12)).unwrap();
    assert_eq!(baked.report.keys[0], baked.report.keys[1]);
    assert_eq!(Gauge::new(&character, 1).worst(&clip, &baked.clip, &[0.0, 0.3]).distance, 0.0);
}

/// A node that moves, beside data that nobody may touch.
fn file() -> (Vec<u8>, Import) {
    let floats: Vec<u8> = [0.0_f32, 0.5, 1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0]
        .iter()
        .flat_map(|f| f.to_le_bytes())
        .collect();
    let json = serde_json::json!({
        "asset": {"version": "2.0", "extras": {"artist": "M. S."}},
        "extras": {"keep": [1, 2]},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "n"}],
        "buffers": [{"byteLength": 48}],
        "bufferViews": [{"buffer": 0, "byteLength": 12}, {"buffer": 0, "byteOffset": 12, "byteLength": 36}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "SCALAR", "min": [0], "max": [1]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "animations": [{"name": "slide", "extras": {"loop": true}, "samplers": [{"input": 0, "output": 1}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}],
    });
    let map = json.as_object().unwrap().clone();
    let bytes = gltf::Rewritten { json: map, bin: floats, ..Default::default() }.glb();
    let import = gltf::import_bytes(&bytes, None, &Options::default()).unwrap();
    (bytes, import)
}

#[test]
fn a_file_with_other_clips_keeps_everything_else() {
    let (bytes, import) = file();
    let character = &import.asset.character;
    let desc = BakeDesc { metric: Metric::Shell(0.1), ..desc(1e-4) };
    let baked = bake(character, &character.clips()[0], &desc).unwrap();
    let new = NewClip { clip: &baked.clip, short: &baked.short, replaces: Some(0), carried: None };
    let extras = serde_json::json!({"sinew": {"tolerance": 1e-4}}).as_object().unwrap().clone();
    let change = gltf::Change { clips: &[new], extras, ..Default::default() };
    let out = gltf::changed(&bytes, None, &import, change).unwrap();
    assert_eq!(out.json["extras"]["keep"], serde_json::json!([1, 2]));
    assert_eq!(
        out.json["asset"]["extras"],
        serde_json::json!({"artist": "M. S.", "sinew": {"tolerance": 1e-4}})
    );
    assert_eq!(out.json["animations"][0]["extras"]["loop"], true);
    // The middle key lay on the line between the others; the old keys are gone.
    assert_eq!((out.bin.len(), out.json["accessors"].as_array().unwrap().len()), (2 * 4 + 2 * 12, 2));
    let again = gltf::import_bytes(&out.glb(), None, &Options::default()).unwrap();
    assert!(again.warnings.is_empty(), "{:?}", again.warnings);
    assert_eq!(again.asset.character.clips()[0], baked.clip);
}

#[test]
fn slopes_by_a_rule_are_written_as_numbers_and_notes_find_their_clips() {
    let (bytes, import) = file();
    let rule = Interpolation::CatmullRom(Tangents::ThreePoint);
    let values = vec![0.0, 0.0, 0.0, 1.0, 2.0, 0.0, 3.0, 0.0, 1.0, 2.0, 1.0, 0.5];
    let curve = Curve::new(vec![0.0, 0.3, 1.0, 1.2], values, 3, rule).unwrap();
    let moving =
        Clip { name: "curved".into(), tracks: vec![Track { target: Target::Translation(BoneId(0)), curve }] };
    let still = Clip { name: "still".into(), tracks: vec![] };
    let new = [&still, &moving].map(|clip| NewClip { clip, short: &[], replaces: None, carried: None });
    let change = gltf::Change { clips: &new, ..Default::default() };
    let mut out = gltf::changed(&bytes, None, &import, change).unwrap();
    // What moves nothing has no animation; notes on it go nowhere, and the others' where they belong.
    out.note(0, "what", "still".into());
    out.note(1, "what", "curved".into());
    assert_eq!(out.json["animations"].as_array().unwrap().len(), 1);
    assert_eq!(out.json["animations"][0]["extras"]["sinew"]["what"], "curved");

    let back = gltf::import_bytes(&out.glb(), None, &Options::default()).unwrap();
    let character = &back.asset.character;
    for t in (0..=120).map(|k| k as f64 * 0.01) {
        let places = [&moving, &character.clips()[0]].map(|clip| {
            let mut pose = character.rest_pose();
            clip.sample(character.skeleton(), t, &mut pose);
            pose.locals[0].translation
        });
        assert!(places[0].distance(places[1]) < 1e-6, "{t}: {places:?}");
    }
}

#[test]
fn joined_and_turned_clips_are_baked_as_well_as_others() {
    let (character, bones) = arm();
    let clip = swing(&bones);
    // The joint is a jump: the arm is elsewhere at the end than at the start.
    let twice = edit::concat("twice", &[&clip, &clip]);
    let report = bake(&character, &twice, &desc(1e-2)).unwrap().report;
    assert!(report.keys[1] < report.keys[0] / 3, "{report:?}");

    let hold = Curve::new(
        vec![0.5, 1.0],
        [0.0, 1.0].map(|a: f32| Quat::from_rotation_z(a).to_array()).concat(),
        4,
        Interpolation::Hold,
    );
    let steps = Clip {
        name: "steps".into(),
        tracks: vec![Track { target: Target::Rotation(bones[0]), curve: hold.unwrap() }],
    };
    assert_eq!(edit::reverse(&steps).playback(), steps.playback());
}
