//! Parser of the output of `--help`.

use std::process::Command;

/// Parts of the output of `--help`.
#[derive(Default, Debug)]
pub(super) struct Help {
    pub(super) about: String,
    pub(super) usage: Vec<String>,
    /// Arguments and options.
    pub(super) entries: Vec<Entry>,
    pub(super) examples: Vec<String>,
    /// Subcommands, such as `point` of `stability`.
    pub(super) parts: Vec<String>,
}

/// Argument or option.
#[derive(Default, Clone, PartialEq, Eq, Debug)]
pub(super) struct Entry {
    /// Name as written in the help, such as `--set <KEY=VALUE>`.
    pub(super) name: String,
    pub(super) about: String,
    pub(super) default: String,
}

/// Section of a line of help.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    About,
    Usage,
    Entries,
    Parts,
    Examples,
    Rest,
}

impl Help {
    /// Asks a command.
    pub(super) fn of(command: &[String]) -> Self {
        let output = Command::new(env!("CARGO_BIN_EXE_cohaptic")).args(command).arg("--help").env_remove("COLUMNS").output().unwrap();
        assert!(output.status.success(), "{command:?}");
        Self::read(&String::from_utf8(output.stdout).unwrap())
    }

    fn read(text: &str) -> Self {
        let mut help = Self::default();
        let mut place = Place::About;
        for line in text.lines() {
            let words = line.trim();
            let begins = match words.split(' ').next() {
                Some("Usage:") => Some(Place::Usage),
                Some("Arguments:" | "Options:") => Some(Place::Entries),
                Some("Commands:" | "Commands") => Some(Place::Parts),
                Some("Examples:") => Some(Place::Examples),
                Some("Exit") => Some(Place::Rest),
                _ => None,
            };
            if let Some(begins) = begins.filter(|_| !line.starts_with(' ')) {
                place = begins;
                help.usage.extend(words.strip_prefix("Usage: ").map(str::to_owned));
            } else {
                help.line(place, line, words);
            }
        }
        for entry in &mut help.entries {
            entry.take_default();
        }
        help.entries.retain(|entry| entry.name != "-h, --help" && entry.name != "-V, --version");
        help
    }

    fn line(&mut self, place: Place, line: &str, words: &str) {
        let indent = line.len() - line.trim_start().len();
        match place {
            _ if words.is_empty() => {}
            Place::About => join(&mut self.about, words),
            Place::Usage => self.usage.push(words.to_owned()),
            Place::Examples => self.examples.push(words.to_owned()),
            Place::Parts if indent == 2 => self.parts.extend(words.split(' ').next().filter(|part| *part != "help").map(str::to_owned)),
            Place::Parts | Place::Rest => {}
            // Options are further in than arguments by the width of `-h, `.
            Place::Entries if indent == 2 || indent == 6 && words.starts_with("--") => {
                let (name, about) = words.split_once("  ").unwrap_or((words, ""));
                self.entries.push(Entry { name: name.to_owned(), about: about.trim().to_owned(), default: String::new() });
            }
            Place::Entries => {
                let about = &mut self.entries.last_mut().unwrap().about;
                match words.strip_prefix("- ") {
                    // One of the words that an option takes, with its meaning.
                    Some(word) if about.ends_with("Possible values:") => join(about, word),
                    Some(word) => *about = format!("{about}; {word}"),
                    None => join(about, words),
                }
            }
        }
    }
}

impl Entry {
    /// `[default: 1]` stands by itself.
    fn take_default(&mut self) {
        const BEGIN: &str = "[default: ";
        if let Some((before, rest)) = self.about.split_once(BEGIN)
            && let Some((default, behind)) = rest.split_once(']')
        {
            self.default = default.to_owned();
            self.about = format!("{}{behind}", before.trim_end());
        }
        // Several spaces stand before the meaning of a word.
        self.about = self.about.replace(" Possible values:", ":").replace("[possible values:", "[");
        self.about = self.about.split_whitespace().collect::<Vec<_>>().join(" ");
    }
}

fn join(text: &mut String, words: &str) {
    if !text.is_empty() {
        text.push(' ');
    }
    text.push_str(words);
}

#[test]
fn help_is_taken_apart() {
    let text = "Walks\nfar\n\nUsage: cohaptic walk [OPTIONS] <TO>\n       cohaptic walk --home\n\nArguments:\n  <TO>  Where to\n\nOptions:\n      \
                --far <N>  How far,\n                 --set or not [default: 1]. Or more\n      --gait <GAIT>\n          How\n\n          Possible \
                values:\n          - slow:   Slowly\n          - faster: Fast\n\n          [default: slow]\n\n  -h, --help  Print help\n\nExamples:\n  \
                cohaptic walk there\n\nExit status: 0\n";
    let help = Help::read(text);
    let entry = |name: &str, about: &str, default: &str| Entry { name: name.to_owned(), about: about.to_owned(), default: default.to_owned() };
    assert_eq!(
        (help.about.as_str(), &help.usage[..]),
        ("Walks far", &["cohaptic walk [OPTIONS] <TO>".to_owned(), "cohaptic walk --home".to_owned()][..])
    );
    assert_eq!(help.examples, ["cohaptic walk there"]);
    let wanted = [
        entry("<TO>", "Where to", ""),
        entry("--far <N>", "How far, --set or not. Or more", "1"),
        entry("--gait <GAIT>", "How: slow: Slowly; faster: Fast", "slow"),
    ];
    assert_eq!(help.entries, wanted);
    assert_eq!(Help::read("Commands:\n  point  The\n         verdict\n  help   Print\n").parts, ["point"]);
}
