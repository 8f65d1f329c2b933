//! The help of every command, read as a user and as a program would.

use clap::Command;

use super::Arguments;

/// Returns every command with its full name, including the program itself.
fn commands() -> Vec<(String, Command)> {
    fn walk(name: &str, command: &Command, all: &mut Vec<(String, Command)>) {
        all.push((name.to_owned(), command.clone()));
        for inner in command.get_subcommands() {
            walk(&format!("{name} {}", inner.get_name()), inner, all);
        }
    }
    let mut all = Vec::new();
    walk("cohaptic", &Arguments::program().disable_help_subcommand(true), &mut all);
    all
}

/// Words as a shell makes them of a line without quotes, up to where its output goes.
fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().take_while(|word| *word != ">").collect()
}

fn examples(command: &Command) -> Vec<String> {
    let after = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let listed = after.strip_prefix("Examples:\n").unwrap_or_default();
    let lines = listed.lines().take_while(|line| !line.is_empty());
    lines.flat_map(|line| line.split('|')).map(|line| line.trim().to_owned()).collect()
}

#[test]
fn help_is_plain_text() {
    for (name, mut command) in commands() {
        for help in [command.render_help().to_string(), command.render_long_help().to_string()] {
            for residue in ["\\", "`", "**", "](", "[["] {
                assert!(!help.contains(residue), "{residue} in the help of {name}:\n{help}");
            }
        }
    }
}

#[test]
fn every_command_has_examples_and_each_can_be_typed() {
    let all = commands();
    assert!(all.len() >= 25, "{}", all.len());
    for (name, mut command) in all {
        for help in [command.render_help().to_string(), command.render_long_help().to_string()] {
            assert!(help.contains("\nExamples:\n  cohaptic "), "{name}:\n{help}");
        }
        let examples = examples(&command);
        assert!(!examples.is_empty(), "{name}");
        // A line of a hundred columns holds each whole, so that it can be copied.
        assert!(
            command.get_after_help().is_some_and(|text| text.to_string().lines().take(examples.len()).all(|line| line.chars().count() <= 100)),
            "{name}"
        );
        for example in &examples {
            Arguments::of(words(example).into_iter().map(Into::into)).unwrap_or_else(|error| panic!("{example}: {error}"));
        }
        assert!(examples.iter().any(|example| example.starts_with(&name)), "no example of {name}");
    }
}

#[test]
fn scenes_in_examples_ship_with_the_program() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (_, command) in commands() {
        for example in examples(&command) {
            for word in words(&example).into_iter().filter(|word| word.starts_with("scenarios")) {
                assert!(root.join(word).exists(), "{example}");
            }
        }
    }
}

/// Returns the `KEY=VALUE` of each `--set KEY=VALUE` in a text.
fn overrides(text: &str) -> Vec<String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    words.windows(2).filter(|pair| pair[0] == "--set" && pair[1].contains('=') && !pair[1].starts_with('<')).map(|pair| pair[1].to_owned()).collect()
}

fn shown(name: &str) -> Vec<String> {
    let (_, command) = commands().into_iter().find(|(known, _)| known == name).unwrap();
    // Unwrapped, so that no text is cut in two.
    overrides(&command.term_width(10_000).render_long_help().to_string())
}

#[test]
fn the_help_of_relay_router_and_run_shows_keys_that_they_have() {
    let relay = "link = {}\n[[programs]]\nname = \"left\"\nport = \"127.0.0.1:7001\"\n[[programs]]\nname = \"right\"\nport = \"127.0.0.1:7002\"\n";
    let router = "router.default = \"wan\"\nleft.tun = \"left0\"\nright.tun = \"right0\"\nlinks.wan = {}\n";
    let scene = include_str!("../../../../scenarios/paper/5-1-ap-2100.toml");
    let path = std::path::Path::new("file.toml");
    for (name, least) in [("cohaptic relay", 4), ("cohaptic router", 3), ("cohaptic run", 3)] {
        let shown = shown(name);
        assert!(shown.len() >= least, "{name}: {shown:?}");
        for set in shown {
            let set = std::slice::from_ref(&set);
            let read = match name {
                "cohaptic relay" => cohaptic_linkfile::RelayFile::parse(relay, path, set).map(drop),
                "cohaptic router" => cohaptic_linkfile::router::RouterFile::parse(router, path, set).map(drop),
                _ => cohaptic_scene::Scene::parse(scene, path, set).map(drop),
            };
            read.unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }
}
