//! Options of the pictures and of the files that they go to.

use crate::cli::Failure;
use sinew::io::picture::{Format, PngLevel, Target};
use sinew::render::Settings;

#[derive(clap::Args)]
#[command(next_help_heading = "Output")]
pub struct OutputArgs {
    /// A picture (.png, .webp, .exr), a numbered sequence (out.####.png, out.%04d.png), a film (.webp, .gif, .apng, .y4m) or - for
    /// standard output; of several inputs or clips with {name}, {folder} and {clip} in it.
    #[arg(short, long, value_name = "OUT", required_unless_present = "list")]
    output: Option<String>,
    /// Pixels, as in 512 or 1920x1080; 512 if neither this nor the scene says.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[usize; 2]>,
    /// How hard to press PNG files: fast, balanced or best.
    #[arg(long, default_value = "fast", value_parser = parse_level)]
    pub png: PngLevel,
    /// The format, for standard output (-o -) or an animated PNG whose name ends in .png: png, webp, exr, gif, apng or y4m.
    #[arg(long, value_name = "FORMAT")]
    format: Option<Format>,
    /// Write an animated PNG even though the name ends in .png.
    #[arg(long, conflicts_with = "format")]
    apng: bool,
    /// Worker threads; 0 takes one a processor. The result does not depend on it.
    #[arg(long, default_value = "0", value_name = "N")]
    threads: usize,
    /// Overwrite existing files.
    #[arg(short, long)]
    pub force: bool,
}

impl OutputArgs {
    /// The output's name, its fields unfilled.
    pub fn name(&self) -> &str {
        self.output.as_deref().unwrap_or_default()
    }

    /// What a name asks for.
    pub fn target(&self, name: &str) -> Result<Target, Failure> {
        let format = self.format.or(self.apng.then_some(Format::Apng));
        let target = match format {
            Some(format) => Target::parse_as(name, format),
            None => Target::parse(name),
        };
        target.map_err(|e| Failure::Usage(e.to_string()))
    }

    /// Size and samples of the rasterizer's, for drawing on one thread; `usual` is the size where no option says it.
    pub fn settings(&self, usual: Option<[usize; 2]>, samples: u8) -> Result<Settings, Failure> {
        let [width, height] = self.size.or(usual).unwrap_or([512, 512]);
        let settings = Settings { width, height, samples, threads: 1 };
        settings.check().map_err(|e| Failure::Usage(format!("--size: {e}")))?;
        Ok(settings)
    }

    /// Worker threads.
    pub fn threads(&self) -> usize {
        let processors = std::thread::available_parallelism().map_or(1, |n| n.get());
        if self.threads == 0 { processors } else { self.threads.min(256) }
    }
}

fn parse_size(text: &str) -> Result<[usize; 2], String> {
    let side = |s: &str| s.trim().parse::<usize>().ok().filter(|n| (1..=16384).contains(n));
    let (w, h) = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
    match (side(w), side(h)) {
        (Some(w), Some(h)) => Ok([w, h]),
        _ => Err("expected pixels from 1 to 16384, as in 512 or 1920x1080".into()),
    }
}

fn parse_level(text: &str) -> Result<PngLevel, String> {
    match text {
        "fast" => Ok(PngLevel::Fast),
        "balanced" => Ok(PngLevel::Balanced),
        "best" => Ok(PngLevel::Best),
        _ => Err("expected fast, balanced or best".into()),
    }
}
