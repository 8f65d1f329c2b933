//! The reference of commands.

use std::fmt::Write as _;

use super::help::{Entry, Help};
use super::{WRITTEN, prose, table};

/// What as many commands take with one meaning is explained once.
const SHARED: usize = 2;

const INTRODUCTION: &str = "\
Every command with its arguments, options and examples, as `--help` prints them. [commands.md](commands.md) says which command answers which question.

Every command has `-h, --help`, and the program has `--version`. An option without a default is off, or is not applied, unless it is given.
";

/// The commands that do something, each with the words behind `cohaptic`, in the order of `--help`.
fn all(command: &[String]) -> Vec<(String, Help)> {
    let help = Help::of(command);
    if help.parts.is_empty() {
        return vec![(command.join(" "), help)];
    }
    help.parts.iter().flat_map(|part| all(&[command, std::slice::from_ref(part)].concat())).collect()
}

fn row(entry: &Entry) -> Vec<String> {
    let default = if entry.default.is_empty() { String::new() } else { prose(&entry.default) };
    vec![format!("`{}`", entry.name.replace('|', "\\|")), default, prose(&entry.about)]
}

/// The name of an option without its value.
fn option(entry: &Entry) -> String {
    format!("`{}`", entry.name.split([' ', '[']).next().unwrap_or_default())
}

/// The whole page.
pub(super) fn page() -> String {
    let all = all(&[]);
    let entries = || all.iter().flat_map(|(_, help)| &help.entries);
    let mut shared: Vec<&Entry> = Vec::new();
    for entry in entries() {
        if !shared.contains(&entry) && entries().filter(|other| *other == entry).count() >= SHARED {
            shared.push(entry);
        }
    }
    let mut page = format!("# Reference: commands\n\n{WRITTEN}\n\n{INTRODUCTION}\n## In several commands\n\n");
    let rows: Vec<Vec<String>> = shared.iter().map(|entry| row(entry)).collect();
    page += &table(&["argument or option", "default", "meaning"], &rows);
    for (name, help) in &all {
        let _ = write!(page, "## {name}\n\n{}.\n\n```text\n", help.about);
        for line in &help.usage {
            let _ = writeln!(page, "{line}");
        }
        page += "```\n\n";
        let (common, own): (Vec<&Entry>, Vec<&Entry>) = help.entries.iter().partition(|entry| shared.contains(entry));
        let rows: Vec<Vec<String>> = own.into_iter().map(row).collect();
        page += &table(&["argument or option", "default", "meaning"], &rows);
        if !common.is_empty() {
            let names: Vec<String> = common.into_iter().map(option).collect();
            let _ = write!(page, "[Also](#in-several-commands): {}.\n\n", names.join(", "));
        }
        page += "```text\n";
        for line in &help.examples {
            let _ = writeln!(page, "{line}");
        }
        page += "```\n\n";
    }
    page.trim_end().to_owned() + "\n"
}
