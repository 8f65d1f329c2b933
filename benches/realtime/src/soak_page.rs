//! The soak: `cargo run --profile dist -p cohaptic-benches-realtime --bin soak -- [DURATION] [--every SPAN] [--out FILE.md]`. An hour, unless told otherwise; Ctrl-C ends it early, with
//! what was seen until then. With `--flooded` it starts the program `cohaptic` that lies beside this one, floods its ports, and writes the last section of the
//! page.
#![allow(clippy::print_stdout, reason = "printing the table is what this program is for")]

use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use cohaptic_benches_realtime::machine;
use cohaptic_benches_realtime::soak::flooded::{self, FloodedPlan, HEADING};
use cohaptic_benches_realtime::soak::{HEADER, Judgement, Outcome, SoakPlan, Verdict, judge, run};
use cohaptic_units::parse;

const USAGE: &str = "expected: soak [DURATION] [--flooded] [--every SPAN] [--out FILE.md], with spans such as 90s, 10min or 1h";

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Arguments { duration, every, out, is_flooded } = read(&arguments)?;
    let interrupted = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&interrupted);
    ctrlc::set_handler(move || {
        if asked.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })?;
    let command = arguments.join(" ");
    let every = every.unwrap_or_else(|| Duration::from_secs(if is_flooded { 1 } else { 60 }));
    let judgements = if is_flooded {
        let plan = FloodedPlan { duration, every, program: flooded::program_beside_this_one()?, rate: RATE, priority: true };
        let outcome = flooded::run(&plan, &interrupted, print)?;
        let judgements = flooded::judge(&outcome);
        let lines: Vec<String> = verdicts(&judgements).collect();
        let command = format!("{BUILD} && {RUN} -- {command}");
        let section = flooded::section(&plan, &outcome, &lines, &command, &today())?;
        out.map_or(Ok(()), |file| write(&file, |before, _| format!("{}\n\n{section}", before.trim_end())))?;
        judgements
    } else {
        println!("{HEADER}");
        let plan = SoakPlan::new(duration, every);
        let outcome = run(&plan, &interrupted, print)?;
        let judgements = judge(&outcome);
        let page = page(&plan, &outcome, &judgements, &command)?;
        out.map_or(Ok(()), |file| write(&file, |_, section| if section.is_empty() { page } else { format!("{page}\n{section}") }))?;
        judgements
    };
    println!();
    for line in verdicts(&judgements) {
        println!("{line}");
    }
    let is_broken = judgements.iter().any(|judgement| judgement.verdict == Verdict::Broken);
    Ok(if is_broken { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// The commands on the page.
const BUILD: &str = "cargo build --profile dist -p cohaptic-cli";
const RUN: &str = "cargo run --profile dist -p cohaptic-benches-realtime --bin soak";

/// Recorded hellos a second of a flooded soak: what once shut a session.
const RATE: u32 = 9_700;

/// Somebody may read it in a file while it grows.
fn print(row: &impl std::fmt::Display) {
    println!("{row}");
    let _ = std::io::stdout().flush();
}

/// Writes a file anew: `make` is given what stands in it before the section on floods, and that section.
fn write(file: &Path, make: impl FnOnce(&str, &str) -> String) -> Result<(), String> {
    let failed = |error| format!("{}: {error}", file.display());
    let text = match std::fs::read_to_string(file) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
        read => read.map_err(failed)?,
    };
    let (before, section) = split(&text);
    std::fs::write(file, make(before, section)).map_err(failed)
}

/// The text before the section on floods, and that section, which is the last one.
fn split(text: &str) -> (&str, &str) {
    text.split_at(text.find(&format!("\n{HEADING}")).map_or(text.len(), |at| at + 1))
}

struct Arguments {
    duration: Duration,
    every: Option<Duration>,
    out: Option<PathBuf>,
    is_flooded: bool,
}

fn read(arguments: &[String]) -> Result<Arguments, Box<dyn Error>> {
    let mut read = Arguments { duration: Duration::from_secs(3600), every: None, out: None, is_flooded: false };
    let span = |text: &str| match parse::duration(text) {
        Ok(span) if !span.is_zero() => Ok(span),
        Ok(_) => Err(format!("\"{text}\" is no time at all; {USAGE}")),
        Err(error) => Err(format!("\"{text}\": {error}; {USAGE}")),
    };
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--every" => read.every = Some(span(rest.next().ok_or(USAGE)?)?),
            "--flooded" => read.is_flooded = true,
            "--out" => read.out = Some(rest.next().ok_or(USAGE)?.into()),
            text if text.starts_with('-') => return Err(format!("\"{text}\" is not known; {USAGE}").into()),
            text => read.duration = span(text)?,
        }
    }
    Ok(read)
}

fn verdicts(judgements: &[Judgement]) -> impl Iterator<Item = String> {
    judgements.iter().map(|Judgement { rule, verdict, why }| {
        let verdict = match verdict {
            Verdict::Kept => "kept",
            Verdict::Broken => "**broken**",
            Verdict::Skipped => "skipped",
        };
        format!("- *{rule}*: {verdict}. {why}.")
    })
}

fn page(plan: &SoakPlan, outcome: &Outcome, judgements: &[Judgement], command: &str) -> Result<String, std::fmt::Error> {
    let mut page = String::new();
    let span = |span: Duration| cohaptic_units::print::Span(span).to_string();
    writeln!(page, "# A soak\n")?;
    writeln!(page, "A live session and a relay beside each other in one process, for {}. This page is written by\n", span(plan.duration))?;
    writeln!(page, "    {RUN} -- {command}\n")?;
    writeln!(page, "and measured on: {}; {}.\n", machine::name(), today())?;
    writeln!(
        page,
        "- The session, at 1 kHz: three simulated peers and one in another program, played by a thread that speaks the [protocol](live-protocol.md) over loopback, with a key. It stays for\n  {}, is away for {}, and joins again from another port. Every peer sends 125 samples a second; links: 24 ms ± 2 ms, 1 % loss.",
        span(plan.stay),
        span(plan.away)
    )?;
    writeln!(
        page,
        "- The [relay](relay.md), as a proxy over loopback: 1000 packets of 64 bytes a second through the same link, from one thread to another.\n"
    )?;
    match outcome.refused.as_slice() {
        [] => {
            writeln!(page, "Session and relay had `SCHED_FIFO`; memory was not locked, since that would count as memory in use, touched or not.\n")?
        }
        refused => writeln!(page, "Session and relay had to do without: {}.\n", refused.join("; "))?,
    }
    if outcome.interrupted {
        writeln!(page, "Somebody ended it after {:.0} s.\n", outcome.elapsed.as_secs_f64())?;
    }
    writeln!(page, "## Verdict\n")?;
    for line in verdicts(judgements) {
        writeln!(page, "{line}")?;
    }
    writeln!(page, "\n## Every look\n")?;
    writeln!(
        page,
        "Means are those since the look before, quantiles those since the beginning. *Wall − logical* is `CLOCK_MONOTONIC` since the session began, less its logical time, over the looks\nsince the row before, 16 a second; *behind* says at how many of them it was a tick or more, which is lateness as long as it goes away. The last row was made when nobody sent any\nmore and nothing was on its way from the visitor or in the relay.\n"
    )?;
    writeln!(page, "{HEADER}")?;
    for row in &outcome.rows {
        writeln!(page, "{row}")?;
    }
    writeln!(page, "\n## Accounts at the end\n")?;
    for account in &outcome.accounts {
        writeln!(page, "- {account}")?;
    }
    Ok(page)
}

fn today() -> String {
    date(SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs() / 86_400)
}

/// The date a number of days after the beginning of 1970, as in 2025-03-01: by the rule of the calendar, a leap year every four years but for three of four centuries.
fn date(days: u64) -> String {
    // Counted from the first of March of year 0, so that the leap day is the last of its year.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day_of_month = day - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    format!("{}-{month:02}-{day_of_month:02}", era * 400 + year + next)
}

#[cfg(test)]
mod tests {
    use super::{date, split};

    #[test]
    fn the_section_on_floods_is_the_last_part_of_its_page() {
        assert_eq!(split("# A soak\n\ntext\n\n## Under floods\n\nmore\n"), ("# A soak\n\ntext\n\n", "## Under floods\n\nmore\n"));
        assert_eq!(split("# A soak\n\ntext\n"), ("# A soak\n\ntext\n", ""));
    }

    #[test]
    fn days_are_dates() {
        // 30 years have 7 leap days from 1972 to 1996; 54 years have 13.
        let known = [
            (0, "1970-01-01"),
            (30 * 365 + 7 + 59, "2000-02-29"),
            (30 * 365 + 7 + 60, "2000-03-01"),
            (54 * 365 + 13 + 59, "2024-02-29"),
            (55 * 365 + 14 + 364, "2025-12-31"),
        ];
        for (days, expected) in known {
            assert_eq!(date(days), expected);
        }
    }

    #[test]
    fn no_day_is_left_out_and_none_comes_twice() {
        let days: Vec<String> = (0..200_000).map(date).collect();
        assert!(days.is_sorted_by(|before, after| before < after));
    }
}
