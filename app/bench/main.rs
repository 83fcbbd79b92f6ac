//! Two measurements of the editor: what the interface adds to a playing character, and what a large dope sheet costs.
//!
//! `cargo bench -p sinew-app`. Times are of this thread's processor, so other programs do not count.

use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect, pos2, vec2};
use glam::Vec3;
use sinew::asset::Asset;
use sinew::character::{Binding, Character, Instance, MeshId};
use sinew::clip::{Clip, Curve, Interpolation, Target, Track};
use sinew::mesh::{Mesh, MeshData};
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

/// Seconds that this thread has run.
fn processor() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanos: f64 = text.split(' ').next().and_then(|t| t.parse().ok()).unwrap_or(0.0);
    nanos * 1e-9
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
        let [few, many] = times.map(|mut t| {
            t.sort_by(f64::total_cmp);
            t[t.len() / 2]
        });
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

fn playing() {
    let mut h = Headless::new(State::open(chain(100, 48, Some(cloth(316, 100)))), vec2(1280.0, 720.0));
    h.app.state.update(Command::Play(true)).expect("it plays");
    let (mut all, mut engine) = (0.0, 0.0);
    for i in 0..120 {
        let spent = h.frame(vec![]) * 1e3;
        let c = h.app.viewport.cost;
        if i >= 20 {
            all += spent;
            engine += f64::from(c.evaluate_ms + c.skin_ms + c.draw_ms);
        }
    }
    println!("100,000 vertices, 100 bones, playing at 1280×720: processor ms a frame of the window's thread");
    println!(
        "  {:.2} in all, engine {:.2}: the interface adds {:.0} %; at most 25 %",
        all / 100.0,
        engine / 100.0,
        100.0 * (all / engine - 1.0)
    );
}

fn main() {
    dope();
    playing();
}
