//! Options of sheets: many frames in one picture.

#[derive(clap::Args)]
#[command(next_help_heading = "Sheets")]
pub struct SheetArgs {}
