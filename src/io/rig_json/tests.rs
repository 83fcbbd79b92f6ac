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
    let arm = read(ARM).unwrap().asset.character;
    let text = |rows: &str| {
        format!(
            r#"{{"sinew_poses": 1, "clips": [{{"name": "sway", "loop": true, "interpolation": "catmull-rom",
            "tracks": [{{"bone": "arm", "xzx_deg": [{rows}]}}]}}]}}"#
        )
    };
    let clips =
        poses_from_bytes(text("[0,0,0,0],[1,0,30,0],[2,0,0,0],[3,0,-30,0],[4,0,0,0]").as_bytes(), &arm);
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

    let open = poses_from_bytes(text("[0,0,0,0],[1,0,30,0]").as_bytes(), &arm).unwrap_err().to_string();
    assert!(open.contains("the last key of a loop must repeat the first"), "{open}");
}

/// Two bones in a row along x, a box's worth of room for a mesh.
fn with_mesh(mesh: &str) -> Result<Import, RigError> {
    read(&format!(
        r#"{{"sinew_rig": 1, "bones": [
        {{"name": "a", "head": [0,0,0], "tail": [1,0,0]}},
        {{"name": "b", "parent": "a", "translation": [1,0,0], "length": 1}}], "meshes": [{mesh}]}}"#
    ))
}

#[test]
fn parts_follow_the_closest_bone_also_where_creases_split_them() {
    // Two triangles that meet at a right angle near b, one triangle near a.
    let mesh = r#"{"name": "m", "bind": "closest", "crease_deg": 30,
        "positions": [[1.2,0,0],[1.8,0,0],[1.2,0.1,0],[1.2,0,0.1],[0.2,0,0],[0.4,0,0],[0.2,0.1,0]],
        "triangles": [[0,1,2],[0,3,1],[4,5,6]]}"#;
    let c = with_mesh(mesh).unwrap().asset.character;
    // The two corners on the sharp edge are there twice.
    assert_eq!(c.meshes()[0].positions.len(), 9);
    let crate::character::Binding::Skin { palette, weights } = &c.instances()[0].binding else {
        panic!("no skin")
    };
    for (v, p) in c.meshes()[0].positions.iter().enumerate() {
        let bone = palette[weights.of(v).next().unwrap().0].0;
        assert_eq!(c.skeleton().name(bone), if p.x < 1.0 { "a" } else { "b" });
    }
}

#[test]
fn weights_that_do_not_sum_to_one_are_scaled_with_a_warning() {
    let mesh = r#"{"name": "m", "bind": {"weights": {"bones": ["b", "a"], "vertices": [[[0,2]], [[0,1],[1,1]], []]}},
        "positions": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2]]}"#;
    let warnings = with_mesh(mesh).unwrap().warnings;
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert_eq!(
        warnings[0].to_string(),
        "mesh `m`: 2 vertices had weights that did not sum to 1 and were scaled"
    );
    assert!(warnings[1].to_string().contains("1 vertices had no weights"));
}

#[test]
fn offsets_start_from_rest_and_channels_exclude_each_other() {
    let arm = read(ARM).unwrap().asset.character;
    let clip = |track: &str| {
        let text = format!(
            r#"{{"sinew_poses": 1, "clips": [{{"name": "c", "tracks": [{{"bone": "hand", {track}}}]}}]}}"#
        );
        poses_from_bytes(text.as_bytes(), &arm)
    };
    let moved = clip(r#""offset": [[0, 0.5, 0, 0]]"#).unwrap();
    assert_eq!(moved[0].tracks[0].curve.value(0), [1.5, 0.0, 0.0]);
    let both = clip(r#""offset": [[0, 0.5, 0, 0]], "scale": [[0, 1, 1, 1]]"#).unwrap_err().to_string();
    assert!(both.contains("keys of exactly one of"), "{both}");
    let short = clip(r#""xzx_deg": [[0, 0.5, 0]]"#).unwrap_err().to_string();
    assert!(
        short.contains("key 0 of `xzx_deg`: expected 4 numbers (a time and 3 values), found 3"),
        "{short}"
    );
    let back = clip(r#""scale": [[1, 1, 1, 1], [0, 1, 1, 1]]"#).unwrap_err().to_string();
    assert!(back.contains("key 1: its time 0 s is before"), "{back}");
}

#[test]
fn both_signs_of_a_quaternion_are_one_rotation() {
    let arm = read(ARM).unwrap().asset.character;
    // A tenth of a radian to and fro, once not at all; every other key is written with the other sign.
    let q = glam::Quat::from_xyzw(0.5, 0.5, 0.5, 0.5);
    let turned = -(q * glam::Quat::from_rotation_x(0.1));
    let keys = [q, turned, q, -q, turned, -q];
    for (kind, repeats) in
        [("linear", false), ("catmull-rom", false), ("catmull-rom", true), ("hermite", false)]
    {
        let flat = if kind == "hermite" { ",0,0,0,0" } else { "" };
        let row = |(t, q): (usize, &glam::Quat)| format!("[{t}{flat},{},{},{},{}{flat}]", q.x, q.y, q.z, q.w);
        let rows = keys.iter().enumerate().map(row).collect::<Vec<_>>().join(",");
        let text = format!(
            r#"{{"sinew_poses": 1, "clips": [{{"name": "c", "loop": {repeats}, "interpolation": "{kind}",
            "tracks": [{{"bone": "arm", "rotation": [{rows}]}}]}}]}}"#
        );
        let clip = &poses_from_bytes(text.as_bytes(), &arm).unwrap()[0];
        for i in 0..=500 {
            let found = clip.tracks[0].curve.sample_rotation(i as f64 * 0.01);
            let off = crate::math::rotation::angle_between(found, q);
            // Splines overshoot a little.
            assert!(off < 0.12, "{kind}, loop {repeats}: {off} at {i} / 100 s");
        }
    }
}

#[test]
fn paths_stay_inside_the_project() {
    for good in ["x.png", "../poses/x.json", "./a/../b.png", "a/../../poses/x.json"] {
        assert!(inside_project(good).is_ok(), "{good}");
    }
    for one in ["a/b.png", "./a/b.png", "a//b.png", "a/./c/../b.png"] {
        assert_eq!(inside_project(one).unwrap(), "a/b.png");
    }
    assert_eq!(inside_project("a/../../poses/x.json").unwrap(), "../poses/x.json");
    for bad in ["", "/etc/passwd", "../../x", "a/../../../x", "c:\\x", "..\\x", "file://x", "a/../../../b/x"]
    {
        assert!(inside_project(bad).is_err(), "{bad}");
    }
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

#[cfg(feature = "pictures")]
fn with_textures(files: &[&str], fetch: Fetch) -> Result<Import, RigError> {
    let one = |(i, f): (usize, &&str)| format!(r#"{{"name": "{i}", "texture": "{f}"}}"#);
    let materials: Vec<String> = files.iter().enumerate().map(one).collect();
    let rig = format!(
        r#"{{"sinew_rig": 1, "bones": [{{"name": "a", "head": [0,0,0], "tail": [1,0,0]}}], "meshes": [],
        "materials": [{}]}}"#,
        materials.join(",")
    );
    import_bytes(rig.as_bytes(), &Options { textures: true }, fetch)
}

#[cfg(feature = "pictures")]
fn white_png(side: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::GrayImage::new(side, side).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[cfg(feature = "pictures")]
#[test]
fn a_picture_under_several_spellings_is_decoded_once() {
    let (png, fetched) = (white_png(2), std::cell::Cell::new(0));
    let fetch = |_: &str| {
        fetched.set(fetched.get() + 1);
        Ok(png.clone())
    };
    let asset = with_textures(&["a.png", "./a.png", "x/..//a.png", "b.png"], &fetch).unwrap().asset;
    assert_eq!((asset.textures.len(), fetched.get()), (2, 2));
    let of = |i: usize| asset.materials[i].diffuse_map.unwrap().texture.0;
    assert_eq!([0, 1, 2, 3].map(of), [0, 0, 0, 1]);
}

#[cfg(feature = "pictures")]
#[test]
fn alpha_weighs_no_colors_where_it_means_nothing() {
    let mut png = std::io::Cursor::new(Vec::new());
    let texels = vec![255, 0, 0, 255, 0, 255, 0, 0];
    let picture = image::RgbaImage::from_raw(2, 1, texels).unwrap();
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let rig = r##"{"sinew_rig": 1, "bones": [{"name": "a", "head": [0,0,0], "tail": [1,0,0]}], "meshes": [], "materials": [
        {"name": "solid", "texture": "a.png"}, {"name": "glass", "texture": "a.png", "diffuse": "#ffffff80"}]}"##;
    let fetch = |_: &str| Ok(png.get_ref().clone());
    let import = import_bytes(rig.as_bytes(), &Options { textures: true }, &fetch).unwrap();
    // The mean of red and green in linear light; and red alone, where green is not seen.
    let coarse = import.asset.textures.iter().map(|t| t.levels()[1].clone()).collect::<Vec<_>>();
    assert_eq!(coarse, [[188, 188, 0, 128], [255, 0, 0, 128]]);
    let of = |i: usize| import.asset.materials[i].diffuse_map.unwrap().texture.0;
    assert_eq!([0, 1].map(of), [0, 1]);
}

#[test]
fn highlights_whose_map_is_left_out_are_its_mean() {
    use crate::scene::{Filter, Material, Texture, TextureId, WrapMode};
    let map = |codes: [u8; 8]| {
        let (content, wrap) = (Content::ColorAndNumber, [WrapMode::Clamp; 2]);
        Texture::new(2, 1, codes.to_vec(), content, wrap, Filter::Trilinear).unwrap()
    };
    let textures = vec![map([188, 0, 0, 128, 188, 0, 0, 128])];
    let on = TextureRef { texture: TextureId(0), uv_set: 0, transform: Affine2::IDENTITY };
    let matt = Material {
        specular: glam::Vec3::ONE,
        shininess: 1024.0,
        specular_map: Some(on),
        ..Material::default()
    };
    let skin = Material { name: "skin".into(), diffuse_map: Some(on), ..Material::default() };
    let asset = Asset { materials: vec![matt, skin], textures, ..Asset::default() };
    let out = export("x", &asset, &["x.png".into()]);
    let [matt, skin] = &out.document.materials[..] else { panic!("two materials") };
    let specular = matt.specular.unwrap().0;
    assert!((specular.x - 0.5).abs() < 0.01 && specular.y == 0.0, "{specular}");
    // 1024 to the power of 128/255.
    assert!((matt.shininess.unwrap() - 32.4).abs() < 0.1, "{:?}", matt.shininess);
    assert_eq!((skin.specular, skin.shininess), (None, None));
    let said = out.warnings.iter().map(|w| w.to_string()).collect::<Vec<_>>().join("; ");
    assert!(said.contains("material `skin`: its texture's sampler left out"), "{said}");
}

#[cfg(feature = "pictures")]
#[test]
fn pictures_beyond_the_bound_are_refused_before_they_are_decoded() {
    // 8193² × 4 bytes are just too many; only the header is there.
    let mut png = white_png(1);
    png[16..20].copy_from_slice(&8193_u32.to_be_bytes());
    png[20..24].copy_from_slice(&8193_u32.to_be_bytes());
    let crc = png[12..29].iter().fold(!0_u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    });
    png[29..33].copy_from_slice(&(!crc).to_be_bytes());
    let error = with_textures(&["a.png"], &|_| Ok(png.clone())).unwrap_err().to_string();
    assert!(error.starts_with("texture `a.png`: 8193 × 8193 pixels; the pictures of a rig"), "{error}");

    // Small ones count together.
    let mut left = 4 * 2 * 2 + 1;
    let small = white_png(2);
    assert!(texture::decode("a", &small, Content::Color, &mut left).is_ok());
    assert!(texture::decode("b", &small, Content::Color, &mut left).is_err());
}

#[cfg(unix)]
#[test]
fn neither_links_out_of_the_project_nor_pipes_are_read() {
    let home = std::env::temp_dir().join(format!("sinew-rig-{}", std::process::id()));
    std::fs::create_dir_all(home.join("project/rigs")).unwrap();
    let (rigs, poses) = (home.join("project/rigs"), r#"{"sinew_poses": 1, "clips": []}"#);
    std::fs::write(home.join("out.json"), poses).unwrap();
    std::fs::write(home.join("project/in.json"), poses).unwrap();
    std::os::unix::fs::symlink("../../out.json", rigs.join("out.json")).unwrap();
    std::os::unix::fs::symlink("../in.json", rigs.join("in.json")).unwrap();
    std::process::Command::new("mkfifo").arg(rigs.join("pipe.json")).status().unwrap();
    let import = |poses: &str| {
        let rig = ARM.replace("\"materials\"", &format!("\"poses\": [\"{poses}\"], \"materials\""));
        std::fs::write(rigs.join("rig.json"), rig).unwrap();
        import(&rigs.join("rig.json"), &Options::default()).map_err(|e| e.to_string())
    };
    let found = ["in.json", "out.json", "pipe.json"].map(import);
    std::fs::remove_dir_all(&home).unwrap();
    let [inside, out, pipe] = found;
    assert!(inside.is_ok(), "{inside:?}");
    let (out, pipe) = (out.unwrap_err(), pipe.unwrap_err());
    assert!(out.contains("cannot read `out.json`: it is a link to "), "{out}");
    assert!(pipe.contains("cannot read `pipe.json`: this is a pipe"), "{pipe}");
}

#[test]
fn rates_ranges_and_markers_come_back_and_wrong_ones_are_refused() {
    let text = r#"{"sinew_poses": 1, "rate": [30000, 1001], "clips": [{"name": "nod", "range": [0, 2], "preview": [0.5, 1],
        "markers": [[0.25, "up"], [1, "\"down\""]], "tracks": []}]}"#;
    let poses = Poses::from_bytes(text.as_bytes()).unwrap();
    let timeline = poses.timeline().unwrap();
    assert_eq!(timeline.rate.unwrap().to_string(), "30000/1001");
    assert_eq!((timeline.clips[0].markers[1].time, &*timeline.clips[0].markers[1].name), (1.0, "\"down\""));
    let bare = Clip { name: "nod".into(), ..Clip::default() };
    let again = Poses { sinew_poses: 1, rate: None, clips: vec![bare] }.with_timeline(&timeline);
    assert_eq!(Poses::from_bytes(again.to_text().as_bytes()).unwrap(), poses);
    for (from, to, why) in [
        ("[30000, 1001]", "[0, 1]", "rate: "),
        ("[0, 2]", "[3, 2]", "clip `nod`: its range ends at 2 s, before it starts at 3 s"),
        ("[0.5, 1]", "[0.5, 0]", "clip `nod`: its preview ends"),
        ("[0.25, ", "[1.5, ", "clip `nod`: marker `\"down\"` at 1 s follows one at 1.5 s"),
        ("[0, 2]", "[0]", "line 1"),
    ] {
        let bad = Poses::from_bytes(text.replace(from, to).as_bytes()).and_then(|p| p.timeline());
        let found = bad.unwrap_err().to_string();
        assert!(found.starts_with(why), "{found}");
    }
}
