//! `cohaptic completions`: scripts for the completion of command lines by shells, and the program's answers to these scripts.
//!
//! Commands and options stand in a script, generated from the definitions of the arguments. Keys, peers and scenes depend on files, so that the scripts for
//! bash, fish and zsh run the program with the words typed so far, and show the answer of the program.

mod keys;
mod shells;
#[cfg(test)]
mod tests;
mod words;

use std::path::Path;
use std::process::ExitCode;

use clap::Arg;
use clap_complete::Shell;
use cohaptic_linkfile::document::{BEGINNING, Node, Sources};
use cohaptic_linkfile::reading::{file_text, parse};
use cohaptic_scene::schema::FileSchema;

use crate::arguments::{Arguments, CompletionsArguments};
use crate::failure::Failure;
use crate::init::shipped_names;
use crate::output;
use words::Asked;

/// Proposed text in place of the typed text, and the meaning of the proposal, possibly empty.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Offer {
    text: String,
    about: &'static str,
}

/// Prints the script of a shell or, if words of a command line are given, the proposals for the last word.
pub(crate) fn completions(arguments: &CompletionsArguments) -> Result<ExitCode, Failure> {
    if arguments.words.is_empty() {
        output::raw(shells::script(arguments.shell).as_bytes())?;
    } else {
        let words: Vec<String> = arguments.words.iter().map(|word| word.to_string_lossy().into_owned()).collect();
        output::raw(answer(arguments.shell, &words).as_bytes())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns a line per proposal for the last word, in the form of the script of `shell`. Empty if the script itself completes the word.
fn answer(shell: Shell, words: &[String]) -> String {
    let split = shells::Split::of(shell, words);
    let mut program = Arguments::program();
    // `build` puts global options into the subcommands and counts positional arguments.
    program.build();
    let Some(asked) = words::asked(&program, &split.words) else { return String::new() };
    let mut offers = offers(&asked);
    offers.retain(|offer| offer.text.starts_with(&asked.typed));
    offers.iter().map(|offer| split.line(&asked.option, offer)).collect()
}

/// Kinds of values for which the program looks into files.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    /// `KEY=VALUE`, or with `many` several `KEY=VALUE` separated by commas.
    Keys { many: bool },
    /// Name of a peer of the scene.
    Peer,
    /// Name of a shipped scene.
    Shipped,
    /// File that the command reads.
    File,
}

impl Kind {
    /// Returns the kind of the values of an argument of `command`, by the name of the value in the help. `None` if the values do not depend on files.
    fn of(arg: &Arg, command: &str) -> Option<Self> {
        let name = arg.get_value_names()?.first()?.as_str();
        match (name, arg.is_positional()) {
            ("PEER", _) => Some(Self::Peer),
            ("SCENE", false) => Some(Self::Shipped),
            ("SCENE", true) => Some(Self::File),
            (_, true) if matches!(command, "relay" | "router") || name == "SPEC | FILE" => Some(Self::File),
            _ => name.starts_with("KEY=").then(|| Self::Keys { many: name.ends_with(",...") }),
        }
    }
}

/// Returns the proposals for the value at the end of the command line.
fn offers(asked: &Asked<'_>) -> Vec<Offer> {
    let named = |text: String| Offer { text, about: "" };
    match Kind::of(asked.arg, asked.command) {
        None => Vec::new(),
        Some(Kind::Shipped) => shipped_names().map(|name| named(name.to_owned())).collect(),
        Some(Kind::File) => paths(&asked.typed),
        Some(Kind::Peer) => keys::ends(&document(asked.file)).into_iter().map(named).collect(),
        Some(Kind::Keys { many }) => {
            // Only the text after the last comma is completed. The text before stands unchanged in each proposal.
            let done = if many { asked.typed.rfind(',').map_or(0, |comma| comma + 1) } else { 0 };
            let (done, typed) = asked.typed.split_at(done);
            let kind = match asked.command {
                "relay" => FileSchema::Relay,
                "router" => FileSchema::Router,
                "exec" => FileSchema::Exec,
                _ => FileSchema::Scene,
            };
            let offers = keys::offers(kind.root(), &document(asked.file), typed);
            offers.into_iter().map(|Offer { text, about }| Offer { text: format!("{done}{text}"), about }).collect()
        }
    }
}

/// Returns the possible scenes, relay files and router files at paths that begin with `typed`, sorted: files with names that end in `.toml`, and folders,
/// which may hold such files. Folders end in a slash. Hidden files are left out unless the name typed so far begins with a dot.
fn paths(typed: &str) -> Vec<Offer> {
    let (folder, name) = typed.rfind('/').map_or(("", typed), |slash| typed.split_at(slash + 1));
    let Ok(entries) = std::fs::read_dir(if folder.is_empty() { Path::new(".") } else { Path::new(folder) }) else { return Vec::new() };
    let mut offers: Vec<Offer> = entries
        .filter_map(|entry| {
            let entry = entry.ok()?;
            // A name that is not UTF-8 cannot be compared with the typed text, and a name with a line break would read as two names.
            let own = entry.file_name().into_string().ok().filter(|own| !own.contains(char::is_control))?;
            if !own.starts_with(name) || (own.starts_with('.') && !name.starts_with('.')) {
                return None;
            }
            // `is_dir` follows symbolic links, so that a link to a folder counts as a folder.
            let is_folder = entry.path().is_dir();
            (is_folder || own.ends_with(".toml")).then(|| Offer { text: format!("{folder}{own}{}", if is_folder { "/" } else { "" }), about: "" })
        })
        .collect();
    // The order in which a system lists files is not defined.
    offers.sort_by(|a, b| a.text.cmp(&b.text));
    offers
}

/// Returns the document of a file. An unreadable file, perhaps half written at this time, counts as empty: keys are known without a file.
fn document(file: Option<&str>) -> Node {
    let path = Path::new(file.unwrap_or_default());
    // A pipe is not read: the text in the pipe is meant for the typed command.
    let text = if path.is_file() { file_text(path).unwrap_or_default() } else { String::new() };
    let parsed = parse(Sources { file: path, text: &text, overrides: &[] }, |document, _| Some(document.clone()));
    parsed.map_or_else(|_| Node::empty_table(BEGINNING, String::new()), |parsed| parsed.document)
}
