//! `cohaptic exec`, with real commands in namespaces. On a system that allows no namespaces, the tests are skipped with a message.
#![expect(clippy::print_stdout, reason = "a test that is skipped says why, and a command says what it has seen")]

use std::env;
use std::fs;
use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream, ToSocketAddrs as _, UdpSocket};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::integration::desk::{Desk, Outcome};
use crate::integration::running::{PATIENCE, Running, uninterrupted};

/// Variable that tells a process inside what to do.
pub(super) const ROLE: &str = "COHAPTIC_CLI_TEST_EXEC";

/// Returns whether namespaces and devices can be made here, and says why not.
pub(super) fn can_run() -> bool {
    let can = Command::new("unshare").args(["-Urnm", "true"]).stderr(Stdio::null()).status().is_ok_and(|status| status.success());
    if !can {
        println!("skipped: this system allows no namespaces (`unshare -Urnm true` fails)");
        return false;
    }
    if let Err(error) = fs::OpenOptions::new().read(true).write(true).open("/dev/net/tun") {
        println!("skipped: /dev/net/tun cannot be opened: {error}");
        return false;
    }
    true
}

/// Returns whether namespaces and devices can be made here and `ping` is installed, and says why not.
pub(super) fn can_ping() -> bool {
    let can = can_run();
    let has_ping = Command::new("ping").arg("-V").stdout(Stdio::null()).status().is_ok_and(|status| status.success());
    if can && !has_ping {
        println!("skipped: `ping -V` fails");
    }
    can && has_ping
}

/// Returns `cohaptic exec OPTIONS -- ` with this test program as the command, in a role of [`be_inside`].
pub(super) fn with_role(desk: &Desk, options: &str, role: &str) -> Command {
    let mut command = desk.command(&format!("exec {options} --no-priority --"));
    command.arg(env::current_exe().unwrap()).args(["integration::exec::be_inside", "--exact", "--nocapture"]).env(ROLE, role);
    command
}

/// Sends octets, ends this half of the connection, and returns whether the same octets come back.
fn data_come_back(mut stream: TcpStream, length: u32) -> bool {
    let data: Vec<u8> = (0..length).map(|place| u8::try_from(place % 251).unwrap()).collect();
    let mut sender = stream.try_clone().unwrap();
    let sent = data.clone();
    let sending = thread::spawn(move || {
        sender.write_all(&sent).unwrap();
        sender.shutdown(Shutdown::Write).unwrap();
    });
    let mut back = Vec::new();
    stream.read_to_end(&mut back).unwrap();
    sending.join().unwrap();
    back == data
}

/// Runs the command inside to its end, and returns what it says.
pub(super) fn said_by(desk: &Desk, options: &str, role: &str) -> Vec<String> {
    let outcome = Running::begin(with_role(desk, options, role)).end();
    assert_eq!(outcome.status, Some(0), "{role}: {}\n{}", outcome.stdout, outcome.stderr);
    outcome.stdout.lines().filter_map(|line| line.split_once("inside: ")).map(|(_, said)| said.to_owned()).collect()
}

/// Command inside, as a test that does nothing unless its process has a role.
#[test]
fn be_inside() {
    let Ok(role) = env::var(ROLE) else { return };
    let words: Vec<&str> = role.split(' ').collect();
    match words.as_slice() {
        // Connects, sends data, ends its half, and reads what comes back.
        ["echo", to, length] => {
            let begin = Instant::now();
            let stream = TcpStream::connect(*to).unwrap();
            println!("inside: {}", begin.elapsed().as_millis());
            println!("inside: {}", if data_come_back(stream, length.parse().unwrap()) { "the same" } else { "something else" });
        }
        ["refused", to] => {
            let tcp = TcpStream::connect(*to).unwrap_err();
            let udp = UdpSocket::bind("0.0.0.0:0").unwrap();
            udp.connect(*to).unwrap();
            udp.set_read_timeout(Some(PATIENCE)).unwrap();
            udp.send(b"question").unwrap();
            let udp = udp.recv(&mut [0; 64]).unwrap_err();
            println!("inside: {:?} {:?}", tcp.kind(), udp.kind());
        }
        ["ask", to] => {
            let udp = UdpSocket::bind("0.0.0.0:0").unwrap();
            udp.connect(*to).unwrap();
            udp.set_read_timeout(Some(PATIENCE)).unwrap();
            let begin = Instant::now();
            udp.send(b"question").unwrap();
            let mut answer = [0; 64];
            let length = udp.recv(&mut answer).unwrap();
            println!("inside: {} {}", String::from_utf8_lossy(&answer[..length]), begin.elapsed().as_millis());
        }
        // Asks by datagrams, and fails if a question or its answer is lost: without a repetition each number of a packet is that of its question.
        ["each", to, count] => {
            let udp = UdpSocket::bind("0.0.0.0:0").unwrap();
            udp.connect(*to).unwrap();
            udp.set_read_timeout(Some(Duration::from_millis(1500))).unwrap();
            for question in 0..count.parse().unwrap() {
                udp.send(&[question]).unwrap();
                let mut answer = [0];
                if udp.recv(&mut answer).is_err() {
                    println!("inside: question {question} has no answer");
                    std::process::exit(7);
                }
            }
        }
        // Connects to a server of this process at each name, and sends data there and back.
        ["own-tcp", names @ ..] => {
            for name in names {
                let listener = TcpListener::bind((*name, 0)).unwrap();
                let to = listener.local_addr().unwrap();
                thread::spawn(move || {
                    let (mut stream, _) = listener.accept().unwrap();
                    std::io::copy(&mut stream.try_clone().unwrap(), &mut stream).unwrap();
                    stream.shutdown(Shutdown::Write).unwrap();
                });
                let begin = Instant::now();
                let stream = TcpStream::connect((*name, to.port())).unwrap();
                let handshake = begin.elapsed().as_millis();
                println!("inside: {handshake} {}", data_come_back(stream, 100_000));
            }
        }
        // Asks a server of this process by datagrams, without repetitions. Says which questions have an answer, and how many have reached the server, whose
        // port is the lower or the higher one.
        ["own-udp", port, count, length] => {
            let mut sockets = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
            sockets.sort_by_key(|socket| socket.local_addr().unwrap().port());
            let [low, high] = sockets;
            let (server, client) = if *port == "low" { (low, high) } else { (high, low) };
            let to = server.local_addr().unwrap();
            let questions = Arc::new(AtomicU32::new(0));
            let asked = Arc::clone(&questions);
            thread::spawn(move || {
                let mut data = vec![0; 65_536];
                while let Ok((length, from)) = server.recv_from(&mut data) {
                    asked.fetch_add(1, Ordering::Relaxed);
                    server.send_to(&data[..length], from).unwrap();
                }
            });
            client.set_read_timeout(Some(Duration::from_millis(1500))).unwrap();
            let question = vec![7; length.parse().unwrap()];
            let answers = (0..count.parse::<u32>().unwrap()).map(|_| {
                client.send_to(&question, to).unwrap();
                let mut answer = vec![0; 65_536];
                client.recv(&mut answer).map_or('0', |length| if answer[..length] == question { '1' } else { '?' })
            });
            let answers: String = answers.collect();
            println!("inside: {answers} {}", questions.load(Ordering::Relaxed));
        }
        // Listens at addresses of IPv6, and connects to `::1`.
        ["six"] => {
            let [own, all] = ["[::1]:0", "[::]:0"].map(|at| TcpListener::bind(at).err().map(|error| error.kind()));
            println!("inside: {own:?} {all:?} {:?}", TcpStream::connect("[::1]:9").unwrap_err().kind());
        }
        // A datagram that is longer than a packet, and its echo.
        ["long", to] => {
            let udp = UdpSocket::bind("0.0.0.0:0").unwrap();
            udp.connect(*to).unwrap();
            udp.set_read_timeout(Some(PATIENCE)).unwrap();
            let data = vec![7; 9000];
            udp.send(&data).unwrap();
            let mut answer = vec![0; 10_000];
            let length = udp.recv(&mut answer).unwrap();
            println!("inside: {}", answer[..length] == data);
        }
        ["tell", to] => {
            UdpSocket::bind("0.0.0.0:0").unwrap().send_to(b"farewell", *to).unwrap();
        }
        ["look-up", name] => {
            let found: Vec<String> = (*name, 80).to_socket_addrs().unwrap().map(|address| address.ip().to_string()).collect();
            println!("inside: {}", found.join(" "));
        }
        // Echoes one connection and one datagram.
        ["serve", port] => {
            let (tcp, udp) = (TcpListener::bind(format!("0.0.0.0:{port}")).unwrap(), UdpSocket::bind(format!("0.0.0.0:{port}")).unwrap());
            eprintln!("ready");
            let (mut stream, _) = tcp.accept().unwrap();
            let mut data = Vec::new();
            stream.read_to_end(&mut data).unwrap();
            stream.write_all(&data).unwrap();
            drop(stream);
            let mut datagram = [0; 64];
            udp.set_read_timeout(Some(PATIENCE)).unwrap();
            let (length, from) = udp.recv_from(&mut datagram).unwrap();
            udp.send_to(&datagram[..length], from).unwrap();
        }
        _ => panic!("no role {role}"),
    }
}

/// A server of the real machine that sends back what each connection brings.
pub(super) fn echo_server() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    thread::spawn(move || {
        while let Ok((mut stream, _)) = listener.accept() {
            thread::spawn(move || {
                let mut reader = stream.try_clone().unwrap();
                let _ = std::io::copy(&mut reader, &mut stream);
                let _ = stream.shutdown(Shutdown::Write);
            });
        }
    });
    address
}

/// A connection crosses the link in both directions: the handshake takes a round trip, all data arrives in spite of the losses, and each half ends by itself.
#[test]
fn a_connection_reaches_a_server_of_the_machine_through_the_link() {
    if !can_run() {
        return;
    }
    let (desk, server) = (Desk::new(), echo_server());
    for name in ["host", "10.0.2.2"] {
        let said = said_by(&desk, "'delay 30ms loss 1%'", &format!("echo {name}:{} 300000", server.port()));
        let handshake: u64 = said[0].parse().unwrap();
        // A lost SYN is sent again after a second.
        assert!(handshake >= 60, "{said:?}");
        assert_eq!(said[1], "the same");
    }
}

#[test]
fn a_port_without_a_program_refuses() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    // Both kinds of sockets hold the port, so that no other test gets it, and neither listens.
    let port = {
        let udp = UdpSocket::bind("127.0.0.1:0").unwrap();
        udp.local_addr().unwrap().port()
    };
    assert_eq!(said_by(&desk, "'delay 1ms'", &format!("refused host:{port}")), ["ConnectionRefused ConnectionRefused"]);
}

#[test]
fn datagrams_go_out_and_answers_come_back_and_a_farewell_arrives_after_the_end() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    let server = UdpSocket::bind("127.0.0.1:0").unwrap();
    server.set_read_timeout(Some(PATIENCE)).unwrap();
    let port = server.local_addr().unwrap().port();
    let answering = thread::spawn(move || {
        let mut data = [0; 64];
        let (length, from) = uninterrupted(|| server.recv_from(&mut data)).unwrap();
        assert_eq!(&data[..length], b"question");
        server.send_to(b"answer", from).unwrap();
        server
    });
    let said = said_by(&desk, "'delay 20ms'", &format!("ask host:{port}"));
    let (answer, millis) = said[0].split_once(' ').unwrap();
    assert!(answer == "answer" && millis.parse::<u64>().unwrap() >= 40, "{said:?}");
    let server = answering.join().unwrap();
    // The command ends at once, and its datagram is on the way for 300 ms.
    said_by(&desk, "'delay 300ms'", &format!("tell host:{port}"));
    let mut data = [0; 64];
    let length = uninterrupted(|| server.recv(&mut data)).unwrap();
    assert_eq!(&data[..length], b"farewell");
}

/// The kernel inside cuts a long datagram and puts its echo together, as the gateway does.
#[test]
fn a_long_datagram_crosses_the_link_in_fragments() {
    if !can_run() {
        return;
    }
    let server = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = server.local_addr().unwrap().port();
    thread::spawn(move || {
        let mut data = vec![0; 10_000];
        while let Ok((length, from)) = server.recv_from(&mut data) {
            server.send_to(&data[..length], from).unwrap();
        }
    });
    assert_eq!(said_by(&Desk::new(), "'delay 5ms'", &format!("long 10.0.2.2:{port}")), ["true"]);
}

/// A name server of the machine answers through the link. Its answer is one address for every name.
#[test]
fn names_come_from_the_file_and_from_the_name_server() {
    if !can_run() {
        return;
    }
    if !Path::new("/etc/resolv.conf").exists() || !Path::new("/etc/hosts").exists() {
        println!("skipped: this system has no /etc/resolv.conf or no /etc/hosts");
        return;
    }
    let desk = Desk::new();
    let server = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap();
    thread::spawn(move || {
        let mut question = [0; 512];
        while let Ok((length, from)) = server.recv_from(&mut question) {
            let mut answer = question[..length].to_vec();
            // The question without its additional records: the name ends with a zero, and four bytes follow.
            let end = 12 + answer[12..].iter().position(|byte| *byte == 0).unwrap() + 5;
            answer.truncate(end);
            let is_v4 = answer[end - 4..end - 2] == [0, 1];
            answer[2..12].copy_from_slice(&[0x81, 0x80, 0, 1, 0, u8::from(is_v4), 0, 0, 0, 0]);
            if is_v4 {
                // Name, type, class, time to live, length and address.
                answer.extend([0xc0, 12, 0, 1, 0, 1, 0, 0, 0, 60, 0, 4, 192, 0, 2, 99]);
            }
            server.send_to(&answer, from).unwrap();
        }
    });
    let options = format!("'delay 5ms' --dns {address}");
    assert_eq!(said_by(&desk, &options, "look-up name.of.a.test"), ["192.0.2.99"]);
    assert_eq!(said_by(&desk, &options, "look-up host"), ["10.0.2.2"]);
    assert!(!fs::read_to_string("/etc/hosts").unwrap().contains("10.0.2.2\thost"), "the file of the machine has not changed");
}

#[test]
fn the_gateway_answers_ping() {
    if !can_ping() {
        return;
    }
    let outcome = Desk::new().cohaptic("exec 'delay 10ms' --no-priority -- ping -c 2 -i 0.2 host");
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    assert!(outcome.stdout.contains("2 received"), "{}", outcome.stdout);
}

#[test]
fn the_status_is_that_of_the_command() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    desk.write("no-program", "text");
    for (line, status, part) in [
        ("exec 'delay 1ms' -- true", 0, ""),
        ("exec 'delay 1ms' -- sh -c 'exit 7'", 7, ""),
        ("exec delay 1ms -- sh -c 'kill -9 $$'", 137, ""),
        ("exec delay=1ms -- no-such-command", 127, "cohaptic exec: cannot run no-such-command: No such file or directory"),
        ("exec 'delay 1ms' -- ./no-program", 126, "cohaptic exec: cannot run ./no-program: Permission denied"),
        ("exec 'delay one' -- true", 125, "these words do not describe a link"),
        ("exec 'delay 1ms' --listen 0 -- true", 125, "expected a port such as 8080"),
        ("exec 'delay 1ms'", 125, "is not a file: expected a file of hosts, or a command after two dashes"),
    ] {
        let outcome = desk.cohaptic_within(PATIENCE, line);
        assert_eq!(outcome.status, Some(status), "{line}: {outcome:?}");
        assert!(outcome.stderr.contains(part) && (!part.is_empty() || outcome.stderr.is_empty()), "{line}: {}", outcome.stderr);
    }
    // Standard input and output are those of the command.
    let mut command = desk.command("exec 'delay 1ms' -- tr a-z A-Z");
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(b"words").unwrap();
    assert_eq!(Outcome::of(child.wait_with_output().unwrap()).stdout, "WORDS");
    // A background process ends with its command. The pipe of the output then closes, or this call would time out.
    assert_eq!(desk.cohaptic_within(PATIENCE, "exec 'delay 1ms' -- sh -c 'sleep 1000 & exit 3'").status, Some(3));
}

/// Nothing is run, so that no namespaces are needed.
#[test]
fn a_wrong_call_is_told_with_what_was_expected() {
    let desk = Desk::new();
    desk.write("net.toml", "[[hosts]]\n");
    let command_of_hosts =
        "net.toml is a file, whose hosts have commands of their own: expected no command after two dashes. A host's command is its key command";
    for (line, part) in [
        ("exec net.toml -- true", command_of_hosts),
        ("exec net.toml --listen 8080 -- true", command_of_hosts),
        (
            "exec net.toml --back 'delay 1ms'",
            "net.toml has its own links: expected [[links]] with from and to there, or --set links.FROM.TO.delay=20ms",
        ),
        ("exec net.toml --loopback", "--loopback is for a command after two dashes. Packets between the hosts of the file net.toml pass its links"),
        ("exec net.toml --listen 8080", "Hosts of the file net.toml are reached by each other: expected a client as a further host"),
        ("exec 'delay 1ms' --back 'delay 2ms'", "\"delay 1ms\" is not a file: expected a file of hosts, or a command after two dashes"),
        ("exec '' -- true", "an empty text is no link: expected words such as 'delay 50ms loss 1%'"),
        ("exec ' ' -- true", "an empty text is no link"),
        ("exec 'delay 1ms' --back '' -- true", "an empty text is no link"),
        (
            "exec 'delay 1ms stall 2s' -- true",
            "stall is a word of links for connections of TCP, and this link carries packets: expected another word, or cohaptic relay --tcp",
        ),
    ] {
        desk.cohaptic_within(PATIENCE, line).assert_refused(125, &[part]);
    }
}

/// A signal reaches the command once, whether it was sent to the program alone or to its whole process group, as the terminal does on Ctrl-C.
#[test]
fn a_signal_reaches_the_command_once() {
    if !can_run() {
        return;
    }
    // A shell cannot trap a signal that was ignored at its start, as under `nohup`.
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).map(|mask| u64::from_str_radix(mask.trim(), 16).unwrap());
    if ignored.is_some_and(|mask| mask & (1 << (2 - 1)) != 0) {
        println!("skipped: SIGINT is ignored here, as in a background job of a script");
        return;
    }
    const COMMAND: &str = "exec 'delay 1ms' --no-priority -- sh -c 'trap \"echo interrupted >&2\" INT; echo ready >&2; while :; do sleep 0.1; done'";
    let desk = Desk::new();
    let mut command = desk.command(COMMAND);
    // A group of its own, which leaves out the tests.
    command.process_group(0);
    let running = Running::begin(command);
    running.said("ready");
    // The group comes last: the program may still have its own copy of that signal unread, and the system merges a second signal of the kind with the copy.
    for target in [running.id(), running.id(), format!("-{}", running.id())] {
        assert!(Command::new("kill").args(["-INT", "--", &target]).status().unwrap().success());
        running.said("interrupted");
    }
    // The shell ends by the signal, whose number the status has.
    let outcome = running.end_by("-TERM");
    assert_eq!(outcome.status, Some(143), "{outcome:?}");
    assert_eq!(outcome.stderr.matches("interrupted").count(), 3, "{}", outcome.stderr);
}

/// The end of the program is the end of everything inside, however the program ends: a process left behind would hold the pipe open.
#[test]
fn nothing_is_left_when_the_program_is_killed() {
    if !can_run() {
        return;
    }
    let running = Running::begin(Desk::new().command("exec 'delay 1ms' --no-priority -- sh -c 'sleep 1000 & echo ready >&2; sleep 1000'"));
    running.said("ready");
    let begin = Instant::now();
    assert_eq!(running.end_by("-KILL").status, None);
    assert!(begin.elapsed() < PATIENCE);
}

#[test]
fn a_port_of_the_machine_leads_inside() {
    if !can_run() {
        return;
    }
    let desk = Desk::new();
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let running = Running::begin(with_role(&desk, &format!("'delay 20ms' --listen {port}"), &format!("serve {port}")));
    running.said("ready");
    let begin = Instant::now();
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.write_all(b"to the inside").unwrap();
    stream.shutdown(Shutdown::Write).unwrap();
    let mut back = String::new();
    stream.read_to_string(&mut back).unwrap();
    // The handshake, and the question with its answer: two round trips.
    assert!(back == "to the inside" && begin.elapsed() >= Duration::from_millis(80), "{back:?} after {:?}", begin.elapsed());
    let udp = UdpSocket::bind("127.0.0.1:0").unwrap();
    udp.connect(("127.0.0.1", port)).unwrap();
    udp.set_read_timeout(Some(PATIENCE)).unwrap();
    udp.send(b"datagram").unwrap();
    let mut data = [0; 64];
    let length = uninterrupted(|| udp.recv(&mut data)).unwrap();
    assert_eq!(&data[..length], b"datagram");
    assert_eq!(running.end().status, Some(0));
    // A port that another program has is refused before anything begins.
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let outcome = desk.cohaptic(&format!("exec 'delay 1ms' --listen {} -- true", taken.local_addr().unwrap().port()));
    assert!(outcome.status == Some(125) && outcome.stderr.contains("cannot listen at 127.0.0.1:"), "{outcome:?}");
}

#[test]
fn a_client_is_refused_where_no_command_listens() {
    if !can_run() {
        return;
    }
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let line = format!("exec 'delay 1ms' --no-priority --listen {port} -- sh -c 'echo ready >&2; sleep 1000'");
    let running = Running::begin(Desk::new().command(&line));
    running.said("ready");
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    assert_eq!(uninterrupted(|| stream.read(&mut [0])).unwrap_err().kind(), ErrorKind::ConnectionReset);
    assert_eq!(running.end_by("-TERM").status, Some(143));
}

/// An ordinary user runs commands too, and stays the same user inside.
#[test]
fn an_ordinary_user_needs_no_root() {
    if !can_ping() {
        return;
    }
    // A user without rights, in a view of files in which everybody may use the device.
    const SCRIPT: &str = "mount -t tmpfs tmpfs /dev/net && mknod -m 666 /dev/net/tun c 10 200 && \
        exec setpriv --reuid 65534 --regid 65534 --clear-groups --inh-caps=-all \"$@\"";
    let script = |words: &[&str]| {
        let mut command = Command::new("unshare");
        command.args(["-m", "sh", "-c", SCRIPT, "sh"]).args(words).stdin(Stdio::null());
        Outcome::of(command.output().unwrap())
    };
    let desk = Desk::new();
    let program = desk.path("cohaptic");
    // The build's own folder may be closed to others.
    fs::copy(env!("CARGO_BIN_EXE_cohaptic"), &program).unwrap();
    desk.set_mode("cohaptic", 0o755);
    desk.set_mode(".", 0o755);
    let program = program.to_str().unwrap();
    if script(&["test", "-x", program, "-a", "-w", "/dev/net/tun"]).status != Some(0) || script(&["unshare", "-Urnm", "true"]).status != Some(0) {
        println!("skipped: this test needs root, to become an ordinary user who may have namespaces");
        return;
    }
    let server = echo_server();
    let fetch = format!(
        "id -u; id -g; cat /proc/1/comm; exec 3<>/dev/tcp/10.0.2.2/{}; echo hello >&3; head -n 1 <&3; ping -c 1 host >/dev/null && echo pong",
        server.port()
    );
    let outcome = script(&[program, "exec", "delay 5ms", "--no-priority", "--", "bash", "-c", &fetch]);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(0), "65534\n65534\ncohaptic\nhello\npong\n"), "{outcome:?}");
    // The second question has an answer, and the first is lost: both have taken the link.
    let ping = ["--loopback", "--lose", "command -> loopback: 0", "--no-priority", "--", "ping", "-c", "2", "-i", "0.2", "localhost"];
    let outcome = script(&[&[program, "exec", "delay 5ms"][..], &ping].concat());
    assert!(outcome.status == Some(0) && outcome.stdout.contains("2 packets transmitted, 1 received"), "{outcome:?}");
}

#[test]
fn a_system_without_namespaces_is_told_which_setting_is_in_the_way() {
    if !can_run() {
        return;
    }
    // A user namespace in which no further one may be made, and a process without rights in it.
    const SCRIPT: &str = "echo 0 > /proc/sys/user/max_user_namespaces && exec setpriv --bounding-set=-all --inh-caps=-all \"$@\"";
    let mut command = Command::new("unshare");
    let exec = Desk::new().command("exec 'delay 1ms' -- true");
    command.args(["-Ur", "sh", "-c", SCRIPT, "sh"]).arg(exec.get_program()).args(exec.get_args());
    let outcome = Outcome::of(command.output().unwrap());
    assert_eq!(outcome.status, Some(125), "{outcome:?}");
    for part in ["cohaptic exec: cannot make namespaces: ", "sysctl -w user.max_user_namespaces=", "cohaptic relay"] {
        assert!(outcome.stderr.contains(part), "no {part:?} in {}", outcome.stderr);
    }
}

#[test]
fn the_folder_gets_a_capture_and_a_report() {
    if !can_run() {
        return;
    }
    let (desk, server) = (Desk::new(), echo_server());
    said_by(&desk, "'delay 5ms' --out out", &format!("echo host:{} 5000", server.port()));
    assert_eq!(desk.files("out").iter().filter(|name| !name.starts_with('.')).collect::<Vec<_>>(), ["command.pcapng", "report.txt"]);
    let report = desk.read("out/report.txt");
    for part in ["ended with status 0", "the run is ", "  command -> world: ", "  world -> command: ", "mean delay 5.0"] {
        assert!(report.contains(part), "no {part:?} in {report}");
    }
    let capture = fs::read(desk.path("out/command.pcapng")).unwrap();
    assert_eq!(capture[..4], [0x0a, 0x0d, 0x0d, 0x0a]);
    let has = |text: &[u8]| capture.windows(text.len()).any(|part| part == text);
    // The header of a packet from the command to the gateway, and back.
    assert!(has(b"sent") && has(b"delivered after 5ms") && has(&[10, 0, 2, 15, 10, 0, 2, 2]) && has(&[10, 0, 2, 2, 10, 0, 2, 15]));

    // The report names the packets that were dropped, in the words that drop them again. The first one is a SYN, which is sent again.
    said_by(&desk, "'loss={ packets = [0] }' --back 'delay 5ms' --out lost", &format!("echo host:{} 5000", server.port()));
    let report = desk.read("lost/report.txt");
    assert!(report.contains("\n  command -> world dropped packets = [0]\n") && !report.contains("world -> command dropped"), "{report}");
}
