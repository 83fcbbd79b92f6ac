//! The window; or a picture of it.

use sinew::io::picture::{AtomicFile, Folder, PngLevel, encode_png};
use sinew_app::state::{Command, State};
use sinew_app::{App, jobs, screenshot};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "usage: sinew-app [FILE] [--screenshot OUT.png] [--at SECONDS] [--size WIDTHxHEIGHT]";

/// What was typed.
struct Args {
    file: Option<PathBuf>,
    screenshot: Option<PathBuf>,
    at: Option<f64>,
    size: [f32; 2],
}

fn main() -> ExitCode {
    let args = match parse(std::env::args_os().skip(1)) {
        Ok(args) => args,
        Err(why) => return fail(2, &format!("{why}\n{USAGE}")),
    };
    match &args.screenshot {
        Some(out) => picture(&args, out),
        None => window(args),
    }
}

fn fail(code: u8, why: &str) -> ExitCode {
    eprintln!("sinew-app: {why}");
    ExitCode::from(code)
}

fn parse(mut given: impl Iterator<Item = std::ffi::OsString>) -> Result<Args, String> {
    let mut args = Args { file: None, screenshot: None, at: None, size: [1440.0, 900.0] };
    while let Some(word) = given.next() {
        let name = word.to_string_lossy().into_owned();
        let mut value = || given.next().ok_or(format!("{name}: a value is missing"));
        match name.as_str() {
            "-h" | "--help" => return Err("the timeline editor".into()),
            "--screenshot" => args.screenshot = Some(value()?.into()),
            "--at" => {
                let text = value()?.to_string_lossy().into_owned();
                let time = text.parse().ok().filter(|t: &f64| t.is_finite());
                args.at = Some(time.ok_or(format!("--at {text}: expected seconds"))?);
            }
            "--size" => {
                let text = value()?.to_string_lossy().into_owned();
                let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
                let fine = |s: &[u16; 2]| s.iter().all(|s| (64..=8192).contains(s));
                let sides =
                    sides.filter(fine).ok_or(format!("--size {text}: expected 64x64 to 8192x8192"))?;
                args.size = sides.map(f32::from);
            }
            _ if name.starts_with("--") => return Err(format!("{name} is not known")),
            _ if args.file.is_some() => return Err(format!("{name}: one file is enough")),
            _ => args.file = Some(word.into()),
        }
    }
    Ok(args)
}

fn picture(args: &Args, out: &Path) -> ExitCode {
    let state = match args.file.as_deref().map(jobs::open::read).transpose() {
        Ok(opened) => opened.map(|o| o.state()).unwrap_or_else(|| State::open(Default::default())),
        Err(why) => return fail(3, &why),
    };
    let mut app = App::new(state);
    if let Some(t) = args.at {
        let _ = app.state.update(Command::SetTime(t));
    }
    let picture = screenshot::draw(&mut app, args.size);
    let written = encode_png(&picture, PngLevel::default())
        .and_then(|bytes| AtomicFile::write(out, &bytes, true, Folder::MustExist));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => fail(4, &e.to_string()),
    }
}

fn window(args: Args) -> ExitCode {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_inner_size(args.size).with_title("sinew"),
        ..Default::default()
    };
    let shown = eframe::run_native(
        "sinew-app",
        options,
        Box::new(move |cc| {
            sinew_app::set_up(&cc.egui_ctx);
            let mut app = App::new(State::open(Default::default()));
            cc.storage.into_iter().for_each(|s| app.restore(s));
            app.jobs.begin(&cc.egui_ctx, args.file, args.at);
            Ok(Box::new(app))
        }),
    );
    match shown {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => fail(
            5,
            &format!(
                "no window can be opened: {e}\nWithout a display, --screenshot OUT.png draws the interface into a file."
            ),
        ),
    }
}
