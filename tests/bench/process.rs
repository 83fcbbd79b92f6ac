//! What a process costs.

use nix::sys::resource::{UsageWho, getrusage};
use std::process::{Command, Stdio};
use std::time::Instant;

/// Wall and processor seconds of one run.
pub fn run(words: &[String]) -> (f64, f64) {
    let cpu = || {
        let r = getrusage(UsageWho::RUSAGE_CHILDREN).expect("the system counts");
        let seconds = |t: nix::sys::time::TimeVal| t.tv_sec() as f64 + t.tv_usec() as f64 * 1e-6;
        seconds(r.user_time()) + seconds(r.system_time())
    };
    let (before, start) = (cpu(), Instant::now());
    let mut command = Command::new(&words[0]);
    let done = command.args(&words[1..]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    let wall = start.elapsed().as_secs_f64();
    assert!(done.is_ok_and(|s| s.success()), "{words:?} failed");
    (wall, cpu() - before)
}
