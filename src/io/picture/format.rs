//! The formats that can be written, and what each of them can hold.

/// The formats that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// One picture a file, 8-bit sRGB without loss.
    Png,
    /// One picture or a film, 8-bit sRGB without loss; mostly smaller than PNG.
    Webp,
    /// One picture a file, linear light in 32-bit floats, for compositing.
    Exr,
    /// A film of at most 255 colours.
    Gif,
    /// A film without loss.
    Apng,
    /// A film without compression, for programs that read a pipe.
    Y4m,
}

/// No such format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{text}\": expected png, webp, exr, gif, apng or y4m")]
pub struct FormatError {
    /// What was found.
    pub text: String,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 6] = [Self::Png, Self::Webp, Self::Exr, Self::Gif, Self::Apng, Self::Y4m];

    /// What messages call it: `PNG`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Png => "PNG",
            Self::Webp => "WebP",
            Self::Exr => "OpenEXR",
            Self::Gif => "GIF",
            Self::Apng => "APNG",
            Self::Y4m => "Y4M",
        }
    }

    /// Its own ending without the point, which is also its name on a command line: `png`.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Webp => "webp",
            Self::Exr => "exr",
            Self::Gif => "gif",
            Self::Apng => "apng",
            Self::Y4m => "y4m",
        }
    }

    /// Every ending that a file of this format may have, for messages.
    pub(super) fn endings(self) -> &'static str {
        match self {
            Self::Png => ".png",
            Self::Webp => ".webp",
            Self::Exr => ".exr",
            Self::Gif => ".gif",
            Self::Apng => ".apng or .png",
            Self::Y4m => ".y4m",
        }
    }

    /// Whether a file may hold one picture and nothing else, so that numbered files make sense.
    pub fn is_still(self) -> bool {
        matches!(self, Self::Png | Self::Webp | Self::Exr)
    }

    /// Whether one file may hold several frames.
    pub fn is_film(self) -> bool {
        !matches!(self, Self::Png | Self::Exr)
    }
}

impl std::str::FromStr for Format {
    type Err = FormatError;

    fn from_str(text: &str) -> Result<Self, FormatError> {
        let ending = text.to_ascii_lowercase();
        let found = Self::ALL.into_iter().find(|f| f.ending() == ending);
        found.ok_or_else(|| FormatError { text: text.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_holds_something_and_is_found_by_its_ending() {
        for f in Format::ALL {
            assert!(f.is_still() || f.is_film(), "{f:?}");
            assert_eq!(f.ending().parse(), Ok(f));
            assert!(f.endings().contains(f.ending()));
        }
        let message = "jpg".parse::<Format>().unwrap_err().to_string();
        assert!(Format::ALL.iter().all(|f| message.contains(f.ending())), "{message}");
    }
}
