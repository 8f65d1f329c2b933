//! Writes `docs/measured.md` and the pages that have a program of their own: `benches/measure`, which builds the programs first.
#![allow(clippy::print_stderr, reason = "a line for each step is what people look at while it runs")]

mod accuracy;
mod campaign;
mod page;
mod programs;
mod steps;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use cohaptic_benches::effort::Effort;
use cohaptic_files::write_whole;

use page::Page;
use programs::{Measured, Programs};
use steps::Step;

fn main() -> ExitCode {
    match measure(&Arguments::parse()) {
        Ok(failed) if failed.is_empty() => ExitCode::SUCCESS,
        Ok(failed) => {
            eprintln!("error: not measured: {}; what the page said of it before still stands", failed.join(", "));
            ExitCode::FAILURE
        }
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::FAILURE
        }
    }
}

/// Does the steps that are asked for, each of which is on the page as soon as it is done. Gives the names of those that failed.
fn measure(arguments: &Arguments) -> Result<Vec<&'static str>, String> {
    let (docs, effort, steps) = (&arguments.into, arguments.effort(), arguments.steps());
    let file = docs.join("measured.md");
    // Found out before hours of work: a page that this program has not written.
    let mut page = read(&file)?;
    let programs = Programs::beside_this_one(effort)?;
    let mut failed = Vec::new();
    for (number, &step) in steps.iter().enumerate() {
        eprintln!("[{}/{}] {} ({})", number + 1, steps.len(), step.name(), step.takes());
        let start = Instant::now();
        let measured = match step.measure(&programs) {
            Ok(measured) => measured,
            Err(why) if step.is_optional() => {
                eprintln!("      {why}\n      which the page says");
                Measured::nothing(&why)
            }
            Err(why) => {
                eprintln!("      {why}");
                failed.push(step.name());
                continue;
            }
        };
        for (path, content) in &measured.files {
            write(&docs.join(path), content)?;
        }
        page.set(step, step.section(&programs, &measured.body));
        write(&file, &page.text())?;
        eprintln!("      done in {:.1} s", start.elapsed().as_secs_f64());
    }
    Ok(failed)
}

/// Writes a file, and makes the folder for it.
fn write(path: &Path, content: &str) -> Result<(), String> {
    let written = path.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| write_whole(path, |file| file.write_all(content.as_bytes())));
    written.map_err(|error| format!("cannot write {}: {error}", path.display()))
}

fn read(file: &Path) -> Result<Page, String> {
    match fs::read_to_string(file) {
        Ok(text) => Page::parse(&text).map_err(|why| format!("{}: {why}", file.display())),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Page::default()),
        Err(error) => Err(format!("cannot read {}: {error}", file.display())),
    }
}

/// Measures, and writes docs/measured.md and the pages beside it.
///
/// Each step is on the page as soon as it is done, with its own date; steps that are not named keep what the page says of them. A step that fails changes
/// nothing. Pages of figures that need a quiet machine and privileges are not written: measured-relay.md, measured-live.md, measured-devices.md, measured-floods.md, measured-tcp.md, measured-soak.md, measured-first.md and measured-fuzz.md name their own commands.
#[derive(Debug, Parser)]
#[command(name = "benches/measure", version)]
pub(crate) struct Arguments {
    /// Only these [default: all]
    #[arg(value_enum, value_name = "STEP")]
    only: Vec<Step>,
    /// Fewer rounds and less work, some minutes in all; testkit and peers have no shorter form
    #[arg(long)]
    quick: bool,
    /// The least work that prints every row: figures that say nothing. For tests
    #[arg(long, conflicts_with = "quick")]
    smoke: bool,
    /// The folder that the pages are written to
    #[arg(long, value_name = "DIR", default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs"))]
    pub(crate) into: PathBuf,
}

impl Arguments {
    pub(crate) const fn effort(&self) -> Effort {
        match (self.quick, self.smoke) {
            (_, true) => Effort::Smoke,
            (true, false) => Effort::Quick,
            (false, false) => Effort::Full,
        }
    }

    /// In the order of the page, each once.
    pub(crate) fn steps(&self) -> Vec<Step> {
        Step::ALL.into_iter().filter(|step| self.only.is_empty() || self.only.contains(step)).collect()
    }
}
