//! Values of options: lengths, parts, metrics, bones.

use sinew::bake::{Goal, Metric};

#[derive(Clone, Copy)]
pub(super) enum Tolerance {
    Metres(f64),
    OfDiagonal(f64),
}

pub(super) fn tolerance(text: &str) -> Result<Tolerance, String> {
    let units = [("%", 0.01), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("", 1.0)];
    let (unit, scale) = units.into_iter().find(|u| text.ends_with(u.0)).expect("the last fits all");
    let number = text[..text.len() - unit.len()].trim().parse::<f64>();
    match number.map(|n| n * scale) {
        Ok(n) if n > 0.0 && n.is_finite() && unit == "%" => Ok(Tolerance::OfDiagonal(n)),
        Ok(n) if n > 0.0 && n.is_finite() => Ok(Tolerance::Metres(n)),
        _ => Err("expected a length above 0 (0.5mm, 2cm, 0.001) or a part of the diagonal (0.02%)".into()),
    }
}

/// `0.5..2`, `..2` or `0.5..`.
pub(super) fn part(text: &str) -> Result<[Option<f64>; 2], String> {
    let wrong = || "expected two times in seconds, as in 0.5..2, ..2 or 0.5..".to_owned();
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    let end = |t: &str| match t.trim() {
        "" => Ok(None),
        t => t.parse::<f64>().ok().filter(|t| t.is_finite()).map(Some).ok_or_else(wrong),
    };
    match [end(from)?, end(to)?] {
        [Some(a), Some(b)] if a >= b => Err(format!("{a} is not before {b}")),
        ends => Ok(ends),
    }
}

pub(super) fn fewest(text: &str) -> Result<Goal, String> {
    match text {
        "bytes" => Ok(Goal::Bytes),
        "keys" => Ok(Goal::Keys),
        _ => Err("expected bytes or keys".into()),
    }
}

pub(super) fn factor(text: &str) -> Result<f64, String> {
    text.parse::<f64>()
        .ok()
        .filter(|f| (1e-3..=1e3).contains(f))
        .ok_or_else(|| "expected a number from 0.001 to 1000, as in 2 or 0.5".into())
}

pub(super) fn metres(text: &str) -> Option<f64> {
    match tolerance(text) {
        Ok(Tolerance::Metres(m)) => Some(m),
        _ => None,
    }
}

pub(super) fn metric(text: &str) -> Result<Metric, String> {
    let shell = text.strip_prefix("shell:").and_then(metres).map(Metric::Shell);
    let metric = if text == "vertices" { Some(Metric::Vertices) } else { shell };
    metric.ok_or_else(|| "expected vertices, or shell: and a length, as in shell:3cm".into())
}

pub(super) fn pin(text: &str) -> Result<(String, f64), String> {
    let pin = text.rsplit_once('=').and_then(|(bone, length)| Some((bone.to_owned(), metres(length)?)));
    pin.ok_or_else(|| "expected a bone and a length, as in LeftFoot=0.01mm".into())
}

/// `0.2s`, `150ms` or `0.2`.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    let (number, scale) = match text.strip_suffix("ms") {
        Some(number) => (number, 1e-3),
        None => (text.strip_suffix('s').unwrap_or(text), 1.0),
    };
    let seconds = number.trim().parse::<f64>().map(|n| n * scale);
    let wrong = || "expected a time above 0, as in 0.2s or 150ms".to_owned();
    seconds.ok().filter(|s| *s > 0.0 && s.is_finite()).ok_or_else(wrong)
}
