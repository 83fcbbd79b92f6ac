//! Palettes that artists share: lists of hexadecimal colours, GIMP palettes, and pictures of swatches.

use super::palette::Palette;

/// A file that is no palette.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PaletteError {
    /// A line that is no colour.
    #[error("line {line} is \"{found}\": expected {expected}")]
    Line {
        /// From 1.
        line: usize,
        /// The line.
        found: String,
        /// What a line should be.
        expected: &'static str,
    },
    /// None, or more than indices can say.
    #[error("{found} colours: expected 1 to 255 different ones")]
    Count {
        /// Different colours; 256 stands for more.
        found: usize,
    },
    /// Not a PNG file.
    #[error("the picture cannot be read: {message}")]
    Picture {
        /// What the decoder says.
        message: String,
    },
}

/// Different colours in the order in which they came.
#[derive(Default)]
struct Swatches(Vec<[u8; 3]>);

impl Swatches {
    fn add(&mut self, color: [u8; 3]) {
        if self.0.len() < 256 && !self.0.contains(&color) {
            self.0.push(color);
        }
    }

    fn palette(self) -> Result<Palette, PaletteError> {
        match self.0.len() {
            1..=255 => Ok(Palette::new(self.0)),
            found => Err(PaletteError::Count { found }),
        }
    }
}

impl Palette {
    /// The colours of a file: a PNG picture, a GIMP palette (`GIMP Palette` in its first line), or a list with `rrggbb` or `#rrggbb` in
    /// each line, where `;` and `//` begin comments. Repetitions count once; transparent pixels of a picture do not count.
    ///
    /// ```
    /// use sinew::io::picture::Palette;
    /// let p = Palette::from_file_bytes(b"1a1c2c\n#F4F4F4\n1a1c2c\n").unwrap();
    /// assert_eq!(p.colors(), [[0x1a, 0x1c, 0x2c], [0xf4; 3]]);
    /// ```
    ///
    /// # Errors
    /// [`PaletteError`]: what is no colour, and where.
    pub fn from_file_bytes(bytes: &[u8]) -> Result<Self, PaletteError> {
        if bytes.starts_with(b"\x89PNG") {
            return picture(bytes);
        }
        let text = String::from_utf8_lossy(bytes);
        let text = text.trim_start_matches('\u{feff}');
        let mut swatches = Swatches::default();
        let gimp = text.starts_with("GIMP Palette");
        for (i, line) in text.lines().enumerate().skip(usize::from(gimp)) {
            let color = if gimp { gimp_line(line) } else { hex_line(line) };
            match color {
                Ok(color) => color.into_iter().for_each(|c| swatches.add(c)),
                Err(expected) => {
                    let found = line.chars().take(40).collect();
                    return Err(PaletteError::Line { line: i + 1, found, expected });
                }
            }
        }
        swatches.palette()
    }
}

/// A colour, or nothing in a line that says nothing.
fn hex_line(line: &str) -> Result<Option<[u8; 3]>, &'static str> {
    let code = line.split(';').next().unwrap_or("");
    let code = code.split("//").next().unwrap_or("").trim();
    if code.is_empty() {
        return Ok(None);
    }
    let code = code.strip_prefix('#').unwrap_or(code);
    let digits = code.len() == 6 && code.bytes().all(|b| b.is_ascii_hexdigit());
    let code = u32::from_str_radix(code, 16).ok().filter(|_| digits).ok_or("a colour such as 1a1c2c")?;
    let [_, r, g, b] = code.to_be_bytes();
    Ok(Some([r, g, b]))
}

fn gimp_line(line: &str) -> Result<Option<[u8; 3]>, &'static str> {
    let line = line.trim();
    let header = ["Name:", "Columns:", "Channels:", "#"].iter().any(|h| line.starts_with(h));
    if line.is_empty() || header {
        return Ok(None);
    }
    let mut numbers = line.split_whitespace().map(|n| n.parse::<u8>().ok());
    let mut next = || numbers.next().flatten().ok_or("red, green and blue from 0 to 255");
    Ok(Some([next()?, next()?, next()?]))
}

fn picture(bytes: &[u8]) -> Result<Palette, PaletteError> {
    let fault = |e: ::png::DecodingError| PaletteError::Picture { message: e.to_string() };
    let mut decoder = ::png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(::png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(fault)?;
    let mut swatches = Swatches::default();
    while let Some(row) = {
        let channels = reader.output_color_type().0.samples();
        reader.next_row().map_err(fault)?.map(|r| (channels, r.data().to_vec()))
    } {
        let (channels, data) = row;
        for p in data.chunks_exact(channels) {
            match *p {
                [_, 0] | [_, _, _, 0] => {}
                [v] | [v, _] => swatches.add([v; 3]),
                [r, g, b] | [r, g, b, _] => swatches.add([r, g, b]),
                _ => {}
            }
        }
    }
    swatches.palette()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_kinds_of_files_say_the_same() {
        let want = [[26, 28, 44], [244, 244, 244]];
        let gpl = "GIMP Palette\nName: two\nColumns: 2\n# a comment\n 26  28  44\tnight\n244 244 244 snow\n";
        assert_eq!(Palette::from_file_bytes(gpl.as_bytes()).unwrap().colors(), want);
        assert_eq!(Palette::from_file_bytes(b"; two\n1a1c2c // night\n\n#f4f4f4\n").unwrap().colors(), want);
        let pixels = [[26, 28, 44, 255], [9, 9, 9, 0], [244, 244, 244, 255], [26, 28, 44, 255]];
        let data = super::super::indexed::Data::Rgba8(&pixels);
        let png = super::super::encode_data_png([4, 1], data, Default::default(), "").unwrap();
        assert_eq!(Palette::from_file_bytes(&png).unwrap().colors(), want);
        assert!(Palette::from_file_bytes(&png[..40]).is_err());
    }

    #[test]
    fn faults_name_the_line() {
        let fault = |text: &str| Palette::from_file_bytes(text.as_bytes()).unwrap_err().to_string();
        assert!(fault("1a1c2c\nred\n").starts_with("line 2 is \"red\""));
        assert!(fault("+a1c2c").contains("line 1"));
        assert!(fault("GIMP Palette\n1 2\n").contains("line 2"));
        assert!(fault("").starts_with("0 colours"));
        let many: String = (0..300).map(|i| format!("{i:06x}\n")).collect();
        assert!(fault(&many).starts_with("256 colours"));
    }
}
