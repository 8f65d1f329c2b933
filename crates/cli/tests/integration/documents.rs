//! JSON documents, which name their schema, also for errors, and the form of messages.

use std::process::Stdio;

use serde_json::json;

use crate::integration::desk::{Desk, Outcome, parse};
use crate::integration::scenes::TWO;

#[test]
fn a_document_names_its_schema_and_version_before_all_else() {
    let desk = Desk::with("two.toml", TWO);
    for (line, schema) in [
        ("run two.toml --json", "cohaptic/run"),
        ("check two.toml --json", "cohaptic/check"),
        ("explain two.toml --json", "cohaptic/explain"),
        ("campaign two.toml --out out --json", "cohaptic/campaign"),
        ("compare two.toml --strategies average-position,extrapolated --runs 2 --out compared --json", "cohaptic/compare"),
        ("stability point two.toml --json", "cohaptic/stability-point"),
        ("stability map two.toml --x coordination.stiffness=1..2 --y coordination.damping=0..1 --grid 2x2 --json", "cohaptic/stability-map"),
        ("stability map two.toml --x coordination.stiffness=1..2 --y coordination.damping=0..1 --prove 1 --json", "cohaptic/stability-region"),
        ("stability boundary two.toml --along coordination.stiffness=1..2 --prove --json", "cohaptic/stability-line"),
        ("stability boundary two.toml --along coordination.stiffness=1..2 --samples 3 --json", "cohaptic/stability-boundary"),
        ("admittance two.toml --peer left --at 1 --json", "cohaptic/admittance"),
        ("link delay 20ms 2ms --packets 1000 --fates fates.csv --json", "cohaptic/link"),
        ("fit fates.csv --json", "cohaptic/fit"),
        ("falcon simulate --for 10ms --json", "cohaptic/falcon-simulate"),
        ("inverse3 simulate --for 10ms --json", "cohaptic/inverse3-simulate"),
    ] {
        let text = desk.text(line);
        assert!(text.starts_with(&format!("{{\n  \"schema\": \"{schema}\",\n  \"version\": 1,\n")), "{line}: {text}");
        parse(&text);
    }
}

#[test]
fn an_error_is_a_document_with_its_place_and_status() {
    let desk = Desk::with("two.toml", &TWO.replace("\"24ms\"", "\"24 parsecs\""));
    let outcome = desk.cohaptic("run two.toml --json");
    outcome.assert_refused(2, &["error: two.toml:27:9: link.delay: "]);
    let document = parse(&outcome.stdout);
    assert!(outcome.stdout.starts_with("{\n  \"schema\": \"cohaptic/error\",\n  \"version\": 1,\n"), "{}", outcome.stdout);
    assert_eq!(document["status"], 2);
    assert_eq!(outcome.stderr, format!("error: {}\n", document["message"].as_str().unwrap()));
    let place = &document["place"];
    assert_eq!((&place["file"], &place["line"], &place["column"], &place["key"]), (&json!("two.toml"), &json!(27), &json!(9), &json!("link.delay")));
    assert_eq!(place["argument"], json!(null));
    assert!(place["fault"].as_str().unwrap().starts_with("unknown unit \"parsecs\""), "{document:#}");
}

#[test]
fn errors_of_arguments_files_and_options_are_documents() {
    let desk = Desk::with("two.toml", TWO);
    for (line, status, place) in [
        ("run two.toml --json --set link.dlay=8ms", 2, json!("--set link.dlay=8ms")),
        ("run two.toml --json --against link.dlay=8ms", 2, json!("--against link.dlay=8ms")),
        ("run nowhere.toml --json", 3, json!(null)),
        ("run two.toml --json --fast", 2, json!(null)),
        ("link delay=1 --json", 2, json!("delay=1")),
        ("stability map two.toml --json", 2, json!(null)),
        ("admittance two.toml --peer nobody --json", 2, json!(null)),
        ("exec 'delay 1ms' --json --runs 0 -- true", 125, json!(null)),
    ] {
        let outcome = desk.cohaptic(line);
        outcome.assert_refused(status, &["error: "]);
        let document = parse(&outcome.stdout);
        assert_eq!((&document["schema"], &document["status"]), (&json!("cohaptic/error"), &json!(status)), "{line}");
        assert_eq!(document["place"]["argument"], place, "{document:#}");
    }
    // Without --json standard output stays empty.
    assert_eq!(desk.cohaptic("run two.toml --set link.dlay=8ms").stdout, "");
}

/// `CLICOLOR_FORCE` stands for a terminal, as with clap's own errors.
#[test]
fn errors_have_the_colours_of_clap_and_no_color_takes_them_away() {
    let desk = Desk::with("two.toml", TWO);
    let stderr = |line: &str, variables: &[(&str, &str)]| {
        let mut command = desk.command(line);
        command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE").envs(variables.iter().copied());
        Outcome::of(command.output().unwrap()).stderr
    };
    let ours = "run nowhere.toml";
    let forced = stderr(ours, &[("CLICOLOR_FORCE", "1")]);
    assert!(forced.starts_with("\u{1b}[1m\u{1b}[31merror:\u{1b}[0m nowhere.toml: cannot be read"), "{forced:?}");
    assert!(stderr("run --fast", &[("CLICOLOR_FORCE", "1")]).starts_with("\u{1b}[1m\u{1b}[31merror:\u{1b}[0m "));
    for variables in [&[][..], &[("NO_COLOR", "1"), ("CLICOLOR_FORCE", "1")]] {
        assert!(stderr(ours, variables).starts_with("error: nowhere.toml: cannot be read"));
    }
}

/// `cohaptic … | head -1`: 141 is what a shell says of a program that SIGPIPE ended.
#[test]
fn a_closed_pipe_ends_a_command_quietly() {
    let desk = Desk::with("two.toml", TWO);
    for line in ["run two.toml", "run two.toml --json", "explain two.toml", "check two.toml --json", "init -", "schema", "completions bash", "man"] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = desk.command(line).stdout(writer).stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        let outcome = Outcome::of(output);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(141), ""), "{line}");
    }
}

/// All commands name written files on standard error in the same words. A JSON document names its files itself.
#[test]
fn what_was_written_is_said_on_standard_error() {
    let desk = Desk::with("two.toml", TWO);
    for (line, last) in [
        ("run two.toml --out out", "wrote out/network.svg"),
        ("link delay 20ms 2ms --packets 1000 --fates fates.csv", "wrote fates.csv"),
        ("fit fates.csv --out link.toml", "wrote link.toml"),
        ("campaign two.toml --out campaign --format csv", "wrote campaign/runs.csv"),
        ("stability boundary two.toml --along coordination.stiffness=1..2 --samples 3 --out boundary", "wrote boundary/boundary.svg"),
        ("stability map two.toml --x coordination.stiffness=1..2 --y coordination.damping=0..1 --grid 2x2 --out map", "wrote map/map.svg"),
        ("admittance two.toml --peer left --at 1 --out bode", "wrote bode/admittance.svg"),
        ("init new.toml", "wrote new.toml"),
    ] {
        let outcome = desk.cohaptic(line);
        assert_eq!(outcome.status, Some(0), "{line}");
        let said: Vec<&str> = outcome.stderr.lines().collect();
        assert!(said.contains(&last) && said.iter().all(|line| line.strip_prefix("wrote ").is_some_and(|file| desk.path(file).exists())), "{said:?}");
        assert!(!outcome.stdout.contains("wrote ") && !outcome.stdout.contains(&last["wrote ".len()..]), "{}", outcome.stdout);
    }
    assert_eq!(desk.cohaptic("run two.toml --json --out out").stderr, "");
}

#[test]
fn the_seed_of_a_run_is_that_of_the_scene_replaced() {
    let noisy = TWO.replace("\"24ms\"", "\"24ms\"\nloss = 0.3");
    let desk = Desk::with("two.toml", &noisy);
    let links = |line: &str| desk.json(&format!("run two.toml --json {line}"))["links"].clone();
    assert_eq!(links("--seed 7"), links("--set scene.seed=7"));
    assert_ne!(links("--seed 7"), links("--seed 8"));
    // Of two, the option that names it.
    assert_eq!(links("--seed 7 --set scene.seed=8"), links("--seed 7"));
    desk.cohaptic("run two.toml --seed many").assert_refused(2, &["--seed", "many"]);
}

#[test]
fn threads_are_said_in_one_way_and_jobs_is_another_name() {
    let desk = Desk::with("two.toml", TWO);
    for option in ["--threads", "--jobs"] {
        for line in [
            "check two.toml OPTION 1",
            "campaign two.toml --out OPTION-1 OPTION 1",
            "stability map two.toml --x coordination.stiffness=1..2 --y coordination.damping=0..1 --grid 2x2 OPTION 1",
        ] {
            let outcome = desk.cohaptic(&line.replace("OPTION-1", option.trim_start_matches('-')).replace("OPTION", option));
            assert_eq!(outcome.status, Some(0), "{line} {option}: {}", outcome.stderr);
        }
    }
}
