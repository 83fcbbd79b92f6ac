use super::*;
use crate::test_rng::Rng;

const ARM: &str = r##"{
  "sinew_rig": 1,
  "bones": [
    {"name": "hand", "parent": "arm", "head": [0,1,0], "tail": [0,1.5,0], "min_deg": [0,-10,null]},
    {"name": "arm", "head": [0,0,0], "tail": [0,1,0]}
  ],
  "materials": [{"name": "red", "diffuse": "#ff0000"}],
  "meshes": [
    {"name": "m", "material": "red", "bind": {"weights": {"bones": ["arm", "hand"],
      "vertices": [[[0,1]], [[0,0.3],[1,0.7]], [[1,1]]]}},
     "positions": [[0,0,0],[0.2,1,0],[0,1.4,0]], "triangles": [[0,1,2]]}
  ]
}"##;

fn nothing(_: &str) -> std::io::Result<Vec<u8>> {
    Err(std::io::ErrorKind::NotFound.into())
}

fn read(text: &str) -> Result<Import, RigError> {
    import_bytes(text.as_bytes(), &Options::default(), &nothing)
}

fn message(from: &str, to: &str) -> String {
    assert!(ARM.contains(from), "{from}");
    read(&ARM.replace(from, to)).unwrap_err().to_string()
}

#[test]
fn heads_and_tails_give_frames_that_run_along_the_bones() {
    let import = read(ARM).unwrap();
    let c = &import.asset.character;
    let posed = c.posed(&c.rest_pose());
    let hand = c.skeleton().find("hand").unwrap();
    let world = posed.world_from_bone(hand);
    assert!((world.matrix3.x_axis - glam::DVec3::Y).length() < 1e-6);
    assert!((world.matrix3.z_axis - glam::DVec3::X).length() < 1e-6);
    assert!((posed.origin(hand) - glam::DVec3::Y).length() < 1e-6);
    assert_eq!(c.skeleton().length(hand), 0.5);
    assert!(import.warnings.is_empty());
}

#[test]
fn an_exported_rig_reads_as_the_same() {
    let asset = read(ARM).unwrap().asset;
    let text = export("arm", &asset, &[]).document.to_text();
    let again = read(&text).unwrap().asset;
    assert_eq!(again.character.skeleton(), asset.character.skeleton());
    assert_eq!(again.character.meshes(), asset.character.meshes());
    assert_eq!(again.character.instances(), asset.character.instances());
    assert_eq!(again.materials, asset.materials);
    assert_eq!(export("arm", &again, &[]).document.to_text(), text);
}

#[test]
fn mistakes_are_named() {
    assert_eq!(
        message("\"tail\": [0,1,0]", "\"tial\": [0,1,0]").split(", expected").next().unwrap(),
        "line 5, column 43: unknown field `tial`"
    );
    assert_eq!(message("\"sinew_rig\": 1", "\"sinew_rig\": 2"), "`sinew_rig` is 2; this version reads 1");
    assert_eq!(
        message("\"parent\": \"arm\"", "\"parent\": \"amr\""),
        "bone `hand`: parent `amr` is none of the 2 bones"
    );
    assert!(message("\"parent\": \"arm\"", "\"parent\": \"hand\"").contains("its own ancestor"));
    assert!(
        message("\"tail\": [0,1,0]", "\"tail\": [0,0,0]")
            .contains("bone `arm`: `head` and `tail` are at one place")
    );
    assert!(
        message("\"material\": \"red\"", "\"material\": \"rde\"").contains("material `rde` is none of the 1")
    );
    assert!(
        message("[1,0.7]", "[2,0.7]")
            .contains("mesh `m`: vertex 1: influence 1 names bone 2, but the skin has 2")
    );
    assert!(message("[0,1,2]", "[0,1,3]").contains("uses vertex 3, but there are 3"));
    assert!(message("[[1,1]]]", "]").contains("trailing comma"));
    assert!(
        message("\"diffuse\": \"#ff0000\"", "\"texture\": \"../../x.png\"").contains("leaves the folder")
    );
}

#[test]
fn a_loop_runs_over_its_seam_without_a_kink() {
    let skeleton = read(ARM).unwrap().asset.character.skeleton().clone();
    let text = |rows: &str| {
        format!(
            r#"{{"sinew_poses": 1, "clips": [{{"name": "sway", "loop": true, "interpolation": "catmull-rom",
            "tracks": [{{"bone": "arm", "xzx_deg": [{rows}]}}]}}]}}"#
        )
    };
    let clips =
        poses_from_bytes(text("[0,0,0,0],[1,0,30,0],[2,0,0,0],[3,0,-30,0],[4,0,0,0]").as_bytes(), &skeleton);
    let curve = &clips.unwrap()[0].tracks[0].curve;
    let bend = |t: f64| {
        let mut v = [0.0; 3];
        curve.sample(t, &mut v);
        v[1] as f64
    };
    let slope = |a: f64, b: f64| (bend(b) - bend(a)) / (b - a);
    assert!((slope(0.0, 1e-3) - slope(4.0 - 1e-3, 4.0)).abs() < 1e-2);
    assert!((slope(0.0, 1e-3) - 30_f64.to_radians()).abs() < 1e-2);
    assert_eq!((curve.range().unwrap().start, curve.range().unwrap().end), (0.0, 4.0));

    let open = poses_from_bytes(text("[0,0,0,0],[1,0,30,0]").as_bytes(), &skeleton).unwrap_err().to_string();
    assert!(open.contains("the last key of a loop must repeat the first"), "{open}");
}

#[test]
fn broken_files_are_errors() {
    let mut rng = Rng::new(5);
    for cut in 0..ARM.len() {
        if ARM.is_char_boundary(cut) {
            assert!(read(&ARM[..cut]).is_err(), "cut at {cut}");
        }
    }
    for _ in 0..3000 {
        let mut bytes = ARM.as_bytes().to_vec();
        for _ in 0..3 {
            let at = rng.range(0.0, bytes.len() as f64) as usize;
            bytes[at] = rng.range(32.0, 127.0) as u8;
        }
        let _ = import_bytes(&bytes, &Options::default(), &nothing);
    }
}
