//! `--help` and wrong usage.

use crate::integration::desk::Desk;
use crate::integration::scenes::TWO;

#[test]
fn help_names_the_commands() {
    let text = Desk::new().text("--help");
    assert!(
        [
            "run",
            "check",
            "explain",
            "campaign",
            "compare",
            "stability",
            "admittance",
            "play",
            "study",
            "relay",
            "router",
            "exec",
            "link",
            "fit",
            "paper",
            "init",
            "schema",
            "completions",
            "man",
            "Exit status: 0 done",
            "130 interrupted"
        ]
        .iter()
        .all(|word| text.contains(word)),
        "{text}"
    );
    assert!(Desk::new().text("--version").starts_with("cohaptic "));
}

#[test]
fn help_of_a_command_names_its_options_and_the_exit_status() {
    for (command, options) in [
        ("run", &["<SCENE>", "--set <KEY=VALUE>", "--json", "--against <KEY=VALUE>", "--out <DIR>", "--no-plot", "--general"][..]),
        ("check", &["<SCENE>...", "--set <KEY=VALUE>", "--json", "--threads <N>", "--jobs", "--general"]),
        ("explain", &["<SCENE>", "--set <KEY=VALUE>", "--json", "--cost", "--out <DIR>"]),
        (
            "campaign",
            &[
                "[SCENE]",
                "--set <KEY=VALUE>",
                "--json",
                "--vary <KEY=VALUES>",
                "--runs <N>",
                "--out <DIR>",
                "--format <FORMAT>",
                "--threads <N>",
                "--part <N>",
            ],
        ),
        (
            "compare",
            &[
                "<SCENE>",
                "--strategies <A,B{KEY=VALUE},...>",
                "--vary <KEY=VALUES>",
                "--preset <NAME>",
                "--runs <N>",
                "--out <DIR>",
                "--format <FORMAT>",
                "--json",
            ],
        ),
        ("stability point", &["<SCENE>", "--set <KEY=VALUE>", "--json", "--method <METHOD>"]),
        (
            "stability map",
            &[
                "<SCENE>",
                "--json",
                "--x <KEY=LO..HI>",
                "--y <KEY=LO..HI>",
                "--grid <WxH>",
                "--curve <KEY=VALUE,...>",
                "--against <KEY=VALUE>",
                "--out <DIR>",
            ],
        ),
        ("stability boundary", &["<SCENE>", "--json", "--along <KEY=LO..HI>", "--tolerance <T>", "--samples <N>", "--out <DIR>"]),
        (
            "link",
            &["[SPEC]...", "--from <FATES.csv>", "--packets <N>", "--every <TIME>", "--size <SIZE>", "--seed <N>", "--profile <PROFILE>", "--ecn"],
        ),
        ("fit", &["<FILE> [RECEIVER]", "--port <N>", "--skew", "--json", "--out <SCENE_LINK.toml>"]),
        (
            "admittance",
            &[
                "--peer <PEER>",
                "--from <HZ>",
                "--to <HZ>",
                "--points <N>",
                "--at <HZ,...>",
                "--curve <KEY=VALUE,...>",
                "--set <KEY=VALUE>",
                "--json",
                "--out <DIR>",
            ],
        ),
        ("paper", &["--out <DIR>", "--quick", "--json"]),
    ] {
        let text = Desk::new().text(&format!("{command} --help"));
        for part in options.iter().chain(&["Exit status: 0 done, 1 an expectation failed, 2 a bad argument or scene, 3 an input or output"]) {
            let words: Vec<&str> = text.split_whitespace().collect();
            assert!(words.join(" ").contains(part), "no {part:?} in {text}");
        }
    }
}

#[test]
fn wrong_usage_is_refused() {
    let desk = Desk::with("two.toml", TWO);
    for (line, part) in [
        ("", "Usage"),
        ("fly two.toml", "'fly'"),
        ("accuracy --quick", "cargo run --release -p cohaptic-accuracy"),
        ("run", "<SCENE>"),
        ("run two.toml another.toml", "another.toml"),
        ("run two.toml --set", "--set"),
        ("run two.toml --out", "--out"),
        ("run two.toml --fast", "--fast"),
        ("explain", "<SCENE>"),
        ("explain two.toml --general", "--general"),
        ("check --jobs many two.toml", "many"),
        ("check --jobs 100000 two.toml", "from 1 to 1024"),
    ] {
        desk.cohaptic(line).assert_refused(2, &[part]);
    }
}
