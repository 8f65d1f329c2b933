//! `cohaptic exec --loopback`: commands that speak to servers of their own, through the link.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::integration::desk::{Desk, Outcome};
use crate::integration::exec::{can_ping, can_run, echo_server, said_by};

/// Returns whether a program is installed.
fn has(program: &str) -> bool {
    Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
}

/// The handshake takes a round trip, and all data arrives in spite of the losses, at each address of the command. The world stays beyond a link of its own.
#[test]
fn connections_of_a_command_to_itself_pass_the_link() {
    if !can_run() {
        return;
    }
    let (desk, server) = (Desk::new(), echo_server());
    for said in said_by(&desk, "'delay 20ms loss 1%' --loopback", "own-tcp localhost 127.0.0.1 127.1.2.3 10.0.2.15") {
        let (handshake, is_same) = said.split_once(' ').unwrap();
        assert!(handshake.parse::<u64>().unwrap() >= 40 && is_same == "true", "{said}");
    }
    let said = said_by(&desk, "'delay 20ms' --loopback", &format!("echo host:{} 3000", server.port()));
    assert!(said[0].parse::<u64>().unwrap() >= 40 && said[1] == "the same", "{said:?}");
    assert_eq!(said_by(&desk, "'delay 1ms' --loopback", "refused 127.0.0.1:9"), ["ConnectionRefused ConnectionRefused"]);
}

/// Questions and answers have links of their own, whether the port of the server is the lower or the higher one.
#[test]
fn each_direction_has_its_own_link() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    for port in ["low", "high"] {
        for (options, said) in [
            ("'delay 1ms' --lose 'command -> loopback: 1'", "101 2"),
            ("'delay 1ms' --lose 'loopback -> command: 0'", "011 3"),
            ("'delay 1ms' --back 'loss 100%'", "000 3"),
            ("'loss 100%' --back 'delay 1ms'", "000 0"),
        ] {
            assert_eq!(said_by(&desk, &format!("{options} --loopback --out out"), &format!("own-udp {port} 3 100")), [said], "{port}: {options}");
        }
    }
    let report = desk.read("out/report.txt");
    for part in
        ["  command -> loopback: 3 offered", "  loopback -> command: ", "  command -> world: ", "  command -> loopback dropped packets = [0, 1, 2]\n"]
    {
        assert!(report.contains(part), "no {part:?} in {report}");
    }
    assert!(!report.contains("world -> loopback") && !report.contains("loopback -> world"), "{report}");
    let capture = fs::read(desk.path("out/command.pcapng")).unwrap();
    assert!(capture.windows(8).any(|part| part == [127, 0, 0, 1, 127, 0, 0, 1]));
}

/// A long datagram passes in seven fragments, all on the link of its direction.
#[test]
fn fragments_pass_the_link_of_their_datagram() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    for (lost, said) in [("none", "11 2"), ("command -> loopback: 6", "01 1"), ("loopback -> command: 6", "01 2")] {
        assert_eq!(said_by(&desk, &format!("'delay 1ms' --loopback --lose '{lost}'"), "own-udp low 2 9000"), [said], "{lost}");
    }
}

#[test]
fn an_echo_request_of_ping_and_its_reply_pass_the_link() {
    if !can_ping() {
        return;
    }
    let desk = Desk::new();
    for lost in ["command -> loopback: 0", "loopback -> command: 1"] {
        let outcome = desk.cohaptic(&format!("exec 'delay 10ms' --loopback --lose '{lost}' --no-priority -- ping -c 2 -i 0.2 127.0.0.1"));
        assert!(outcome.status == Some(0) && outcome.stdout.contains("2 packets transmitted, 1 received"), "{lost}: {outcome:?}");
    }
}

/// No way leads past the link: `localhost` is 127.0.0.1 alone, and `::1` is no address, to which a connection fails at once. A server at all addresses still
/// listens.
#[test]
fn localhost_has_no_address_of_ipv6() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    assert_eq!(said_by(&desk, "'delay 1ms' --loopback", "look-up localhost"), ["127.0.0.1"]);
    if Path::new("/proc/sys/net/ipv6").exists() {
        assert_eq!(said_by(&desk, "'delay 1ms' --loopback", "six"), ["Some(AddrNotAvailable) None HostUnreachable"]);
    }
}

/// A test as people write it: it starts its own server at localhost, and knows nothing of a bad network.
const OWN_TEST: &str = r#"
import socket, socketserver, threading, unittest

class Echo(socketserver.BaseRequestHandler):
    def handle(self):
        data, server = self.request
        server.sendto(data, self.client_address)

class Own(unittest.TestCase):
    def test_each_question_has_an_answer(self):
        with socketserver.UDPServer(("localhost", 0), Echo) as server, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            client.settimeout(1.5)
            for question in range(6):
                client.sendto(bytes([question]), ("localhost", server.server_address[1]))
                self.assertEqual(client.recv(10), bytes([question]))
            server.shutdown()
"#;

/// The search finds the lost packet in an unchanged test, and prints a command line with which the test fails each time.
#[test]
fn a_search_finds_the_lost_packet_in_an_unchanged_test() {
    if !can_run() || !has("python3") {
        return;
    }
    let desk = Desk::new();
    desk.write("test_own.py", OWN_TEST);
    let outcome = desk.cohaptic("exec 'delay 1ms loss 15%' --loopback --seeds 1..4 --runs 2 --no-priority -- python3 -m unittest -q test_own");
    assert_eq!(outcome.status, Some(1), "{outcome:?}");
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert_eq!(lines[0], "losing nothing: passes");
    let found = "the command fails 2 of 2 times if 1 packet is lost:";
    let last = lines.iter().position(|line| *line == found).unwrap_or_else(|| panic!("{}", outcome.stdout));
    // Nothing comes before packet 0 of a link, so that nothing is simpler.
    let line = lines[last + 1].trim();
    let begin = "cohaptic exec 'delay 1ms loss 15%' --loopback --lose '";
    assert!(line.starts_with(begin) && line.ends_with(": 0' -- python3 -m unittest -q test_own"), "{line}");
    let line = line.strip_prefix("cohaptic ").unwrap();
    assert_eq!(desk.cohaptic(line).status, Some(1), "{line}");
    let lost = line.split('\'').nth(3).unwrap();
    assert_eq!(desk.cohaptic(&line.replace(lost, "none")).status, Some(0), "{line}");
}

/// Node listens at all addresses of both versions unless told otherwise, and Python at the address of a name.
#[test]
fn servers_of_other_languages_are_reached_through_the_link() {
    const NODE: &str = r#"
        const server = require("http").createServer((_, answer) => answer.end("hello"));
        server.listen(0, () => require("http").get({ host: "localhost", port: server.address().port, agent: false }, (answer) => {
            answer.on("data", (data) => console.log(String(data)));
            answer.on("end", () => server.close());
        }));
    "#;
    const PYTHON: &str = r#"
import http.server, threading, urllib.request
class Hello(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200); self.end_headers(); self.wfile.write(b"hello")
    def log_message(self, *words): pass
server = http.server.ThreadingHTTPServer(("localhost", 0), Hello)
threading.Thread(target=server.serve_forever, daemon=True).start()
print(urllib.request.urlopen(f"http://localhost:{server.server_port}").read().decode())
"#;
    if !can_run() {
        return;
    }
    for (program, option, script) in [("node", "-e", NODE), ("python3", "-c", PYTHON)] {
        if !has(program) {
            continue;
        }
        let desk = Desk::new();
        let mut command = desk.command("exec 'delay 10ms' --loopback --out out --no-priority --");
        let outcome = Outcome::of(command.args([program, option, script]).output().unwrap());
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(0), "hello\n"), "{program}: {outcome:?}");
        let report = desk.read("out/report.txt");
        // At least a SYN, an acknowledgement and a question go to the server.
        let packets = |link: &str| report.lines().find_map(|line| line.trim().strip_prefix(link)?.split_whitespace().next()?.parse::<u32>().ok());
        assert!(packets("command -> loopback: ") >= Some(3) && packets("loopback -> command: ") >= Some(2), "{program}: {report}");
    }
}
