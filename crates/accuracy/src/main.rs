//! `cohaptic-accuracy`: measures cost and error of every method of this project, and presents the rows of the library as tables, plots, a page, or JSON.
//!
//! Results go to standard output, everything else to standard error. Exit status: 0 done, 2 a bad argument, 3 an input or output error, 130 interrupted,
//! 141 standard output was closed.

mod program;

use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    match program::Arguments::try_parse() {
        Ok(arguments) => program::run(&arguments),
        Err(error) => program::usage(&error),
    }
}
