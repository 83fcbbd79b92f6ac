//! What was found, for people and for programs.

use super::pair::Outcome;
use crate::cli::say;
use serde_json::{Value, json};
use std::fmt::Write;

const CHANNELS: [&str; 4] = ["red", "green", "blue", "alpha"];

/// A line a pair that differs, all pairs with `all`, and a line that counts.
pub fn as_text(outcomes: &[Outcome], all: bool) -> String {
    let mut t = String::new();
    for o in outcomes.iter().filter(|o| all || o.verdict.name() != "equal") {
        let _ =
            writeln!(t, "{:<10} {}{}", o.verdict.name(), say::name(&o.name.to_string_lossy()), figures(o));
        if let Some(why) = o.verdict.reason() {
            let _ = writeln!(t, "           {}", say::name(why));
        }
        if let Some(Ok(place)) = &o.drawn {
            let place = say::name(&place.to_string_lossy());
            let _ = writeln!(t, "           drawn to {place}, differences × {}", o.gain);
        }
    }
    let counts = counts(outcomes).into_iter().filter(|c| c.1 > 0);
    let counts: Vec<String> = counts.map(|(name, n)| format!("{n} {name}")).collect();
    let _ = writeln!(t, "{}", counts.join(", "));
    t
}

fn counts(outcomes: &[Outcome]) -> [(&'static str, usize); 5] {
    ["equal", "within", "past", "missing", "unreadable"]
        .map(|name| (name, outcomes.iter().filter(|o| o.verdict.name() == name).count()))
}

/// `: PSNR 38.21 dB, …`, if anything was measured.
fn figures(o: &Outcome) -> String {
    let s = &o.summary;
    if s.differing_frames == 0 {
        return String::new();
    }
    let (worst, frame) = s.worst;
    let frames = match s.frames {
        1 => String::new(),
        n => format!(" in {} of {n} frames, the first being {}", s.differing_frames, s.first.unwrap_or(0)),
    };
    let of = if s.frames > 1 { format!(" of frame {frame}") } else { String::new() };
    format!(
        ": PSNR {:.2} dB, SSIM {:.4}, {} pixels differ ({:.3} %){frames}, worst {} codes of {} at {}, {}{of}",
        s.psnr,
        s.ssim,
        s.differing_pixels,
        100.0 * s.differing_pixels as f64 / s.pixels.max(1) as f64,
        worst.codes,
        CHANNELS[worst.channel.min(3)],
        worst.at[0],
        worst.at[1],
    )
}

/// One object; what is infinite or not known is `null`.
pub fn as_json(outcomes: &[Outcome]) -> String {
    let counts: serde_json::Map<String, Value> =
        counts(outcomes).into_iter().map(|(name, n)| (name.to_owned(), n.into())).collect();
    let pairs: Vec<Value> = outcomes.iter().map(pair).collect();
    let mut text = json!({ "schema": 1, "counts": counts, "pairs": pairs }).to_string();
    text.push('\n');
    text
}

fn pair(o: &Outcome) -> Value {
    let s = &o.summary;
    let measured = s.frames > 0;
    let finite = |v: f64| Some(v).filter(|v| measured && v.is_finite());
    let (worst, frame) = s.worst;
    let worst = (s.differing_pixels > 0).then(|| {
        json!({
            "codes": worst.codes,
            "channel": CHANNELS[worst.channel.min(3)],
            "x": worst.at[0],
            "y": worst.at[1],
            "frame": frame,
        })
    });
    json!({
        "name": o.name.to_string_lossy(),
        "verdict": o.verdict.name(),
        "reason": o.verdict.reason(),
        "expected": side(o, 0),
        "actual": side(o, 1),
        "frames_compared": s.frames,
        "frames_differing": s.differing_frames,
        "first_differing_frame": s.first,
        "pixels_differing": s.differing_pixels,
        "psnr_db": finite(s.psnr),
        "psnr_linear_db": finite(s.psnr_linear),
        "ssim": measured.then_some(s.ssim),
        "worst": worst,
        "diff": o.drawn.as_ref().and_then(|d| d.as_ref().ok()).map(|d| d.to_string_lossy()),
        "diff_gain": o.drawn.as_ref().map(|_| o.gain),
    })
}

fn side(o: &Outcome, k: usize) -> Value {
    json!({ "size": o.sizes[k], "frames": o.frames[k], "duration_ms": o.durations_ms[k] })
}
