//! Runs scene files by the command `foible`: `cargo run --release --example scene -- [--out DIR] [FILE…]`, the same as
//! `cargo run --release -p foible-cli -- run …`.
//!
//! A call of cargo, not a dependency: that would switch features of the crate on in its own tests.

use std::process::{Command, ExitCode};

fn main() -> ExitCode {
    let mut command = Command::new(env!("CARGO"));
    command.args(["run", "--release", "--quiet", "--manifest-path"]);
    command.args([concat!(env!("CARGO_MANIFEST_DIR"), "/cli/Cargo.toml"), "--", "run"]);
    match command.args(std::env::args().skip(1)).status() {
        Ok(status) => ExitCode::from(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1)),
        Err(error) => {
            eprintln!("cargo: {error}");
            ExitCode::FAILURE
        }
    }
}
