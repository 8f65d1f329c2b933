use super::*;

/// Returns the lines of the answer for a line whose last word is being typed.
fn answers(shell: Shell, line: &str) -> Vec<String> {
    let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
    answer(shell, &words).lines().map(str::to_owned).collect()
}

/// Returns the answers without their meanings, joined by spaces.
fn fish(line: &str) -> String {
    let texts: Vec<String> = answers(Shell::Fish, line).iter().map(|line| line.split('\t').next().unwrap_or_default().to_owned()).collect();
    texts.join(" ")
}

#[test]
fn a_key_is_completed_part_by_part() {
    assert_eq!(fish("run --set scen"), "scene.");
    assert_eq!(fish("run --set scene.dur"), "scene.duration=");
    assert_eq!(fish("run --set link.lo"), "link.loss= link.loss.");
    assert_eq!(fish("run --set link.loss.tok"), "");
    assert!(fish("run --set link.queue.").contains("link.queue.limit="), "{}", fish("run --set link.queue."));
    assert_eq!(fish("run --set nothing.dur"), "");
    assert_eq!(
        answers(Shell::Fish, "run --set object.ma")[0].split_once('\t').map(|(key, about)| (key, about.is_empty())),
        Some(("object.mass=", false))
    );
}

#[test]
fn words_of_a_key_are_completed_after_the_equals_sign() {
    assert_eq!(fish("run --set coordination.strategy=prop"), "coordination.strategy=proportional-derivative");
    assert_eq!(fish("check --set scene.duration="), "");
}

/// The option is found wherever it stands, in every form of an option, after flags and after the values of other options.
#[test]
fn the_option_is_found_in_each_form() {
    for before in [
        "run --set ",
        "run -s ",
        "-q run --json --seed -3 --set ",
        "stability map --x ",
        "stability a.toml --set ",
        "relay --back delay 5ms --set relay.",
        "run -- ",
    ] {
        let key = if before.starts_with("relay") { "see" } else { "scene.se" };
        let expected = if before.starts_with("relay") {
            "relay.seed="
        } else if before.ends_with("-- ") {
            ""
        } else {
            "scene.seed="
        };
        assert_eq!(fish(&format!("{before}{key}")), expected, "{before}");
    }
    assert_eq!(fish("run --set=scene.se"), "scene.seed=");
    assert_eq!(fish("run -sscene.se"), "scene.seed=");
    assert_eq!(answers(Shell::Zsh, "run --set=scene.se")[0].split('\t').next(), Some("--set=scene.seed="));
    assert_eq!(answers(Shell::Zsh, "run -qsscene.se")[0].split('\t').next(), Some("-qsscene.seed="));
    // A list with commas goes on after its last comma.
    assert_eq!(fish("stability map --curve scene.count=3,scene.se"), "scene.count=3,scene.seed=");
    // Not the values of an option, but options and commands, which the script knows.
    for line in ["run --se", "ru", "", "run --out ", "run --seed ", "run -s", "stability po", "completions ba"] {
        assert_eq!(fish(line), "", "{line}");
    }
}

/// Bash splits words at `=` and `:`, and replaces the part after the last break, so that an answer is this part alone.
#[test]
fn bash_gets_what_stands_after_the_last_break() {
    assert_eq!(answers(Shell::Bash, "run --set = scene.se"), ["scene.seed="]);
    assert_eq!(answers(Shell::Bash, "run --set coordination.strategy = prop"), ["proportional-derivative"]);
    assert!(answers(Shell::Bash, "run --set coordination.strategy =").contains(&"average-position".to_owned()));
    assert_eq!(answers(Shell::Bash, "run --set link.delay = 8ms --set scene.se"), ["scene.seed="]);
}

#[test]
fn every_argument_with_a_key_has_answers() {
    let program = Arguments::program();
    let mut commands = vec![&program];
    let mut count = 0;
    while let Some(command) = commands.pop() {
        commands.extend(command.get_subcommands());
        for arg in command.get_arguments() {
            let name = arg.get_value_names().and_then(|names| names.first()).map_or("", |name| name.as_str());
            let is_known = Kind::of(arg, command.get_name()).is_some();
            assert!(is_known || !(name.starts_with("KEY") || matches!(name, "SCENE" | "PEER")), "{name} of {}", command.get_name());
            count += usize::from(is_known);
        }
    }
    // `--set` and the file of 14 commands, and what `campaign`, `compare`, `stability` and `admittance` vary.
    assert!(count > 30, "{count}");
}
