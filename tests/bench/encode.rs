//! What it costs to turn drawn frames into bytes, beside the `png` crate's fastest setting with the same filter.
//!
//! ```text
//! sinew render man.glb -o /tmp/man.####.png
//! cargo bench --bench encode -- /tmp/man.*.png
//! ```
//!
//! Each round encodes every frame once with every encoder, so a machine that slows down slows all of them. Printed are the
//! medians over all rounds of processor milliseconds a frame, and kilobytes a frame.

use nix::sys::resource::{UsageWho, getrusage};
use sinew::image::{Image, Rgba8};
use sinew::io::picture::{
    Coding, ExrDepth, Film, FrameEncoder, PngLevel, encode_exr, encode_png, encode_webp,
};
use sinew::time::Rate;

const ROUNDS: usize = 15;

/// Bytes of a frame, which follows another one.
type Encode<'a> = Box<dyn FnMut(&Rgba8, &Rgba8) -> usize + 'a>;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if args.is_empty() {
        println!("usage: cargo bench --bench encode -- FRAME.png …");
        return;
    }
    let frames: Vec<Rgba8> = args.iter().map(|a| load(a)).collect();
    let size = [frames[0].width, frames[0].height];
    let film = Film::new(size, frames.len() as u32, Rate::default());
    let codings = [Coding::Apng(PngLevel::Fast), Coding::Webp, Coding::Y4m];
    let mut encoders: Vec<(&str, Encode)> = vec![
        ("png crate, fast", Box::new(|_, f| peer(f))),
        ("png fast", Box::new(|_, f| encode_png(f, PngLevel::Fast).unwrap().len())),
        ("webp", Box::new(|_, f| encode_webp(f).unwrap().len())),
        ("exr float", Box::new(|_, f| encode_exr(&linear(f), ExrDepth::Float).unwrap().len())),
        ("(linear)", Box::new(|_, f| linear(f).pixels.len())),
    ];
    for (coding, name) in codings.iter().zip(["apng film", "webp film", "y4m film"]) {
        let mut encoder = FrameEncoder::new(film, coding);
        encoders.push((name, Box::new(move |b, f| encoder.encode(Some(b), f).unwrap().bytes())));
    }
    let mut spent = vec![Vec::new(); encoders.len()];
    let mut bytes = vec![0; encoders.len()];
    for _ in 0..ROUNDS {
        for (k, (_, encode)) in encoders.iter_mut().enumerate() {
            let start = cpu();
            bytes[k] = (0..frames.len()).map(|i| encode(&frames[i.saturating_sub(1)], &frames[i])).sum();
            spent[k].push(cpu() - start);
        }
    }
    println!("{} frames of {}×{}", frames.len(), size[0], size[1]);
    for (k, (name, _)) in encoders.iter().enumerate() {
        spent[k].sort_by(f64::total_cmp);
        let ms = 1e3 * spent[k][ROUNDS / 2] / frames.len() as f64;
        let least = 1e3 * spent[k][0] / frames.len() as f64;
        println!(
            "{name:16} {ms:7.3} ms (least {least:.3}) {:8.1} KB",
            bytes[k] as f64 / 1e3 / frames.len() as f64
        );
    }
}

fn load(path: &str) -> Rgba8 {
    let picture = image::open(path).unwrap_or_else(|e| panic!("{path}: {e}")).into_rgba8();
    Rgba8 { width: picture.width() as usize, height: picture.height() as usize, data: picture.into_raw() }
}

/// Processor seconds of this thread.
fn cpu() -> f64 {
    let r = getrusage(UsageWho::RUSAGE_THREAD).expect("the system counts");
    let seconds = |t: nix::sys::time::TimeVal| t.tv_sec() as f64 + t.tv_usec() as f64 * 1e-6;
    seconds(r.user_time()) + seconds(r.system_time())
}

fn linear(f: &Rgba8) -> Image {
    let light = &*sinew::image::color::LINEAR_OF_SRGB8;
    let pixel = |p: &[u8; 4]| [0, 1, 2, 3].map(|c| if c == 3 { 1.0 } else { light[usize::from(p[c])] });
    Image { width: f.width, height: f.height, pixels: f.data.as_chunks::<4>().0.iter().map(pixel).collect() }
}

fn peer(f: &Rgba8) -> usize {
    let rgb: Vec<u8> = f.data.as_chunks::<4>().0.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut bytes = Vec::with_capacity(f.data.len() / 4);
    let mut encoder = png::Encoder::new(&mut bytes, f.width as u32, f.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Paeth);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&rgb).unwrap();
    writer.finish().unwrap();
    bytes.len()
}
