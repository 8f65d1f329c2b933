//! `cohaptic exec` with `--seeds`, `--runs`, `--lose` and `--json`, with real commands in namespaces.

use std::net::UdpSocket;
use std::os::unix::process::CommandExt as _;
use std::thread;
use std::time::Duration;

use serde_json::json;

use crate::integration::desk::{Desk, parse};
use crate::integration::exec::{can_ping, can_run, with_role};
use crate::integration::exec_hosts::net;
use crate::integration::running::{PATIENCE, Running};

/// A server of the real machine that sends back what each datagram brings.
fn datagram_server() -> u16 {
    let server = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = server.local_addr().unwrap().port();
    thread::spawn(move || {
        let mut data = [0; 64];
        while let Ok((length, from)) = server.recv_from(&mut data) {
            let _ = server.send_to(&data[..length], from);
        }
    });
    port
}

/// The search names the failed seeds with their lost packets, and prints the command line that loses the first packet alone. The line fails as it stands.
#[test]
fn a_search_finds_the_lost_packet_behind_failed_seeds() {
    if !can_run() {
        return;
    }
    let (desk, port) = (Desk::new(), datagram_server());
    let role = format!("each 10.0.2.2:{port} 6");
    let outcome = Running::begin(with_role(&desk, "'delay 1ms loss 15%' --seeds 1..4 --runs 2 --out out", &role)).end();
    assert_eq!(outcome.status, Some(7), "{}\n{}", outcome.stdout, outcome.stderr);
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert_eq!(lines[0], "losing nothing: passes");
    let seeds: Vec<bool> =
        lines.iter().filter_map(|line| line.strip_prefix("seed ")).map(|line| line.contains(": fails with status 7, lost ")).collect();
    assert!(seeds.len() == 4 && seeds.contains(&true), "{}", outcome.stdout);
    let last =
        lines.iter().position(|line| *line == "the command fails 2 of 2 times if 1 packet is lost:").unwrap_or_else(|| panic!("{}", outcome.stdout));
    // Nothing comes before packet 0 of a link, so that nothing is simpler.
    let line = lines[last + 1].trim();
    assert!(line.starts_with("cohaptic exec 'delay 1ms loss 15%' --lose '") && line.contains(": 0' -- "), "{line}");
    assert!(outcome.stdout.contains("  | ") && outcome.stdout.contains("has no answer"), "{}", outcome.stdout);
    assert!(desk.read("out/report.txt").contains("dropped packets = [0]\n"), "{}", desk.read("out/report.txt"));

    let lost = line.split('\'').nth(3).unwrap();
    let options = format!("'delay 1ms loss 15%' --lose '{lost}' --runs 2 --json");
    let outcome = Running::begin(with_role(&desk, &options, &role)).end();
    let document = parse(&outcome.stdout);
    assert_eq!((outcome.status, &document["verdict"], &document["failed"], &document["of"]), (Some(7), &json!("failed"), &json!(2), &json!(2)));
    // Without the packet the command passes, whatever the seed.
    assert_eq!(Running::begin(with_role(&desk, "'delay 1ms loss 15%' --lose none", &role)).end().status, Some(0));
}

/// A command that fails over the link without a lost packet, and passes over ideal links: the delay is the cause.
#[test]
fn a_search_says_that_the_delay_is_the_cause() {
    if !can_ping() {
        return;
    }
    // The round trip of 1.4 s is longer than the deadline of a second.
    let outcome = Desk::new().cohaptic("exec 'delay 700ms loss 1%' --seeds 1..9 --runs 2 --no-priority -- timeout 1 ping -c 1 host");
    assert_eq!(outcome.status, Some(124), "{outcome:?}");
    for part in [
        "over ideal links: passes\n",
        "the command fails 2 of 2 times without a lost packet:\n  cohaptic exec 'delay 700ms loss 1%' --lose none -- timeout 1 ping",
    ] {
        assert!(outcome.stdout.contains(part), "{}", outcome.stdout);
    }
}

/// Causes that are no lost packets are told apart, and a signal ends all trials.
#[test]
fn a_search_says_what_is_not_due_to_lost_packets() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    let outcome = desk.cohaptic("exec 'delay 1ms loss 1%' --seeds 1..9 --runs 2 --no-priority -- sh -c 'echo spoken; exit 3'");
    assert_eq!(outcome.status, Some(3), "{outcome:?}");
    for part in [
        "losing nothing: fails 2 of 2 times\nover ideal links: fails 2 of 2 times\nthe command fails over ideal links too\nno packet has passed a link",
        "\nwith --loopback, packets of the command to localhost pass a link too. ",
        " as in\n  -- env SERVER=http://host:8000 COMMAND\n",
        "  | spoken\n",
    ] {
        assert!(outcome.stdout.contains(part), "{}", outcome.stdout);
    }
    let outcome = desk.cohaptic("exec 'delay 1ms loss 1%' --seeds 1..3 --no-priority --json -- true");
    let document = parse(&outcome.stdout);
    assert_eq!((outcome.status, &document["verdict"], document["seeds"].as_array().unwrap().len()), (Some(0), &json!("passed"), 3));
    // The steps of the search go to standard error, where `-q` leaves out all but errors.
    assert!(outcome.stderr.contains("losing nothing: passes\n") && outcome.stderr.contains("seed 3: passes"), "{}", outcome.stderr);
    assert_eq!(desk.cohaptic("exec 'delay 1ms loss 1%' --seeds 1..3 --no-priority --json -q -- true").stderr, "");
    // More losses would find nothing in a command that sends no packet.
    let outcome = desk.cohaptic("exec 'delay 1ms loss 1%' --seeds 1..3 --no-priority -- true");
    assert!(outcome.stdout.contains("the command passes with 3 seeds\nno packet has passed a link"), "{}", outcome.stdout);
    let outcome = desk.cohaptic("exec 'delay 1ms loss 1%' --loopback --runs 1 --no-priority -- true");
    assert_eq!(outcome.stdout, "run 1: passes, lost nothing\nthe command passes 1 of 1 times\nno packet has passed a link\n");
    desk.write("net.toml", net("command = \"true\"", "command = \"true\""));
    let outcome = desk.cohaptic("exec net.toml --runs 1 --no-priority");
    assert!(
        outcome.stdout.ends_with("no packet has passed a link\nhosts reach each other by their names, as in http://server:8000\n"),
        "{}",
        outcome.stdout
    );

    let mut command =
        desk.command("exec 'delay 1ms' --runs 100 --no-priority -- sh -c 'echo ready >>said; sleep 0.1; [ $(wc -l <said) -lt 3 ] || sleep 1000'");
    command.process_group(0);
    let running = Running::begin(command);
    while desk.files("").iter().all(|name| name != "said") || desk.read("said").lines().count() < 3 {
        thread::sleep(Duration::from_millis(10));
    }
    let outcome = running.end_by("-TERM");
    assert_eq!((outcome.status, outcome.stdout.lines().count()), (Some(143), 2), "{outcome:?}");
    assert_eq!(outcome.stderr, "interrupted: a signal has ended the trials\n");
}

/// A signal in the midst of a search keeps the failed seeds, and the smallest case found so far, with its command line.
#[test]
fn an_ended_search_says_what_it_has_found() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    // Run 1 passes, two seeds and their case fail, and the run after these waits for the signal.
    let script = "echo ready >>tried; n=$(wc -l <tried); [ $n -lt 6 ] || sleep 1000; [ $n -eq 1 ]";
    let mut command = desk.command(&format!("exec 'delay 1ms' --seeds 1..2 --runs 2 --no-priority -- sh -c '{script}'"));
    command.process_group(0);
    let running = Running::begin(command);
    while desk.files("").iter().all(|name| name != "tried") || desk.read("tried").lines().count() < 6 {
        thread::sleep(Duration::from_millis(10));
    }
    let outcome = running.end_by("-TERM");
    assert_eq!(outcome.status, Some(143), "{outcome:?}");
    let found =
        "trials\n2 of 2 seeds fail: 1, 2\nthe command fails 2 of 2 times without a lost packet:\n  cohaptic exec 'delay 1ms' --lose none -- sh -c ";
    assert!(outcome.stderr.contains(found), "{}", outcome.stderr);
}

/// Under `--json` standard output has the document alone, for a command and for a file.
#[test]
fn the_document_stands_alone_on_standard_output() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    let outcome = desk.cohaptic("exec 'delay 1ms' --no-priority --json -- sh -c 'echo spoken; exit 4'");
    let document = parse(&outcome.stdout);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(4), "spoken\n"), "{outcome:?}");
    assert_eq!((&document["schema"], &document["status"], &document["hosts"][0]["status"]), (&json!("cohaptic/exec"), &json!(4), &json!(4)));
    assert_eq!((&document["links"][0]["from"], &document["links"][0]["to"]), (&json!("command"), &json!("world")));
    desk.write("net.toml", net("command = \"echo one\"", "command = \"sleep 0.2; echo two; exit 5\"\nmain = true"));
    let outcome = desk.cohaptic("exec net.toml --no-priority --json");
    let document = parse(&outcome.stdout);
    assert_eq!((outcome.status, &document["hosts"][1]["status"]), (Some(5), &json!(5)));
    assert!(outcome.stderr.contains("server | one\n") && outcome.stderr.contains("client | two\n"), "{}", outcome.stderr);
    let outcome = desk.cohaptic("exec 'delay 1ms' --json -- no-such-command");
    let document = parse(&outcome.stdout);
    assert_eq!((outcome.status, &document["schema"], &document["status"]), (Some(127), &json!("cohaptic/error"), &json!(127)), "{outcome:?}");
}

#[test]
fn wrong_trials_are_refused() {
    let desk = Desk::new();
    for (options, parts) in [
        ("--seeds 40", &["expected the first and the last seed, such as 1..40"][..]),
        ("--seeds 40..1", &["expected 1..40"]),
        ("--seeds 1..2 --seed 3", &["cannot be used with"]),
        ("--seeds 1..2 --lose none", &["cannot be used with"]),
        ("--runs 0", &["--runs"]),
        ("--until-failure", &["--seeds"]),
        ("--lose 'here -> world: 0'", &["there is no host \"here\" among command, world"]),
        ("--lose 'command -> loopback: 0'", &["there is no host \"loopback\" among command, world"]),
        ("--loopback --lose 'world -> loopback: 0'", &["there is no link from world to loopback"]),
    ] {
        let outcome = desk.cohaptic_within(PATIENCE, &format!("exec 'delay 1ms' {options} -- true"));
        assert_eq!(outcome.status, Some(125), "{options}: {outcome:?}");
        assert!(parts.iter().all(|part| outcome.stderr.contains(part)), "{options}: {}", outcome.stderr);
    }
}
