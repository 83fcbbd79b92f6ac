//! `sinew compare` as its users meet it: verdicts, exit codes, reports, panels.

use sinew::image::Rgba8;
use sinew::io::picture::{
    Coding, Dither, Film, FilmWriter, FrameEncoder, Mapper, Palette, PngLevel, encode_png, frames_of,
};
use std::path::Path;
use std::process::{Command, Output};

fn compare(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sinew"));
    command.arg("compare").args(args).output().expect("the program starts")
}

fn code(out: &Output) -> i32 {
    out.status.code().expect("it exits by itself")
}

fn said(out: &Output) -> String {
    String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr)
}

/// A gradient with one pixel, at 5, 3, that is `more` brighter in green.
fn picture(width: usize, more: u8) -> Rgba8 {
    let pixel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let green = 4 * y as u8 + if (x, y) == (5, 3) { more } else { 0 };
        [3 * x as u8, green, 90, 255]
    };
    Rgba8 { width, height: 24, data: (0..width * 24).flat_map(pixel).collect() }
}

struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().expect("UTF-8").to_string()
    }

    fn put(&self, name: &str, bytes: &[u8]) -> String {
        let path = self.0.path().join(name);
        std::fs::create_dir_all(path.parent().expect("below the folder")).expect("made");
        std::fs::write(path, bytes).expect("written");
        self.path(name)
    }

    fn png(&self, name: &str, picture: &Rgba8) -> String {
        self.put(name, &encode_png(picture, PngLevel::Fast).expect("encoded"))
    }

    fn film(&self, name: &str, frames: &[Rgba8], fps: &str) -> String {
        self.put(name, &film(frames, fps, &Coding::Apng(PngLevel::Fast)))
    }
}

fn head(frames: &[Rgba8], fps: &str) -> Film {
    Film::new([frames[0].width, frames[0].height], frames.len() as u32, fps.parse().expect("a rate"))
}

fn film(frames: &[Rgba8], fps: &str, coding: &Coding) -> Vec<u8> {
    let (film, mut file) = (head(frames, fps), std::io::Cursor::new(Vec::new()));
    let mut writer = FilmWriter::new(&mut file, film, coding).expect("begun");
    let mut encoder = FrameEncoder::new(film, coding);
    for (k, frame) in frames.iter().enumerate() {
        let before = k.checked_sub(1).map(|b| &frames[b]);
        writer.write(encoder.encode(before, frame).expect("encoded")).expect("written");
    }
    writer.finish().expect("finished");
    file.into_inner()
}

fn json(out: &Output) -> serde_json::Value {
    serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{e}: {}", said(out)))
}

fn decode(path: &str) -> Rgba8 {
    let bytes = std::fs::read(path).expect("it was written");
    let first = frames_of(&bytes).expect("a picture").next().expect("a frame");
    first.expect("decoded").pixels.into_codes()
}

#[test]
fn equal_is_0_and_different_is_4_with_the_place() {
    let b = Bench::new();
    let (a, same, off) = (
        b.png("a.png", &picture(40, 0)),
        b.png("same.png", &picture(40, 0)),
        b.png("off.png", &picture(40, 2)),
    );
    let out = compare(&[&a, &same]);
    assert_eq!((code(&out), said(&out).trim()), (0, "1 equal"));
    let out = compare(&[&a, &off]);
    assert_eq!(code(&out), 4, "{}", said(&out));
    assert!(
        said(&out).contains("1 pixels differ (0.104 %), worst 2 codes of green at 5, 3"),
        "{}",
        said(&out)
    );

    let v = json(&compare(&[&a, &off, "--json"]));
    let pair = &v["pairs"][0];
    assert_eq!((&v["counts"]["past"], &pair["verdict"]), (&1.into(), &"past".into()));
    assert_eq!(
        pair["worst"],
        serde_json::json!({ "codes": 2, "channel": "green", "x": 5, "y": 3, "frame": 1 })
    );
    // One of 960 pixels, one of three channels, 2 codes: 10 log₁₀(255² · 2880 / 4).
    assert!((pair["psnr_db"].as_f64().unwrap() - 76.704).abs() < 0.001, "{pair}");
    assert!(
        pair["ssim"].as_f64().unwrap() > 0.999 && pair["psnr_linear_db"].as_f64().unwrap() > 70.0,
        "{pair}"
    );
}

#[test]
fn bounds_are_kept_to_the_digit() {
    let b = Bench::new();
    let (a, off) = (b.png("a.png", &picture(40, 0)), b.png("off.png", &picture(40, 2)));
    for (bounds, want) in [
        (&["--max-diff", "2"][..], 0),
        (&["--max-diff", "1"], 4),
        (&["--max-pixels", "1"], 0),
        (&["--max-pixels", "0"], 4),
        (&["--max-diff", "1", "--max-pixels", "1"], 0),
        (&["--psnr-min", "76.7"], 0),
        (&["--psnr-min", "76.71"], 4),
        (&["--ssim-min", "0.99"], 0),
        (&["--ssim-min", "1"], 4),
        (&["--psnr-min", "40", "--max-diff", "1"], 4),
        (&["--psnr-min", "x"], 2),
        (&["--ssim-min", "1.5"], 2),
        (&["--max-diff", "256"], 2),
    ] {
        let mut args = vec![a.as_str(), off.as_str()];
        args.extend(bounds);
        let out = compare(&args);
        assert_eq!(code(&out), want, "{bounds:?}: {}", said(&out));
    }
    let out = compare(&[&a, &off, "--max-diff", "2"]);
    assert!(said(&out).starts_with("within"), "{}", said(&out));
}

#[test]
fn folders_are_matched_by_name_and_nothing_may_be_missing() {
    let b = Bench::new();
    for name in ["x/1.png", "x/sub/2.png", "y/1.png", "y/sub/2.png"] {
        b.png(name, &picture(40, 0));
    }
    b.put("x/notes.txt", b"not a picture");
    let (x, y) = (b.path("x"), b.path("y"));
    assert_eq!(code(&compare(&[&x, &y])), 0);

    b.png("y/sub/2.png", &picture(40, 9));
    b.png("x/3.png", &picture(40, 0));
    b.png("y/4.png", &picture(40, 0));
    for threads in ["1", "2", "5"] {
        let out = compare(&[&x, &y, "--threads", threads]);
        assert_eq!(code(&out), 4);
        let lines: Vec<String> = said(&out).lines().map(|l| l.chars().take(20).collect()).collect();
        let heads: Vec<&str> = lines.iter().filter(|l| !l.starts_with(' ')).map(|l| l.trim_end()).collect();
        assert_eq!(heads[..2], ["missing    3.png", "missing    4.png"], "{}", said(&out));
        assert!(heads[2].starts_with("past       sub/2.png"), "{}", said(&out));
        assert!(said(&out).contains("1 equal, 1 past, 2 missing"), "{}", said(&out));
    }
    assert_eq!(code(&compare(&[&x, &b.path("x/1.png")])), 2, "a folder and a file");
    std::fs::create_dir(b.path("empty")).unwrap();
    assert_eq!(code(&compare(&[&b.path("empty"), &b.path("empty")])), 3, "nothing to compare");
}

#[test]
fn one_broken_file_is_3_and_the_others_are_still_compared() {
    let b = Bench::new();
    b.png("x/1.png", &picture(40, 0));
    b.png("y/1.png", &picture(40, 1));
    b.png("x/2.png", &picture(40, 0));
    let whole = std::fs::read(b.png("y/2.png", &picture(40, 0))).unwrap();
    for n in [0, 1, 7, 8, 20, 33, whole.len() / 2, whole.len() - 20] {
        b.put("y/2.png", &whole[..n]);
        let out = compare(&[&b.path("x"), &b.path("y")]);
        assert_eq!(code(&out), 3, "{n} bytes: {}", said(&out));
        assert!(
            said(&out).contains("1 past, 1 unreadable") && said(&out).contains("y/2.png"),
            "{}",
            said(&out)
        );
    }
    let out = compare(&[&b.path("x/1.png"), &b.path("nowhere.png")]);
    assert!(code(&out) == 3 && said(&out).contains("nowhere.png"), "{}", said(&out));
    let noise = b.put("noise.png", b"\x00\x01\x02");
    let out = compare(&[&b.path("x/1.png"), &noise]);
    assert!(code(&out) == 3 && said(&out).contains("found bytes 00 01 02"), "{}", said(&out));
}

#[test]
fn other_sizes_and_numbers_of_frames_are_said_not_panicked_on() {
    let b = Bench::new();
    let (a, wide) = (b.png("a.png", &picture(40, 0)), b.png("wide.png", &picture(44, 0)));
    let diff = b.path("diff.png");
    let out = compare(&[&a, &wide, "--psnr-min", "1", "--diff", &diff]);
    assert!(code(&out) == 4 && said(&out).contains("40 × 24 and 44 × 24"), "{}", said(&out));
    assert_eq!(decode(&diff).width, 40 + 44 + 44 + 8);

    let frames: Vec<Rgba8> = [0, 5, 9].map(|m| picture(40, m)).into();
    let (three, two) = (b.film("3.apng", &frames, "8"), b.film("2.apng", &frames[..2], "8"));
    let out = compare(&[&three, &two]);
    assert!(code(&out) == 4 && said(&out).contains("2 frames, expected 3"), "{}", said(&out));
    let slow = b.film("slow.apng", &frames, "4");
    let out = compare(&[&three, &slow]);
    assert!(code(&out) == 4 && said(&out).contains("lasts another time"), "{}", said(&out));
    let out = compare(&[&three, &b.png("still.png", &frames[0])]);
    assert!(code(&out) == 4 && said(&out).contains("1 frames, expected 3"), "{}", said(&out));
}

#[test]
fn films_are_compared_frame_by_frame() {
    let b = Bench::new();
    let frames = |more: [u8; 4]| more.map(|m| picture(40, m));
    let a = b.film("a.apng", &frames([0, 0, 0, 0]), "10");
    let c = b.film("c.apng", &frames([0, 1, 7, 2]), "10");
    assert_eq!(code(&compare(&[&a, &a])), 0);
    let v = json(&compare(&[&a, &c, "--json"]));
    let pair = &v["pairs"][0];
    assert_eq!((&pair["frames_compared"], &pair["frames_differing"]), (&4.into(), &3.into()));
    assert_eq!((&pair["first_differing_frame"], &pair["pixels_differing"]), (&2.into(), &3.into()));
    assert_eq!((&pair["worst"]["codes"], &pair["worst"]["frame"]), (&7.into(), &3.into()));
    assert_eq!((&pair["actual"]["duration_ms"], &pair["actual"]["frames"]), (&400.0.into(), &4.into()));
    assert_eq!(code(&compare(&[&a, &c, "--max-diff", "7"])), 0);
    assert_eq!(code(&compare(&[&a, &c, "--max-diff", "6"])), 4);
}

#[test]
fn the_panels_show_expected_difference_and_actual() {
    let b = Bench::new();
    b.png("x/deep/1.png", &picture(40, 0));
    b.png("y/deep/1.png", &picture(40, 5));
    b.png("x/2.png", &picture(40, 0));
    b.png("y/2.png", &picture(40, 0));
    let out = compare(&[&b.path("x"), &b.path("y"), "--diff", &b.path("d"), "--max-diff", "9"]);
    assert!(code(&out) == 0 && said(&out).contains("differences × 51"), "{}", said(&out));
    assert!(!Path::new(&b.path("d/2.png")).exists(), "what is equal is not drawn");
    let shown = decode(&b.path("d/deep/1.png"));
    let at = |x: usize, y: usize| &shown.data[4 * (y * shown.width + x)..][..4];
    assert_eq!([shown.width, shown.height], [3 * 40 + 8, 24]);
    assert_eq!(
        (at(5, 3), at(49, 3), at(93, 3)),
        (&[15, 12, 90, 255][..], &[0, 255, 0, 255][..], &[15, 17, 90, 255][..])
    );
    assert_eq!(at(50, 3), [0, 0, 0, 255]);

    // Neither input may be lost to its own report.
    let (a, c) = (b.path("x/deep/1.png"), b.path("y/deep/1.png"));
    let before = std::fs::read(&c).unwrap();
    for (args, says) in [
        ([&a, &c, "--diff", &c], "write over"),
        ([&b.path("x"), &b.path("y"), "--diff", &b.path("y")], "write over"),
        ([&a, &c, "--diff", &b.path("d.jpg")], ".png"),
        ([&b.path("x"), &b.path("y"), "--diff", &a], "found a file"),
    ] {
        let out = compare(&args.map(|s: &str| s));
        assert!(code(&out) == 2 && said(&out).contains(says), "{args:?}: {}", said(&out));
    }
    assert_eq!(std::fs::read(&c).unwrap(), before);
}

#[test]
fn films_of_the_program_are_read_as_they_were_meant() {
    // Our writers store rectangles and keep what is below.
    let frames: Vec<Rgba8> = [0, 100, 200, 0].map(|m| picture(40, m)).into();
    let head = head(&frames, "10");
    let palette = Palette::from_frames(&frames[..], 256, &head);
    let mut mapper = Mapper::new(&palette, &head);
    let of_palette = |indices: Vec<u8>| -> Vec<u8> {
        let color = |&i: &u8| palette.colors()[usize::from(i)];
        indices.iter().map(color).flat_map(|[r, g, b]| [r, g, b, 255]).collect()
    };
    let mapped = frames.iter().map(|f| of_palette(mapper.map(f, Dither::None).indices)).collect();
    let exact: Vec<Vec<u8>> = frames.iter().map(|f| f.data.clone()).collect();
    let b = Bench::new();
    for (coding, want) in [
        (Coding::Gif(palette.clone(), Dither::None), &mapped),
        (Coding::Apng(PngLevel::Fast), &exact),
        (Coding::Webp, &exact),
    ] {
        let bytes = film(&frames, "10", &coding);
        let read: Vec<_> = frames_of(&bytes).unwrap().map(|f| f.unwrap()).collect();
        assert!(read.iter().all(|f| f.delay_ms.0 == 100 * f.delay_ms.1), "{coding:?}");
        let read: Vec<Vec<u8>> = read.into_iter().map(|f| f.pixels.into_codes().data).collect();
        assert!(read == *want, "{coding:?}");

        let (whole, cut) = (b.put("whole", &bytes), b.put("cut", &bytes[..bytes.len() / 2]));
        assert_eq!(code(&compare(&[&whole, &whole])), 0, "{coding:?}");
        assert_eq!(code(&compare(&[&whole, &cut])), 3, "{coding:?}");
    }
}

#[test]
fn light_is_compared_as_it_is() {
    use sinew::image::Image;
    use sinew::io::picture::{ExrDepth, encode_exr};
    let b = Bench::new();
    let light = |l: f32| Image::filled(20, 20, [l, 4.0, 0.25, 1.0]);
    let put = |name: &str, l: f32| b.put(name, &encode_exr(&light(l), ExrDepth::Float).unwrap());
    let (a, same, near, far) =
        (put("a.exr", 0.5), put("same.exr", 0.5), put("near.exr", 0.500001), put("far.exr", 0.6));
    assert_eq!(code(&compare(&[&a, &same])), 0);
    // No code differs, the light does.
    assert_eq!(code(&compare(&[&a, &near])), 4);
    assert_eq!(code(&compare(&[&a, &near, "--max-diff", "0"])), 0);
    let v = json(&compare(&[&a, &far, "--json"]));
    // A tenth in one of three channels: 10 log₁₀(3 / 0.01).
    assert!((v["pairs"][0]["psnr_linear_db"].as_f64().unwrap() - 24.771).abs() < 0.001, "{v}");
    assert_eq!(v["pairs"][0]["worst"]["channel"], "red");
    // A picture of 8 bits may stand against light.
    let png = b.png("a.png", &light(0.5).to_rgba8());
    assert_eq!(code(&compare(&[&a, &png])), 0);
    let cut = b.put("cut.exr", &std::fs::read(&a).unwrap()[..400]);
    assert_eq!(code(&compare(&[&a, &cut])), 3);
}

#[test]
fn a_bomb_is_refused_before_it_goes_off() {
    let b = Bench::new();
    let a = b.png("a.png", &picture(40, 0));
    let mut png = std::fs::read(&a).unwrap();
    // 65535 × 65535 pixels, announced by a few bytes.
    png[16..24].copy_from_slice(&[0, 0, 255, 255, 0, 0, 255, 255]);
    let crc = png[12..29].iter().fold(!0u32, |c, &byte| {
        (0..8).fold(c ^ u32::from(byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 })
    });
    png[29..33].copy_from_slice(&(!crc).to_be_bytes());
    let bomb = b.put("bomb.png", &png);
    let out = compare(&[&a, &bomb]);
    assert!(code(&out) == 3 && said(&out).contains("65535"), "{}", said(&out));
    let gif = b.put(
        "bomb.gif",
        b"GIF89a\xff\xff\xff\xff\x00\x00\x00\x2c\x00\x00\x00\x00\xff\xff\xff\xff\x00\x02\x00\x3b",
    );
    let out = compare(&[&a, &gif]);
    assert!(code(&out) == 3 && said(&out).contains("65535"), "{}", said(&out));
}
