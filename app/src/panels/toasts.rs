//! Notices in passing: what was refused, what was done.

/// A few lines in a corner.
#[derive(Default)]
pub struct Toasts {
    lines: Vec<(String, f64)>,
}

/// How long a notice stays, and how many do.
const SECONDS: f64 = 6.0;
const MOST: usize = 5;

impl Toasts {
    /// Show a notice; the same one again stays longer.
    pub fn push(&mut self, text: String, now: f64) {
        self.lines.retain(|(t, _)| *t != text);
        // What is long takes longer to read.
        let until = now + SECONDS + 0.04 * text.len() as f64;
        self.lines.push((text, until));
        let over = self.lines.len().saturating_sub(MOST);
        self.lines.drain(..over);
    }

    /// What is shown now.
    pub fn texts(&self) -> impl Iterator<Item = &str> {
        self.lines.iter().map(|l| l.0.as_str())
    }

    /// Draw them, and wake up when the first is over.
    pub fn ui(&mut self, ctx: &egui::Context) {
        let now = ctx.input(|i| i.time);
        self.lines.retain(|l| l.1 > now);
        let Some(first) = self.lines.iter().map(|l| l.1).reduce(f64::min) else { return };
        let area = egui::Area::new(egui::Id::unique("toasts")).order(egui::Order::Foreground);
        area.anchor(egui::Align2::RIGHT_BOTTOM, [-12.0, -36.0]).show(ctx, |ui| {
            for (text, _) in &self.lines {
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.set_max_width(420.0);
                    ui.label(text);
                });
            }
        });
        ctx.request_repaint_after(std::time::Duration::from_secs_f64(first - now));
    }
}
