//! A small renderer of the interface's triangles on the processor: the same bytes on every machine.
//!
//! Follows what egui asks of its backends: vertex colours times textures, both premultiplied in gamma space, put over what is
//! there; 8 bits a channel after each triangle; pixels whose centre a triangle holds, shared edges once (top-left rule, 1/256 px).

use egui::epaint::{ImageData, Mesh, Primitive, Vertex};
use egui::{Color32, ColorImage, Rect, TextureFilter, TextureId, TexturesDelta};
use sinew::image::Rgba8;
use std::collections::BTreeMap;

/// Textures of an interface, by which its output is drawn.
#[derive(Default)]
pub struct Paint {
    textures: BTreeMap<TextureId, Texture>,
}

struct Texture {
    image: ColorImage,
    nearest: bool,
}

/// Pixels from the left, top, right, bottom; the last two are not in it.
type Window = [i64; 4];

impl Paint {
    /// Take in new and changed textures; what is freed is dropped.
    pub fn apply(&mut self, delta: &mut TexturesDelta) {
        for (id, parts) in delta.set.drain() {
            for part in parts.into_iter() {
                let ImageData::Color(image) = part.image;
                let nearest = part.options.magnification == TextureFilter::Nearest;
                match part.pos {
                    None => {
                        self.textures.insert(id, Texture { image: (*image).clone(), nearest });
                    }
                    Some(pos) => {
                        if let Some(texture) = self.textures.get_mut(&id) {
                            texture.patch(pos, &image);
                        }
                    }
                }
            }
        }
        for id in delta.free.drain() {
            self.textures.remove(&id);
        }
    }

    /// The picture of a frame of `size` points on `background`; its textures must have been applied.
    pub fn draw(
        &self,
        ctx: &egui::Context,
        output: &egui::FullOutput,
        size: [f32; 2],
        background: Color32,
    ) -> Rgba8 {
        let scale = output.pixels_per_point;
        let [width, height] = size.map(|s| (s * scale).round().max(0.0) as usize);
        let mut out = Rgba8 { width, height, data: background.to_array().repeat(width * height) };
        for part in ctx.tessellate(output.shapes.clone(), scale) {
            let Primitive::Mesh(mesh) = &part.primitive else { continue };
            let Some(texture) = self.textures.get(&mesh.texture_id) else { continue };
            let window = window(part.clip_rect, scale, &out);
            mesh_on(&mut out, mesh, texture, window, scale);
        }
        out
    }
}

impl Texture {
    fn patch(&mut self, [left, top]: [usize; 2], part: &ColorImage) {
        let [width, height] = part.size;
        for row in 0..height {
            let at = (top + row) * self.image.size[0] + left;
            if let Some(to) = self.image.pixels.get_mut(at..at + width) {
                to.copy_from_slice(&part.pixels[row * width..][..width]);
            }
        }
    }

    /// Colour at texel coordinates, 0…255.
    fn sample(&self, u: f32, v: f32) -> [f32; 4] {
        let [w, h] = self.image.size;
        let texel = |x: i64, y: i64| {
            let (x, y) = (x.clamp(0, w as i64 - 1) as usize, y.clamp(0, h as i64 - 1) as usize);
            self.image.pixels[y * w + x].to_array().map(f32::from)
        };
        if self.nearest {
            return texel(u.floor() as i64, v.floor() as i64);
        }
        let (u, v) = (u - 0.5, v - 0.5);
        let (x, y) = (u.floor(), v.floor());
        let (fx, fy) = (u - x, v - y);
        let (x, y) = (x as i64, y as i64);
        let (a, b, c, d) = (texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1));
        std::array::from_fn(|k| {
            let (top, bottom) = (a[k] + (b[k] - a[k]) * fx, c[k] + (d[k] - c[k]) * fx);
            top + (bottom - top) * fy
        })
    }
}

fn window(clip: Rect, scale: f32, out: &Rgba8) -> Window {
    let (w, h) = (out.width as i64, out.height as i64);
    let edge = |x: f32, end: i64| ((x * scale).round() as i64).clamp(0, end);
    [edge(clip.min.x, w), edge(clip.min.y, h), edge(clip.max.x, w), edge(clip.max.y, h)]
}

fn mesh_on(out: &mut Rgba8, mesh: &Mesh, texture: &Texture, window: Window, scale: f32) {
    if texture.image.pixels.is_empty() {
        return;
    }
    for corners in mesh.indices.chunks_exact(3) {
        let vertex = |k: usize| mesh.vertices.get(corners[k] as usize);
        if let (Some(a), Some(b), Some(c)) = (vertex(0), vertex(1), vertex(2)) {
            triangle(out, [a, b, c], texture, window, scale);
        }
    }
}

/// `E(x, y) = a x + b y + c ≥ 0` inside, in 1/256 px; the bias for edges that are neither top nor left is in `c`.
#[derive(Clone, Copy)]
struct Edge {
    a: i64,
    b: i64,
    c: i64,
}

impl Edge {
    fn new(p: [i64; 2], q: [i64; 2]) -> Self {
        let (a, b) = (p[1] - q[1], q[0] - p[0]);
        let top_left = a > 0 || (a == 0 && b > 0);
        Self { a, b, c: -(a * p[0] + b * p[1]) - i64::from(!top_left) }
    }

    /// First and last column whose centre is inside in the row with its centre at `y`.
    fn span(self, y: i64) -> [i64; 2] {
        let rest = self.b * y + self.c;
        // a·(256 x + 128) + rest ≥ 0
        let (step, rest) = (256 * self.a, rest + 128 * self.a);
        match step.signum() {
            1 => [-rest.div_euclid(step), i64::MAX],
            -1 => [i64::MIN, rest.div_euclid(-step)],
            _ if rest >= 0 => [i64::MIN, i64::MAX],
            _ => [0, -1],
        }
    }
}

fn triangle(out: &mut Rgba8, v: [&Vertex; 3], texture: &Texture, window: Window, scale: f32) {
    // Far away positions are drawn in so that products stay within 64 bits.
    let snap = |x: f32| ((x * scale).clamp(-1e6, 1e6) * 256.0).round() as i64;
    let mut p = v.map(|v| [snap(v.pos.x), snap(v.pos.y)]);
    let mut v = v;
    let area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
    if area == 0 || v.iter().any(|v| !(v.pos.x.is_finite() && v.pos.y.is_finite())) {
        return;
    }
    if area < 0 {
        p.swap(1, 2);
        v.swap(1, 2);
    }
    let edges = [Edge::new(p[1], p[2]), Edge::new(p[2], p[0]), Edge::new(p[0], p[1])];
    let area = area.abs() as f32;

    // One colour for all of it, where its corners agree.
    let size = texture.image.size.map(|s| s as f32);
    let uv = v.map(|v| [v.uv.x * size[0], v.uv.y * size[1]]);
    let color = v.map(|v| v.color.to_array().map(|c| f32::from(c) / 255.0));
    let flat = (uv[0] == uv[1] && uv[1] == uv[2] && color[0] == color[1] && color[1] == color[2])
        .then(|| quantised(color[0], texture.sample(uv[0][0], uv[0][1])));

    let reach = |k: usize| {
        let of = p.map(|p| p[k]);
        [
            of.into_iter().min().unwrap_or(0).div_euclid(256),
            of.into_iter().max().unwrap_or(0).div_euclid(256) + 1,
        ]
    };
    let ([x0, x1], [y0, y1]) = (reach(0), reach(1));
    for y in y0.max(window[1])..y1.min(window[3]) {
        let center = 256 * y + 128;
        let spans = edges.map(|e| e.span(center));
        let first = spans.iter().map(|s| s[0]).fold(x0.max(window[0]), i64::max);
        let last = spans.iter().map(|s| s[1]).fold(x1.min(window[2]) - 1, i64::min);
        for x in first..=last {
            let source = flat.unwrap_or_else(|| {
                let weigh = |e: Edge| (e.a * (256 * x + 128) + e.b * center + e.c) as f32 / area;
                let (wb, wc) = (weigh(edges[1]), weigh(edges[2]));
                let mix = |a: f32, b: f32, c: f32| a + (b - a) * wb + (c - a) * wc;
                let [s, t] = [0, 1].map(|k| mix(uv[0][k], uv[1][k], uv[2][k]));
                let tint = [0, 1, 2, 3].map(|k| mix(color[0][k], color[1][k], color[2][k]));
                quantised(tint, texture.sample(s, t))
            });
            let at = 4 * (y as usize * out.width + x as usize);
            over(source, &mut out.data[at..at + 4]);
        }
    }
}

/// Vertex colour (0…1) times texel (0…255), rounded.
fn quantised(tint: [f32; 4], texel: [f32; 4]) -> [u8; 4] {
    std::array::from_fn(|k| (tint[k] * texel[k] + 0.5) as u8)
}

/// Premultiplied source over destination.
fn over(source: [u8; 4], to: &mut [u8]) {
    let rest = 255 - u32::from(source[3]);
    for (to, s) in to.iter_mut().zip(source) {
        *to = (u32::from(s) + (u32::from(*to) * rest + 127) / 255).min(255) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Stroke, pos2, vec2};

    fn canvas() -> Rgba8 {
        Rgba8 { width: 16, height: 16, data: [0, 0, 0, 255].repeat(256) }
    }

    fn white() -> Texture {
        Texture { image: ColorImage::filled([1, 1], Color32::WHITE), nearest: true }
    }

    /// Half-covering triangles that share edges cover each pixel once, whatever their winding.
    #[test]
    fn shared_edges_are_covered_once() {
        let half = Color32::from_rgba_premultiplied(100, 0, 0, 128);
        let at = |x: f32, y: f32| Vertex::untextured(pos2(x, y), half);
        let corners = [at(0.0, 0.0), at(16.0, 0.0), at(16.0, 16.0), at(0.0, 16.0)];
        for center in [(8.0, 8.0), (7.5, 8.5), (3.3, 9.1), (0.5, 0.5)] {
            let mut out = canvas();
            let middle = at(center.0, center.1);
            for k in 0..4 {
                let (a, b) = (&corners[k], &corners[(k + 1) % 4]);
                let v = if k % 2 == 0 { [a, b, &middle] } else { [b, a, &middle] };
                triangle(&mut out, v, &white(), [0, 0, 16, 16], 1.0);
            }
            assert!(out.data.chunks(4).all(|p| p[0] == 100), "{center:?}");
        }
    }

    #[test]
    fn clip_rectangles_and_huge_triangles_hold() {
        let mut out = canvas();
        let at = |x: f32, y: f32| Vertex::untextured(pos2(x, y), Color32::WHITE);
        let v = [at(-1e9, -1e9), at(1e9, -1e9), at(0.0, 1e9)];
        triangle(&mut out, [&v[0], &v[1], &v[2]], &white(), [2, 3, 5, 4], 1.0);
        let lit: Vec<usize> = (0..256).filter(|i| out.data[4 * i] == 255).collect();
        assert_eq!(lit, [50, 51, 52]);
        let v = [at(f32::NAN, 0.0), at(1e9, 0.0), at(0.0, 1e9)];
        triangle(&mut out, [&v[0], &v[1], &v[2]], &white(), [0, 0, 16, 16], 1.0);
        assert_eq!(out.data[0], 0);
    }

    /// A frame of egui itself: a filled rectangle is exact, text leaves ink, and both runs agree.
    #[test]
    fn a_frame_is_drawn() {
        let draw = || {
            let ctx = egui::Context::default();
            let mut paint = Paint::default();
            let size = vec2(120.0, 40.0);
            let mut last = Rgba8::default();
            for _ in 0..2 {
                let input = egui::RawInput {
                    screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), size)),
                    ..Default::default()
                };
                let mut output = ctx.run_ui(input, |ui| {
                    let p = ui.painter();
                    p.rect_filled(Rect::from_min_size(pos2(4.0, 4.0), vec2(8.0, 8.0)), 0.0, Color32::RED);
                    p.line_segment([pos2(100.0, 4.0), pos2(110.0, 30.0)], Stroke::new(2.0, Color32::GREEN));
                    let font = egui::FontId::proportional(14.0);
                    p.text(pos2(20.0, 10.0), egui::Align2::LEFT_TOP, "Sinew θ₂", font, Color32::WHITE);
                });
                paint.apply(&mut output.textures_delta);
                last = paint.draw(&ctx, &output, [size.x, size.y], Color32::BLACK);
            }
            last
        };
        let image = draw();
        let at = |x: usize, y: usize| &image.data[4 * (120 * y + x)..][..4];
        assert_eq!((at(8, 8), at(2, 2)), (&[255, 0, 0, 255][..], &[0, 0, 0, 255][..]));
        let ink: u32 =
            (10..30).flat_map(|y| (20..80).map(move |x| (x, y))).map(|(x, y)| u32::from(at(x, y)[0])).sum();
        assert!((20_000..120_000).contains(&ink), "{ink}");
        assert!(image == draw());
        if let Ok(path) = std::env::var("PAINT") {
            let bytes = sinew::io::picture::encode_png(&image, sinew::io::picture::PngLevel::Fast);
            std::fs::write(path, bytes.unwrap()).unwrap();
        }
    }
}
