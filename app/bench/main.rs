//! Two measurements of the editor: what the interface adds to a playing character, and what a large dope sheet costs.
//!
//! `cargo bench -p sinew-app`. Times are of the processor, all threads together, so other programs hardly count; what is compared
//! is done in turns in one run.

use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect, pos2, vec2};
use glam::Vec3;
use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike;
use sinew::asset::Asset;
use sinew::character::{Binding, Character, Instance, MeshId};
use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
use sinew::frames::{BonesDesc, Live, Look};
use sinew::image::Rgba8;
use sinew::mesh::{Mesh, MeshData};
use sinew::render::Settings;
use sinew::skeleton::{BoneDesc, BoneId, Skeleton};
use sinew::skin::Weights;
use sinew_app::App;
use sinew_app::state::{Command, State};
use std::sync::Arc;

/// The editor, without a window and without whoever listens for names.
struct Headless {
    ctx: egui::Context,
    app: App,
    size: egui::Vec2,
    time: f64,
}

impl Headless {
    fn new(state: State, size: egui::Vec2) -> Self {
        let mut it = Self { ctx: egui::Context::default(), app: App::new(state), size, time: 0.0 };
        sinew_app::set_up(&it.ctx);
        (0..5).for_each(|_| {
            it.frame(vec![]);
        });
        it
    }

    /// One frame, triangles included; seconds of the processor.
    fn frame(&mut self, events: Vec<Event>) -> f64 {
        self.time += 1.0 / 60.0;
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, self.size));
        let input = RawInput { screen_rect, time: Some(self.time), events, ..Default::default() };
        let before = processor();
        let mut out = self.ctx.run_ui(input, |ui| self.app.ui(ui));
        out.textures_delta.clear();
        let triangles = self.ctx.tessellate(out.shapes, out.pixels_per_point);
        std::hint::black_box(triangles);
        processor() - before
    }
}

/// Seconds that this program has run, on all processors.
fn processor() -> f64 {
    let used = getrusage(UsageWho::RUSAGE_SELF).expect("the system counts");
    (used.user_time() + used.system_time()).num_microseconds() as f64 * 1e-6
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn chain(bones: usize, keys: usize, mesh: Option<(Mesh, Weights)>) -> Arc<Asset> {
    let bone = |i: usize| BoneDesc {
        parent: i.checked_sub(1),
        length: 0.1,
        rest: sinew::math::Trs { translation: Vec3::new(0.1, 0.0, 0.0), ..sinew::math::Trs::IDENTITY },
        ..BoneDesc::new(format!("bone {i}"))
    };
    let (skeleton, _) = Skeleton::new((0..bones).map(bone).collect()).expect("a tree");
    let times: Vec<f64> = (0..keys).map(|k| k as f64 * 20.0 / keys as f64).collect();
    let track = |b: usize| {
        let values = times.iter().flat_map(|t| [0.1 * (t + b as f64).sin() as f32, 0.3, 0.0]).collect();
        let curve = Curve::new(times.clone(), values, 3, Interpolation::Linear).expect("keys");
        Track { target: Target::Xzx(BoneId(b as u32)), curve }
    };
    let clip = Clip { name: "clip".into(), tracks: (0..bones).map(track).collect() };
    let palette = (0..bones)
        .map(|b| (BoneId(b as u32), glam::Affine3A::from_translation(Vec3::new(-0.1 * b as f32, 0.0, 0.0))));
    let (meshes, instances) = match mesh {
        Some((mesh, weights)) => {
            let binding = Binding::Skin { palette: palette.collect(), weights };
            (vec![mesh], vec![Instance { mesh: MeshId(0), binding, first_weight: 0 }])
        }
        None => (vec![], vec![]),
    };
    let character = Character::new(skeleton, meshes, instances, vec![], vec![clip]).expect("parts that fit");
    Arc::new(Asset { character, ..Asset::default() })
}

/// What somebody does in frame `i`.
type Doing<'a> = (&'a str, &'a dyn Fn(usize) -> Vec<Event>);

fn dope() {
    println!("dope sheet, 2,000 bones: processor ms a frame, median");
    let mut editors =
        [500, 5000].map(|keys| Headless::new(State::open(chain(2000, keys, None)), vec2(1280.0, 720.0)));
    let (names, keys, from) = (pos2(60.0, 600.0), pos2(420.0, 600.0), pos2(420.0, 690.0));
    let wheel = |y: f32| Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: vec2(0.0, y),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    };
    let button = |pos, pressed| {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        Event::PointerButton { pos, button, pressed, modifiers }
    };
    let scroll = |_| vec![Event::PointerMoved(names), wheel(-37.0)];
    let zoom = |i| vec![Event::PointerMoved(keys), wheel(if i % 20 < 10 { 30.0 } else { -30.0 })];
    let boxed = |i| match i % 10 {
        0 => vec![Event::PointerMoved(from), button(from, true)],
        9 => vec![button(pos2(200.0, 560.0), false)],
        i => vec![Event::PointerMoved(from - vec2(24.0, 14.0) * i as f32)],
    };
    let all: [Doing<'_>; 3] = [("scroll", &scroll), ("zoom", &zoom), ("box", &boxed)];
    for (name, events) in all {
        // One after the other, so that whatever else runs troubles both alike.
        let mut times = [vec![], vec![]];
        for i in 0..300 {
            for (editor, times) in editors.iter_mut().zip(&mut times) {
                times.push(editor.frame(events(i)) * 1e3);
            }
        }
        let [few, many] = times.map(|t| median(&t));
        let ratio = many / few;
        println!("  {name}: {few:.2} with 500 keys a bone, {many:.2} with 5,000: ×{ratio:.2}; at most ×1.20");
    }
    let chosen = editors.each_ref().map(|e| e.app.state.selection.key_count());
    println!("  the last box chose {chosen:?} keys");
}

/// A grid of `n · n` vertices along the chain.
fn cloth(n: usize, bones: usize) -> (Mesh, Weights) {
    let at = |i: usize| Vec3::new((i % n) as f32 * 0.1 * bones as f32 / n as f32, (i / n) as f32 * 0.01, 0.0);
    let quad = |i: usize| [[i, i + 1, i + n], [i + 1, i + n + 1, i + n]].map(|t| t.map(|v| v as u32));
    let inside = (0..n * n).filter(|i| i % n + 1 < n && i / n + 1 < n);
    let triangles: Vec<[u32; 3]> = inside.flat_map(quad).collect();
    let positions: Vec<Vec3> = (0..n * n).map(at).collect();
    let joints: Vec<u32> = (0..n * n)
        .flat_map(|i| {
            let b = (i % n) * bones / n;
            [b as u32, (b + 1).min(bones - 1) as u32]
        })
        .collect();
    let weights = vec![0.5; 2 * n * n];
    let (weights, _) = Weights::new(2, &joints, &weights, bones, 0).expect("two bones a vertex");
    let normals = vec![Vec3::Z; n * n];
    let data = MeshData { name: "cloth".into(), positions, normals, triangles, ..MeshData::default() };
    (Mesh::new(data).expect("a grid"), weights)
}

/// The engine alone, at what the editor's viewport shows: pose, deform, draw, draw the bones.
struct Engine {
    asset: Arc<Asset>,
    live: Live,
    buffer: Rgba8,
}

impl Engine {
    /// The frame that the editor just drew; seconds of the processor.
    fn frame(&mut self, h: &Headless) -> f64 {
        let (state, view) = (&h.app.state, &h.app.viewport);
        let [width, height] = view.cost.size;
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
        let settings = Settings { width, height, samples: 1, threads };
        let camera = view.orbit.camera(self.live.center());
        let before = processor();
        self.live.pose(&self.asset, &state.pose());
        self.live.draw(&self.asset, &camera, [0.0; 4], &settings, &mut self.buffer);
        self.live.draw_bones(&self.asset, &BonesDesc::default(), &camera, &settings, &mut self.buffer);
        processor() - before
    }
}

fn playing(size: egui::Vec2) {
    let asset = chain(100, 48, Some(cloth(316, 100)));
    let mut engine =
        Engine { live: Live::new(&asset, Look::default()), asset: asset.clone(), buffer: Rgba8::default() };
    let mut h = Headless::new(State::open(asset), size);
    h.app.state.update(Command::Play(true)).expect("it plays");
    let (mut all, mut alone) = (vec![], vec![]);
    for i in 0..150 {
        let times = (h.frame(vec![]), engine.frame(&h));
        if i >= 20 {
            all.push(times.0 * 1e3);
            alone.push(times.1 * 1e3);
        }
    }
    let (all, alone) = (median(&all), median(&alone));
    let ([w, d], pane) = ([size.x, size.y], h.app.viewport.cost.size);
    println!(
        "100,000 vertices, 100 bones, playing; window {w}×{d}, viewport {pane:?}: processor ms a frame, median"
    );
    println!(
        "  editor {all:.2}, engine alone {alone:.2}: the interface adds {:.0} %; at most 25 %",
        100.0 * (all / alone - 1.0)
    );
}

fn main() {
    dope();
    // The window of that size, and about the picture of that size.
    [vec2(1280.0, 720.0), vec2(2002.0, 1314.0)].into_iter().for_each(playing);
}
