//! What a file name asks for: a picture, a numbered sequence, or a film.

use super::format::Format;
use std::path::{Path, PathBuf};

/// A numbered name: `out.####.png` or `out.%04d.png`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Pattern {
    /// The folder, may be empty.
    folder: PathBuf,
    /// What stands before and after the number.
    around: [String; 2],
    /// Digits at least, padded with zeros.
    width: usize,
}

/// Where pictures go.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// One picture; a WebP is a film where several frames are written.
    Still(PathBuf, Format),
    /// A picture a frame.
    Sequence(Pattern, Format),
    /// All frames in one file.
    Film(PathBuf, Format),
    /// Standard output: `-`.
    Stdout(Format),
}

/// Why a name cannot be written to.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TargetError {
    /// No format belongs to the ending.
    #[error("\"{name}\": expected a name that ends in .png, .webp, .exr, .gif, .apng or .y4m, found {found}")]
    Ending {
        /// The name.
        name: String,
        /// `".jpg"`, or `no ending`.
        found: String,
    },
    /// The ending and the format that was asked for differ.
    #[error("\"{name}\": {format} was asked for, expected a name that ends in {expected}")]
    Mismatch {
        /// The name.
        name: String,
        /// What was asked for.
        format: &'static str,
        /// The endings that fit.
        expected: &'static str,
    },
    /// A `%` that is neither `%d`, `%04d` nor `%%`.
    #[error("\"{name}\": \"{found}\" is no frame number; expected #### or %04d, and %% for a per cent sign")]
    Conversion {
        /// The name.
        name: String,
        /// From the `%` on.
        found: String,
    },
    /// More digits than a frame number can have.
    #[error("\"{name}\": a frame number of {found} digits; expected at most {limit}")]
    Digits {
        /// The name.
        name: String,
        /// Digits that were asked for.
        found: usize,
        /// The limit.
        limit: usize,
    },
    /// Two places for one number.
    #[error("\"{name}\": two places for the frame number; expected one")]
    Twice {
        /// The name.
        name: String,
    },
    /// A number in the name of a film, which is one file.
    #[error("\"{name}\": all frames of a film go into one file; expected a name without # and %d")]
    NumberedFilm {
        /// The name.
        name: String,
    },
    /// Several frames and one name.
    #[error(
        "\"{name}\" names one picture and {frames} frames are to be written; put the frame number into it: \
         \"{hint}\", or end it in .webp, .gif, .apng or .y4m for a film"
    )]
    OneName {
        /// The name.
        name: String,
        /// Frames to be written.
        frames: usize,
        /// The same name with a number.
        hint: String,
    },
    /// Several frames on standard output, in a format whose files hold one.
    #[error(
        "{frames} frames are to be written to standard output and {format} holds one picture; \
         expected the format y4m, webp, gif, apng or png (one after the other)"
    )]
    OneOutput {
        /// What was asked for.
        format: &'static str,
        /// Frames to be written.
        frames: usize,
    },
    /// Standard output without a format.
    #[error("\"-\": standard output has no ending; name its format: png, webp, exr, gif, apng or y4m")]
    Stdout,
    /// A name that is no text, or no name at all.
    #[error("\"{name}\": expected a file name, in UTF-8")]
    NoName {
        /// The name, as far as it can be shown.
        name: String,
    },
}

/// Digits of the longest frame number, its sign left out.
const MAX_DIGITS: usize = 19;

impl Pattern {
    /// The file of a frame: the number as decimal digits, padded with zeros to the pattern's width.
    ///
    /// Numbers that need more digits get them; a minus sign counts as one (`-007`).
    pub fn path_of(&self, frame: i64) -> PathBuf {
        let [before, after] = &self.around;
        self.folder.join(format!("{before}{frame:0width$}{after}", width = self.width))
    }

    /// The folder that holds the sequence; empty for the current one.
    pub fn folder(&self) -> &Path {
        &self.folder
    }
}

impl Target {
    /// What a name asks for, by its ending.
    ///
    /// In the last component of the path, one run of `#` or one `%d`, `%04d` stands for the frame number, and `%%` for
    /// a per cent sign; folders are taken as they are.
    ///
    /// ```
    /// use sinew::io::picture::{Format, Target};
    /// let t = Target::parse("a/50%%.%03d.png").unwrap();
    /// assert_eq!(t.path_of(12), Some("a/50%.012.png".into()));
    /// assert_eq!(Target::parse("a.gif"), Ok(Target::Film("a.gif".into(), Format::Gif)));
    /// let message = Target::parse("a.jpg").unwrap_err().to_string();
    /// assert_eq!(message, "\"a.jpg\": expected a name that ends in .png, .webp, .exr, .gif, .apng or .y4m, found \".jpg\"");
    /// ```
    ///
    /// # Errors
    /// [`TargetError`], with what was expected.
    pub fn parse(path: impl AsRef<Path>) -> Result<Self, TargetError> {
        let path = path.as_ref();
        if is_stdout(path) {
            return Err(TargetError::Stdout);
        }
        let format = format_of(path)?;
        Self::build(path, format)
    }

    /// What a name asks for, the format being given; APNG may end in `.png`, and `-` is standard output.
    ///
    /// # Errors
    /// [`TargetError`], also where the ending belongs to another format.
    pub fn parse_as(path: impl AsRef<Path>, format: Format) -> Result<Self, TargetError> {
        let path = path.as_ref();
        if is_stdout(path) {
            return Ok(Self::Stdout(format));
        }
        let found = format_of(path)?;
        if found != format && (found, format) != (Format::Png, Format::Apng) {
            let name = path.display().to_string();
            return Err(TargetError::Mismatch { name, format: format.name(), expected: format.endings() });
        }
        Self::build(path, format)
    }

    fn build(path: &Path, format: Format) -> Result<Self, TargetError> {
        let name = file_name(path)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let (around, width) = split(name).map_err(|e| e.error(path))?;
        match width {
            None if format.is_still() => Ok(Self::Still(folder.join(around.concat()), format)),
            None => Ok(Self::Film(folder.join(around.concat()), format)),
            Some(width) if format.is_still() => Ok(Self::Sequence(Pattern { folder, around, width }, format)),
            Some(_) => Err(TargetError::NumberedFilm { name: path.display().to_string() }),
        }
    }

    /// What is written.
    pub fn format(&self) -> Format {
        match self {
            Self::Still(_, f) | Self::Sequence(_, f) | Self::Film(_, f) | Self::Stdout(f) => *f,
        }
    }

    /// The name, with `#` where the frame number goes; `-` for standard output.
    pub fn name(&self) -> PathBuf {
        match self {
            Self::Still(path, _) | Self::Film(path, _) => path.clone(),
            Self::Sequence(Pattern { folder, around: [before, after], width }, _) => {
                folder.join(format!("{before}{}{after}", "#".repeat(*width)))
            }
            Self::Stdout(_) => "-".into(),
        }
    }

    /// The file that a frame goes into; none for standard output.
    pub fn path_of(&self, frame: i64) -> Option<PathBuf> {
        match self {
            Self::Still(path, _) | Self::Film(path, _) => Some(path.clone()),
            Self::Sequence(pattern, _) => Some(pattern.path_of(frame)),
            Self::Stdout(_) => None,
        }
    }

    /// Whether a whole clip goes there unless fewer frames are asked for: into films, sequences and WebP, but not into
    /// one PNG or EXR.
    pub fn takes_a_clip(&self) -> bool {
        matches!(self, Self::Sequence(..)) || self.format().is_film()
    }

    /// Whether that many frames become one film: several in a WebP, any number in GIF, APNG and Y4M.
    pub fn is_film(&self, frames: usize) -> bool {
        match self {
            Self::Sequence(..) => false,
            Self::Still(_, f) | Self::Film(_, f) | Self::Stdout(f) => {
                f.is_film() && (!f.is_still() || frames > 1)
            }
        }
    }

    /// Refuse several frames for what holds one picture.
    ///
    /// # Errors
    /// [`TargetError::OneName`], with the name that would do; [`TargetError::OneOutput`].
    pub fn check_frames(&self, frames: usize) -> Result<(), TargetError> {
        match self {
            Self::Still(path, format) if frames > 1 && !format.is_film() => {
                let hint = path.with_extension(format!("####.{}", format.ending())).display().to_string();
                Err(TargetError::OneName { name: path.display().to_string(), frames, hint })
            }
            // PNGs one after the other are what `ffmpeg -f image2pipe` reads.
            Self::Stdout(format) if frames > 1 && !format.is_film() && *format != Format::Png => {
                Err(TargetError::OneOutput { format: format.name(), frames })
            }
            _ => Ok(()),
        }
    }
}

/// Whether a name stands for standard output.
fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// The last component of a path.
fn file_name(path: &Path) -> Result<&str, TargetError> {
    // A path that ends in a slash names a folder, which `Path` would not say.
    let slash =
        path.as_os_str().as_encoded_bytes().last().is_some_and(|b| std::path::is_separator(*b as char));
    let name = path.file_name().and_then(|n| n.to_str()).filter(|_| !slash);
    name.ok_or_else(|| TargetError::NoName { name: path.display().to_string() })
}

/// The format that an ending stands for, in any case.
fn format_of(path: &Path) -> Result<Format, TargetError> {
    file_name(path)?;
    let ending = path.extension().map(|e| e.to_string_lossy().into_owned());
    let format = ending.as_deref().and_then(|e| e.parse().ok());
    format.ok_or_else(|| {
        let found = ending.map_or("no ending".to_owned(), |e| format!("\".{e}\""));
        TargetError::Ending { name: path.display().to_string(), found }
    })
}

/// What is wrong with a pattern, before the name is known.
enum Fault {
    Conversion(String),
    Digits(usize),
    Twice,
}

impl Fault {
    fn error(self, path: &Path) -> TargetError {
        let name = path.display().to_string();
        match self {
            Self::Conversion(found) => TargetError::Conversion { name, found },
            Self::Digits(found) => TargetError::Digits { name, found, limit: MAX_DIGITS },
            Self::Twice => TargetError::Twice { name },
        }
    }
}

/// What stands before and after the number, and the number's width if there is one.
fn split(name: &str) -> Result<([String; 2], Option<usize>), Fault> {
    let (mut around, mut width) = ([String::new(), String::new()], None);
    let mut rest = name;
    while let Some(c) = rest.chars().next() {
        let (number, length) = match c {
            '#' => {
                let n = rest.len() - rest.trim_start_matches('#').len();
                (Some(n), n)
            }
            '%' => conversion(rest)?,
            _ => (None, c.len_utf8()),
        };
        match number {
            None => around[usize::from(width.is_some())].push(c),
            Some(_) if width.is_some() => return Err(Fault::Twice),
            Some(n) if n > MAX_DIGITS => return Err(Fault::Digits(n)),
            number => width = number,
        }
        rest = &rest[length..];
    }
    Ok((around, width))
}

/// The width (if it is a number) and the length of `%d`, `%04d` or `%%` at the start of `text`.
fn conversion(text: &str) -> Result<(Option<usize>, usize), Fault> {
    let after = &text[1..];
    if after.starts_with('%') {
        return Ok((None, 2));
    }
    let digits = after.len() - after.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let (width, tail) = after.split_at(digits);
    // `%4d` pads with spaces in C; a name with spaces is nobody's wish.
    if !tail.starts_with('d') || (digits > 0 && !width.starts_with('0')) {
        return Err(Fault::Conversion(text.to_owned()));
    }
    let width = if width.is_empty() { Ok(1) } else { width.parse::<usize>() };
    Ok((Some(width.unwrap_or(usize::MAX).max(1)), digits + 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(pattern: &str, frame: i64) -> String {
        Target::parse(pattern).unwrap().path_of(frame).unwrap().to_str().unwrap().to_owned()
    }

    #[test]
    fn numbers_go_where_the_pattern_says() {
        assert_eq!(name("o/out.####.png", 12), "o/out.0012.png");
        assert_eq!(name("out.%04d.png", 12), "out.0012.png");
        assert_eq!(name("#.PNG", 12345), "12345.PNG");
        assert_eq!(name("out%d.png", -7), "out-7.png");
        assert_eq!(name("out####.png", -7), "out-007.png");
        assert_eq!(name("100%%_%02d.png", 3), "100%_03.png");
        assert_eq!(name("50%d/a#b.png", 3), "50%d/a3b.png");
        assert_eq!(Target::parse("a.png"), Ok(Target::Still("a.png".into(), Format::Png)));
        assert_eq!(Target::parse("a.WebP"), Ok(Target::Still("a.WebP".into(), Format::Webp)));
        assert_eq!(name("o/out.####.webp", 12), "o/out.0012.webp");
        assert_eq!(name("o/out.%02d.exr", 1), "o/out.01.exr");
        assert_eq!(Target::parse("a.y4m"), Ok(Target::Film("a.y4m".into(), Format::Y4m)));
        assert_eq!(Target::parse_as("-", Format::Y4m), Ok(Target::Stdout(Format::Y4m)));
        assert_eq!(Target::parse("100%%.gif"), Ok(Target::Film("100%.gif".into(), Format::Gif)));
        assert_eq!(Target::parse_as("a.png", Format::Apng), Ok(Target::Film("a.png".into(), Format::Apng)));
    }

    #[test]
    fn faults_say_what_was_expected() {
        let says = |text: &str, part: &str| {
            let message = Target::parse(text).unwrap_err().to_string();
            assert!(message.contains(part), "{text}: {message}");
        };
        says("a.jpg", "found \".jpg\"");
        says("a", "no ending");
        says("", "file name");
        says("a.png/", "file name");
        says("..", "file name");
        says("a#b#.png", "two places");
        says("a%d#.png", "two places");
        says("a%4d.png", "%04d");
        says("a%s.png", "\"%s.png\" is no frame number");
        says("a%.png", "%%");
        says("a%0999999999999999999999d.png", "at most 19");
        says(&format!("{}.png", "#".repeat(20)), "20 digits");
        says("-", "name its format");
        says("a.###.y4m", "one file");
        says("a.###.gif", "one file");
        says("a.%d.apng", "one file");
        assert!(Target::parse_as("a.gif", Format::Apng).unwrap_err().to_string().contains(".apng or .png"));
    }

    #[test]
    fn many_frames_need_a_number_or_a_film() {
        let still = Target::parse("d/a.png").unwrap();
        assert_eq!(still.check_frames(1), Ok(()));
        assert!(still.check_frames(48).unwrap_err().to_string().contains("d/a.####.png"));
        let message = Target::parse("a.exr").unwrap().check_frames(2).unwrap_err().to_string();
        assert!(message.contains("a.####.exr"), "{message}");
        for (text, film) in [("a.#.png", false), ("a.#.webp", false), ("a.gif", true), ("a.webp", true)] {
            let target = Target::parse(text).unwrap();
            assert_eq!(target.check_frames(48), Ok(()));
            assert_eq!((target.takes_a_clip(), target.is_film(48)), (true, film), "{text}");
        }
        assert!(!Target::parse("a.webp").unwrap().is_film(1) && Target::parse("a.gif").unwrap().is_film(1));
        assert!(!still.takes_a_clip() && !still.is_film(1));
    }

    #[test]
    fn standard_output_takes_films_and_png() {
        for format in Format::ALL {
            let target = Target::parse_as("-", format).unwrap();
            assert_eq!((target.path_of(1), target.check_frames(1)), (None, Ok(())));
            let many = target.check_frames(3);
            assert_eq!(many.is_err(), format == Format::Exr, "{format:?}");
            assert_eq!(target.takes_a_clip(), format.is_film());
        }
    }
}
