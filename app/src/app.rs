//! The application: state, panes, and what goes between them.

use crate::commands::{ACTIONS, ALIASES, Action, Run, Scope, Task, named};
use crate::jobs::Jobs;
use crate::layout::{self, Pane};
use crate::panels::Panels;
use crate::state::{Command, State};
use crate::viewport::Viewport;
use egui::KeyboardShortcut;
use std::time::Duration;

/// Fonts and look; once, before the first frame.
pub fn set_up(ctx: &egui::Context) {
    let mut fonts = egui::FontDefinitions::default();
    // Arrows and diamonds are in the font of code alone.
    fonts.families.entry(egui::FontFamily::Proportional).or_default().push("Hack".into());
    ctx.set_fonts(fonts);
    ctx.set_theme(egui::Theme::Dark);
    ctx.style_mut_of(egui::Theme::Dark, |style| {
        // The light font needs more contrast than the theme gives it.
        style.visuals.widgets.noninteractive.fg_stroke.color = egui::Color32::from_gray(205);
        style.visuals.widgets.inactive.fg_stroke.color = egui::Color32::from_gray(215);
        style.visuals.weak_text_color = Some(egui::Color32::from_gray(150));
    });
}

/// What panes ask for while they draw; done when the last has drawn.
#[derive(Default)]
pub struct Bus {
    commands: Vec<Command>,
    tasks: Vec<Task>,
    notices: Vec<String>,
}

impl Bus {
    /// Change the state.
    pub fn send(&mut self, command: Command) {
        self.commands.push(command);
    }

    /// Something of the window.
    pub fn ask(&mut self, task: Task) {
        self.tasks.push(task);
    }

    /// Tell the user.
    pub fn tell(&mut self, notice: impl Into<String>) {
        self.notices.push(notice.into());
    }

    /// Do what an action does, if it can be done.
    pub fn run(&mut self, action: &Action, state: &State) {
        if (action.enabled)(state) {
            match action.run {
                Run::State(commands) => self.commands.extend(commands(state)),
                Run::Window(task) => self.tasks.push(task),
            }
        }
    }
}

/// The editor, without a window.
pub struct App {
    /// What is edited.
    pub state: State,
    /// The picture of the character.
    pub viewport: Viewport,
    /// Files.
    pub jobs: Jobs,
    /// Everything else that is drawn.
    pub panels: Panels,
    tree: egui_tiles::Tree<Pane>,
    bus: Bus,
    last_time: Option<f64>,
}

/// Where settings are kept between runs.
const KEPT: &str = "sinew-app";
/// And files that were opened.
const FILES: &str = "sinew-app files";

impl App {
    /// A document, opened, in panes where they were at first.
    pub fn new(state: State) -> Self {
        Self {
            state,
            viewport: Viewport::default(),
            jobs: Jobs::default(),
            panels: Panels::default(),
            tree: layout::default_tree(),
            bus: Bus::default(),
            last_time: None,
        }
    }

    /// Panes and view as the last run left them.
    pub fn restore(&mut self, storage: &dyn eframe::Storage) {
        if let Some((tree, view)) = eframe::get_value(storage, KEPT) {
            (self.tree, self.state.view) = (tree, view);
        }
        self.jobs.recent = eframe::get_value(storage, FILES).unwrap_or_default();
    }

    /// One frame.
    pub fn ui(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        self.jobs.poll(&ctx, &mut self.state, &mut self.bus);
        self.tick(&ctx);
        self.shortcuts(&ctx);

        let Self { state, viewport, panels, tree, bus, jobs, .. } = self;
        egui::Panel::top("header").show(ui, |ui| panels.header.ui(ui, state, bus));
        egui::Panel::bottom("status").show(ui, |ui| panels.status.ui(ui, state, viewport, bus));
        egui::CentralPanel::no_frame().show(ui, |ui| {
            let rect = ui.max_rect();
            tree.ui(&mut layout::Panes { state, viewport, panels, bus }, ui);
            // Automatic keys cannot be missed, wherever one looks.
            if state.auto_key {
                let red = egui::Stroke::new(2.0, egui::Color32::from_rgb(220, 40, 40));
                ui.painter().rect_stroke(rect, 0.0, red, egui::StrokeKind::Inside);
            }
        });
        jobs.camera = viewport.orbit;
        jobs.ui(&ctx, state, bus);
        panels.over(&ctx, state, bus);
        self.settle(&ctx);
    }

    /// Do an action by its name, as its shortcut would.
    pub fn action(&mut self, name: &str) {
        self.bus.run(named(name), &self.state);
    }

    /// Tell the user something in passing.
    pub fn tell(&mut self, notice: impl Into<String>) {
        self.bus.tell(notice);
    }

    fn tick(&mut self, ctx: &egui::Context) {
        let now = ctx.input(|i| i.time);
        let dt = now - self.last_time.replace(now).unwrap_or(now);
        let p = self.state.playback;
        if p.playing.is_none() {
            self.panels.header.stopped();
            return;
        }
        // Real time shows as many frames as the screen does; every frame waits for its own.
        let wait = if p.every_frame {
            self.panels.header.wait(now, self.state.frame_seconds() / p.speed)
        } else {
            0.0
        };
        if wait <= 1e-4 {
            self.panels.header.shown(now);
            self.bus.send(Command::Tick(dt));
        }
        ctx.request_repaint_after(Duration::from_secs_f64(wait));
    }

    /// Keys pressed, unless somebody types.
    fn shortcuts(&mut self, ctx: &egui::Context) {
        // A drag hears Esc before anybody, and no other key.
        if self.state.in_gesture() {
            if ctx.input(|i| i.key_pressed(egui::Key::Escape)) {
                self.bus.send(Command::Cancel);
                self.settle(ctx);
            }
            return;
        }
        if ctx.text_edit_focused() || self.panels.modal() || self.jobs.modal() {
            return;
        }
        self.clipboard(ctx);
        let time = self.panels.hovered.is_some_and(Pane::has_time);
        let here = |s: Scope| s == Scope::Any || (s == Scope::Time) == time;
        let own = ACTIONS.iter().filter_map(|a| a.shortcut.map(|s| (s, a)));
        let other = ALIASES.iter().map(|(s, name)| (*s, named(name)));
        let mut all: Vec<(KeyboardShortcut, &Action)> =
            own.chain(other).filter(|(_, a)| here(a.scope)).collect();

        // More modifiers first: Ctrl+Shift+Z is not Ctrl+Z.
        all.sort_by_key(|(s, _)| {
            std::cmp::Reverse([s.modifiers.shift, s.modifiers.alt].iter().filter(|m| **m).count())
        });
        for (shortcut, action) in all {
            if ctx.input_mut(|i| i.consume_shortcut(&shortcut)) {
                self.bus.run(action, &self.state);
            }
        }
    }

    /// Copying and pasting come as events of their own; pasting only where the system's clipboard has text.
    fn clipboard(&mut self, ctx: &egui::Context) {
        let events = ctx.input(|i| i.events.clone());
        let time = self.panels.hovered.is_some_and(Pane::has_time);
        let shift = ctx.input(|i| i.modifiers.shift);
        for event in events {
            let name = match event {
                egui::Event::Copy if time => "Copy keys",
                egui::Event::Copy => "Copy pose",
                egui::Event::Paste(_) if shift => "Paste mirrored pose",
                egui::Event::Paste(_) if time => "Paste keys",
                egui::Event::Paste(_) => "Paste pose",
                _ => continue,
            };
            if name.starts_with("Copy") {
                ctx.copy_text("sinew".into());
            }
            self.bus.run(named(name), &self.state);
        }
    }

    /// Do what was asked for.
    fn settle(&mut self, ctx: &egui::Context) {
        for command in std::mem::take(&mut self.bus.commands) {
            if let Err(refused) = self.state.update(command) {
                self.bus.tell(refused.to_string());
            }
            // What was drawn is of the state before.
            ctx.request_repaint();
        }
        for task in std::mem::take(&mut self.bus.tasks) {
            self.task(ctx, task);
            ctx.request_repaint();
        }
        for notice in std::mem::take(&mut self.bus.notices) {
            self.panels.toasts.push(notice, ctx.input(|i| i.time));
        }
    }

    fn task(&mut self, ctx: &egui::Context, task: Task) {
        match task {
            Task::ResetLayout => self.tree = layout::default_tree(),
            Task::Open
            | Task::Save
            | Task::SaveAs
            | Task::Export
            | Task::Still
            | Task::BakeXzx
            | Task::BakeQuaternions
            | Task::Quit => {
                self.jobs.task(ctx, task, &mut self.state, &mut self.bus);
            }
            Task::FrameAll | Task::FrameSelection if self.panels.hovered == Some(Pane::Viewport) => {
                self.viewport.task(task, &self.state);
            }
            _ => self.panels.task(task, &self.state, &mut self.bus),
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        Self::ui(self, ui);
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, KEPT, &(&self.tree, &self.state.view));
        eframe::set_value(storage, FILES, &self.jobs.recent);
    }
}
