//! `cohaptic tokio` and `cohaptic test`: a package `tokio` that stands in for tokio, for tests of programs that nobody changes.
//!
//! `workspace` asks cargo about the workspace of the user, `sources` gets the sources of tokio from cargo, `package` writes the packages, of which `loopback`
//! describes one, and `test` calls `cargo test` with the package in the place of tokio. The sources of the package lie in the folder `tokio`.

mod cargo;
mod files;
mod loopback;
mod package;
mod sources;
mod test;
mod workspace;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use crate::arguments::{TestArguments, TokioArguments};
use crate::failure::Failure;
use crate::output;
use workspace::Workspace;

/// Generates the package for the workspace of the current folder.
pub(crate) fn tokio(arguments: &TokioArguments) -> Result<ExitCode, Failure> {
    let workspace = Workspace::here(arguments.sim.as_deref())?;
    let (version, package) = generate(&workspace)?;
    output::text(&format!(
        "tokio {version} for tests: {}\nIn the Cargo.toml of the workspace with the tests:\n\n[patch.crates-io]\ntokio = {{ path = {} }}\n",
        output::path(&package),
        toml::Value::String(workspace.patch(&package)),
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Runs `cargo test` with the package in the place of tokio.
pub(crate) fn test(arguments: &TestArguments) -> Result<ExitCode, Failure> {
    test::run(&with_dashes(&arguments.arguments, std::env::args_os().collect()))
}

/// Returns the arguments of `cargo test` among `all` arguments of this program, of which `read` were read as such. The parser of arguments takes two dashes
/// before the first of these as its own, which are meant for cargo: `cohaptic test -- --nocapture`.
fn with_dashes(read: &[OsString], mut all: Vec<OsString>) -> Vec<OsString> {
    let begin = all.len().saturating_sub(read.len());
    let has_dashes = begin > 0 && all[begin - 1] == "--";
    all.split_off(begin - usize::from(has_dashes))
}

/// Generates the package. Returns the version of tokio, and the folder of the package.
fn generate(workspace: &Workspace) -> Result<(String, PathBuf), Failure> {
    let sources = sources::find(workspace, workspace.tokio()?.as_deref())?;
    let package = package::write(workspace, &sources)?;
    Ok((sources.version, package))
}
