//! Which clips are baked, and what is done to them before.

use super::Args;
use crate::cli::{Failure, say};
use sinew::bake::edit;
use sinew::clip::Clip;
use sinew::io::Import;
use sinew::time::Range;

/// The clips as they are to be baked, and which of the file's each takes the place of.
pub(super) fn edited(
    args: &Args,
    import: &Import,
    chosen: &[usize],
) -> Result<Vec<(Clip, Option<usize>)>, Failure> {
    let clips = import.asset.character.clips();
    let mut out = vec![];
    for &c in chosen {
        let mut clip = clips[c].clone();
        if let Some([from, to]) = args.trim {
            let whole = clip.playback();
            let range = Range { start: from.unwrap_or(whole.start), end: to.unwrap_or(whole.end) };
            if range.start >= whole.end || range.end <= whole.start || range.start >= range.end {
                let (name, Range { start, end }) = (say::name(&clip.name), whole);
                let message =
                    format!("--trim: clip {name} runs from {start} to {end} s; nothing would be left of it");
                return Err(Failure::Usage(message));
            }
            clip = edit::trim(&clip, range);
        }
        if args.reverse {
            clip = edit::reverse(&clip);
        }
        if let Some(factor) = args.speed {
            clip = edit::speed(&clip, factor);
        }
        out.push((clip, Some(c)));
    }
    if let Some(name) = &args.concat {
        let all: Vec<&Clip> = out.iter().map(|c| &c.0).collect();
        out = vec![(edit::concat(name, &all), None)];
    }
    Ok(out)
}
