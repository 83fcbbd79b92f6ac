//! Pictures that are written come back as they were.

use sinew::image::Rgba8;
use sinew::io::picture::*;
use sinew::time::Rate;
use std::io::{Cursor, Write};

/// A shaded ball that moves over a background; frame `k` of a film.
fn ball(size: [usize; 2], k: usize, background: [u8; 4]) -> Rgba8 {
    let [w, h] = size;
    let radius = h as f64 * 0.3;
    let centre = [w as f64 * 0.3 + 3.0 * k as f64, h as f64 * 0.5];
    let mut data = Vec::with_capacity(4 * w * h);
    for i in 0..w * h {
        let [x, y] = [(i % w) as f64 - centre[0], (i / w) as f64 - centre[1]];
        let distance = x.hypot(y);
        let z = (radius * radius - distance * distance).max(0.0).sqrt() / radius;
        let shade = 0.2 + 0.8 * (0.6 * z - 0.5 * x / radius - 0.5 * y / radius).clamp(0.0, 1.0);
        let cover = (radius + 0.5 - distance).clamp(0.0, 1.0);
        let front = [250.0 * shade, 170.0 * shade, 60.0 + 90.0 * shade];
        if background[3] == 0 {
            data.extend(front.map(|c| c as u8));
            data.push((255.0 * cover).round() as u8);
        } else {
            data.extend((0..3).map(|c| (front[c] * cover + f64::from(background[c]) * (1.0 - cover)) as u8));
            data.push(255);
        }
    }
    Rgba8 { width: w, height: h, data }
}

fn film(size: [usize; 2], frames: u32, fps: u16) -> Film {
    Film::new(size, frames, Rate::new(fps, 1).unwrap())
}

fn balls(size: [usize; 2], frames: usize, background: [u8; 4]) -> Vec<Rgba8> {
    (0..frames).map(|k| ball(size, k, background)).collect()
}

/// The bytes of a film.
fn film_of(frames: &[Rgba8], film: Film, coding: &Coding) -> Result<(Vec<u8>, FilmReport), Error> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = FilmWriter::new(&mut file, film, coding)?;
    let mut encoder = FrameEncoder::new(film, coding);
    for (k, frame) in frames.iter().enumerate() {
        let before = k.checked_sub(1).map(|b| &frames[b]);
        writer.write(encoder.encode(before, frame)?)?;
    }
    let report = writer.finish()?;
    Ok((file.into_inner(), report))
}

fn gif_of(frames: &[Rgba8], film: Film, dither: Dither) -> (Vec<u8>, Palette, FilmReport) {
    let palette = Palette::from_frames(frames, 256, &film);
    let (bytes, report) = film_of(frames, film, &Coding::Gif(palette.clone(), dither)).unwrap();
    (bytes, palette, report)
}

/// What a viewer shows of a GIF: the canvas after each frame, its delay, and the repetitions.
struct Shown {
    frames: Vec<Vec<u8>>,
    delays: Vec<u16>,
    repeat: gif::Repeat,
}

fn play_gif(bytes: &[u8]) -> Shown {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let (w, h) = (usize::from(decoder.width()), usize::from(decoder.height()));
    let (mut canvas, mut frames, mut delays) = (vec![0u8; 4 * w * h], vec![], vec![]);
    while let Some(f) = decoder.read_next_frame().unwrap() {
        let [left, top, width, height] = [f.left, f.top, f.width, f.height].map(usize::from);
        let row = |y: usize| ((top + y) * w + left) * 4;
        for y in 0..height {
            let line = &f.buffer[y * width * 4..][..width * 4];
            for (to, from) in canvas[row(y)..][..width * 4].chunks_mut(4).zip(line.chunks(4)) {
                if from[3] != 0 {
                    to.copy_from_slice(from);
                }
            }
        }
        frames.push(canvas.clone());
        delays.push(f.delay);
        if f.dispose == gif::DisposalMethod::Background {
            (0..height).for_each(|y| canvas[row(y)..][..width * 4].fill(0));
        }
    }
    Shown { frames, delays, repeat: decoder.repeat() }
}

/// The picture that indices stand for.
fn picture(indexed: &Indexed, palette: &Palette) -> Vec<u8> {
    let color = |i: &u8| match palette.colors().get(usize::from(*i)) {
        Some(&[r, g, b]) => [r, g, b, 255],
        None => [0; 4],
    };
    indexed.indices.iter().flat_map(color).collect()
}

#[test]
fn png_is_lossless_and_opaque_pictures_have_no_alpha() {
    for (background, colour) in [([9, 9, 9, 255], image::ColorType::Rgb8), ([0; 4], image::ColorType::Rgba8)]
    {
        let picture = ball([61, 47], 2, background);
        for level in [PngLevel::Fast, PngLevel::Balanced, PngLevel::Best] {
            let bytes = encode_png(&picture, level).unwrap();
            assert_eq!(bytes, encode_png(&picture, level).unwrap());
            assert!(bytes.windows(4).any(|w| w == b"sRGB"));
            let back = image::load_from_memory(&bytes).unwrap();
            assert_eq!((back.width(), back.height(), back.color()), (61, 47, colour));
            assert_eq!(back.into_rgba8().into_raw(), picture.data);
        }
    }
}

#[test]
fn pictures_that_are_none_are_refused() {
    for (width, height, bytes) in [(0, 0, 0), (0, 4, 0), (2, 2, 15), (2, 2, 17), (usize::MAX, 2, 8)] {
        let message = encode_png(&Rgba8 { width, height, data: vec![0; bytes] }, PngLevel::Fast);
        assert!(message.unwrap_err().to_string().contains("expected sides of 1 to"));
    }
}

#[test]
fn a_gif_shows_exactly_what_was_mapped() {
    for (background, transparent) in [([30, 60, 90, 255], false), ([0; 4], false), ([0; 4], true)] {
        let frames = balls([80, 60], 7, background);
        let film = Film { transparent, ..film([80, 60], 7, 25) };
        for dither in Dither::ALL {
            let (bytes, palette, report) = gif_of(&frames, film, dither);
            assert_eq!(bytes, gif_of(&frames, film, dither).0, "the same bytes twice");
            let shown = play_gif(&bytes);
            assert_eq!((shown.frames.len(), report), (7, FilmReport { frames: 7, dropped: 0 }));
            assert_eq!((shown.delays, shown.repeat), (vec![4; 7], gif::Repeat::Infinite));
            let mut mapper = Mapper::new(&palette, &film);
            for (k, frame) in frames.iter().enumerate() {
                let mapped = picture(&mapper.map(frame, dither), &palette);
                assert_eq!(shown.frames[k], mapped, "{dither:?}, frame {k}");
                let holes =
                    mapped.chunks(4).zip(frame.data.chunks(4)).all(|(m, f)| (m[3] == 0) == (f[3] < 128));
                assert!(holes || !transparent);
            }
        }
    }
}

#[test]
fn gif_delays_add_up_and_none_is_too_short() {
    for (fps, frames, dropped) in
        [(24, 48, 0), (30, 45, 0), (50, 5, 0), (60, 60, 20), (60, 2, 1), (7, 5, 0), (1000, 10, 9)]
    {
        let film = film([4, 3], frames, fps);
        let pictures = balls([4, 3], frames as usize, [0, 0, 0, 255]);
        let (bytes, _, report) = gif_of(&pictures, film, Dither::None);
        let delays = play_gif(&bytes).delays;
        let total: u32 = delays.iter().map(|d| u32::from(*d)).sum();
        assert_eq!(total, (f64::from(frames) * 100.0 / f64::from(fps)).round() as u32, "{fps}");
        assert_eq!((report.frames, report.dropped), (frames - dropped, dropped), "{fps}");
        assert!(delays.len() == 1 || delays.iter().all(|d| *d >= 2), "{fps}: {delays:?}");
    }
}

#[test]
fn films_are_played_as_often_as_asked() {
    let frames = balls([9, 9], 2, [0, 0, 0, 255]);
    for (plays, repeat) in
        [(0, gif::Repeat::Infinite), (1, gif::Repeat::Finite(0)), (3, gif::Repeat::Finite(2))]
    {
        let film = Film { plays, ..film([9, 9], 2, 10) };
        let (bytes, ..) = gif_of(&frames, film, Dither::None);
        assert_eq!(play_gif(&bytes).repeat, repeat);
        assert_eq!(bytes.windows(8).any(|w| w == b"NETSCAPE"), plays != 1);
        let apng = apng_of(&frames, film).unwrap();
        let reader = png::Decoder::new(Cursor::new(apng)).read_info().unwrap();
        assert_eq!(reader.info().animation_control().unwrap().num_plays, u32::from(plays));
    }
}

#[test]
fn few_colours_are_kept_exactly_and_many_closely() {
    let flat: Vec<u8> = (0..240u32).flat_map(|i| [i as u8, (i / 2) as u8, 7, 255]).collect();
    let flat = Rgba8 { width: 16, height: 15, data: flat };
    let film = film([16, 15], 1, 24);
    let (dither, scores) = choose(std::slice::from_ref(&flat), &film);
    assert_eq!((dither, scores[0].total()), (Dither::None, 0.0));
    for dither in Dither::ALL {
        let (bytes, ..) = gif_of(std::slice::from_ref(&flat), film, dither);
        assert_eq!(play_gif(&bytes).frames[0], flat.data, "{dither:?}");
    }

    let frames = balls([96, 64], 6, [40, 40, 48, 255]);
    let film = Film { size: [96, 64], frames: 6, ..film };
    let (best, scores) = choose(&frames, &film);
    assert_eq!((best, scores), choose(&frames, &film));
    let least = scores.iter().find(|s| s.dither == best).unwrap();
    assert!(scores.iter().all(|s| s.total() >= least.total()));
    assert!(least.total() < 1.0, "{scores:?}");
    let palette = Palette::from_frames(&frames, 256, &film);
    let plain = Mapper::new(&palette, &film).map(&frames[3], Dither::None);
    let shown = picture(&plain, &palette);
    let worst = shown.iter().zip(&frames[3].data).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(worst.unwrap() <= 12, "{worst:?}");
}

fn choose(frames: &[Rgba8], film: &Film) -> (Dither, [DitherScore; 3]) {
    choose_dither(frames, &Palette::from_frames(frames, 256, film), film)
}

#[test]
fn dithering_brings_back_what_three_greys_cannot_show() {
    // A ramp that moves a little, so that its error is not the same in both frames.
    let ramp = |k: usize| {
        let data = (0..96 * 64).flat_map(|i| [[((i % 96 + k) * 2) as u8; 3].as_slice(), &[255]].concat());
        Rgba8 { width: 96, height: 64, data: data.collect() }
    };
    let film = film([96, 64], 2, 24);
    let palette = Palette::new(vec![[0; 3], [110; 3], [255; 3]]);
    let (best, scores) = choose_dither(&[ramp(0), ramp(3)], &palette, &film);
    let error = |d: Dither| scores.iter().find(|s| s.dither == d).unwrap().error;
    assert!(error(Dither::FloydSteinberg) < 0.4 * error(Dither::None), "{scores:?}");
    assert!(error(Dither::Ordered) < 0.6 * error(Dither::None), "{scores:?}");
    assert_ne!(best, Dither::None);
}

#[test]
fn a_dark_gradient_fills_the_palette() {
    // Clustering alone gives the same 8-bit colours several times and leaves bands.
    let data = (0..64 * 512usize).flat_map(|i| {
        let t = (i / 64) as f64 / 512.0;
        [(40.0 + 30.0 * t) as u8, (42.0 + 30.0 * t) as u8, (50.0 + 40.0 * t) as u8, 255]
    });
    let mut picture = Rgba8 { width: 64, height: 512, data: data.collect() };
    // Enough other colours that not all fit.
    for (i, p) in picture.data.as_chunks_mut::<4>().0.iter_mut().take(700).enumerate() {
        *p = [(i % 250) as u8, (i % 97 * 2) as u8, (i / 7) as u8, 255];
    }
    let film = film([64, 512], 1, 24);
    let palette = Palette::from_frames([&picture], 256, &film);
    assert_eq!(palette.colors().len(), 255);
    let mapped = Mapper::new(&palette, &film).map(&picture, Dither::None);
    let rows = mapped.indices.chunks(64).skip(11).zip(picture.data.chunks(256).skip(11));
    let worst =
        rows.map(|(i, p)| (0..3).map(|c| palette.colors()[usize::from(i[0])][c].abs_diff(p[c])).max());
    assert!(worst.flatten().max().unwrap() <= 1);
}

#[test]
fn empty_and_transparent_films_have_palettes() {
    let clear = Rgba8 { width: 3, height: 2, data: vec![0; 24] };
    let film = Film { transparent: true, ..film([3, 2], 1, 24) };
    assert_eq!(Palette::from_frames(&[], 256, &film).colors(), [[255; 3]]);
    let (bytes, ..) = gif_of(std::slice::from_ref(&clear), film, Dither::FloydSteinberg);
    assert_eq!(play_gif(&bytes).frames, [clear.data]);
}

/// Every way to code a film.
fn codings() -> [Coding; 4] {
    let gif = Coding::Gif(Palette::new(vec![[0; 3]]), Dither::None);
    [gif, Coding::Apng(PngLevel::Fast), Coding::Webp, Coding::Y4m]
}

#[test]
fn films_take_the_frames_that_they_announced() {
    let frame = ball([8, 8], 0, [0, 0, 0, 255]);
    let film = film([8, 8], 2, 24);
    for coding in codings() {
        let mut encoder = FrameEncoder::new(film, &coding);
        let other = encoder.encode(None, &ball([9, 8], 0, [0; 4])).unwrap_err().to_string();
        assert!(other.contains("9 × 8, expected 8 × 8"), "{other}");
        let frames = [frame.clone(), frame.clone(), frame.clone()];
        let of = |n: usize, film| film_of(&frames[..n], film, &coding);
        assert!(matches!(of(3, film), Err(Error::FrameCount { expected: 2, found: 3 })));
        assert!(matches!(of(1, film), Err(Error::FrameCount { expected: 2, found: 1 })));
        assert!(matches!(of(0, Film { frames: 0, ..film }), Err(Error::FrameCount { .. })));
        let wide = of(0, Film { size: [usize::MAX, 1], ..film });
        assert!(matches!(wide, Err(Error::Size { .. })), "{coding:?}");
        let name = coding.format().name();
        for (rate, refused) in
            [(Rate::new(1, 65535), ["GIF", "WebP"].contains(&name)), (Rate::new(1001, 1), name == "WebP")]
        {
            let made = of(2, Film { rate: rate.unwrap(), ..film });
            let message = made.err().map(|e| e.to_string());
            assert_eq!(message.is_some(), refused, "{message:?}");
            assert!(message.is_none_or(|m| m.contains(name)));
        }
    }
}

fn apng_of(frames: &[Rgba8], film: Film) -> Result<Vec<u8>, Error> {
    film_of(frames, film, &Coding::Apng(PngLevel::Fast)).map(|f| f.0)
}

/// Little-endian number of three bytes.
fn u24(b: &[u8]) -> usize {
    usize::from(b[0]) | usize::from(b[1]) << 8 | usize::from(b[2]) << 16
}

/// Chunks of a RIFF file, names and contents.
fn riff(bytes: &[u8]) -> Vec<(&[u8], &[u8])> {
    let mut chunks = Vec::new();
    let mut rest = bytes;
    while let Some((head, after)) = rest.split_first_chunk::<8>() {
        let size = u32::from_le_bytes(head[4..].try_into().unwrap()) as usize;
        chunks.push((&rest[..4], &after[..size]));
        rest = &after[size + size % 2..];
    }
    assert!(rest.is_empty());
    chunks
}

#[test]
fn a_webp_film_is_lossless_and_as_long_as_it_should_be() {
    use image::AnimationDecoder;
    for (transparent, plays) in [(false, 0), (true, 3)] {
        let background = if transparent { [0; 4] } else { [30, 60, 90, 255] };
        let mut frames = balls([41, 30], 5, background);
        frames.push(frames[4].clone());
        let film = Film { transparent, plays, rate: "23.976".parse().unwrap(), ..film([41, 30], 6, 24) };
        let (bytes, report) = film_of(&frames, film, &Coding::Webp).unwrap();
        assert_eq!(report, FilmReport { frames: 6, dropped: 0 });
        assert_eq!(bytes, film_of(&frames, film, &Coding::Webp).unwrap().0);
        let decoder = image::codecs::webp::WebPDecoder::new(Cursor::new(&bytes)).unwrap();
        assert!(decoder.has_animation());
        let shown: Vec<image::Frame> = decoder.into_frames().collect_frames().unwrap();
        assert_eq!(shown.len(), 6);
        let delay = |f: &image::Frame| std::time::Duration::from(f.delay()).as_millis();
        // 6 · 1001/24000 s, rounded once.
        assert_eq!(shown.iter().map(delay).sum::<u128>(), 250);
        for (k, frame) in frames.iter().enumerate() {
            assert!(*shown[k].buffer().as_raw() == frame.data, "frame {k}");
        }

        // The container, by hand: sizes, loops, alpha, and no more pixels than what changed.
        assert_eq!(u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize, bytes.len() - 8);
        let chunks = riff(&bytes[12..]);
        assert_eq!((chunks[0].0, chunks[1].0), (&b"VP8X"[..], &b"ANIM"[..]));
        assert_eq!(chunks[0].1, [if transparent { 0x12 } else { 2 }, 0, 0, 0, 40, 0, 0, 29, 0, 0]);
        assert_eq!(chunks[1].1[4..], plays.to_le_bytes());
        let sizes: Vec<usize> =
            chunks[2..].iter().map(|(_, c)| (u24(&c[6..]) + 1) * (u24(&c[9..]) + 1)).collect();
        assert!(sizes[0] == 41 * 30 && sizes[1] < 41 * 30 && sizes[5] == 1, "{sizes:?}");
    }
}

#[test]
fn a_webp_still_is_lossless_and_opaque_pictures_have_no_alpha() {
    for (background, colour) in [([9, 9, 9, 255], image::ColorType::Rgb8), ([0; 4], image::ColorType::Rgba8)]
    {
        let picture = ball([61, 47], 2, background);
        let bytes = encode_webp(&picture).unwrap();
        assert_eq!(bytes, encode_webp(&picture).unwrap());
        let back = image::load_from_memory(&bytes).unwrap();
        assert_eq!(back.color(), colour);
        assert!(back.into_rgba8().into_raw() == picture.data);
    }
    let wide = Rgba8 { width: 16385, height: 1, data: vec![0; 4 * 16385] };
    assert!(encode_webp(&wide).unwrap_err().to_string().contains("1 to 16384"));
}

#[test]
fn a_y4m_is_read_back_within_a_step() {
    let frames = balls([32, 20], 3, [200, 60, 90, 255]);
    let film = Film { rate: Rate::new(30000, 1001).unwrap(), ..film([32, 20], 3, 24) };
    let (bytes, _) = film_of(&frames, film, &Coding::Y4m).unwrap();
    let head = b"YUV4MPEG2 W32 H20 F30000:1001 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
    assert_eq!(bytes[..head.len()], *head);
    let body = bytes[head.len()..].chunks(6 + 3 * 640);
    assert_eq!(body.len(), 3);
    for (frame, planes) in frames.iter().zip(body) {
        assert_eq!(planes[..6], *b"FRAME\n");
        for (i, p) in frame.data.chunks(4).enumerate() {
            let [y, b, r] = [0, 640, 1280].map(|plane| f64::from(planes[6 + plane + i]));
            let (y, b, r) = ((y - 16.0) / 219.0, (b - 128.0) / 224.0, (r - 128.0) / 224.0);
            let (red, blue) = (y + 1.5748 * r, y + 1.8556 * b);
            let green = (y - 0.2126 * red - 0.0722 * blue) / 0.7152;
            for (c, v) in [red, green, blue].into_iter().enumerate() {
                assert!((255.0 * v - f64::from(p[c])).abs() <= 2.0, "{p:?} {v}");
            }
        }
    }
}

#[test]
fn an_exr_holds_the_numbers_themselves() {
    use exr::prelude::*;
    // Numbers of every kind, more rows than a block has, and noise that does not shrink.
    let number = |i: u32| match i % 7 {
        0 => -0.0,
        1 => f32::MAX,
        2 => 1e-40,
        3 => f32::from_bits(i.wrapping_mul(0x9e37_79b9) & 0x7f7f_ffff),
        _ => i as f32 * 1e-3,
    };
    for height in [1, 16, 37] {
        let pixels: Vec<[f32; 4]> =
            (0..13 * height).map(|i| [0, 1, 2, 3].map(|c| number(4 * i + c))).collect();
        let picture = sinew::image::Image { width: 13, height: height as usize, pixels };
        for depth in [ExrDepth::Float, ExrDepth::Half] {
            let bytes = encode_exr(&picture, depth).unwrap();
            assert_eq!(bytes, encode_exr(&picture, depth).unwrap());
            let read = exr::image::read::read().no_deep_data().largest_resolution_level().all_channels();
            let read = read.first_valid_layer().all_attributes();
            let back = read.from_buffered(Cursor::new(&bytes)).unwrap();
            let layer = back.layer_data;
            assert_eq!(layer.size, Vec2(13, height as usize));
            let names: Vec<String> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
            assert_eq!(names, ["A", "B", "G", "R"]);
            for (channel, c) in layer.channel_data.list.iter().zip([3, 2, 1, 0]) {
                for (v, p) in channel.sample_data.values_as_f32().zip(&picture.pixels) {
                    let same = match depth {
                        ExrDepth::Float => v.to_bits() == p[c].to_bits(),
                        ExrDepth::Half => v == f16::from_f32(p[c]).to_f32(),
                    };
                    assert!(same, "{depth:?}: {v:e} {:e}", p[c]);
                }
            }
        }
    }
    let none = sinew::image::Image { width: 2, height: 2, pixels: vec![[0.0; 4]; 3] };
    assert!(encode_exr(&none, ExrDepth::Float).unwrap_err().to_string().contains("OpenEXR"));
}

#[test]
fn an_apng_is_lossless_with_exact_delays() {
    let rate: Rate = "23.976".parse().unwrap();
    for transparent in [false, true] {
        let background = if transparent { [0; 4] } else { [30, 60, 90, 255] };
        // The last frame repeats the one before: nothing changes.
        let mut frames = balls([40, 30], 5, background);
        frames.push(frames[4].clone());
        let film = Film { rate, transparent, ..film([40, 30], 6, 24) };
        let bytes = apng_of(&frames, film).unwrap();
        assert_eq!(bytes, apng_of(&frames, film).unwrap());
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        assert_eq!(reader.info().animation_control().unwrap().num_frames, 6);
        let channels = if transparent { 4 } else { 3 };
        let mut canvas = vec![0; 40 * 30 * channels];
        for frame in &frames {
            let mut buffer = vec![0; canvas.len()];
            let info = reader.next_frame(&mut buffer).unwrap();
            let control = *reader.info().frame_control().unwrap();
            assert_eq!((control.delay_num, control.delay_den), (1001, 24000));
            let (left, top) = (control.x_offset as usize, control.y_offset as usize);
            for y in 0..info.height as usize {
                let line = &buffer[y * info.line_size..][..info.line_size];
                canvas[((top + y) * 40 + left) * channels..][..line.len()].copy_from_slice(line);
            }
            let pixels = frame.data.chunks(4).flat_map(|p| &p[..channels]);
            assert!(canvas.iter().eq(pixels));
        }
    }
}

#[test]
fn half_written_files_never_appear() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let entries = || std::fs::read_dir(folder.path()).unwrap().count();
    let mut file = AtomicFile::create(&path, false, Folder::MustExist).unwrap();
    file.write_all(&[7; 100_000]).unwrap();
    assert!(!path.exists() && entries() <= 1);
    drop(file);
    assert_eq!(entries(), 0);

    // A film that breaks off leaves the old file as it was.
    AtomicFile::write(&path, b"old", false, Folder::MustExist).unwrap();
    let file = AtomicFile::create(&path, true, Folder::MustExist).unwrap();
    let (film, coding) = (film([8, 8], 2, 24), Coding::Apng(PngLevel::Fast));
    let mut writer = FilmWriter::new(file, film, &coding).unwrap();
    let frame = FrameEncoder::new(film, &coding).encode(None, &ball([8, 8], 0, [0; 4]));
    writer.write(frame.unwrap()).unwrap();
    assert!(writer.finish().is_err());
    assert_eq!((std::fs::read(&path).unwrap(), entries()), (b"old".to_vec(), 1));
}

#[test]
fn of_files_that_belong_together_none_is_written_if_one_cannot_be() {
    let dir = tempfile::tempdir().unwrap();
    let [first, second, lost] = ["a.bin", "a.gltf", "nowhere/a.gltf"].map(|n| dir.path().join(n));
    let together = |second: &std::path::Path| {
        let files = [(first.clone(), &b"one"[..]), (second.to_owned(), b"two")];
        AtomicFile::write_together(&files, false, Folder::MustExist)
    };
    assert!(together(&lost).is_err());
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    together(&second).unwrap();
    assert_eq!([&first, &second].map(|p| std::fs::read(p).unwrap()), [b"one", b"two"]);
}

#[test]
fn files_are_overwritten_only_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let write = |bytes: &[u8], overwrite| AtomicFile::write(&path, bytes, overwrite, Folder::MustExist);
    write(b"one", false).unwrap();
    let message = write(b"two", false).unwrap_err().to_string();
    assert!(message.contains("a.png") && message.contains("--force"), "{message}");
    write(b"two", true).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"two");

    // Somebody takes the name while the picture is drawn.
    let other = folder.path().join("b.png");
    let file = AtomicFile::create(&other, false, Folder::MustExist).unwrap();
    std::fs::write(&other, b"theirs").unwrap();
    assert!(matches!(file.commit(), Err(Error::Exists { .. })));
    assert_eq!(std::fs::read(&other).unwrap(), b"theirs");

    let folder_error = AtomicFile::create(folder.path(), true, Folder::MustExist).unwrap_err().to_string();
    assert!(folder_error.contains("expected a file name, found a folder"), "{folder_error}");
    let missing = folder.path().join("no/such/a.png");
    let message = AtomicFile::create(&missing, false, Folder::MustExist).unwrap_err().to_string();
    assert!(message.contains("no/such does not exist") && message.contains("mkdir"), "{message}");
    AtomicFile::write(&missing, b"made", false, Folder::Create).unwrap();
    assert!(missing.exists());
    let under_a_file = path.join("a.png");
    assert!(AtomicFile::write(under_a_file, b"", false, Folder::Create).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[cfg(unix)]
#[test]
fn permissions_and_links_are_those_of_any_file() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let (ours, theirs) = (folder.path().join("ours"), folder.path().join("theirs"));
    std::fs::write(&theirs, b"").unwrap();
    AtomicFile::write(&ours, b"", false, Folder::MustExist).unwrap();
    let mode = |p: &std::path::Path| p.metadata().unwrap().mode() & 0o777;
    assert_eq!(mode(&ours), mode(&theirs));
    std::fs::set_permissions(&theirs, std::fs::Permissions::from_mode(0o640)).unwrap();
    let link = folder.path().join("link");
    symlink(&theirs, &link).unwrap();
    AtomicFile::write(&link, b"new", true, Folder::MustExist).unwrap();
    assert!(link.is_symlink() && std::fs::read(&theirs).unwrap() == b"new");
    assert_eq!(mode(&theirs), 0o640);
}

/// The clean-up is for the end of a process, so this test runs itself in one of its own.
#[test]
fn an_interrupted_program_leaves_nothing() {
    const FOLDER: &str = "SINEW_TEST_CLEANUP";
    if let Some(folder) = std::env::var_os(FOLDER) {
        let path = |name| std::path::Path::new(&folder).join(name);
        AtomicFile::write(path("done"), b"1", false, Folder::MustExist).unwrap();
        let mut file = AtomicFile::create(path("open"), false, Folder::MustExist).unwrap();
        file.write_all(b"half").unwrap();
        cleanup_temporaries();
        assert!(matches!(file.commit(), Err(Error::Interrupted { .. })));
        assert!(matches!(
            AtomicFile::create(path("late"), false, Folder::MustExist),
            Err(Error::Interrupted { .. })
        ));
        std::process::exit(42);
    }
    let folder = tempfile::tempdir().unwrap();
    let mut child = std::process::Command::new(std::env::current_exe().unwrap());
    child.args(["an_interrupted_program_leaves_nothing", "--test-threads=1"]).env(FOLDER, folder.path());
    assert_eq!(child.output().unwrap().status.code(), Some(42));
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["done"]);
}
