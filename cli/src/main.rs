//! The command `foible`: see `foible --help`.

fn main() -> std::process::ExitCode {
    foible_cli::command::main()
}
