//! `tokio` and `test`: existing programs on the test kit.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;

use super::examples::{self, after};

#[derive(Debug, Args)]
#[command(after_help = after(examples::TOKIO))]
pub(crate) struct TokioArguments {
    /// The folder of the workspace with the tests [default: sim, or else the workspace itself]
    #[arg(long, value_name = "FOLDER")]
    pub(crate) sim: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::TEST))]
pub(crate) struct TestArguments {
    /// Arguments of cargo test, as they would be without cohaptic. The variable COHAPTIC_TEST_LOOPBACK='delay 20ms loss 1%' gives the tests a loopback with these
    /// words of tc-netem
    #[arg(value_name = "ARGS", trailing_var_arg = true, allow_hyphen_values = true)]
    pub(crate) arguments: Vec<OsString>,
}
