//! Files: opened, saved, exported, recovered; and bad ones, which say what is wrong.

use super::keys::face;
use super::person::Person;
use super::{file, pip};
use sinew::bake::xzx;
use sinew::clip::Target;
use sinew::frames::View;
use sinew::io::picture::frames_of;
use sinew::io::sheet_json::Style;
use sinew::io::{self, Options};
use sinew::render::{Renderer, Settings};
use sinew::sheet::{Kind as Lie, SheetDesc};
use sinew::time::{Marker, Range};
use sinew_app::App;
use sinew_app::jobs::film::{SheetWish, Wish};
use sinew_app::jobs::open::{self, Kind, Source};
use sinew_app::jobs::{recover, save};
use sinew_app::state::{Change, Command, Edit, Playback, State};
use std::path::{Path, PathBuf};

/// An empty folder, gone when the test is over.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("sinew-app-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a folder for tests");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Frames until the job is done.
pub fn wait(p: &mut Person) {
    let start = std::time::Instant::now();
    while start.elapsed().as_secs() < 900 {
        p.ui.step();
        if !p.ui.state().jobs.busy() {
            return p.ui.run_steps(3);
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    panic!("the job does not end");
}

/// A small film of the clip that is edited.
pub fn small(to: PathBuf, state: &State) -> Wish {
    Wish {
        to,
        sheet: None,
        settings: Settings { width: 48, height: 40, ..Settings::default() },
        transparent: false,
        view: View::default(),
        renderer: Renderer::Raster,
        rate: "6".parse().expect("a rate"),
        clip: state.clip,
        at: 0.0,
        range: state.active().range,
    }
}

fn nod() -> State {
    let mut state = State::open(pip());
    state.view.quality = sinew_app::state::Quality::Draft;
    let head = state.document.skeleton().find("head").expect("pip has one");
    state.update(Command::SetAutoKey(true)).expect("always");
    let change = Edit::Pose(vec![(head, Change::Xzx(glam::Vec3::new(0.1, 0.4, 0.0)))]);
    state.update(Command::Do(change)).expect("a finite pose");
    state
}

#[test]
fn what_is_saved_is_opened_equal() {
    let folder = Folder::new("save");
    let to = folder.0.join("pip.json");
    let mut state = nod();
    for edit in [
        Edit::SetRate("30000/1001".parse().expect("a rate")),
        Edit::SetRange(Range { start: 0.25, end: 1.5 }),
        Edit::SetMarker(Marker { time: 0.75, name: "contact".into() }),
        Edit::SetMarker(Marker { time: 0.5, name: "\"down\"".into() }),
    ] {
        state.update(Command::Do(edit)).expect("an edit");
    }
    let preview = Playback { range: Range { start: 0.5, end: 1.0 }, ..state.playback };
    state.update(Command::SetPlayback(preview)).expect("a range");
    let mut p = Person::at(state);
    assert!(p.state().unsaved());
    let ctx = p.ui.ctx.clone();
    let app: &mut App = p.ui.state_mut();
    app.jobs.save(&ctx, to.clone(), &app.state);
    wait(&mut p);
    assert!(!p.state().unsaved());
    let again = open::read(&to).expect("what was written").state();
    assert_eq!(again.document.to_clips(), p.state().document.to_clips());
    assert_eq!(again.document.skeleton(), p.state().document.skeleton());
    let of = |s: &State| (s.timeline(), s.document.rate, s.playback.range, s.clip);
    assert_eq!(of(&again), of(p.state()));
    assert_eq!(again.active().markers.len(), 2);

    // Another edit goes into the same poses; the rig is not touched.
    let rig = std::fs::read(&to).expect("the rig");
    p.ui.state_mut().state.update(Command::Do(Edit::RenameClip("stroll".into()))).expect("a name");
    p.ui.state_mut().action("Save");
    wait(&mut p);
    let again = open::read(&to).expect("what was written").state();
    assert_eq!(again.document.to_clips(), p.state().document.to_clips());
    assert_eq!(std::fs::read(&to).expect("the rig"), rig);
}

#[test]
fn exports_hold_what_was_edited() {
    let folder = Folder::new("export");
    let state = nod();
    let clips = state.document.to_clips();
    let glb = folder.0.join("pip.glb");
    save::gltf(&glb, None, &state.document.asset, &clips).expect("a GLB");
    let import = io::import(&glb, &Options::default()).expect("it is read again");
    let (a, b) = (&state.document.asset.character, &import.asset.character);
    assert_eq!(b.clips().len(), clips.len());
    let head = |c: &sinew::character::Character, pose: sinew::pose::Pose| {
        c.posed(&pose).origin(c.skeleton().find("ear tip.L").expect("pip has ears"))
    };
    for t in [0.0, 0.21, 0.5] {
        let mut pose = a.rest_pose();
        clips[0].sample(a.skeleton(), t, &mut pose);
        let (want, found) = (head(a, pose), head(b, b.pose(Some(0), t)));
        assert!(want.distance(found) < 2e-4, "{t}: {want} {found}");
    }

    // A film and a sheet, as the command line makes them.
    let mut p = Person::at(state);
    let rays = Renderer::Ray(Default::default());
    let (film, still) = (Renderer::Raster, rays);
    let grid = SheetWish { desc: SheetDesc::default(), sides: 1, json: Some(Style::TexturePacker) };
    let desc = SheetDesc { kind: Lie::Trimmed, ..SheetDesc::default() };
    let trimmed = SheetWish { desc, sides: 8, json: Some(Style::Aseprite) };
    for (name, sheet, renderer) in [
        ("pip.gif", None, film),
        ("pip.##.png", None, film),
        ("pip.png", Some(grid), film),
        ("trimmed.png", Some(trimmed), film),
        ("still.png", None, still),
    ] {
        let ctx = p.ui.ctx.clone();
        let wish = Wish { renderer, sheet, ..small(folder.0.join(name), p.state()) };
        let app = p.ui.state_mut();
        app.jobs.export_film(&ctx, wish, &app.state);
        wait(&mut p);
    }
    let bytes = std::fs::read(folder.0.join("pip.gif")).expect("a film");
    let frames = frames_of(&bytes).expect("a GIF").count();
    let stills = (1..100).take_while(|i| folder.0.join(format!("pip.{i:02}.png")).exists()).count();
    assert!(frames >= 4 && stills == frames, "{frames} {stills}");
    assert!(folder.0.join("pip.png").exists() && folder.0.join("still.png").exists());
    let table = |name: &str| std::fs::read_to_string(folder.0.join(name)).expect("a table");
    assert_eq!(table("pip.json").matches("\"rotated\"").count(), frames);
    // Eight sides, each with a tag of its own.
    let (all, clip) = (table("trimmed.json"), &clips[0].name);
    assert_eq!(all.matches("\"duration\"").count(), 8 * frames);
    for side in ["s", "sw", "w", "nw", "n", "ne", "e", "se"] {
        assert!(all.contains(&format!("\"{clip}/{side}\"")), "{side}");
    }
}

#[test]
fn shapes_keep_their_names() {
    let folder = Folder::new("shapes");
    let state = face();
    let (asset, clips) = (&state.document.asset, state.document.to_clips());
    let [glb, rig] = ["face.glb", "face.json"].map(|n| folder.0.join(n));
    save::gltf(&glb, None, asset, &clips).expect("a GLB");
    save::save(&rig, None, asset, &clips, &state.timeline()).expect("a rig");
    for file in [glb, rig] {
        let again = open::read(&file).expect("what was written").state();
        assert_eq!([0, 1].map(|i| again.document.shape(i)), ["smile", "w1"], "{}", file.display());
    }
}

#[test]
fn a_bad_file_says_which_and_what_and_nothing_is_lost() {
    let folder = Folder::new("bad");
    let bad = folder.0.join("bad.glb");
    std::fs::write(&bad, b"glTF and then nothing").expect("a file");
    let mut p = Person::at(nod());
    let (ctx, before) = (p.ui.ctx.clone(), p.state().document.clone());
    p.ui.state_mut().jobs.open(&ctx, &bad, None);
    wait(&mut p);
    let says = |t: &str| t.contains("bad.glb");
    assert!(p.ui.state().panels.toasts.texts().any(says));
    assert!(p.state().document.same_bits(&before) && p.state().unsaved());
}

#[test]
fn a_crash_loses_no_clip() {
    let folder = Folder::new("recover");
    let state = nod();
    recover::keep(&folder.0, &file("rigs/pip.json"), &state.document).expect("it is kept");
    assert!(recover::left(&folder.0).is_empty(), "this program still runs");
    let (opened, clips, timeline) = recover::restore(&recover::own(&folder.0)).expect("it is found");
    let found = recover::state(&opened, clips, &timeline);
    assert_eq!(found.document.to_clips(), state.document.to_clips());
    assert!(found.unsaved() && opened.source.kind == Kind::Rig);
}

#[test]
fn unsaved_changes_are_asked_about() {
    let mut p = Person::at(nod());
    p.ui.state_mut().jobs.source = Some(Source { path: file("rigs/pip.json"), kind: Kind::Rig });
    p.ui.state_mut().action("Quit");
    p.ui.run_steps(3);
    assert!(p.has("Unsaved changes") && p.has("Save first"));
    p.shot("unsaved");
    p.click("Stay");
    assert!(!p.has("Save first") && p.state().unsaved());
    p.ui.state_mut().action("Export…");
    p.ui.run_steps(3);
    p.shot("export");
    p.click("GIF");
    p.click("Cancel");
    p.ui.state_mut().action("Open…");
    p.ui.run_steps(3);
    p.shot("open");
    p.click("Cancel");
}

#[test]
fn a_gltf_is_baked_to_angles_and_back_with_a_measured_error() {
    let mut character = pip().character.clone();
    let one = character.clips()[0].clone();
    character = character.with_clips(vec![one.clone()]).expect("its own clip");
    let quat = xzx::to_quat(&character, &one, &save::desc(&character)).expect("a bake").clip;
    let character = character.with_clips(vec![quat]).expect("its own clip");
    let asset = sinew::asset::Asset { character, ..(*pip()).clone() };
    let mut state = State::open(asset.into());
    state.view.quality = sinew_app::state::Quality::Draft;
    let mut p = Person::at(state);
    let angles =
        |p: &Person| p.state().active().tracks.iter().filter(|t| matches!(t.target, Target::Xzx(_))).count();
    assert_eq!(angles(&p), 0);
    p.ui.state_mut().action("Bake to angles");
    p.ui.step();
    wait(&mut p);
    assert!(angles(&p) > 10);
    assert!(p.ui.state().panels.toasts.texts().any(|t| t.contains("nothing moved by more than")));
    p.key(super::person::CTRL, egui::Key::Z);
    assert_eq!(angles(&p), 0);
}

/// Every broken file is a message or a document, and never the end.
#[test]
fn every_invalid_file_is_answered() {
    let given = std::env::var_os("SINEW_DATA").map(PathBuf::from);
    let data = given.unwrap_or_else(|| file("../shared/data")).join("invalid");
    let mut files = vec![];
    collect(&data, &mut files);
    let mut refused = 0;
    for path in &files {
        match open::read(path) {
            Err(why) => {
                refused += 1;
                let name = path.file_name().expect("a file").to_string_lossy();
                assert!(why.contains(&*name) && why.len() > name.len() + 8, "{}: {why}", path.display());
            }
            Ok(opened) => drop(opened.state().pose()),
        }
    }
    println!("{refused} of {} files were refused", files.len());
    assert!(files.is_empty() || refused * 4 > files.len(), "{refused} of {}", files.len());
}

fn collect(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, out);
        } else if path.extension().is_some_and(|e| ["gltf", "glb"].iter().any(|k| e == *k)) {
            out.push(path);
        }
    }
    out.sort();
}
