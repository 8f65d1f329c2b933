//! Writes `docs/measured.md` and the pages that have a program of their own: `benches/measure`, which builds the programs first.
#![allow(clippy::print_stderr, reason = "a line for each step is what people look at while it runs")]

mod accuracy;
mod arguments;
mod campaign;
mod page;
mod programs;
mod steps;

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use arguments::Arguments;
use clap::Parser as _;
use cohaptic_files::write_whole;
use page::Page;
use programs::{Measured, Programs};

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
