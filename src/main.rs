//! The program `sinew`: see `sinew --help`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
