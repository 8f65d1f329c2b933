//! `cohaptic`: runs, checks, explains and analyses scenes of people who move an object together over a bad network, in virtual time and by the wall clock;
//! drives and estimates links; reproduces a paper.
//!
//! This program alone prints the results of the libraries, apart from `cohaptic-accuracy`. Results go to standard output, everything else to standard error.
//! Exit status: 0 done, 1 an expectation failed, 2 a bad argument or scene, 3 an input or output error, 130 interrupted, 141 standard output was closed.
//!
//! Use this crate as a program, after `cargo install cohaptic-cli`. All of the program is a library with a single function, because cargo compiles a library
//! beside the libraries on which it depends, and a program only after them:
//!
//! ```
//! # fn program() -> std::process::ExitCode {
//! cohaptic_cli::main()
//! # }
//! ```
#![expect(non_camel_case_types, reason = "`document!` makes a type parameter of each key")]
#![cfg_attr(not(target_os = "linux"), allow(dead_code, unused_imports, reason = "the commands that need Linux use them"))]
#![cfg_attr(not(all(feature = "falcon", feature = "inverse3")), allow(dead_code, unused_imports, reason = "the commands of devices use them"))]

mod admittance;
mod analysis_watch;
mod arguments;
mod campaign;
mod check;
mod compare;
mod completions;
#[cfg(target_os = "linux")]
mod device_text;
mod document_schema;
#[cfg(not(all(target_os = "linux", feature = "falcon", feature = "inverse3")))]
mod elsewhere;
#[cfg(target_os = "linux")]
mod exec;
mod expectations;
mod explain;
mod facade;
mod failure;
#[cfg(all(target_os = "linux", feature = "falcon"))]
mod falcon;
mod file;
mod fit;
mod init;
mod input;
mod interrupt;
#[cfg(all(target_os = "linux", feature = "inverse3"))]
mod inverse3;
#[cfg(target_os = "linux")]
mod join;
mod link;
#[cfg(target_os = "linux")]
mod live;
mod output;
mod paper;
#[cfg(target_os = "linux")]
mod play;
mod progress;
#[cfg(target_os = "linux")]
mod push;
mod realtime;
#[cfg(target_os = "linux")]
mod relay;
mod report;
#[cfg(target_os = "linux")]
mod router;
mod run;
mod shard;
mod shell;
mod stability;
mod streams;
mod study;
mod texts;
mod variants;

use std::process::ExitCode;

use arguments::{Arguments, Command};
#[cfg(not(all(target_os = "linux", feature = "falcon")))]
use elsewhere::falcon;
#[cfg(not(all(target_os = "linux", feature = "inverse3")))]
use elsewhere::inverse3;
#[cfg(not(target_os = "linux"))]
use elsewhere::{exec, join, live, play, relay, router};

/// Runs the command in the arguments of this process, and returns the exit status.
#[must_use]
pub fn main() -> ExitCode {
    // A process of `exec` inside its namespaces has arguments of its own, and must not have a second thread.
    #[cfg(target_os = "linux")]
    if let Some(ended) = cohaptic_exec::run_inside() {
        return ended;
    }
    // `--json` is looked for before the arguments are parsed, because a refused argument is answered with a document too. Words after `--` are no options.
    if std::env::args_os().skip(1).take_while(|argument| argument != "--").any(|argument| argument == "--json") {
        output::want_json();
    }
    let arguments = match Arguments::of(std::env::args_os()) {
        Ok(arguments) => arguments,
        Err(error) => {
            // `exec` has the status of its command, so that each failure of its own has one and the same status.
            let is_of_exec =
                std::env::args_os().skip(1).find(|argument| !argument.as_encoded_bytes().starts_with(b"-")).is_some_and(|name| name == "exec");
            let fault_status = if is_of_exec { failure::EXEC_FAILED } else { failure::BAD_INPUT };
            return report::wrong_usage(&report::visible(error), fault_status);
        }
    };
    if arguments.quiet {
        output::be_quiet();
    }
    // Signals belong to the command that `exec` runs, so that this program does not listen to them. After the parsing of arguments: until here Ctrl-C ends the
    // program at once, and nothing has been begun.
    if !matches!(arguments.command, Command::Exec(_)) {
        interrupt::listen();
    }
    let done = match arguments.command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Check(arguments) => check::check(&arguments),
        Command::Explain(arguments) => explain::explain(&arguments),
        Command::Campaign(arguments) => campaign::campaign(&arguments),
        Command::Compare(arguments) => compare::compare(&arguments),
        Command::Stability(arguments) => stability::stability(&arguments),
        Command::Admittance(arguments) => admittance::admittance(&arguments),
        Command::Live(arguments) => live::live(&arguments),
        Command::Join(arguments) => join::join(&arguments),
        Command::Play(arguments) => play::play(&arguments),
        Command::Study(arguments) => study::study(&arguments),
        Command::Relay(arguments) if arguments.tcp => streams::relay(&arguments),
        Command::Relay(arguments) => relay::relay(&arguments),
        Command::Router(arguments) => router::router(&arguments),
        Command::Exec(arguments) => return exec::exec(&arguments),
        Command::Tokio(arguments) => facade::tokio(&arguments),
        Command::Test(arguments) => facade::test(&arguments),
        Command::Falcon(arguments) => falcon::falcon(&arguments),
        Command::Inverse3(arguments) => inverse3::inverse3(&arguments),
        Command::Link(arguments) => link::link(&arguments),
        Command::Fit(arguments) => fit::fit(&arguments),
        Command::Paper(arguments) => paper::paper(&arguments),
        Command::Init(arguments) => init::init(&arguments),
        Command::Schema(arguments) => texts::schema(&arguments),
        Command::Completions(arguments) => completions::completions(&arguments),
        Command::Man(arguments) => texts::man(&arguments),
    };
    match done {
        // A command that ends by a signal has the status of an interruption, whatever its own status is.
        Ok(_) if interrupt::requested() => ExitCode::from(failure::INTERRUPTED),
        Ok(code) => code,
        Err(failure) => report::report(&failure),
    }
}
