//! The frames of a GIF as they are seen.

use super::read::{Frame, Pixels};
use crate::image::Rgba8;
use gif::{ColorOutput, DecodeOptions, Decoder, DisposalMethod, MemoryLimit};
use std::num::NonZeroU64;

/// Lays the rectangles of a GIF over each other.
pub(super) struct GifFrames<'a> {
    decoder: Decoder<&'a [u8]>,
    /// What is seen.
    canvas: Rgba8,
    /// What happens to the canvas before the next frame.
    then: Then,
}

enum Then {
    Keep,
    /// Clear a rectangle: left, top, width, height.
    Clear([usize; 4]),
    Restore(Vec<u8>),
}

impl<'a> GifFrames<'a> {
    pub fn new(bytes: &'a [u8], memory: u64) -> Result<Self, String> {
        let mut options = DecodeOptions::new();
        options.set_color_output(ColorOutput::RGBA);
        if let Some(bytes) = NonZeroU64::new(memory) {
            options.set_memory_limit(MemoryLimit::Bytes(bytes));
        }
        let decoder = options.read_info(bytes).map_err(|e| e.to_string())?;
        Ok(Self { decoder, canvas: Rgba8::default(), then: Then::Keep })
    }

    pub fn size(&self) -> [usize; 2] {
        [self.decoder.width(), self.decoder.height()].map(usize::from)
    }

    fn dispose(&mut self) {
        match std::mem::replace(&mut self.then, Then::Keep) {
            Then::Keep => {}
            Then::Clear([left, top, width, height]) => {
                for row in rows(&mut self.canvas, left, top, width, height) {
                    row.fill(0);
                }
            }
            Then::Restore(before) => self.canvas.data = before,
        }
    }
}

/// The bytes of a rectangle, as far as it lies on the canvas, row by row.
fn rows(
    canvas: &mut Rgba8,
    left: usize,
    top: usize,
    width: usize,
    height: usize,
) -> impl Iterator<Item = &mut [u8]> {
    let (from, to) = (left.min(canvas.width), (left + width).min(canvas.width));
    let rows = canvas.data.chunks_mut((4 * canvas.width).max(1)).skip(top).take(height);
    rows.map(move |row| &mut row[4 * from..4 * to])
}

impl Iterator for GifFrames<'_> {
    type Item = Result<Frame, String>;

    fn next(&mut self) -> Option<Self::Item> {
        // The canvas is made when its size has been checked.
        if self.canvas.data.is_empty() {
            let [width, height] = self.size();
            self.canvas = Rgba8 { width, height, data: vec![0; 4 * width * height] };
        }
        self.dispose();
        let frame = match self.decoder.read_next_frame() {
            Ok(frame) => frame?,
            Err(e) => return Some(Err(e.to_string())),
        };
        let [left, top, width, height] = [frame.left, frame.top, frame.width, frame.height].map(usize::from);
        self.then = match frame.dispose {
            DisposalMethod::Background => Then::Clear([left, top, width, height]),
            DisposalMethod::Previous => Then::Restore(self.canvas.data.clone()),
            DisposalMethod::Any | DisposalMethod::Keep => Then::Keep,
        };

        // Transparent pixels leave what was there.
        let from = frame.buffer.chunks((4 * width).max(1));
        for (to, from) in rows(&mut self.canvas, left, top, width, height).zip(from) {
            let pixels = to.as_chunks_mut::<4>().0.iter_mut().zip(from.as_chunks::<4>().0);
            pixels.filter(|(_, p)| p[3] > 0).for_each(|(to, p)| *to = *p);
        }
        let delay_ms = (10 * u32::from(frame.delay), 1);
        Some(Ok(Frame { pixels: Pixels::Codes(self.canvas.clone()), delay_ms }))
    }
}
