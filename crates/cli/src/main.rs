//! `cohaptic`: see the [library](cohaptic_cli).

use std::process::ExitCode;

fn main() -> ExitCode {
    cohaptic_cli::main()
}
