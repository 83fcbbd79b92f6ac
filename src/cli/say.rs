//! What the program says on standard error, and in which colour.

use sinew::io::Warning;
use std::io::IsTerminal;
use std::path::Path;

/// Warnings shown without `-v`.
const FEW: usize = 5;

/// How much to say.
pub struct Say {
    quiet: bool,
    pub verbose: bool,
    color: bool,
}

impl Say {
    pub fn new(quiet: bool, verbose: bool) -> Self {
        let plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
        Self { quiet, verbose, color: !plain && std::io::stderr().is_terminal() }
    }

    pub fn error(&self, message: &str) {
        tell(&format!("{} {}", self.paint("error:", "1;31"), plain(message)));
    }

    pub fn warn(&self, message: &str) {
        if !self.quiet {
            tell(&format!("{} {}", self.paint("warning:", "1;33"), plain(message)));
        }
    }

    /// Something worth knowing, shown unless `-q`.
    pub fn note(&self, message: &str) {
        if !self.quiet {
            tell(&plain(message));
        }
    }

    /// What was asked for by an option of its own, shown in any case.
    pub fn report(&self, message: &str) {
        tell(&plain(message));
    }

    /// Something for the curious, shown with `-v`.
    pub fn detail(&self, message: &str) {
        if self.verbose {
            tell(&plain(message));
        }
    }

    pub fn warnings(&self, file: &Path, warnings: &[Warning]) {
        if self.quiet {
            return;
        }
        let shown = if self.verbose { warnings.len() } else { FEW };
        for w in warnings.iter().take(shown) {
            self.warn(&format!("{}: {w}", file.display()));
        }
        if warnings.len() > shown {
            tell(&format!("… and {} more warnings; -v shows them", warnings.len() - shown));
        }
    }

    /// A bar with the time left; nothing where standard error is no terminal.
    pub fn progress(&self, total: usize) -> indicatif::ProgressBar {
        use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
        if self.quiet || total < 2 {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr());
        let style = ProgressStyle::with_template("{pos}/{len} frames [{bar:30}] {elapsed} gone, {eta} left");
        if let Ok(style) = style {
            bar.set_style(style);
        }
        bar
    }

    /// A bar of clips, with what is being done.
    pub fn clip_progress(&self, total: usize) -> indicatif::ProgressBar {
        // One clip may take long as well.
        let bar = self.progress(total.max(2));
        bar.set_length(total as u64);
        if let Ok(style) =
            indicatif::ProgressStyle::with_template("{pos}/{len} clips [{bar:20}] {elapsed} gone; {msg}")
        {
            bar.set_style(style);
        }
        bar
    }

    /// A bar for the parts of one picture.
    pub fn picture_progress(&self) -> indicatif::ProgressBar {
        let bar = self.progress(1000);
        if let Ok(style) =
            indicatif::ProgressStyle::with_template("{percent}% [{bar:30}] {elapsed} gone, {eta} left")
        {
            bar.set_style(style);
        }
        bar
    }

    fn paint(&self, text: &str, code: &str) -> String {
        if self.color { format!("\x1b[{code}m{text}\x1b[0m") } else { text.into() }
    }
}

/// A line on standard error; nobody may be listening, and that is no failure.
fn tell(message: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{message}");
}

/// Text from a file without what would steer a terminal; line breaks stay.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && c != '\n' { '\u{fffd}' } else { c }).collect()
}

/// A name from a file, fit for one line of a terminal.
pub fn name(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
