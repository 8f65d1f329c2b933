//! `docs/measured.md`: a section for each step, some of them from an earlier day.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use cohaptic_benches::effort::Effort;
use cohaptic_benches::machine;

use crate::steps::Step;

const HEAD: &str = "# Measured

How fast, how exact, on which machine, by which command. This page is written by

    benches/measure

which also writes the pages of single parts that it names. With the name of a section it does only that one (`benches/measure speed accuracy`) and leaves the
others as they are, so every section has its own date and machine. Commands are typed in the folder of the project; `cohaptic` stands for `target/dist/cohaptic`, which
`cargo build --profile dist` makes. Tests run each of them in its smallest form, so that none is here that no longer runs; of those that need the crates of others, or
wait by the wall clock, they look the programs up (`benches/tests/integration/commands.rs`).

Nothing here is typed by hand. Where a figure was asked for, it stands beside the one measured, whether it is met or not.
";

/// In the place of figures.
const NOT_YET: &str = "Not measured yet:";
const OTHERS: &str = "## Written by other commands";

/// Pages that need a quiet machine or privileges: what they say, and what writes them.
const ALONE: [(&str, &str, &str); 10] = [
    (
        "measured-relay.md",
        "how late the relay and how fast",
        "cargo run --profile dist -p cohaptic-benches-realtime --bin relay-table > docs/measured-relay.md",
    ),
    (
        "measured-live.md",
        "how late the ticks of a live session, and what they cost",
        "cargo run --profile dist -p cohaptic-benches-realtime --bin live-table > docs/measured-live.md",
    ),
    (
        "measured-devices.md",
        "how late a session with devices and a peer at another computer, and how long exchanges with devices take",
        "benches/devices > docs/measured-devices.md",
    ),
    (
        "measured-floods.md",
        "how long a host waits for its page while strangers and guests flood the server, and which peers come in while hellos and noise flood a session",
        "cargo run --profile dist -p cohaptic-benches-realtime --bin floods-table > docs/measured-floods.md",
    ),
    (
        "measured-tcp.md",
        "how far the TCP of the test kit and that of Linux are apart, over the same links",
        "cargo run --profile dist -p cohaptic-benches-realtime --bin tcp-table > docs/measured-tcp.md",
    ),
    (
        "measured-soak.md",
        "an hour of both: memory, drift, lateness",
        "cargo run --profile dist -p cohaptic-benches-realtime --bin soak -- 1h --out docs/measured-soak.md",
    ),
    (
        "measured-cluster.md",
        "the same campaign by shards, by GNU parallel, by Dask and by Slurm, and the merge",
        "cargo build --profile dist && COHAPTIC_PROGRAM=target/dist/cohaptic cargo test --workspace --test cluster -- --ignored",
    ),
    ("measured-build.md", "how long a first build and the tests take", "benches/build-times > docs/measured-build.md"),
    ("measured-first.md", "how long a new user waits for the first result, with and without Rust", "benches/first-result > docs/measured-first.md"),
    ("measured-fuzz.md", "how often each fuzz target was run, and how much of the code it reached", "fuzz/run --runs 10000000 --page"),
];

#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Page(BTreeMap<Step, String>);

impl Page {
    /// Reads a page that this program has written.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let mut page = Self::default();
        let mut current = None;
        for line in text.split_inclusive('\n') {
            if line.starts_with("## ") {
                let heading = line.trim_end();
                current = Step::ALL.into_iter().find(|step| step.heading() == heading);
                if current.is_none() && heading != OTHERS {
                    return Err(format!("there is no step for {heading:?}; remove that section, or put back the one that it was"));
                }
            }
            if let Some(step) = current {
                page.0.entry(step).or_default().push_str(line);
            }
        }
        page.0.retain(|_, section| !section.contains(NOT_YET));
        for section in page.0.values_mut() {
            section.truncate(section.trim_end().len());
        }
        Ok(page)
    }

    /// Puts a section in the place of the one that was there.
    pub(crate) fn set(&mut self, step: Step, section: String) {
        self.0.insert(step, section);
    }

    pub(crate) fn text(&self) -> String {
        let mut text = HEAD.to_owned();
        for step in Step::ALL {
            match self.0.get(&step) {
                Some(section) => {
                    let _ = writeln!(text, "\n{}", section.trim_end());
                }
                None => {
                    let _ = writeln!(text, "\n{}\n{NOT_YET} `benches/measure {}`.", step.head(Effort::Full), step.name());
                }
            }
        }
        let _ = writeln!(
            text,
            "\n{OTHERS}\n\nThese need a quiet machine, and most of them better privileges than a user has; they say themselves where they were measured."
        );
        for (page, says, command) in ALONE {
            let date = machine::last_change(page).map_or_else(String::new, |date| format!(", last written {date}"));
            let _ = writeln!(text, "\n[{page}]({page}): {says}{date}.\n\n    {command}");
        }
        text += "\n[measured-router.md](measured-router.md): how late the router and how fast. It needs root, and its figures are copied from the output of the command that it names.\n";
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_read_back_as_it_was_and_other_sections_stay() {
        let mut page = Page::default();
        assert_eq!(Page::parse(&page.text()).unwrap().text(), page.text());
        page.set(Step::Speed, format!("{}\n\nFast.\n\n### Below\n\n| 1 |", Step::Speed.heading()));
        page.set(Step::Peers, format!("{}\n\nBeside others.", Step::Peers.heading()));
        assert_eq!(Page::parse(&page.text()), Ok(page.clone()));
        let mut read = Page::parse(&page.text()).unwrap();
        assert_eq!(read.text(), page.text());
        read.set(Step::Speed, format!("{}\n\nFaster.", Step::Speed.heading()));
        let text = read.text();
        assert!(text.contains("\nFaster.\n") && text.contains("\nBeside others.\n") && !text.contains("Fast.\n"), "{text}");
        assert_eq!(text.matches(NOT_YET).count(), Step::ALL.len() - 2);
    }

    #[test]
    fn a_page_of_somebody_else_is_refused() {
        assert!(Page::parse("# Measured\n\n## My notes\n").is_err_and(|why| why.contains("My notes")));
    }
}
