//! `cohaptic exec` with a file of hosts, with real commands in namespaces.

use std::env;
use std::fs;
use std::os::unix::process::CommandExt as _;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::integration::desk::Desk;
use crate::integration::exec::{ROLE, can_run, echo_server};
use crate::integration::running::{PATIENCE, Running};

/// A file with a server and a client, whose further keys and commands are given.
pub(super) fn net(server: &str, client: &str) -> String {
    format!("[[hosts]]\nname = \"server\"\n{server}\n[[hosts]]\nname = \"client\"\n{client}\n[link]\ndelay = \"10ms\"\n")
}

/// Returns the key `command` with this test program, in a role of [`be_inside`](super::exec::be_inside).
fn command_in_role(role: &str) -> String {
    let program = env::current_exe().unwrap();
    format!("command = \"{ROLE}='{role}' exec {} integration::exec::be_inside --exact --nocapture\"", program.display())
}

/// Hosts of a file find each other by name, start in order, and have their names before their lines.
#[test]
fn hosts_of_a_file_speak_over_their_links() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    let server = command_in_role("serve 80") + "\nready = \"ready\"";
    let client = "command = \"hostname; ping -c 1 -W 60 server >/dev/null && echo pong; exec 3<>/dev/tcp/server/80\"";
    // A shell without /dev/tcp is of no use here, so the client is this program too.
    let client = client.replace("exec 3<>/dev/tcp/server/80", "true")
        + "\n[[hosts]]\nname = \"other\"\n"
        + &command_in_role("echo server:80 3000")
        + "\nmain = true";
    desk.write("net.toml", net(&server, &client));
    let outcome = desk.cohaptic_within(PATIENCE, "exec net.toml --no-priority --set links.other.server.delay=40ms --out out");
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    let said: Vec<&str> =
        outcome.stdout.lines().filter_map(|line| line.strip_prefix("other | ")?.split_once("inside: ")).map(|(_, said)| said).collect();
    assert!(said[0].parse::<u64>().unwrap() >= 50 && said[1] == "the same", "{outcome:?}");
    assert!(outcome.stdout.contains("client | client\n"), "{outcome:?}");
    assert!(outcome.stderr.contains("server | ready\n"), "{outcome:?}");
    assert_eq!(desk.files("out").iter().filter(|name| !name.starts_with('.')).count(), 4);
    let report = desk.read("out/report.txt");
    // The server waited for a datagram that never came, so that it was asked to end.
    for part in ["server: sh -c ", "other: sh -c ", "ended with status 0", "ended with status 143", "  other -> server: ", "mean delay 40.0"] {
        assert!(report.contains(part), "no {part:?} in {report}");
    }
}

#[test]
fn the_main_host_or_the_first_failure_decides_the_status() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    for (server, client, status) in [
        ("command = \"exit 3\"", "command = \"sleep 0.3; exit 4\"\nmain = true", 4),
        ("command = \"sleep 0.3; exit 5\"", "command = \"exit 0\"", 5),
        ("command = \"exit 0\"", "command = [\"true\"]", 0),
        ("command = \"sleep 1000\"", "command = \"exit 6\"", 6),
        // A host that fails before it is ready lets the others start, and its status counts.
        ("command = \"exit 7\"\nready = \"never\"", "command = \"sleep 1000\"", 7),
        ("command = [\"no-such-command\"]", "command = \"sleep 1000\"", 127),
    ] {
        desk.write("net.toml", net(server, client));
        let outcome = desk.cohaptic_within(PATIENCE, "exec net.toml --no-priority");
        assert_eq!(outcome.status, Some(status), "{server} {client}: {outcome:?}");
    }
    // A command that does not end by SIGTERM is killed after 5 s.
    desk.write("net.toml", net("command = \"trap '' TERM; while :; do sleep 1; done\"", "command = \"sleep 0.2\"\nmain = true"));
    let begin = Instant::now();
    assert_eq!(desk.cohaptic_within(PATIENCE, "exec net.toml --no-priority").status, Some(0));
    assert!(begin.elapsed() >= Duration::from_secs(5));
}

/// A command that waits when a signal comes never starts, and the status does not say that it has succeeded.
#[test]
fn a_signal_ends_a_run_whose_main_command_still_waits() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    // A server that survives the signal to the whole group, by ignoring it, and one that ends well by it.
    for (server, signal, status) in [
        ("trap '' INT; echo up >&2; while :; do sleep 0.1; done", "-INT", 130),
        ("trap 'exit 0' TERM; echo up >&2; while :; do sleep 0.1; done", "-TERM", 143),
    ] {
        desk.write("net.toml", net(&format!("command = \"{server}\"\nready = \"never\""), "command = \"echo started\"\nmain = true"));
        let mut command = desk.command("exec net.toml --no-priority");
        command.process_group(0);
        let running = Running::begin(command);
        running.said("server | up");
        assert!(Command::new("kill").args([signal, "--", &format!("-{}", running.id())]).status().unwrap().success());
        let outcome = running.end();
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(status), ""), "{server}: {outcome:?}");
    }
}

/// A command counts as killed if its host is killed while the command waits.
#[test]
fn a_host_that_is_killed_before_its_command_starts_fails_the_run() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    desk.write("net.toml", net("command = \"echo up >&2; sleep 5\"\nready = \"never\"", "command = \"echo started\"\nmain = true"));
    let running = Running::begin(desk.command("exec net.toml --no-priority"));
    running.said("server | up");
    let parent = format!("\nPPid:\t{}\n", running.id());
    let is_of_client = |pid: &String| {
        let read = |file: &str| fs::read_to_string(format!("/proc/{pid}/{file}")).unwrap_or_default();
        read("status").contains(&parent) && read("cmdline").contains("echo started")
    };
    let processes = fs::read_dir("/proc").unwrap().filter_map(|entry| entry.unwrap().file_name().into_string().ok());
    let client: Vec<String> = processes.filter(is_of_client).collect();
    assert_eq!(client.len(), 1, "{client:?}");
    assert!(Command::new("kill").args(["-KILL", &client[0]]).status().unwrap().success());
    let outcome = running.end();
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(137), ""), "{outcome:?}");
}

/// With a world, hosts of a file reach the real machine over the links to the world.
#[test]
fn a_file_may_have_the_real_world() {
    if !can_run() {
        return;
    }
    let (desk, server) = (Desk::new(), echo_server());
    let host = command_in_role(&format!("echo host:{} 3000", server.port()));
    desk.write(
        "net.toml",
        format!(
            "[exec]\nworld = \"internet\"\n[[hosts]]\nname = \"client\"\n{host}\n[[links]]\nfrom = \"client\"\nto = \"internet\"\ndelay = \"30ms\"\n"
        ),
    );
    let outcome = desk.cohaptic_within(PATIENCE, "exec net.toml --no-priority");
    assert!(outcome.status == Some(0) && outcome.stdout.contains("inside: the same"), "{outcome:?}");
}

#[test]
fn a_bad_file_is_refused_with_its_place() {
    let desk = Desk::new();
    let (two, link) = (net("command = \"true\"", "command = \"true\""), "[[links]]\nfrom = \"server\"\nto = \"client\"\n");
    for (text, parts) in [
        (net("command = \"true\"", "command = \"\""), &["net.toml:6:11: hosts.1.command: there is no command: expected a line for sh"][..]),
        (net("command = \"true\"", "command = [\"true\", 1]"), &["hosts.1.command.1", "a word of the command"]),
        (net("command = \"true\"", "command = \"true\"").replace("\"client\"", "\"server\""), &["there is a host \"server\" already"]),
        (net("command = \"true\"", "command = \"true\"").replace("\"client\"", "\"host\""), &["\"host\" cannot be the name of a host"]),
        (net("command = \"true\"\nmain = true", "command = \"true\"\nmain = true"), &["host \"server\" is the main one already"]),
        (net("command = \"true\"\nready = \"\"", "command = \"true\""), &["expected a text that the command writes"]),
        ("[[hosts]]\nname = \"alone\"\ncommand = \"true\"\n".to_owned(), &["one host alone has no link", "world = \"world\""]),
        ("[exec]\nworld = \"a\"\n[[hosts]]\nname = \"a\"\ncommand = \"true\"\n".to_owned(), &["there is a host \"a\" already"]),
        (net("command = \"true\"", "comand = \"true\""), &["comand", "did you mean \"command\"?"]),
        (format!("{two}trace = 3\n"), &["expected the name of a recording, relative to the folder of this file"]),
        (format!("{two}trace = \"none.csv\"\n"), &["cannot read none.csv", "expected a file, relative to the folder of this file"]),
        (format!("{two}{link}{link}"), &["expected one entry for each direction between two hosts"]),
        (format!("{two}[[links]]\nfrom = \"client\"\nto = \"sever\"\n"), &["there is no host \"sever\"", "did you mean \"server\"?"]),
    ] {
        desk.write("net.toml", &text);
        desk.cohaptic_within(PATIENCE, "exec net.toml").assert_refused(125, parts);
    }
    assert_eq!(desk.cohaptic_within(PATIENCE, "exec net.toml --set link.delay=1ms -- true").status, Some(125));
}
