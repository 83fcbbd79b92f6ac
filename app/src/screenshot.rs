//! The whole interface as a picture, without a window.

use crate::paint::Paint;
use crate::{App, set_up};
use egui::{Color32, Rect, pos2, vec2};
use sinew::image::Rgba8;

/// Frames until panes have found their places and what was loaded is drawn.
const FRAMES: usize = 6;

/// Draw the editor at a size in points.
pub fn draw(app: &mut App, [width, height]: [f32; 2]) -> Rgba8 {
    let ctx = egui::Context::default();
    set_up(&ctx);
    let (mut paint, mut picture) = (Paint::default(), Rgba8::default());
    for frame in 0..FRAMES {
        let input = egui::RawInput {
            screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), vec2(width, height))),
            time: Some(frame as f64 * 0.1),
            ..Default::default()
        };
        let mut output = ctx.run_ui(input, |ui| app.ui(ui));
        paint.apply(&mut output.textures_delta);
        if frame + 1 == FRAMES {
            picture = paint.draw(&ctx, &output, [width, height], Color32::from_gray(27));
        }
    }
    picture
}
