//! Options of work on many inputs and clips.

#[derive(clap::Args)]
#[command(next_help_heading = "Batch")]
pub struct BatchArgs {}
