//! Completion of keys, peers and scenes in shells. Shells that are not installed are left out, with a message.

use std::process::Command;

use crate::integration::desk::{Desk, Outcome};
use crate::integration::scenes::TWO;

/// Returns a desk with files whose names are completed, and files whose names are not.
fn desk() -> Desk {
    let desk = Desk::with("two.toml", TWO);
    desk.write("two.csv", "");
    desk.write("a folder/four.toml", "[scene]\ncount = 4\n");
    desk.write("half.toml", "[[peers]]\nname = \"anna\"\n[scene\n");
    desk.write("relay.toml", "[[programs]]\nname = \"robot\"\n[[programs]]\nname = \"hand\"\n");
    desk.write("router.toml", "[links.wan]\ndelay = \"8ms\"\n");
    desk.write(".hidden.toml", "");
    desk
}

/// Lines typed after `cohaptic`, the last word not complete, and what the last word becomes.
const LINES: [(&str, &[&str]); 15] = [
    ("run two.toml --set scene.dur", &["scene.duration="]),
    ("run two.toml -s coordination.strat", &["coordination.strategy="]),
    ("run two.toml --set coordination.strategy=prop", &["coordination.strategy=proportional-derivative"]),
    ("run two.toml --set peers.", &["peers.left.", "peers.right."]),
    ("run two.toml --set peers.left.comp", &["peers.left.compute-delay="]),
    ("run two.toml --set links.left.", &["links.left.right."]),
    ("run two.toml --set links.left.right.del", &["links.left.right.delay="]),
    ("stability map two.toml --x object.ma", &["object.mass="]),
    ("relay relay.toml --set links.robot.", &["links.robot.hand."]),
    ("router router.toml --set links.", &["links.wan."]),
    ("admittance two.toml --peer ", &["left", "right"]),
    ("run tw", &["two.toml"]),
    ("check two.toml half", &["half.toml"]),
    ("init --from paper/5-2-p", &["paper/5-2-pd"]),
    // A file that cannot be read names nobody, but keys are known without it.
    ("run half.toml --set scene.dur", &["scene.duration="]),
];

/// Runs a shell on the desk with `script`, which prints what the last word of the line in the variable LINE can become, a line each.
fn assert_completes(shell: &str, options: &[&str], script: &str) {
    let desk = desk();
    desk.write("completions", desk.text(&format!("completions {shell}")));
    let folder = std::path::Path::new(env!("CARGO_BIN_EXE_cohaptic")).parent().unwrap();
    let path = std::env::join_paths(std::iter::once(folder.to_path_buf()).chain(std::env::split_paths(&std::env::var_os("PATH").unwrap()))).unwrap();
    for (line, expected) in LINES {
        let mut command = Command::new(shell);
        command.args(options).arg(script).current_dir(desk.path("")).env("PATH", &path).env("LINE", format!("cohaptic {line}"));
        let output = match command.output() {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return eprintln!("skipped: there is no {shell}"),
            output => output.unwrap(),
        };
        let outcome = Outcome::of(output);
        let found: Vec<&str> = outcome.stdout.lines().collect();
        assert_eq!(found, expected, "{shell}: {line}\n{}", outcome.stderr);
    }
}

/// Splits the line as bash does, and puts what stands before the last break before each completion.
#[test]
fn bash_completes_keys_peers_and_scenes() {
    const SCRIPT: &str = r#"
        source ./completions
        line=${LINE//=/ = }
        read -r -a COMP_WORDS <<< "$line"
        [[ "$line" == *" " ]] && COMP_WORDS+=("")
        COMP_CWORD=$(( ${#COMP_WORDS[@]} - 1 ))
        cur=${COMP_WORDS[COMP_CWORD]}
        _cohaptic cohaptic "$cur" "${COMP_WORDS[COMP_CWORD-1]}"
        word=${LINE##* }
        before=
        [[ "$word" == *=* ]] && before=${word%=*}=
        printf "%s\n" "${COMPREPLY[@]/#/$before}"
    "#;
    assert_completes("bash", &["--norc", "-c"], SCRIPT);
}

/// The functions that zsh calls at a key stroke are replaced by functions that print.
#[test]
fn zsh_completes_keys_peers_and_scenes() {
    const SCRIPT: &str = r#"
        typeset -A compstate=(nmatches 0)
        compdef() { }
        compadd() {
            local value=$argv[-1]
            if [[ $value == ${words[CURRENT]}* ]]; then
                print -r -- $value
                compstate[nmatches]=1
            fi
        }
        source ./completions
        words=("${(@s: :)LINE}")
        CURRENT=$#words
        _cohaptic
    "#;
    assert_completes("zsh", &["-f", "-c"], SCRIPT);
}

#[test]
fn fish_completes_keys_peers_and_scenes() {
    const SCRIPT: &str = r#"
        source ./completions
        complete -C "$LINE" | string replace -r '\t.*' ''
    "#;
    assert_completes("fish", &["--no-config", "-c"], SCRIPT);
}

/// Bash inserts an answer as it is, so that characters at which the shell would split are quoted.
#[test]
fn names_with_spaces_are_quoted_for_bash() {
    let desk = desk();
    assert_eq!(desk.text("completions bash -- run a"), "a\\ folder/\n");
    assert_eq!(desk.text("completions fish -- run 'a folder/'"), "a folder/four.toml\n");
    assert_eq!(desk.text("completions fish -- run .h"), ".hidden.toml\n");
    assert_eq!(desk.text("completions fish -- run 'a folder/four.toml' --set peers."), "peers.peer1.\npeers.peer2.\npeers.peer3.\npeers.peer4.\n");
}

/// Returns the answers for fish without their meanings, joined by blanks.
fn fish(desk: &Desk, line: &str) -> String {
    let text = desk.text(&format!("completions fish -- {line}"));
    let answers: Vec<&str> = text.lines().map(|line| line.split('\t').next().unwrap()).collect();
    answers.join(" ")
}

/// Entries of lists are offered by name, those of tables with free keys by key, and neither if the shell would read the name as two words.
#[test]
fn names_in_the_file_are_offered_as_far_as_they_are_words() {
    let desk = desk();
    desk.write("relay.toml", "[[programs]]\nname = \"robot\"\n[[programs]]\nname = \"two words\"\n");
    desk.write("router.toml", "[links.wan]\ndelay = \"8ms\"\n[links.\"two words\"]\n");
    let states = "[[modulators]]\nname = \"night\"\n[[modulators.states]]\nname = \"on\"\n[[modulators]]\nname = \"two words\"\n\
                  [[modulators]]\nname = \"day\"\n[[modulators.states]]\nname = \"off\"\n[[timeline]]\nat = \"1s\"\n";
    desk.write("states.toml", states);
    for (line, expected) in [
        ("relay relay.toml --set programs.", "programs.robot."),
        ("relay relay.toml --set links.", "links.robot."),
        ("relay relay.toml --set relay.allow-remote=", "relay.allow-remote=true relay.allow-remote=false"),
        ("router router.toml --set links.", "links.wan."),
        ("router router.toml --set links.wan.del", "links.wan.delay="),
        ("run two.toml --set links.", "links.left. links.right."),
        ("run states.toml --set modulators.", "modulators.night. modulators.day."),
        ("run states.toml --set modulators.day.states.", "modulators.day.states.off."),
        ("run states.toml --set timeline.", "timeline.0."),
    ] {
        assert_eq!(fish(&desk, line), expected, "{line}");
    }
}

/// Values of options are no files, wherever they stand.
#[test]
fn files_are_offered_where_a_file_is_meant() {
    let desk = desk();
    desk.write("points.toml", "");
    desk.write("re:lay.toml", "");
    desk.write("two\nlines.toml", "");
    for (line, expected) in [
        ("check r", "re:lay.toml relay.toml router.toml"),
        ("relay rel", "relay.toml"),
        ("router rou", "router.toml"),
        ("run --jobs 3 tw", "two.toml"),
        ("run ''", "a folder/ half.toml points.toml re:lay.toml relay.toml router.toml two.toml"),
        // A dash is the file.
        ("run - tw", ""),
        // These are values of `--back`.
        ("relay --back delay 5ms rel", ""),
        ("relay --back -5 rel", ""),
        // The beginning of a command.
        ("stability po", ""),
        // Behind the two dashes nothing is an option.
        ("run -- --set scene.se", ""),
    ] {
        assert_eq!(fish(&desk, line), expected, "{line}");
    }
    // Bash splits the word at the colon as well.
    assert_eq!(desk.text("completions bash -- run re : la"), "lay.toml\n");
}

/// A pipe is not read: its writer means the text for the command that is typed.
#[test]
fn a_pipe_is_not_read() {
    use std::io::Write as _;
    use std::process::Stdio;
    let desk = desk();
    let mut command = desk.command("completions fish -- run /dev/stdin --set peers.");
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(TWO.as_bytes()).unwrap();
    assert_eq!(Outcome::of(child.wait_with_output().unwrap()).stdout, "");
}

/// Several commands have the same option, for which fish needs one line.
#[test]
fn the_script_for_fish_has_each_line_once() {
    let script = desk().text("completions fish");
    let mut lines: Vec<&str> = script.lines().filter(|line| line.contains("__cohaptic_answers)")).collect();
    let count = lines.len();
    lines.sort_unstable();
    lines.dedup();
    assert!(count > 3 && lines.len() == count, "{lines:?}");
}

/// A command line that nobody can complete has no answer and no error.
#[test]
fn what_the_program_does_not_know_has_no_answer() {
    let desk = desk();
    for line in [
        "run missing.toml --set peers.",
        "run half.toml --set peers.",
        "fly --set scene.",
        "run -",
        "run two.toml --set a..b.",
        "admittance --peer x",
    ] {
        assert_eq!(desk.text(&format!("completions bash -- {line}")), "", "{line}");
    }
}
