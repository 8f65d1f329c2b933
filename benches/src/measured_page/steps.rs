//! The sections: what each asks, the commands that answer, and how the answer gets onto the page.

use clap::ValueEnum;
use cohaptic_benches::effort::Effort;
use cohaptic_benches::{machine, pages};

use crate::programs::{Measured, Programs};
use crate::{accuracy, campaign};

/// A section, in the order of the page.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, ValueEnum)]
pub(crate) enum Step {
    /// One run, many side by side, memory: also writes measured-speed.md
    Speed,
    /// Whole campaigns on one thread and on all
    Campaign,
    /// `cohaptic-accuracy`: speed against error, tables and plots
    Accuracy,
    /// Also writes measured-link.md
    Link,
    /// Also writes measured-samplers.md
    Samplers,
    /// Also writes measured-stability.md
    Stability,
    /// Also writes measured-testkit.md; needs the crates of others
    Testkit,
    /// Also writes measured-peers.md; needs the crates of others, and measures ns-3, SimPy and numpy where they are installed
    Peers,
}

/// A page of its own, from which tables are taken.
#[derive(Debug)]
struct Source {
    name: &'static str,
    /// The command that prints it.
    how: How,
    tables: &'static [Taken],
}

/// A heading, and which rows of the first table below it are taken.
type Taken = (&'static str, fn(&str) -> bool);

#[derive(Debug)]
enum How {
    /// A program of this package.
    Program(&'static str),
    /// A line for a shell; where its output goes, seen from there.
    Shell(&'static str, &'static str),
}

const ALL_ROWS: fn(&str) -> bool = |_| true;
const ENDS: fn(&str) -> bool = |row| row.contains("| 4096 steps |") || row.contains("| **draw** |");
const THREE_HOSTS: fn(&str) -> bool = |row| row.starts_with("| 3 | 8 |");
const TEN_PEERS: fn(&str) -> bool = |row| row.starts_with("| 10 |");

impl Step {
    pub(crate) const ALL: [Self; 8] =
        [Self::Speed, Self::Campaign, Self::Accuracy, Self::Link, Self::Samplers, Self::Stability, Self::Testkit, Self::Peers];

    /// As on the command line.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Campaign => "campaign",
            Self::Accuracy => "accuracy",
            Self::Link => "link",
            Self::Samplers => "samplers",
            Self::Stability => "stability",
            Self::Testkit => "testkit",
            Self::Peers => "peers",
        }
    }

    /// How long the whole step takes, on two cores and once it is built.
    pub(crate) const fn takes(self) -> &'static str {
        match self {
            Self::Link | Self::Samplers | Self::Testkit => "about a minute",
            Self::Speed | Self::Campaign | Self::Stability => "some minutes",
            Self::Accuracy => "up to ten minutes",
            Self::Peers => "some ten minutes",
        }
    }

    /// Returns whether it needs what may not be there.
    pub(crate) const fn is_optional(self) -> bool {
        matches!(self, Self::Testkit | Self::Peers)
    }

    pub(crate) const fn heading(self) -> &'static str {
        match self {
            Self::Speed => "## Runs",
            Self::Campaign => "## Whole campaigns",
            Self::Accuracy => "## Speed against error",
            Self::Link => "## One link",
            Self::Samplers => "## Random delays",
            Self::Stability => "## Verdicts on stability",
            Self::Testkit => "## The test kit",
            Self::Peers => "## Compared with others",
        }
    }

    /// The question, and what the tables are.
    const fn question(self) -> &'static str {
        match self {
            Self::Speed => {
                "How fast is one run, how far from the limit of the machine, what do many runs side by side gain, what do measures cost, and does memory grow with time? Simulated seconds per
second of processor time on one core, of N peers at 1 kHz who all hold the object; the *bare loop* does the same arithmetic by hand and nothing else. The
tables are described in [measured-speed.md](measured-speed.md)."
            }
            Self::Campaign => {
                "How many runs a second does [a campaign](campaign.md) make, from the scene to the table on the disk? Wall time, all of it: reading and checking the scene,
running, writing Parquet. A row is the median of some campaigns, each in an empty folder, in rounds in which all rows alternate; the tables that one thread and all threads
write are compared, and are the same to the byte."
            }
            Self::Accuracy => {
                "What does each method cost, and how wrong is it? Costs are measured, errors computed unless a note says otherwise; each method of a table has done the same work.
The methods that are compared, against which reference, and how to read it: [accuracy.md](accuracy.md). In the plots, further left is cheaper, further down more exact."
            }
            Self::Link => "What does a packet through one emulated link cost? The cost of each stage: [measured-link.md](measured-link.md).",
            Self::Samplers => {
                "What does a random delay cost, and how far is it from its law? Of each law, netem's table and the program's own draw; the ways between and what the columns
are: [measured-samplers.md](measured-samplers.md)."
            }
            Self::Stability => {
                "How many verdicts on stability a second? Equal peers along a map of two gains; maps, long delays and speed against error of each method:
[measured-stability.md](measured-stability.md)."
            }
            Self::Testkit => {
                "How fast and how exact is [the test kit](testing.md) compared with turmoil, on the same programs? Of three hosts that send a datagram every 8 ms; the others:
[measured-testkit.md](measured-testkit.md)."
            }
            Self::Peers => {
                "How fast is the same scene on what others wrote? Of ten peers; every program ends in the same state, to the bit unless the table says how far. 3 and 50 peers,
one link alone, a stability map, and what each of the others does not model: [measured-peers.md](measured-peers.md)."
            }
        }
    }

    fn source(self) -> Option<Source> {
        let source = |name, how, tables| Some(Source { name, how, tables });
        match self {
            Self::Speed => {
                let tables = &[
                    ("## A full mesh", ALL_ROWS),
                    ("## Queues and chains", ALL_ROWS),
                    ("## Many runs of one scene", ALL_ROWS),
                    ("## One scene on many threads", ALL_ROWS),
                    ("## Many peers", ALL_ROWS),
                    ("## Watched runs", ALL_ROWS),
                    ("## Measures", ALL_ROWS),
                    ("## Records", ALL_ROWS),
                    ("## Memory", ALL_ROWS),
                ];
                source("measured-speed.md", How::Program("speed-table"), tables)
            }
            Self::Link => source("measured-link.md", How::Program("link-table"), &[("# One link: speed", ALL_ROWS)]),
            Self::Samplers => source("measured-samplers.md", How::Program("samplers-table"), &[("# Samplers", ENDS)]),
            Self::Stability => source("measured-stability.md", How::Program("stability-table"), &[("## Equal peers, Td = Tn", ALL_ROWS)]),
            Self::Testkit => {
                let how = How::Shell("cd benches/peers && cargo run --release", "../../docs/");
                source("measured-testkit.md", how, &[("## Datagrams all the time", THREE_HOSTS)])
            }
            Self::Peers => {
                let line = "cd benches/peers && (cargo run --release --bin mesh-table && others/run)";
                source("measured-peers.md", How::Shell(line, "../../docs/"), &[("## A full mesh", TEN_PEERS), ("## In other languages", TEN_PEERS)])
            }
            Self::Campaign | Self::Accuracy => None,
        }
    }

    /// The commands that a reader can type.
    pub(crate) fn commands(self, effort: Effort) -> Vec<String> {
        match (self, self.source()) {
            (_, Some(source)) => vec![source.command(effort)],
            (Self::Campaign, None) => campaign::commands(effort),
            (_, None) => vec![accuracy::command(effort)],
        }
    }

    /// Does it.
    pub(crate) fn measure(self, programs: &Programs) -> Result<Measured, String> {
        match (self, self.source()) {
            (_, Some(source)) => source.measure(programs),
            (Self::Campaign, None) => campaign::measure(programs),
            (_, None) => accuracy::measure(programs),
        }
    }

    /// The first lines of the section: the question, and the commands.
    pub(crate) fn head(self, effort: Effort) -> String {
        let commands: String = self.commands(effort).iter().map(|command| format!("    {command}\n")).collect();
        format!("{}\n\n{}\n\n{commands}", self.heading(), self.question())
    }

    /// The whole section.
    pub(crate) fn section(self, programs: &Programs, body: &str) -> String {
        format!("{}\nMeasured on {}.\n\n{body}", self.head(programs.effort), machine::line())
    }
}

impl Source {
    fn command(&self, effort: Effort) -> String {
        match self.how {
            How::Program(program) => format!("{} > docs/{}", effort.command(program), self.name),
            How::Shell(line, docs) => format!("{line} > {docs}{}", self.name),
        }
    }

    fn measure(&self, programs: &Programs) -> Result<Measured, String> {
        let page = match self.how {
            How::Program(program) => programs.table(program)?,
            How::Shell(line, _) => programs.shell(line)?,
        };
        Ok(Measured { body: self.tables(&page)?, files: vec![(self.name.into(), page)] })
    }

    /// The tables, each below its heading, if there are several; and what the page says that it could not measure.
    fn tables(&self, page: &str) -> Result<String, String> {
        let mut parts = Vec::new();
        for (heading, wanted) in self.tables {
            let table =
                pages::table(page, heading, wanted).ok_or_else(|| format!("what was printed for {} has no table below {heading:?}", self.name))?;
            parts.push(if self.tables.len() == 1 { table } else { format!("### {}\n\n{table}", heading.trim_start_matches(['#', ' '])) });
        }
        parts.extend(page.lines().filter(|line| line.contains(": skipped. ")).map(|line| format!("{line}\n")));
        Ok(parts.join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_are_those_of_the_command_line() {
        for step in Step::ALL {
            assert_eq!(Step::from_str(step.name(), false), Ok(step));
        }
        assert_eq!(Step::value_variants(), Step::ALL);
    }

    #[test]
    fn what_a_page_could_not_measure_is_said_here_too() {
        let source = Step::Peers.source().unwrap();
        let page = "## A full mesh\n\n| peers |\n| --- |\n| 3 | a |\n| 10 | b |\n\n## In other languages\n\n| peers |\n| --- |\n| 10 | c |\n\nns-3: skipped. There is no compiler\n";
        let tables = source.tables(page).unwrap();
        assert_eq!(
            tables,
            "### A full mesh\n\n| peers |\n| --- |\n| 10 | b |\n\n### In other languages\n\n| peers |\n| --- |\n| 10 | c |\n\nns-3: skipped. There is no compiler\n"
        );
        assert!(source.tables("## A full mesh\n\nNothing.\n").is_err_and(|why| why.contains("measured-peers.md")));
    }

    /// The pages as they lie in `docs/`: were a heading or the first column of a table changed, a step would find out only after hours.
    #[test]
    fn the_tables_that_are_taken_are_in_the_pages() {
        for step in Step::ALL.into_iter().filter(|&step| step != Step::Speed) {
            let Some(source) = step.source() else { continue };
            let page = std::fs::read_to_string(Programs::root().join("docs").join(source.name)).unwrap();
            assert!(pages::commands(&page).contains(&source.command(Effort::Full).as_str()), "{step:?}");
            source.tables(&page).unwrap();
        }
    }
}
