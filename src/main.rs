//! The `softvt` command: everything it does is in [`softvt::cli`].

fn main() -> std::process::ExitCode {
    softvt::cli::main()
}
