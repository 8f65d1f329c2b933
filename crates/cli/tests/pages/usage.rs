//! Check of commands that are not run: their options must be in `--help`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;
use std::sync::Mutex;

use crate::pages::root;

/// Options and subcommands that `--help` of a command names.
#[derive(Clone, Default)]
struct Help {
    options: BTreeSet<String>,
    /// Subcommands, such as `point` of `stability`.
    parts: Vec<String>,
}

/// Help of each command asked so far, by the words after `cohaptic`; `None` for words that are no command.
static HELP: Mutex<BTreeMap<Vec<String>, Option<Help>>> = Mutex::new(BTreeMap::new());

fn help(command: &[String]) -> Option<Help> {
    let mut known = HELP.lock().unwrap();
    known.entry(command.to_vec()).or_insert_with(|| ask(command)).clone()
}

fn ask(command: &[String]) -> Option<Help> {
    let output = Command::new(env!("CARGO_BIN_EXE_cohaptic")).args(command).arg("--help").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let lists = text.split("\nCommands").skip(1).map(|list| list.lines().skip(1).take_while(|line| line.starts_with("  ")));
    let parts = lists.flatten().filter(|line| !line.starts_with("    ")).filter_map(|line| line.split_whitespace().next());
    let parts = parts.filter(|part| *part != "help").map(str::to_owned).collect();
    output.status.success().then(|| Help { options: text.lines().flat_map(options).collect(), parts })
}

/// An option begins a line, `-h, --help` or `--set <KEY=VALUE>`; other names of it stand in brackets, `[alias: --jobs]`.
fn options(line: &str) -> Vec<String> {
    let own = line.trim_start();
    let own = if own.starts_with("--") { Some(own) } else { own.split_once(", ").filter(|(short, _)| short.starts_with('-')).map(|(_, long)| long) };
    let others = line.split_once("[alias").map_or("", |(_, rest)| rest).split(' ').filter(|word| word.starts_with("--"));
    let name = |word: &str| word[..word.find(|letter: char| letter != '-' && !letter.is_ascii_alphanumeric()).unwrap_or(word.len())].to_owned();
    own.into_iter().chain(others).map(name).collect()
}

/// Looks up an option that a page names without a command.
pub(crate) fn of_some_command(code: &str) -> Result<(), String> {
    const OF_CARGO_TEST: [&str; 3] = ["--test-threads", "--ignored", "--nocapture"];
    let end = code.find([' ', '=', '[']).unwrap_or(code.len());
    if OF_CARGO_TEST.contains(&&code[..end]) {
        return Ok(());
    }
    let mut commands = vec![Vec::new()];
    while let Some(command) = commands.pop() {
        let Some(help) = help(&command) else { continue };
        if help.options.contains(&code[..end]) {
            return Ok(());
        }
        commands.extend(help.parts.iter().map(|part| [command.clone(), vec![part.clone()]].concat()));
    }
    Err(format!("no command has the option `{code}`"))
}

/// Checks the words of a command that begins with `cohaptic`: its subcommands and options must exist.
pub(crate) fn of_cohaptic(words: &[String]) -> Result<(), String> {
    let line = words.join(" ");
    let own: Vec<&String> = words.iter().skip(1).collect();
    let named = |word: &&&String| !word.starts_with(['-', '[', '<']) && **word != "…";
    let Some(first) = own.first().filter(named) else { return known_in(&[], &own, &line) };
    let mut command = vec![(*first).clone()];
    let known = help(&command).ok_or_else(|| format!("there is no command `{first}`: {line}"))?;
    if let Some(second) = own.get(1).filter(|word| !known.parts.is_empty() && named(word)) {
        command.push((*second).clone());
    }
    known_in(&command, &own, &line)
}

fn known_in(command: &[String], words: &[&String], line: &str) -> Result<(), String> {
    let known = help(command).ok_or_else(|| format!("there is no command `{}`: {line}", command.join(" ")))?;
    // Words after `--` are no options of this command; after `completions` they are a command line of their own.
    let end = words.iter().position(|word| word.trim_start_matches('[') == "--").unwrap_or(words.len());
    if let (["completions"], Some(others)) = (command.iter().map(String::as_str).collect::<Vec<_>>().as_slice(), words.get(end + 1..)) {
        of_cohaptic(&std::iter::once("cohaptic".to_owned()).chain(others.iter().map(|word| (*word).clone())).collect::<Vec<_>>())?;
    }
    // Words in brackets are those of a line of usage.
    let used = words[..end].iter().map(|word| word.trim_matches(['[', ']'])).filter(|word| word.starts_with("--"));
    for option in used.map(|word| word.split('=').next().unwrap_or_default()) {
        if !known.options.contains(option) {
            return Err(format!("`cohaptic {}` has no option `{option}`: {line}", command.join(" ")));
        }
    }
    Ok(())
}

/// Looks up the packages and programs that a command of cargo names.
pub(crate) fn of_cargo(words: &[String]) -> Result<(), String> {
    let names = names(&root());
    for pair in words.windows(2) {
        let [option, name] = pair else { continue };
        if ["-p", "--test", "--bin", "--example"].contains(&option.as_str()) && !names.contains(name) {
            return Err(format!("no Cargo.toml names {name}: {}", words.join(" ")));
        }
    }
    Ok(())
}

/// All names of packages, programs and tests of the project.
fn names(root: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut folders: Vec<_> =
        ["crates", "benches"].iter().flat_map(|name| std::fs::read_dir(root.join(name)).unwrap()).map(|entry| entry.unwrap().path()).collect();
    folders.extend([root.join("tests"), root.join("benches")]);
    for manifest in folders.iter().filter_map(|folder| std::fs::read_to_string(folder.join("Cargo.toml")).ok()) {
        found.extend(manifest.lines().filter_map(|line| Some(line.strip_prefix("name = \"")?.trim_end_matches('"').to_owned())));
    }
    found
}

#[test]
fn what_is_no_option_is_found() {
    let check = |line: &str| of_cohaptic(&line.split(' ').map(str::to_owned).collect::<Vec<_>>());
    for line in
        ["cohaptic run SCENE --set a=b --json", "cohaptic stability point … --method full", "cohaptic --version", "cohaptic relay [OPTIONS] <FILE>"]
    {
        assert_eq!(check(line), Ok(()));
    }
    assert_eq!(check("cohaptic completions bash -- run SCENE --set"), Ok(()));
    for line in [
        "cohaptic completions bash -- run SCENE --grid",
        "cohaptic run SCENE --grid 2x2",
        "cohaptic stability areas SCENE",
        "cohaptic walk SCENE",
        "cohaptic check --outs=x",
    ] {
        assert!(check(line).is_err(), "{line}");
    }
    assert_eq!((of_some_command("--losses-in-a-row 2"), of_some_command("--losses").is_err()), (Ok(()), true));
    let cargo = |line: &str| of_cargo(&line.split(' ').map(str::to_owned).collect::<Vec<_>>());
    assert_eq!(cargo("cargo test -p cohaptic-tests --test tests hard"), Ok(()));
    assert!(cargo("cargo test -p cohaptic-tests --test soft").is_err());
}
