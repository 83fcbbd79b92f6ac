//! Files whose bytes must not change unseen: `BLESS=1` rewrites their hashes, and fails that run.

use crate::cli::{sinew, text};
use sinew::io::manifest::sha256;
use std::path::Path;

/// `sha256 ending arguments` a line.
const LIST: &str = "tests/golden.txt";

#[test]
fn the_same_command_gives_the_bytes_it_always_gave() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let list = std::fs::read_to_string(root.join(LIST)).expect(LIST);
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (mut found, mut faults, mut count) = (String::new(), vec![], 0);
    for line in list.lines() {
        let mut words = line.split_whitespace();
        let (Some(hash), Some(ending)) = (words.next(), words.next()) else { continue };
        if hash == "#" {
            found += &format!("{line}\n");
            continue;
        }
        let args: Vec<&str> = words.collect();
        count += 1;
        let one = draw(root, dir.path(), ending, &args, "1");
        assert!(one == draw(root, dir.path(), ending, &args, "2"), "{line}: depends on the threads");
        if one != hash {
            faults.push(format!("{ending} {}: expected {hash}, found {one}", args.join(" ")));
        }
        found += &format!("{one} {ending} {}\n", args.join(" "));
    }
    assert!(count >= 15, "{count} commands are left of fifteen");
    if std::env::var_os("BLESS").is_some() && !faults.is_empty() {
        std::fs::write(root.join(LIST), found).expect(LIST);
    }
    assert!(faults.is_empty(), "BLESS=1 rewrites {LIST} if this is meant:\n{}", faults.join("\n"));
}

/// Hash of the file that a command writes.
fn draw(root: &Path, dir: &Path, ending: &str, args: &[&str], threads: &str) -> String {
    let out = dir.join(format!("out.{ending}"));
    let [input, rest @ ..] = args else { panic!("a line without an input") };
    let input = root.join(input);
    let mut all = vec!["render", input.to_str().expect("UTF-8"), "-o", out.to_str().expect("UTF-8")];
    all.extend(["-f", "-q", "--threads", threads]);
    all.extend(rest);
    let done = sinew(&all);
    assert!(done.status.success(), "{all:?}: {}", text(&done.stderr));
    sha256(&std::fs::read(out).expect("written"))
}
