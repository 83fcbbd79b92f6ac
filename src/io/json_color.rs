//! Colours as people write them: `"#rrggbb"`, `"#rrggbbaa"` in sRGB, or arrays of linear numbers.

use crate::image::color::LINEAR_OF_SRGB8;
use glam::Vec4;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Linear RGBA, straight alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Color(pub Vec4);

impl Color {
    /// From three sRGB codes.
    pub fn srgb8(r: u8, g: u8, b: u8) -> Self {
        let [r, g, b] = [r, g, b].map(|c| LINEAR_OF_SRGB8[c as usize]);
        Self(Vec4::new(r, g, b, 1.0))
    }

    fn from_hex(text: &str) -> Option<Self> {
        let digits = text.strip_prefix('#').filter(|d| d.bytes().all(|b| b.is_ascii_hexdigit()))?;
        let code = |i: usize| u8::from_str_radix(digits.get(2 * i..2 * i + 2)?, 16).ok();
        let alpha = match digits.len() {
            6 => 1.0,
            8 => code(3)? as f32 / 255.0,
            _ => return None,
        };
        let mut color = Self::srgb8(code(0)?, code(1)?, code(2)?);
        color.0.w = alpha;
        Some(color)
    }

    /// The hexadecimal form, if it says exactly this colour.
    fn to_hex(self) -> Option<String> {
        let code = |c: f32| LINEAR_OF_SRGB8.iter().position(|l| *l == c);
        let [r, g, b] = [code(self.0.x)?, code(self.0.y)?, code(self.0.z)?];
        if self.0.w == 1.0 {
            return Some(format!("#{r:02x}{g:02x}{b:02x}"));
        }
        let a = (0..256).find(|a| *a as f32 / 255.0 == self.0.w)?;
        Some(format!("#{r:02x}{g:02x}{b:02x}{a:02x}"))
    }
}

impl Serialize for Color {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self.to_hex() {
            Some(hex) => to.serialize_str(&hex),
            None if self.0.w == 1.0 => self.0.truncate().to_array().serialize(to),
            None => self.0.to_array().serialize(to),
        }
    }
}

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(Read)
    }
}

struct Read;

impl<'de> Visitor<'de> for Read {
    type Value = Color;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("a colour: \"#rrggbb\", \"#rrggbbaa\", or 3 or 4 linear numbers")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Color, E> {
        Color::from_hex(text).ok_or_else(|| E::invalid_value(serde::de::Unexpected::Str(text), &self))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Color, A::Error> {
        let mut c = [0.0, 0.0, 0.0, 1.0];
        let mut n = 0;
        while let Some(x) = seq.next_element::<f32>()? {
            *c.get_mut(n).ok_or_else(|| A::Error::invalid_length(n + 1, &self))? = x;
            n += 1;
        }
        if n < 3 { Err(A::Error::invalid_length(n, &self)) } else { Ok(Color(Vec4::from_array(c))) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_come_back_as_they_were() {
        for text in ["\"#ff8000\"", "\"#01020380\"", "[0.1,0.2,0.3]", "[0.1,0.2,0.3,0.5]"] {
            let color: Color = serde_json::from_str(text).unwrap();
            assert_eq!(serde_json::to_string(&color).unwrap(), text);
        }
    }

    #[test]
    fn what_is_no_colour_is_shown() {
        let message = |t: &str| serde_json::from_str::<Color>(t).unwrap_err().to_string();
        assert!(message("\"red\"").contains("\"red\", expected a colour"), "{}", message("\"red\""));
        assert!(message("\"#12345é\"").contains("expected a colour"));
        assert!(message("[1,2]").contains("invalid length 2"));
    }
}
