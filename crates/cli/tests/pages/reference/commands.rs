//! The reference of commands.

use std::fmt::Write as _;

use super::help::{Entry, Help};
use super::{WRITTEN, entry, prose};

/// Number of commands from which on an option with one meaning is explained once for all.
const SHARED: usize = 2;

const INTRODUCTION: &str = "\
Every command with its arguments and options, as `--help` prints them, which also has examples. [commands.md](commands.md) says which command answers which question.

Every command has `-h, --help`, and the program has `--version`. An option without a default is off, or is not applied, unless it is given.
";

/// Returns the commands without subcommands, each with its words after `cohaptic` and its help, in the order of `--help`.
fn all(command: &[String]) -> Vec<(String, Help)> {
    let help = Help::of(command);
    if help.parts.is_empty() {
        return vec![(command.join(" "), help)];
    }
    help.parts.iter().flat_map(|part| all(&[command, std::slice::from_ref(part)].concat())).collect()
}

fn row(of: &Entry) -> String {
    let default = if of.default.is_empty() { String::new() } else { format!("default {}", prose(&of.default)) };
    entry(&format!("`{}`", of.name), &[&default], &prose(&of.about))
}

/// Returns a list of entries and an empty line; empty without entries.
fn list(of: &[&Entry]) -> String {
    if of.is_empty() { String::new() } else { of.iter().map(|entry| row(entry)).collect::<String>() + "\n" }
}

/// Returns the name of an option without its value.
fn option(entry: &Entry) -> String {
    let long = entry.name.split_once(", ").map_or(entry.name.as_str(), |(_, long)| long);
    format!("`{}`", long.split([' ', '[']).next().unwrap_or_default())
}

/// Returns the whole page.
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
    page += &list(&shared);
    for (name, help) in &all {
        let usage: Vec<String> = help.usage.iter().map(|line| format!("`{line}`")).collect();
        let _ = write!(page, "## {name}\n\n{}. {}\n\n", help.about, usage.join(", "));
        let (common, own): (Vec<&Entry>, Vec<&Entry>) = help.entries.iter().partition(|entry| shared.contains(entry));
        page += &list(&own);
        if !common.is_empty() {
            let names: Vec<String> = common.into_iter().map(option).collect();
            let _ = write!(page, "[Also](#in-several-commands): {}.\n\n", names.join(", "));
        }
    }
    page.trim_end().to_owned() + "\n"
}
