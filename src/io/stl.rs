//! Stereolithography files (STL), binary and text: triangles that share nothing. Normals are left out: corners tell them.
//!
//! Which of the two it is says the length, since binary files may begin with `solid` too.

use glam::Vec3;

/// Corners of triangles, counter-clockwise from the front.
pub type Triangles = Vec<[Vec3; 3]>;

/// Why bytes are no such file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StlError {
    /// Neither text nor as many bytes as the head says.
    #[error(
        "binary STL: bytes 80 to 83 announce {count} triangles, so {expected} bytes were expected, found {found}; the file is cut off, or no STL"
    )]
    Length {
        /// Triangles that are announced.
        count: u32,
        /// Bytes of such a file.
        expected: u64,
        /// Bytes that are there.
        found: usize,
    },
    /// Too short for either.
    #[error("expected STL, which begins with `solid` or has 84 bytes at least, found {found} bytes")]
    Short {
        /// Bytes that are there.
        found: usize,
    },
    /// A word that does not belong there.
    #[error("STL text, line {line}: expected {expected}, found `{found}`")]
    Word {
        /// Counted from 1.
        line: usize,
        /// What would have been right.
        expected: &'static str,
        /// What is there; empty at the end.
        found: String,
    },
    /// NaN or infinity.
    #[error("STL triangle {triangle}: corners must be finite numbers")]
    NotFinite {
        /// Counted from 0.
        triangle: usize,
    },
}

/// Read an STL file.
///
/// ```
/// use sinew::io::stl;
/// let text = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a";
/// assert_eq!(stl::parse(text).unwrap()[0][1], glam::Vec3::X);
/// let message = stl::parse(&text[..60]).unwrap_err().to_string();
/// assert_eq!(message, "STL text, line 5: expected a number, found ``");
/// ```
///
/// # Errors
/// [`StlError`], with the line or the triangle.
pub fn parse(bytes: &[u8]) -> Result<Triangles, StlError> {
    let count = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let length = |count: u32| 84 + 50 * u64::from(count);
    let is_text = bytes.trim_ascii_start().get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    let found = bytes.len();
    let triangles = match count {
        Some(n) if length(n) == found as u64 => binary(&bytes[84..]),
        _ if is_text => text(bytes)?,
        Some(count) => return Err(StlError::Length { count, expected: length(count), found }),
        None => return Err(StlError::Short { found }),
    };
    match triangles.iter().position(|t| !t.iter().all(|p| p.is_finite())) {
        Some(triangle) => Err(StlError::NotFinite { triangle }),
        None => Ok(triangles),
    }
}

/// Write a still as binary STL: what shares a point shares its bits. Formats of units have none; these are metres.
///
/// ```
/// use sinew::io::{still::{Still, Surface}, stl};
/// use glam::Vec3;
/// let surface = Surface { point: vec![0, 1, 2], triangles: vec![[0, 1, 2]], ..Surface::default() };
/// let still = Still { points: vec![Vec3::ZERO, Vec3::X, Vec3::Y], surfaces: vec![surface] };
/// assert_eq!(stl::parse(&stl::write(&still)).unwrap(), [[Vec3::ZERO, Vec3::X, Vec3::Y]]);
/// ```
pub fn write(still: &super::still::Still) -> Vec<u8> {
    let mut out = vec![0; 84];
    out[..17].copy_from_slice(b"sinew, metres    ");
    let mut count = 0_u32;
    for t in still.triangles() {
        let [a, b, c] = t.map(|p| still.points[p as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let numbers = [normal, a, b, c].into_iter().flat_map(|p| p.to_array());
        out.extend(numbers.flat_map(f32::to_le_bytes));
        out.extend([0, 0]);
        count += 1;
    }
    out[80..84].copy_from_slice(&count.to_le_bytes());
    out
}

/// A normal, three corners and two bytes each.
fn binary(data: &[u8]) -> Triangles {
    let number = |b: &[u8], k: usize| f32::from_le_bytes([b[k], b[k + 1], b[k + 2], b[k + 3]]);
    let corner = |t: &[u8], k: usize| {
        let at = 12 * (k + 1);
        Vec3::new(number(t, at), number(t, at + 4), number(t, at + 8))
    };
    data.chunks_exact(50).map(|t| [0, 1, 2].map(|k| corner(t, k))).collect()
}

fn text(bytes: &[u8]) -> Result<Triangles, StlError> {
    let text = String::from_utf8_lossy(bytes);
    // Names of solids may be anything: those lines say nothing else.
    let named = |l: &&str| {
        let first = l.split_whitespace().next().unwrap_or("");
        !["solid", "endsolid"].iter().any(|w| first.eq_ignore_ascii_case(w))
    };
    let lines = text.lines().enumerate().filter(|(_, l)| named(l));
    let mut words =
        Words { line: 1, words: &mut lines.flat_map(|(i, l)| l.split_whitespace().map(move |w| (i + 1, w))) };
    let mut triangles = Vec::new();
    while words.facet()? {
        for _ in 0..3 {
            words.number()?;
        }
        words.expect(&["outer", "loop"], "`outer loop`")?;
        let mut triangle = [Vec3::ZERO; 3];
        for corner in &mut triangle {
            words.expect(&["vertex"], "`vertex` and three numbers")?;
            *corner = Vec3::new(words.number()?, words.number()?, words.number()?);
        }
        words.expect(&["endloop", "endfacet"], "`endloop` and `endfacet` after three corners")?;
        triangles.push(triangle);
    }
    // Binary files may begin like text: their beginnings are none.
    let last = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty()).last();
    match last {
        Some((_, l)) if l.trim_start().get(..8).is_some_and(|w| w.eq_ignore_ascii_case("endsolid")) => {
            Ok(triangles)
        }
        last => {
            words.line = last.map_or(1, |(i, _)| i + 1);
            words.wrong("`endsolid` on a line of its own at the end", last.map(|(_, l)| l.trim()))
        }
    }
}

struct Words<'a, 'i> {
    line: usize,
    words: &'i mut dyn Iterator<Item = (usize, &'a str)>,
}

impl<'a> Words<'a, '_> {
    fn next(&mut self) -> Option<&'a str> {
        let (line, word) = self.words.next()?;
        self.line = line;
        Some(word)
    }

    fn wrong<T>(&self, expected: &'static str, found: Option<&str>) -> Result<T, StlError> {
        let found = found.unwrap_or_default().chars().take(40).collect();
        Err(StlError::Word { line: self.line, expected, found })
    }

    fn expect(&mut self, words: &[&str], expected: &'static str) -> Result<(), StlError> {
        for word in words {
            match self.next() {
                Some(w) if w.eq_ignore_ascii_case(word) => {}
                other => return self.wrong(expected, other),
            }
        }
        Ok(())
    }

    fn number(&mut self) -> Result<f32, StlError> {
        let word = self.next();
        match word.and_then(|w| w.parse().ok()) {
            Some(v) => Ok(v),
            None => self.wrong("a number", word),
        }
    }

    /// Whether there is another triangle.
    fn facet(&mut self) -> Result<bool, StlError> {
        match self.next() {
            None => Ok(false),
            Some(w) if w.eq_ignore_ascii_case("facet") => {
                self.expect(&["normal"], "`facet normal`").map(|()| true)
            }
            other => self.wrong("`facet normal` or `endsolid`", other),
        }
    }
}
