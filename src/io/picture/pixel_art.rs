//! Frames as if they were drawn pixel by pixel: few colours, no partial coverage, an outline, large pixels.

use super::dither::{Dither, Indexed, Mapper};
use super::film::Film;
use super::nearest::distance;
use super::palette::Palette;
use crate::image::Rgba8;

/// How frames become pixel art.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PixelArt {
    palette: Palette,
    dither: Dither,
    /// Index of the line around the character.
    outline: Option<u8>,
    /// What stands behind the character; the transparent index if nothing does.
    behind: u8,
    /// Its colour, under what is partly transparent.
    matte: Option<[u8; 3]>,
    scale: usize,
}

/// What is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelArtDesc {
    /// Colours in all, those of the outline and the background included: 1 to 255.
    pub colors: usize,
    /// How colours between those of the palette are shown; ordered patterns stand still where the picture does.
    pub dither: Dither,
    /// sRGB colour of a line one pixel wide around the character.
    pub outline: Option<[u8; 3]>,
    /// sRGB colour behind the character; nothing for `None`.
    pub background: Option<[u8; 3]>,
    /// Pixels of the finished frame, across and down, for each one that is drawn.
    pub scale: usize,
}

impl Default for PixelArtDesc {
    fn default() -> Self {
        Self { colors: 32, dither: Dither::Ordered, outline: None, background: None, scale: 1 }
    }
}

impl PixelArt {
    /// Choose the colours that suit some frames best, or take those of `palette`; outline and background then take the nearest of them.
    ///
    /// Frames are drawn without a background, one sample a pixel. They may be a sample of the clip.
    pub fn new(desc: PixelArtDesc, frames: &[Rgba8], palette: Option<Palette>) -> Self {
        let own = [desc.outline, desc.background];
        let palette = palette.unwrap_or_else(|| {
            let kept: Vec<[u8; 3]> = own.iter().flatten().copied().collect();
            let colors = desc.colors.clamp(1, 255);
            // The colours that are given beforehand come last; what is there already needs no place.
            let room = colors.saturating_sub(kept.len()).max(1);
            let sharp: Vec<Rgba8> = frames.iter().map(|f| sharpened(f, desc.background)).collect();
            let mut found = Palette::from_frames(&sharp, room + 1, &film()).colors().to_vec();
            for color in kept {
                if !found.contains(&color) && found.len() < colors {
                    found.push(color);
                }
            }
            Palette::new(found)
        });
        let index = |color: [u8; 3]| nearest(&palette, color);
        Self {
            outline: desc.outline.map(index),
            behind: desc.background.map_or(palette.transparent(), index),
            matte: desc.background,
            dither: desc.dither,
            scale: desc.scale.max(1),
            palette,
        }
    }

    /// The colours of every frame.
    pub fn palette(&self) -> &Palette {
        &self.palette
    }

    /// Whether a line runs around the character.
    pub fn is_outlined(&self) -> bool {
        self.outline.is_some()
    }

    /// A mapper for [`finish`](Self::finish): one a thread.
    pub fn mapper(&self) -> Mapper {
        Mapper::new(&self.palette, &film())
    }

    /// A drawn frame in the palette's colours, outlined, laid over the background and enlarged.
    pub fn finish(&self, mapper: &mut Mapper, frame: &Rgba8) -> Indexed {
        let mut small = mapper.map(&sharpened(frame, self.matte), self.dither);
        let hole = self.palette.transparent();
        small.indices.iter_mut().filter(|i| **i == hole).for_each(|i| *i = self.behind);
        if let Some(line) = self.outline {
            draw_outline(&mut small, frame, line);
        }
        if self.scale == 1 { small } else { small.enlarged(self.scale) }
    }
}

/// A film that keeps its holes.
fn film() -> Film {
    Film { transparent: true, ..Film::new([0; 2], 1, Default::default()) }
}

/// All or nothing. Without a background, pixels that are covered by half or more become whole, in their own colour; before one,
/// whatever is there (glass, a shadow on the ground) is laid over it.
fn sharpened(frame: &Rgba8, background: Option<[u8; 3]>) -> Rgba8 {
    let mut frame = frame.clone();
    let over = background.map(|matte| Film { matte, ..film() });
    for p in frame.data.as_chunks_mut::<4>().0 {
        *p = match (*p, over) {
            ([.., 0], _) => [0; 4],
            (p, Some(film)) => {
                let [r, g, b] = film.over_matte(p);
                [r, g, b, 255]
            }
            ([r, g, b, a], None) => [r, g, b, if a < 128 { 0 } else { 255 }],
        };
    }
    frame
}

fn nearest(palette: &Palette, color: [u8; 3]) -> u8 {
    let wide = |c: [u8; 3]| c.map(i32::from);
    let far = |c: &[u8; 3]| distance(wide(*c), wide(color));
    let best = palette.colors().iter().enumerate().min_by_key(|(_, c)| far(c));
    best.map_or(0, |(i, _)| i as u8)
}

/// Pixels that touch the character along a side, and are not covered by half, become the line around it.
fn draw_outline(picture: &mut Indexed, frame: &Rgba8, line: u8) {
    let [w, h] = picture.size;
    let solid = |x: usize, y: usize| x < w && y < h && frame.data[4 * (y * w + x) + 3] >= 128;
    let touches = |x: usize, y: usize| {
        solid(x.wrapping_sub(1), y) || solid(x + 1, y) || solid(x, y.wrapping_sub(1)) || solid(x, y + 1)
    };
    for (at, index) in picture.indices.iter_mut().enumerate() {
        let (x, y) = (at % w, at / w);
        if !solid(x, y) && touches(x, y) {
            *index = line;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dot() -> Rgba8 {
        let mut f = Rgba8 { width: 5, height: 5, data: vec![0; 100] };
        f.data[48..52].copy_from_slice(&[200, 40, 40, 200]);
        f.data[0..4].copy_from_slice(&[200, 40, 40, 100]);
        f
    }

    #[test]
    fn a_dot_gets_a_line_around_it_and_no_partial_alpha() {
        let desc = PixelArtDesc { colors: 2, outline: Some([1, 2, 3]), ..Default::default() };
        let art = PixelArt::new(desc, &[dot()], None);
        assert_eq!(art.palette().colors(), [[200, 40, 40], [1, 2, 3]]);
        let got = art.finish(&mut art.mapper(), &dot()).indices;
        let o = art.palette().transparent();
        let mut want = vec![o; 25];
        want[12] = 0;
        for at in [7, 11, 13, 17] {
            want[at] = 1;
        }
        assert_eq!(got, want);
    }

    #[test]
    fn a_background_leaves_no_hole_and_pixels_grow() {
        let desc = PixelArtDesc { background: Some([9; 3]), scale: 3, ..Default::default() };
        let art = PixelArt::new(desc, &[dot()], None);
        let got = art.finish(&mut art.mapper(), &dot());
        assert_eq!(got.size, [15, 15]);
        // What is partly transparent is laid over the background: the corner is neither the one nor the other.
        let corner = got.to_rgba8(art.palette()).data[0];
        assert!(corner > 60 && corner < 200, "{corner}");
        assert!(!got.indices.contains(&art.palette().transparent()));
        let colors = got.to_rgba8(art.palette());
        assert_eq!(colors.data[4 * 14..][..4], [9, 9, 9, 255]);
    }
}
