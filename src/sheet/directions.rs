//! The same character from all sides.

use std::f64::consts::TAU;

/// One side.
#[derive(Clone, Debug, PartialEq)]
pub struct Direction {
    /// Where the character looks on the screen, as on a map: `s` is towards the viewer, `e` to the right. Empty if it is the only one.
    pub name: String,
    /// Radians that the camera has walked on, counter-clockwise as seen from above.
    pub turn: f32,
}

/// `count` sides at equal steps: first the camera's own, then on counter-clockwise as seen from above.
///
/// A character that faces the camera looks south, as on a map whose bottom is near the viewer. The camera walks to the
/// character's left, so the character seems to turn to its right: `s, sw, w, nw, n, ne, e, se`. Names are right for a camera that starts in
/// front of the character (yaw 0). Two, four, eight and sixteen sides have names of the compass, any other number `00`, `01` …
///
/// ```
/// let names: Vec<String> = sinew::sheet::directions(4).into_iter().map(|d| d.name).collect();
/// assert_eq!(names, ["s", "w", "n", "e"]);
/// ```
pub fn directions(count: usize) -> Vec<Direction> {
    let turn = |k: usize| (k as f64 / count as f64 * TAU) as f32;
    (0..count).map(|k| Direction { name: name(k, count), turn: turn(k) }).collect()
}

const COMPASS: [&str; 16] =
    ["s", "ssw", "sw", "wsw", "w", "wnw", "nw", "nnw", "n", "nne", "ne", "ene", "e", "ese", "se", "sse"];

fn name(k: usize, count: usize) -> String {
    match count {
        1 => String::new(),
        2 | 4 | 8 | 16 => COMPASS[k * 16 / count].into(),
        _ => format!("{k:02}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_directions_have_the_names_of_the_compass() {
        let names = |n| directions(n).into_iter().map(|d| d.name).collect::<Vec<_>>();
        assert_eq!(names(8), ["s", "sw", "w", "nw", "n", "ne", "e", "se"]);
        assert_eq!(names(2), ["s", "n"]);
        assert_eq!(names(1), [""]);
        assert_eq!(names(3), ["00", "01", "02"]);
        assert_eq!(directions(8)[2].turn, std::f32::consts::FRAC_PI_2);
    }
}
