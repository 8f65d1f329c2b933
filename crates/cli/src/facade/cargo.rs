//! Calls of cargo.

use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::failure::Failure;

/// Returns a call of cargo, in the folder `folder`. The variable `CARGO` names another cargo, as cargo itself sets it for its subcommands.
pub(super) fn cargo(folder: &Path) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo")));
    command.current_dir(folder);
    command
}

/// Returns what `cargo metadata` prints. `purpose` completes the message of a failure.
pub(super) fn metadata(folder: &Path, arguments: &[&str], purpose: &str) -> Result<Value, Failure> {
    let mut command = cargo(folder);
    let output = command.args(["metadata", "--format-version", "1"]).args(arguments).output().map_err(|error| missing(&error))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(Failure::Input(format!("{purpose}: cargo metadata says:\n{}", said.trim_end())));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| Failure::System(format!("{purpose}: what cargo metadata prints is no JSON: {error}")))
}

/// Returns the failure of a cargo that cannot be called.
pub(super) fn missing(error: &std::io::Error) -> Failure {
    Failure::System(format!("cargo cannot be called: {error}. Expected cargo, which comes with Rust, in a folder of PATH"))
}
