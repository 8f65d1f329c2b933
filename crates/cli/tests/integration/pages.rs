//! `init`, `schema`, `completions` and `man`.

use crate::integration::desk::{Desk, parse};
use crate::integration::scenes::TWO;

#[test]
fn a_scene_to_begin_with_passes_its_own_check() {
    let desk = Desk::new();
    assert_eq!(desk.cohaptic("init").status, Some(0));
    assert_eq!(desk.text("init -"), desk.read("scene.toml"));
    desk.cohaptic("init four.toml --from paper/5-1 --peers 4");
    let checked = desk.text("check scene.toml four.toml");
    assert!(checked.contains("ok    scene.toml\n") && checked.ends_with("2 passed, 0 failed\n"), "{checked}");
    assert_eq!(desk.json("run four.toml --json")["peers"].as_array().unwrap().len(), 4);
}

/// Each shipped scene is accepted with 2 and with 5 peers. A scene keeps its expectations only with its own number of peers, so that `check` simulates few
/// scenes.
#[test]
fn every_scene_of_the_list_is_written_and_accepted() {
    let desk = Desk::new();
    let list = desk.text("init --list");
    let names: Vec<&str> = list.lines().map(|line| line.split_whitespace().next().unwrap()).collect();
    assert!(names.len() > 70 && names.contains(&"paper/5-1") && names.contains(&"network/loss-independent"), "{list}");
    for (number, name) in names.iter().enumerate() {
        for peers in [2, 5] {
            let file = format!("scenes/{number}-{peers}.toml");
            std::fs::create_dir_all(desk.path("scenes")).unwrap();
            let written = desk.cohaptic(&format!("init {file} --from {name} --peers {peers} --force"));
            assert_eq!(written.status, Some(0), "{name}: {}", written.stderr);
        }
    }
    // A scene whose own number of peers this is keeps its expectations; the others pass without being run.
    let checked = desk.cohaptic("check scenes");
    assert_eq!(checked.status, Some(0), "{}", checked.stdout);
}

#[test]
fn nothing_is_written_over_unless_forced() {
    let desk = Desk::with("scene.toml", "mine");
    desk.cohaptic("init").assert_refused(2, &["scene.toml exists already", "--force"]);
    assert_eq!(desk.read("scene.toml"), "mine");
    assert_eq!(desk.cohaptic("init --force").status, Some(0));
    assert!(desk.read("scene.toml").contains("[coordination]"));
    desk.cohaptic("init new.toml --from paper/9").assert_refused(2, &["paper/9", "--list"]);
    desk.cohaptic("init new.toml --peers 1").assert_refused(2, &["--peers", "2"]);
    assert!(!desk.path("new.toml").exists());
}

#[test]
fn a_schema_of_each_kind_of_file_is_printed() {
    let desk = Desk::new();
    for (kind, title, key) in [
        ("", "cohaptic scene", "coordination"),
        ("relay", "cohaptic relay file", "programs"),
        ("router", "cohaptic router file", "rules"),
        ("study", "cohaptic study file", "conditions"),
    ] {
        let schema = parse(&desk.text(&format!("schema {kind}")));
        assert_eq!((&schema["$schema"], &schema["title"]), (&"http://json-schema.org/draft-07/schema#".into(), &title.into()));
        assert!(schema["properties"][key]["description"].is_string(), "{kind}");
    }
    desk.cohaptic("schema robot").assert_refused(2, &["robot"]);
}

#[test]
fn completions_of_every_shell_name_commands_and_options() {
    let desk = Desk::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = desk.text(&format!("completions {shell}"));
        assert!(["campaign", "losses-in-a-row", "token-file"].iter().all(|word| script.contains(word)), "{shell}");
    }
}

#[test]
fn there_is_a_manual_page_of_every_command() {
    let desk = Desk::new();
    let written = desk.cohaptic("man --out man1");
    assert_eq!(written.status, Some(0));
    let pages = desk.files("man1");
    for page in ["cohaptic.1", "cohaptic-run.1", "cohaptic-stability-map.1", "cohaptic-falcon-watch.1", "cohaptic-man.1"] {
        assert!(pages.contains(&page.to_owned()), "{pages:?}");
        assert!(desk.read(&format!("man1/{page}")).contains(".SH SYNOPSIS"), "{page}");
    }
    assert_eq!(written.stderr.lines().count(), pages.len());
    assert_eq!(desk.text("man"), desk.read("man1/cohaptic.1"));
    assert_eq!(desk.text("man stability map"), desk.read("man1/cohaptic-stability-map.1"));
    assert!(desk.text("man run").contains("Examples:"));
    desk.cohaptic("man fly").assert_refused(2, &["\"fly\"", "expected one of run, check"]);
}

/// `cohaptic init - | cohaptic run -` is one of the examples.
#[test]
fn what_init_prints_can_be_run() {
    let desk = Desk::with("two.toml", TWO);
    let scene = desk.text("init - --from network/ideal");
    assert_eq!(desk.piped("run - --json", scene).status, Some(0));
}
