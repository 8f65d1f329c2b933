//! The command line as a whole: commands in groups, short options, and `stability FILE`.

use std::ffi::OsString;
use std::path::Path;

use clap::{Command, CommandFactory as _, FromArgMatches as _};

use super::Arguments;

/// The commands by what they are for, in the order in which help lists them.
const GROUPS: [(&str, &[&str]); 5] = [
    ("Commands for scenes", &["init", "run", "check", "explain", "campaign", "compare"]),
    ("Commands for analysis", &["stability", "admittance", "paper"]),
    ("Commands for networks", &["link", "fit", "relay", "router", "exec", "tokio", "test"]),
    ("Commands for people and devices", &["play", "study", "live", "join", "falcon", "inverse3"]),
    ("Commands for other programs", &["schema", "completions", "man"]),
];

/// Options with a second name of one letter, in every command that has the option.
const SHORT: [(&str, char); 3] = [("set", 's'), ("out", 'o'), ("threads", 'j')];

impl Arguments {
    /// Returns the description of the program with all commands, from which help, completions and manual pages are made.
    pub(crate) fn program() -> Command {
        let program = with_short_options(Self::command());
        let groups: String = GROUPS.iter().map(|(title, names)| group(&program, title, names)).collect();
        program.help_template(format!("{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{groups}Options:\n{{options}}{{after-help}}"))
    }

    /// Parses arguments as the user typed them. The first word is the name of the program.
    pub(crate) fn of(words: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let mut program = Self::program();
        let matches = program.try_get_matches_from_mut(with_command_of_file(words.into_iter().collect()))?;
        Self::from_arg_matches(&matches).map_err(|error| error.format(&mut program))
    }
}

fn with_short_options(command: Command) -> Command {
    let command = command.mut_args(|arg| {
        let short = SHORT.iter().find(|(long, _)| arg.get_long() == Some(long));
        match short {
            Some((_, letter)) => arg.short(*letter),
            None => arg,
        }
    });
    command.mut_subcommands(with_short_options)
}

/// Returns a title, and below the title each command with its description, in lines of at most 100 columns.
fn group(program: &Command, title: &str, names: &[&str]) -> String {
    let mut text = format!("{title}:\n");
    for name in names {
        let about = program.find_subcommand(name).and_then(Command::get_about).map(ToString::to_string).unwrap_or_default();
        let mut line = format!("  {name:<12}");
        for word in about.split_whitespace() {
            if line.chars().count() + 1 + word.chars().count() > 100 {
                text.push_str(&format!("{line}\n"));
                line = " ".repeat(14);
            }
            line.push(' ');
            line.push_str(word);
        }
        text.push_str(&format!("{line}\n"));
    }
    text.push('\n');
    text
}

/// Commands of commands that a file alone stands for: `stability FILE` is `stability point FILE`, and `study FILE` is `study run FILE`.
const OF_FILES: [(&str, &str); 2] = [("stability", "point"), ("study", "run")];

/// Inserts the command of [`OF_FILES`] before a file. A word that names no file stays as the command, so that the error message for a mistyped command speaks
/// of a command and not of a file.
fn with_command_of_file(mut words: Vec<OsString>) -> Vec<OsString> {
    let is_option = |word: &OsString| word.to_string_lossy().starts_with('-');
    let Some(place) = (1..words.len()).find(|place| !is_option(&words[*place])) else { return words };
    let is_file = |word: &OsString| word == "-" || word.to_string_lossy().ends_with(".toml") || Path::new(word).is_file();
    let inner = OF_FILES.iter().find(|(command, _)| words[place] == *command);
    if let Some((_, inner)) = inner
        && words.get(place + 1).is_some_and(is_file)
    {
        words.insert(place + 1, inner.into());
    }
    words
}

#[cfg(test)]
mod tests {
    use super::super::{Command as Chosen, StabilityCommand};
    use super::*;

    fn parsed(line: &str) -> Result<Arguments, clap::Error> {
        Arguments::of(line.split_whitespace().map(OsString::from))
    }

    #[test]
    fn every_command_stands_in_one_group() {
        let mut grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| *names).copied().collect();
        let program = Arguments::command();
        let mut all: Vec<&str> = program.get_subcommands().map(Command::get_name).collect();
        grouped.sort_unstable();
        all.sort_unstable();
        assert_eq!(grouped, all);
        let help = Arguments::program().render_help().to_string();
        for (title, names) in GROUPS {
            let (_, below) = help.split_once(&format!("\n{title}:\n")).unwrap_or_else(|| panic!("no {title} in {help}"));
            let below = below.split("\n\n").next().unwrap_or_default();
            assert!(names.iter().all(|name| below.contains(&format!("\n  {name} ")) || below.starts_with(&format!("  {name} "))), "{below}");
            assert!(below.lines().all(|line| line.chars().count() <= 100), "{below}");
        }
    }

    #[test]
    fn usual_options_have_one_letter() {
        let Chosen::Campaign(campaign) = parsed("cohaptic campaign a.toml -s object.mass=1 -s link.delay=8ms -o out -j 3").unwrap().command else {
            panic!()
        };
        assert_eq!(campaign.overrides.set, ["object.mass=1", "link.delay=8ms"]);
        assert_eq!((campaign.out.as_deref(), campaign.table.threads), (Some(Path::new("out")), Some(3)));
        assert!(parsed("cohaptic -q run a.toml").unwrap().quiet && parsed("cohaptic run a.toml -q").unwrap().quiet);
    }

    #[test]
    fn a_file_behind_stability_is_a_point() {
        for line in ["cohaptic stability a.toml --json", "cohaptic stability -", "cohaptic -q stability a.toml", "cohaptic stability point a.toml"] {
            let Chosen::Stability(found) = parsed(line).unwrap_or_else(|error| panic!("{line}: {error}")).command else { panic!("{line}") };
            assert!(matches!(found.command, StabilityCommand::Point(_)), "{line}");
        }
        let error = parsed("cohaptic stability bondary a.toml").unwrap_err().to_string();
        assert!(error.contains("boundary"), "{error}");
    }
}
