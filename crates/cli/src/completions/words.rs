//! Finds the argument of the last word of a command line.

use clap::{Arg, Command};

/// The argument at the end of a command line, with the typed part of the value.
#[derive(Debug)]
pub(super) struct Asked<'a> {
    /// Name of the command, without the names of the commands above it.
    pub(super) command: &'a str,
    pub(super) arg: &'a Arg,
    /// Part of the last word before the value: `--set=` or `-s` if the value is written together with its option, else empty.
    pub(super) option: String,
    /// Typed part of the value.
    pub(super) typed: String,
    /// First positional argument before the last word: the file of the command, if the command takes a file.
    pub(super) file: Option<&'a str>,
}

/// Returns the argument at the end of `words`, the words after the name of the program. `None` if the last word is an option or a command, or if no argument
/// can stand there.
pub(super) fn asked<'a>(program: &'a Command, words: &'a [String]) -> Option<Asked<'a>> {
    let (last, before) = words.split_last()?;
    let mut state = State { command: program, positionals: Vec::new(), pending: None, only_positionals: false };
    before.iter().for_each(|word| state.pass(word));
    let (arg, option) = match state.read(last) {
        Word::Value(arg) => (arg, ""),
        Word::Option(arg, value) => (arg?, &last[..last.len() - value?.len()]),
        Word::Positional => (state.positional(last)?, ""),
        Word::End => return None,
    };
    // A shell replaces the whole last word, so that the part with the option is returned beside the typed value.
    let typed = last[option.len()..].to_owned();
    Some(Asked { command: state.command.get_name(), arg, option: option.to_owned(), typed, file: state.positionals.first().copied() })
}

/// Role of a word in a command line.
enum Word<'a, 'w> {
    /// The value of the option before the word.
    Value(&'a Arg),
    /// An option (`None` for an unknown option), and the value in the same word.
    Option(Option<&'a Arg>, Option<&'w str>),
    /// A command or a positional argument.
    Positional,
    /// The word `--`: no option follows.
    End,
}

/// State between two words.
struct State<'a> {
    command: &'a Command,
    positionals: Vec<&'a str>,
    /// Option before the next word, if the option takes a value.
    pending: Option<&'a Arg>,
    only_positionals: bool,
}

impl<'a> State<'a> {
    fn read<'w>(&self, word: &'w str) -> Word<'a, 'w> {
        // A lone dash is standard input, and thus a value.
        let is_option = !self.only_positionals && word.starts_with('-') && word != "-";
        // `-0.5` looks like an option, and is a value if the option before allows negative numbers.
        let is_number = word.chars().nth(1).is_some_and(|c| c.is_ascii_digit());
        match self.pending {
            Some(arg) if !is_option || (is_number && arg.is_allow_negative_numbers_set()) => Word::Value(arg),
            _ if !is_option => Word::Positional,
            _ if word == "--" => Word::End,
            _ => match word.strip_prefix("--") {
                Some(long) => self.long(long),
                None => self.short(&word[1..]),
            },
        }
    }

    fn long<'w>(&self, word: &'w str) -> Word<'a, 'w> {
        let (name, value) = word.split_once('=').map_or((word, None), |(name, value)| (name, Some(value)));
        let has_name = |arg: &&Arg| arg.get_long() == Some(name) || arg.get_all_aliases().is_some_and(|aliases| aliases.contains(&name));
        Word::Option(self.command.get_arguments().find(has_name), value)
    }

    /// Reads letters after a single dash: flags, and at most one option with the rest of the word as the value.
    fn short<'w>(&self, letters: &'w str) -> Word<'a, 'w> {
        for (place, letter) in letters.char_indices() {
            let found = self.command.get_arguments().find(|arg| arg.get_short() == Some(letter));
            if let Some(arg) = found.filter(|arg| arg.get_action().takes_values()) {
                let value = &letters[place + letter.len_utf8()..];
                // The rest of the word is the value, as in `-j4`. Without a rest the value is the next word.
                return Word::Option(Some(arg), (!value.is_empty()).then_some(value));
            }
        }
        Word::Option(None, None)
    }

    fn pass(&mut self, word: &'a str) {
        match self.read(word) {
            // An option with any number of values, such as `--back`, goes on until the next option.
            Word::Value(arg) => self.pending = Some(arg).filter(|arg| takes_many(arg)),
            Word::Option(arg, value) => self.pending = arg.filter(|arg| value.is_none() && arg.get_action().takes_values()),
            Word::End => (self.only_positionals, self.pending) = (true, None),
            Word::Positional => match self.command.find_subcommand(word) {
                Some(command) => self.command = command,
                None => {
                    self.command = self.file_command().unwrap_or(self.command);
                    self.positionals.push(word);
                }
            },
        }
    }

    /// Returns the positional argument for `word`. `None` if `word` may become the name of a subcommand.
    fn positional(&mut self, word: &str) -> Option<&'a Arg> {
        if self.command.get_subcommands().any(|command| command.get_name().starts_with(word)) {
            return None;
        }
        self.command = self.file_command().unwrap_or(self.command);
        let all: Vec<&Arg> = self.command.get_positionals().collect();
        all.get(self.positionals.len()).or_else(|| all.last().filter(|arg| takes_many(arg))).copied()
    }

    /// Returns the command for a file in place of a command: `stability FILE` is `stability point FILE`.
    fn file_command(&self) -> Option<&'a Command> {
        self.command.find_subcommand("point")
    }
}

fn takes_many(arg: &Arg) -> bool {
    arg.get_num_args().is_some_and(|count| count.max_values() > 1)
}
