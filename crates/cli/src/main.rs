//! `cohaptic`: runs, checks, explains and analyses scenes of people who move one object together over a bad network, in virtual time and by the
//! wall clock; drives and estimates links; reproduces a paper; sets speed against error.
//!
//! This is the only crate that prints. Results go to standard output, everything else to standard error. Exit status: 0 done, 1 an expectation
//! failed, 2 a bad argument or scene, 3 an input or output error, 130 interrupted.

mod accuracy;
mod admittance;
mod arguments;
mod campaign;
mod check;
mod documents;
mod explain;
mod failure;
mod falcon;
mod fit;
mod interrupt;
mod link;
mod live;
mod output;
mod output_file;
mod paper;
mod progress;
mod realtime;
mod relay;
mod router;
mod run;
mod stability;
mod terminal_plot;
mod variants;

use std::process::ExitCode;

use clap::Parser as _;

use arguments::{Arguments, Command};

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    interrupt::listen();
    let done = match arguments.command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Check(arguments) => check::check(&arguments),
        Command::Explain(arguments) => explain::explain(&arguments),
        Command::Campaign(arguments) => campaign::campaign(&arguments),
        Command::Stability(arguments) => stability::stability(&arguments),
        Command::Admittance(arguments) => admittance::admittance(&arguments),
        Command::Live(arguments) => live::live(&arguments),
        Command::Relay(arguments) => relay::relay(&arguments),
        Command::Router(arguments) => router::router(&arguments),
        Command::Falcon(arguments) => falcon::falcon(&arguments),
        Command::Link(arguments) => link::link(&arguments),
        Command::Fit(arguments) => fit::fit(&arguments),
        Command::Paper(arguments) => paper::paper(&arguments),
        Command::Accuracy(arguments) => accuracy::accuracy(&arguments),
    };
    match done {
        Ok(code) => code,
        Err(failure) => failure.report(),
    }
}
