//! A search over every action.

use crate::Bus;
use crate::commands::{ACTIONS, Action};
use crate::state::State;
use egui::Key;

/// Open or not, and what was typed.
#[derive(Default)]
pub struct Palette {
    open: bool,
    text: String,
    at: usize,
}

impl Palette {
    /// Whether it takes the keys.
    pub fn open(&self) -> bool {
        self.open
    }

    /// Open it on what a text finds.
    pub fn show(&mut self, text: &str) {
        *self = Self { open: true, text: text.into(), at: 0 };
    }

    /// Draw it over the panes.
    pub fn ui(&mut self, ctx: &egui::Context, state: &State, bus: &mut Bus) {
        if !self.open {
            return;
        }
        let found: Vec<&Action> = ACTIONS.iter().filter(|a| matches(a, &self.text)).collect();
        let (down, up, enter, escape) = ctx.input_mut(|i| {
            let mut hit = |k| i.consume_key(egui::Modifiers::NONE, k);
            (hit(Key::ArrowDown), hit(Key::ArrowUp), hit(Key::Enter), hit(Key::Escape))
        });
        self.at =
            (self.at + usize::from(down)).saturating_sub(usize::from(up)).min(found.len().saturating_sub(1));
        let mut chosen = found.get(self.at).copied().filter(|_| enter);
        let shown = egui::Modal::new(egui::Id::unique("palette")).show(ctx, |ui| {
            ui.set_width(440.0);
            let field = egui::TextEdit::singleline(&mut self.text)
                .hint_text("a command")
                .desired_width(f32::INFINITY);
            let response = ui.add(field);
            if response.changed() {
                self.at = 0;
            }
            response.accessible_name("Search for a command").request_focus();
            egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
                for (i, action) in found.iter().enumerate() {
                    if row(ui, action, i == self.at, state) {
                        chosen = Some(action);
                    }
                }
            });
        });
        if let Some(action) = chosen {
            bus.run(action, state);
        }
        self.open = chosen.is_none() && !escape && !shown.should_close();
    }
}

fn row(ui: &mut egui::Ui, action: &Action, at: bool, state: &State) -> bool {
    let keys = action.shortcut.map_or(String::new(), |s| ui.ctx().format_shortcut(&s));
    let text = format!("{} · {}", action.menu, action.name);
    let button = egui::Button::new(text).selected(at).shortcut_text(keys).min_size([430.0, 0.0].into());
    let response = ui.add_enabled((action.enabled)(state), button);
    if at {
        response.scroll_to_me(None);
    }
    response.on_hover_text(action.help).accessible_name(action.name).clicked()
}

/// Every word typed occurs in the name, the menu or the help.
fn matches(action: &Action, text: &str) -> bool {
    let all = format!("{} {} {}", action.menu, action.name, action.help).to_lowercase();
    text.to_lowercase().split_whitespace().all(|word| all.contains(word))
}
