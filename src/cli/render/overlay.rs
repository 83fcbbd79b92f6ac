//! Options of what is drawn over the character.

#[derive(clap::Args)]
#[command(next_help_heading = "Overlays")]
pub struct OverlayArgs {}
