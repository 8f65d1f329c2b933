//! The arguments of `cohaptic-accuracy`.

use std::path::PathBuf;

use clap::Parser;
use cohaptic_accuracy::{Options, Subject};
use cohaptic_picture::Size;

const AFTER_HELP: &str = "Examples:
  cohaptic-accuracy --quick
  cohaptic-accuracy --only motion,time --out accuracy

Exit status: 0 done, 2 a bad argument, 3 an input or output error, 130 interrupted, 141 standard output was closed.";

/// Measures what every method costs and how wrong it is, on the same work.
///
/// Ctrl-C ends the measurement and keeps the rows measured so far. Leave the machine alone meanwhile.
#[derive(Debug, Parser)]
#[command(name = "cohaptic-accuracy", version, after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Write index.html, the plots (SVG) and rows.csv into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// The size of pictures: one-column or two-columns of a paper, page, WIDTHxHEIGHT in pixels (960x400) or millimetres (85x60mm) [default: page]
    #[arg(long, value_name = "SIZE", requires = "out")]
    size: Option<Size>,
    /// Fewer settings and less work: under a minute
    #[arg(long)]
    pub(crate) quick: bool,
    /// Only these: motion, rotation, time, network, analysis, real-time
    #[arg(long, value_name = "SUBJECT", value_delimiter = ',', value_parser = subject)]
    only: Vec<Subject>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

impl Arguments {
    /// Returns the subjects to measure: all of them unless some are named.
    pub(crate) fn subjects(&self) -> &[Subject] {
        if self.only.is_empty() { &Subject::ALL } else { &self.only }
    }

    /// Returns the effort of the measurement.
    pub(crate) const fn options(&self) -> Options {
        Options { quick: self.quick }
    }

    /// Returns the size of the plots.
    pub(crate) fn size(&self) -> Size {
        self.size.unwrap_or_default()
    }

    /// Returns the command line that measures the same rows, without the options that only say where the rows go.
    pub(crate) fn command(&self) -> String {
        let mut command = "cohaptic-accuracy".to_owned();
        if self.quick {
            command.push_str(" --quick");
        }
        if !self.only.is_empty() {
            let names: Vec<&str> = self.only.iter().map(|subject| subject.name()).collect();
            command.push_str(" --only ");
            command.push_str(&names.join(","));
        }
        command
    }
}

fn subject(text: &str) -> Result<Subject, String> {
    Subject::ALL.into_iter().find(|subject| subject.name() == text).ok_or_else(|| {
        let names = Subject::ALL.map(Subject::name).join(", ");
        format!("there is no such subject; expected one of {names}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_names_every_subject() {
        let names = Subject::ALL.map(Subject::name).join(", ");
        let help = <Arguments as clap::CommandFactory>::command().render_long_help().to_string();
        assert!(help.contains(&format!("Only these: {names}")), "{help}");
    }

    #[test]
    fn the_command_names_what_is_measured_and_not_where_it_goes() {
        for (line, command) in [
            ("cohaptic-accuracy --out x --json", "cohaptic-accuracy"),
            ("cohaptic-accuracy --only time,motion --quick", "cohaptic-accuracy --quick --only time,motion"),
        ] {
            assert_eq!(Arguments::try_parse_from(line.split(' ')).unwrap().command(), command);
        }
    }
}
