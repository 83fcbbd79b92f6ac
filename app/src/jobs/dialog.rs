//! Questions over the panes: which file, what to export, what about unsaved changes.

use super::film::{SheetWish, Wish};
use super::open::{Kind, Source};
use super::{Jobs, Outcome, recover};
use crate::Bus;
use crate::state::State;
use crate::viewport::orbit::Orbit;
use egui::{Align2, ProgressBar, RichText, TextEdit, Window};
use sinew::frames::View;
use sinew::io::sheet_json::Style;
use sinew::render::ray::RaySettings;
use sinew::render::{Renderer, Settings};
use sinew::sheet::{Kind as Lie, SheetDesc};
use sinew::time::{Range, Rate};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

/// What follows once unsaved changes are dealt with.
#[derive(Clone, Debug)]
pub enum Then {
    Quit,
    Open(PathBuf),
}

/// What is asked.
pub enum Ask {
    Open { path: String, recent: Vec<PathBuf> },
    Save { path: String },
    Export(Export),
    Unsaved(Then),
    Recover(PathBuf),
}

/// What an export is to be.
pub struct Export {
    path: String,
    kind: &'static str,
    size: [usize; 2],
    as_shown: bool,
    transparent: bool,
    smooth: bool,
    /// Samples a pixel, where it is ray traced.
    rays: Option<u32>,
    rate: Rate,
    range: Range,
    sheet: SheetWish,
}

/// Rays a pixel, at first.
const RAYS: u32 = 16;

/// Kinds of export: name, what stands behind the file's stem, and help.
const KINDS: [(&str, &str, &str); 5] = [
    ("GLB", "-edited.glb", "The character with its clips, for other programs"),
    ("GIF", ".gif", "The clip as a film; .webp, .apng and .y4m work as well"),
    ("frames", ".####.png", "A picture a frame"),
    ("sheet", ".sheet.png", "All frames in one picture, and a table of them"),
    ("still", ".png", "The moment at the playhead"),
];

impl Ask {
    pub fn open(recent: &[PathBuf]) -> Self {
        Self::Open { path: String::new(), recent: recent.to_vec() }
    }

    pub fn save(source: Option<&Source>) -> Self {
        let path = source.map(|s| match s.kind {
            Kind::Rig => s.path.clone(),
            _ => s.path.with_extension("json"),
        });
        Self::Save { path: path.unwrap_or("rig.json".into()).display().to_string() }
    }

    pub fn export(source: Option<&Source>, state: &State, still: bool) -> Self {
        let stem = source.map_or("clip".into(), |s| s.path.with_extension("").display().to_string());
        let (kind, ending, _) = KINDS[if still { 4 } else { 0 }];
        Self::Export(Export {
            path: format!("{stem}{ending}"),
            kind,
            size: [512, 512],
            as_shown: still,
            transparent: false,
            smooth: true,
            rays: still.then_some(RAYS),
            rate: state.document.rate,
            range: state.active().range,
            sheet: SheetWish { desc: SheetDesc::default(), sides: 1, json: Some(Style::default()) },
        })
    }

    /// A path from the system's dialog.
    pub fn choose(&mut self, chosen: &Path) {
        if let Self::Open { path, .. } | Self::Save { path } | Self::Export(Export { path, .. }) = self {
            *path = chosen.display().to_string();
        }
    }
}

/// What was answered.
enum Answer {
    Nothing,
    Close,
    Do,
    Browse,
    Take(PathBuf),
    Save,
    Drop,
}

/// A path to type, and a button for the system's dialog.
fn path_line(ui: &mut egui::Ui, path: &mut String) -> Answer {
    let mut answer = Answer::Nothing;
    ui.horizontal(|ui| {
        let named = ui.label("Path").id;
        let edit = ui.add(TextEdit::singleline(path).desired_width(420.0)).labelled_by(named);
        if edit.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) {
            answer = Answer::Do;
        } else if ui.memory(|m| m.focused().is_none()) {
            // Whoever types means the path.
            edit.request_focus();
        }
        if ui.button("Browse…").on_hover_text("The system's own dialog").clicked() {
            answer = Answer::Browse;
        }
    });
    answer
}

/// What is written replaces what is there.
fn warn_of_loss(ui: &mut egui::Ui, path: &str) {
    if Path::new(path.trim()).is_file() {
        ui.colored_label(ui.visuals().warn_fg_color, "This file exists and will be replaced.");
    }
}

/// Two buttons; the first does it.
fn choice(ui: &mut egui::Ui, name: &str, before: Answer) -> Answer {
    let mut answer = before;
    ui.horizontal(|ui| {
        if ui.button(RichText::new(name).strong()).clicked() {
            answer = Answer::Do;
        }
        if ui.button("Cancel").clicked() || ui.input(|i| i.key_pressed(egui::Key::Escape)) {
            answer = Answer::Close;
        }
    });
    answer
}

impl Ask {
    fn title(&self) -> &'static str {
        match self {
            Self::Open { .. } => "Open a file",
            Self::Save { .. } => "Save the rig and its poses",
            Self::Export(_) => "Export this clip",
            Self::Unsaved(_) => "Unsaved changes",
            Self::Recover(_) => "Recover",
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui) -> Answer {
        match self {
            Self::Open { path, recent } => {
                let mut answer = path_line(ui, path);
                for file in recent.iter() {
                    if ui.link(file.display().to_string()).clicked() {
                        answer = Answer::Take(file.clone());
                    }
                }
                choice(ui, "Open", answer)
            }
            Self::Save { path } => {
                let answer = path_line(ui, path);
                warn_of_loss(ui, path);
                choice(ui, "Write", answer)
            }
            Self::Export(export) => {
                let answer = export.ui(ui);
                choice(ui, "Start", answer)
            }
            Self::Unsaved(_) => {
                ui.label("What was changed since the last save would be lost.");
                let mut answer = Answer::Nothing;
                ui.horizontal(|ui| {
                    for (name, then) in [
                        ("Save first", Answer::Save),
                        ("Discard changes", Answer::Drop),
                        ("Stay", Answer::Close),
                    ] {
                        if ui.button(name).clicked() {
                            answer = then;
                        }
                    }
                });
                answer
            }
            Self::Recover(kept) => {
                let file = recover::file_of(kept).map_or("a file".into(), |f| f.display().to_string());
                ui.label(format!("An editor ended without saving. Its work on {file} is still there."));
                let mut answer = Answer::Nothing;
                ui.horizontal(|ui| {
                    for (name, then) in
                        [("Recover it", Answer::Do), ("Delete it", Answer::Drop), ("Later", Answer::Close)]
                    {
                        if ui.button(name).clicked() {
                            answer = then;
                        }
                    }
                });
                answer
            }
        }
    }
}

impl Export {
    fn ui(&mut self, ui: &mut egui::Ui) -> Answer {
        ui.horizontal(|ui| {
            for (kind, ending, help) in KINDS {
                if ui.radio(self.kind == kind, kind).on_hover_text(help).clicked() {
                    let old = KINDS.iter().find(|k| k.0 == self.kind).map_or("", |k| k.1);
                    let stem = self.path.strip_suffix(old).unwrap_or(&self.path).to_owned();
                    (self.path, self.kind) = (stem + ending, kind);
                }
            }
        });
        let answer = path_line(ui, &mut self.path);
        warn_of_loss(ui, &self.path);
        if self.kind != "GLB" {
            self.pictures(ui);
        }
        if !["GLB", "still"].contains(&self.kind) {
            self.times(ui);
        }
        if self.kind == "sheet" {
            self.sheets(ui);
        }
        answer
    }

    fn pictures(&mut self, ui: &mut egui::Ui) {
        ui.horizontal(|ui| {
            for (k, name) in ["Width", "Height"].into_iter().enumerate() {
                number(ui, name, &mut self.size[k], 1..=8192, " px");
            }
            ui.checkbox(&mut self.as_shown, "as the viewport stands").on_hover_text(
                "Otherwise from where the command line looks: yaw 30°, pitch 12°, the whole clip in the picture",
            );
        });
        ui.horizontal(|ui| {
            let mut rays = self.rays.is_some();
            if ui.checkbox(&mut rays, "ray traced").on_hover_text("With shadows; slow").changed() {
                self.rays = rays.then_some(RAYS);
            }
            match &mut self.rays {
                Some(samples) => number(ui, "Rays a pixel", samples, 1..=4096, ""),
                None => drop(
                    ui.checkbox(&mut self.smooth, "smooth edges")
                        .on_hover_text("Four samples a pixel, or one"),
                ),
            }
            if self.kind != "sheet" {
                let help = "Nothing behind the character; otherwise light paper";
                ui.checkbox(&mut self.transparent, "transparent").on_hover_text(help);
            }
        });
    }

    fn times(&mut self, ui: &mut egui::Ui) {
        ui.horizontal(|ui| {
            let mut fps = self.rate.fps();
            number(ui, "Frames a second", &mut fps, 1.0..=1000.0, "");
            self.rate = Rate::from_fps(fps).unwrap_or(self.rate);
            let Range { start, end } = &mut self.range;
            number(ui, "From", start, -86_400.0..=*end, " s");
            number(ui, "to", end, *start..=86_400.0, " s");
        });
    }

    fn sheets(&mut self, ui: &mut egui::Ui) {
        let SheetWish { desc, sides, json } = &mut self.sheet;
        ui.horizontal(|ui| {
            ui.radio_value(&mut desc.kind, Lie::Grid, "grid")
                .on_hover_text("Rows and columns; a direction a row");
            let help = "Cut to what is visible and packed, equal frames once";
            ui.radio_value(&mut desc.kind, Lie::Trimmed, "trimmed").on_hover_text(help);
            number(ui, "Directions", sides, 1..=64, "");
            for (name, style) in [
                ("TexturePacker", Some(Style::TexturePacker)),
                ("array", Some(Style::TexturePackerArray)),
                ("Aseprite", Some(Style::Aseprite)),
                ("no table", None),
            ] {
                ui.radio_value(json, style, name).on_hover_text("The table of frames beside the picture");
            }
        });
    }

    fn wish(&self, state: &State, camera: &Orbit) -> Wish {
        let sheet = (self.kind == "sheet").then_some(self.sheet);
        let view = match (self.as_shown, View::default()) {
            (true, _) => View::LookAt {
                eye: camera.eye(),
                target: camera.target,
                up: camera.axes()[1].as_vec3(),
                fov_y: Orbit::FOV as f32,
            },
            // Directions start in front of the character.
            (_, View::Orbit { pitch, fov_y, .. }) if sheet.is_some_and(|s| s.sides > 1) => {
                View::Orbit { yaw: 0.0, pitch, fov_y }
            }
            (_, view) => view,
        };
        let rays = |samples| Renderer::Ray(RaySettings { samples, ..RaySettings::default() });
        let [width, height] = self.size;
        let samples = if self.smooth { 4 } else { 1 };
        Wish {
            to: self.path.trim().into(),
            sheet,
            settings: Settings { width, height, samples, threads: 1 },
            transparent: self.transparent,
            view,
            renderer: self.rays.map_or(Renderer::Raster, rays),
            rate: self.rate,
            clip: state.clip,
            at: state.time,
            range: self.range,
        }
    }
}

/// A number with its name before it.
fn number<N: egui::emath::Numeric>(
    ui: &mut egui::Ui,
    name: &str,
    of: &mut N,
    range: std::ops::RangeInclusive<N>,
    unit: &str,
) {
    let label = ui.label(name).id;
    let decimals = if N::INTEGRAL { 0 } else { 3 };
    ui.add(egui::DragValue::new(of).range(range).suffix(unit).max_decimals(decimals)).labelled_by(label);
}

impl Jobs {
    /// Progress, questions and dialogs over the panes.
    pub fn ui(&mut self, ctx: &egui::Context, state: &State, bus: &mut Bus) {
        if let Some(running) = &self.running {
            Window::new(&running.name)
                .id(egui::Id::unique("job"))
                .anchor(Align2::CENTER_BOTTOM, [0.0, -40.0])
                .collapsible(false)
                .resizable(false)
                .show(ctx, |ui| {
                    let share = f32::from_bits(running.progress.load(Ordering::Relaxed));
                    ui.add(ProgressBar::new(share).desired_width(320.0).show_percentage());
                    if ui.button("Stop").clicked() {
                        running.cancel.store(true, Ordering::Relaxed);
                    }
                });
        }
        let Some(ask) = &mut self.ask else { return };
        let shown = Window::new(ask.title())
            .id(egui::Id::unique(("ask", ask.title())))
            .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
            .collapsible(false)
            .resizable(false)
            .show(ctx, |ui| ask.ui(ui));
        let answer = shown.and_then(|s| s.inner).unwrap_or(Answer::Nothing);
        self.answered(ctx, answer, state, bus);
    }

    fn answered(&mut self, ctx: &egui::Context, answer: Answer, state: &State, bus: &mut Bus) {
        let browse = matches!(answer, Answer::Browse);
        if browse && self.browsing.is_none() {
            let open = matches!(self.ask, Some(Ask::Open { .. }));
            self.browse(ctx, !open);
        }
        if browse || matches!(answer, Answer::Nothing) {
            return;
        }
        if self.running.is_some() && !matches!(answer, Answer::Close) {
            bus.tell("something is being read or written already");
            return;
        }
        match (self.ask.take(), answer) {
            (Some(Ask::Open { path, .. }), Answer::Do) => {
                self.leave(ctx, Then::Open(path.trim().into()), state)
            }
            (Some(Ask::Open { .. }), Answer::Take(path)) => self.leave(ctx, Then::Open(path), state),
            (Some(Ask::Save { path }), Answer::Do) => self.save(ctx, path.trim().into(), state),
            (Some(Ask::Export(e)), Answer::Do) if e.kind == "GLB" => {
                self.export_gltf(ctx, e.path.trim().into(), state);
            }
            (Some(Ask::Export(e)), Answer::Do) => {
                let wish = e.wish(state, &self.camera);
                self.export_film(ctx, wish, state);
            }
            (Some(Ask::Unsaved(then)), Answer::Drop) => self.go(ctx, then),
            (Some(Ask::Unsaved(then)), Answer::Save) => {
                self.after_save = Some(then);
                match &self.source {
                    Some(s) if s.kind == Kind::Rig => self.save(ctx, s.path.clone(), state),
                    source => self.ask = Some(Ask::save(source.as_ref())),
                }
            }
            (Some(Ask::Recover(kept)), Answer::Do) => {
                self.start(ctx, "Recovering".into(), move |_| match recover::restore(&kept) {
                    Ok((opened, clips, timeline)) => {
                        let state = recover::state(&opened, clips, &timeline);
                        Outcome::Recovered(Box::new(state), opened.source, kept)
                    }
                    Err(why) => Outcome::Failed(why),
                });
            }
            (Some(Ask::Recover(kept)), Answer::Drop) => {
                let _ = std::fs::remove_file(kept);
            }
            _ => self.after_save = None,
        }
    }
}
