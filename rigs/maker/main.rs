//! Builds every file in rigs/ and poses/: `cargo run --release --example make-rigs`.

mod characters;

use std::path::Path;

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for file in characters::all() {
        std::fs::write(root.join(&file.path), &file.bytes)?;
        println!("{} ({} KB)", file.path, file.bytes.len().div_ceil(1024));
    }
    Ok(())
}
