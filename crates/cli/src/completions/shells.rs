//! Differences between shells: the scripts, the way of words to the program, and the way of answers to the shell.

use clap::{Arg, Command};
use clap_complete::Shell;

use super::{Kind, Offer};
use crate::arguments::Arguments;

/// First line of the completing function in the generated scripts for bash and zsh.
const FUNCTION: &str = "_cohaptic() {\n";

/// Beginning of the function for bash. Without an answer the generated part goes on. Bash 3 lacks `compopt`, so that a space follows each completion there.
const BASH: &str = r#"    local answer
    COMPREPLY=()
    while IFS= read -r answer; do
        COMPREPLY+=("$answer")
        [[ "$answer" == *[=./] ]] && compopt -o nospace 2>/dev/null
    done < <("$1" completions bash -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
    (( ${#COMPREPLY[@]} )) && return 0
"#;

/// Beginning of the function for zsh.
const ZSH: &str = r#"    local answer tab=$'\t'
    local -a texts suffix
    for answer in ${(f)"$("${(Q)words[1]}" completions zsh -- "${(@Q)words[2,CURRENT]}" 2>/dev/null)"}; do
        texts=("${answer/$tab/  -- }")
        answer="${answer%%$tab*}"
        suffix=()
        [[ "$answer" == *[=./] ]] && suffix=(-S '')
        compadd "${(@)suffix}" -l -d texts -- "$answer"
    done
    (( compstate[nmatches] )) && return 0
"#;

/// End of the script for fish: positional arguments. The options follow, a line each, because fish asks for the values of each option apart.
const FISH: &str = r#"
function __cohaptic_answers
    set -l words (commandline -opc)
    set -l last (commandline -ct)
    set -l program $words[1]
    set -e words[1]
    $program completions fish -- $words "$last" 2>/dev/null
end

function __cohaptic_has_answers
    set -l answers (__cohaptic_answers)
    test (count $answers) -gt 0
end

complete -c cohaptic -n __cohaptic_has_answers -f -a "(__cohaptic_answers)"
"#;

/// Returns the completion script of a shell: for commands, options and, in bash, fish and zsh, values from files.
pub(super) fn script(shell: Shell) -> String {
    let mut generated = Vec::new();
    let mut program = Arguments::program();
    clap_complete::generate(shell, &mut program, "cohaptic", &mut generated);
    let generated = String::from_utf8_lossy(&generated);
    match shell {
        Shell::Bash => generated.replacen(FUNCTION, &format!("{FUNCTION}{BASH}"), 1),
        Shell::Zsh => generated.replacen(FUNCTION, &format!("{FUNCTION}{ZSH}"), 1),
        Shell::Fish => format!("{generated}{FISH}{}", fish_options(&program)),
        Shell::Elvish | Shell::PowerShell | _ => generated.into_owned(),
    }
}

/// Returns a line per option with values from files.
fn fish_options(program: &Command) -> String {
    let mut lines: Vec<String> = Vec::new();
    // All commands are visited, with the subcommands of subcommands. An option of several commands gives a single line.
    let mut commands = vec![program];
    while let Some(command) = commands.pop() {
        commands.extend(command.get_subcommands());
        for arg in command.get_opts().filter(|arg| Kind::of(arg, command.get_name()).is_some()) {
            let line = format!("complete -c cohaptic -n __cohaptic_has_answers {} -x -a \"(__cohaptic_answers)\"\n", names(arg));
            if !lines.contains(&line) {
                lines.push(line);
            }
        }
    }
    // Sorted, so that the script does not depend on the order of the visit.
    lines.sort();
    lines.concat()
}

/// Returns the names of an option as fish writes them: `-s s -l set`.
fn names(arg: &Arg) -> String {
    let short = arg.get_short().map(|letter| format!("-s {letter}"));
    let long = arg.get_long().map(|long| format!("-l {long}"));
    short.into_iter().chain(long).collect::<Vec<_>>().join(" ")
}

/// Words of a command line as the program reads words, and the shell, which determines the form of an answer.
pub(super) struct Split {
    pub(super) words: Vec<String>,
    shell: Shell,
    /// Number of bytes at the beginning of the last word that the shell does not replace, because the shell takes these bytes for earlier words.
    kept: usize,
}

impl Split {
    /// Joins the words of a script to words of the program. Bash splits words at `=` and `:`, and passes each of these characters on as a separate word.
    pub(super) fn of(shell: Shell, words: &[String]) -> Self {
        if shell != Shell::Bash {
            return Self { words: words.to_vec(), shell, kept: 0 };
        }
        let is_break = |word: &str| !word.is_empty() && word.chars().all(|c| matches!(c, '=' | ':'));
        let mut joined: Vec<String> = Vec::new();
        let mut kept = 0;
        let mut after_break = false;
        for word in words {
            // A break, and the word after a break, continue the word before: `a`, `=` and `b` stand for `a=b`.
            match joined.last_mut() {
                Some(last) if after_break || is_break(word) => {
                    kept = if is_break(word) { last.len() + word.len() } else { last.len() };
                    last.push_str(word);
                }
                _ => {
                    kept = 0;
                    joined.push(word.clone());
                }
            }
            after_break = is_break(word);
        }
        Self { words: joined, shell, kept }
    }

    /// Returns the line of an answer. `option` is the part of the last word before the value.
    pub(super) fn line(&self, option: &str, offer: &Offer) -> String {
        let Offer { text, about } = offer;
        let meaning = if about.is_empty() { String::new() } else { format!("\t{about}") };
        match self.shell {
            // Bash inserts the answer unchanged after the last `=` or `:`, so that characters with a meaning to the shell are quoted here.
            Shell::Bash => format!("{}\n", quoted(format!("{option}{text}").get(self.kept..).unwrap_or_default())),
            // Zsh replaces the whole word, fish the value.
            Shell::Zsh => format!("{option}{text}{meaning}\n"),
            Shell::Fish | Shell::Elvish | Shell::PowerShell | _ => format!("{text}{meaning}\n"),
        }
    }
}

/// Returns a word with a backslash before each character that may have a meaning in bash.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '.' | '/' | '-' | '_' | '=' | ',' | '+' | '@' | '%');
    word.chars().flat_map(|c| (!is_plain(c)).then_some('\\').into_iter().chain([c])).collect()
}
