//! The notes' scenes by the program: all of them are drawn, and the pictures that the notes have of them come out to the last code.

use sinew::io::picture::frames_of;
use std::path::Path;
use std::process::Command;

/// Pictures that are exact, by their scene and its folder.
const EXACT: [(&str, &str); 2] = [("ray-tracing", "sphere-and-plane"), ("ray-tracing", "sphere-packing")];

fn codes(file: &Path) -> Result<Vec<u8>, String> {
    let named = |e: &dyn std::fmt::Display| format!("{}: {e}", file.display());
    let bytes = std::fs::read(file).map_err(|e| named(&e))?;
    let frame = frames_of(&bytes).map_err(|e| named(&e))?.next().ok_or_else(|| named(&"no frame"))?;
    Ok(frame.map_err(|e| named(&e))?.pixels.into_codes().data)
}

/// Each scene gives a picture with something in it, by default in f64, and what is exact is.
pub fn every_scene_is_drawn(data: &Path) -> Result<(), String> {
    let dir = tempfile::tempdir().map_err(|e| e.to_string())?;
    let mut count = 0;
    for folder in ["ray-casting", "ray-tracing"] {
        let home = data.join("notes").join(folder);
        for file in std::fs::read_dir(&home).map_err(|e| e.to_string())?.map(|e| e.map(|e| e.path())) {
            let file = file.map_err(|e| e.to_string())?;
            if file.extension().is_none_or(|e| e != "json") {
                continue;
            }
            count += 1;
            let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let exact = EXACT.contains(&(folder, &name));
            let out = dir.path().join(format!("{folder}-{name}.png"));
            let mut run = Command::new(env!("CARGO_BIN_EXE_sinew"));
            run.args(["render", "-q", "--channels", "id,depth,normal", "-o"]).args([&out, &file]);
            if !exact {
                run.args(["--size", "160x90"]);
            }
            let done = run.output().map_err(|e| e.to_string())?;
            if !done.status.success() {
                return Err(format!("{folder}/{name}: {}", String::from_utf8_lossy(&done.stderr)));
            }
            let drawn = codes(&out)?;
            if drawn.chunks(4).all(|p| p == &drawn[..4]) {
                return Err(format!("{folder}/{name}: the picture is of one colour"));
            }
            if exact && codes(&home.join("reference").join(format!("{name}.png")))? != drawn {
                return Err(format!("{folder}/{name} is not the picture of the notes"));
            }
        }
    }
    if count == 16 { Ok(()) } else { Err(format!("{count} scenes, expected 16")) }
}
