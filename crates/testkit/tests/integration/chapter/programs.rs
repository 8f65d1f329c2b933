//! The blocks of docs/testing.md that use sockets, as they stand there.

use std::cell::Cell;
use std::net::IpAddr;
use std::rc::Rc;
use std::time::Duration;

use cohaptic_testkit::hit::Verdict;
use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{LinkBounds, Stage, any_hits, links_like};
use cohaptic_testkit::{Instant, Testbed, UdpSocket, time};

use tokio::io::{AsyncReadExt, AsyncWriteExt};

use super::message_of;

#[test]
fn a_hundred_kilobytes_take_four_round_trips() {
    Testbed::new(["client", "server"]).links("delay 100ms").run(|bed| async move {
        let listener = bed.host("server").listen("0.0.0.0:80").unwrap();
        bed.host("server").spawn(async move { listener.accept().await.unwrap().0.write_all(&[7; 100_000]).await });
        let mut client = bed.host("client").connect("server:80").await.unwrap();
        client.read_exact(&mut [0; 100_000]).await.unwrap();
        assert_eq!(bed.now(), Instant::from_nanos(800_000_000));
    });
}

pub(super) async fn echo() {
    let socket = UdpSocket::bind("0.0.0.0:7").await.unwrap();
    let mut buffer = [0; 1500];
    while let Ok((len, from)) = socket.recv_from(&mut buffer).await {
        socket.send_to(&buffer[..len], from).await.unwrap();
    }
}

#[test]
fn each_way_has_a_link_of_its_own() {
    let bed = Testbed::new(["phone", "server"]).links("delay 5ms").link("phone", "server", "delay 24ms 2ms loss 1% rate 5mbit");
    bed.run(|bed| async move {
        bed.host("server").spawn(echo());
        let phone = bed.host("phone").bind("0.0.0.0:0").unwrap();
        let mut answers = 0;
        for _ in 0..1000 {
            phone.send_to(&[0; 100], "server:7").await.unwrap();
            answers += u64::from(time::timeout(Duration::from_millis(100), phone.recv(&mut [0; 100])).await.is_ok());
        }
        assert_eq!(answers, bed.link_stats("phone", "server").delivered());
    });
}

#[test]
fn time_is_exact_to_the_nanosecond() {
    Testbed::new(["client", "server"]).links("delay 1234567ns").run(|bed| async move {
        bed.host("server").spawn(echo());
        let client = bed.host("client").bind("0.0.0.0:0").unwrap();
        time::sleep(Duration::from_nanos(1)).await;
        client.send_to(b"now", "server:7").await.unwrap();
        client.recv(&mut [0; 3]).await.unwrap();
        assert_eq!(time::now().as_nanos(), 1 + 2 * 1_234_567);
    });
}

#[test]
fn tokio_rounds_its_own_timers_up() {
    Testbed::new(["client", "server"]).links("delay 1300us").on_tokio().run(|bed| async move {
        bed.host("server").spawn(echo());
        let client = bed.host("client").bind("0.0.0.0:0").unwrap();
        let begin = tokio::time::Instant::now();
        client.send_to(b"now", "server:7").await.unwrap();
        client.recv(&mut [0; 3]).await.unwrap();
        assert_eq!(begin.elapsed(), Duration::from_micros(2600));
        tokio::time::sleep(Duration::from_micros(100)).await;
        assert_eq!(begin.elapsed(), Duration::from_millis(3));
    });
}

#[test]
fn a_client_outlives_its_servers_troubles() {
    Testbed::new(["client", "server"]).links("delay 10ms").run(|bed| async move {
        let server = bed.host("server");
        server.start(echo);
        let client = bed.host("client").bind("0.0.0.0:0").unwrap();
        let answers = async || {
            client.send_to(b"there?", "server:7").await.unwrap();
            time::timeout(Duration::from_millis(50), client.recv(&mut [0; 10])).await.is_ok()
        };
        assert!(answers().await);

        server.crash();
        assert!(!answers().await);
        server.restart();
        assert!(answers().await);

        // The question arrives, and the answer does not.
        bed.cut("server", "client");
        assert!(!answers().await);
        bed.mend("server", "client");
        assert!(answers().await);

        bed.partition(&["client"], &["server"]);
        assert!(!answers().await);
        bed.mend_all();
        assert!(answers().await);

        // The name is looked up anew with each question, so that it is found again.
        let before = server.ip();
        assert_ne!(IpAddr::from(server.change_addresses().v4), before);
        assert!(answers().await);

        bed.set_link("client", "server", "loss 100%");
        assert!(!answers().await);
    });
}

fn differs() {
    let run = Rc::new(Cell::new(0_u8));
    Testbed::new(["client", "server"]).seed(7).run_twice(|bed| {
        let run = Rc::clone(&run);
        async move {
            let client = bed.host("client").bind("0.0.0.0:0").unwrap();
            time::sleep(Duration::from_millis(3)).await;
            run.set(run.get() + 1);
            client.send_to(&[run.get()], "server:7").await.unwrap();
        }
    });
}

proptest! {
    #[test]
    fn a_question_that_is_asked_often_enough_is_answered(link in links_like(
        LinkBounds::ideal().delay(Duration::ZERO..=Duration::from_millis(200)).loss(0.0..=20.0).always(Stage::Loss)
    )) {
        Testbed::new(["client", "server"]).links(link).run(|bed| async move {
            bed.host("server").spawn(echo());
            let client = bed.host("client").bind("0.0.0.0:0").unwrap();
            client.connect("server:7").await.unwrap();
            for _ in 0..100 {
                client.send(b"there?").await.unwrap();
                if time::timeout(Duration::from_secs(1), client.recv(&mut [0; 10])).await.is_ok() {
                    return;
                }
            }
            panic!("a hundred questions without an answer");
        });
    }
}

#[test]
fn what_happened_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("lossy");
    let bed = Testbed::new(["client", "server"]).links("loss 100%").artefacts(&kept);
    let failed = std::panic::catch_unwind(|| {
        bed.run(|bed| async move {
            let client = bed.host("client").bind("0.0.0.0:0").unwrap();
            client.send_to(b"hello", "server:7").await.unwrap();
            time::timeout(Duration::from_secs(1), client.recv(&mut [0; 10])).await.expect("an answer").unwrap();
        });
    });
    assert!(failed.is_err());
    let trace = std::fs::read_to_string(kept.join("trace.txt")).unwrap();
    assert!(trace.contains("client -> server  packet 0 lost: loss"), "{trace}");
    assert!(kept.join("fates-client-to-server.csv").exists());
    assert!(kept.join("packets-client-to-server.pcapng").exists());
}

/// Returns the panic message of a program whose two runs differ, run in a thread with the name of a test.
fn difference(test: &str) -> String {
    std::thread::Builder::new().name(test.into()).spawn(|| message_of(differs)).unwrap().join().unwrap()
}

#[test]
fn a_program_that_differs_is_told_so() {
    super::assert_shown(&difference("differs"));
}

#[test]
fn the_seed_is_told_with_the_name_of_the_test() {
    super::assert_shown(difference("lossy").lines().last().unwrap());
}

/// Returns the time after which a client that asks every 100 ms has its answer, in milliseconds.
fn answered(bed: Testbed) -> u64 {
    bed.links("delay 10ms").run(|bed| async move {
        bed.host("server").spawn(echo());
        let client = bed.host("client").bind("0.0.0.0:0").unwrap();
        loop {
            client.send_to(b"there?", "server:7").await.unwrap();
            if time::timeout(Duration::from_millis(100), client.recv(&mut [0; 10])).await.is_ok() {
                return time::now().as_nanos() / 1_000_000;
            }
        }
    })
}

#[test]
fn a_question_or_its_answer_is_lost() {
    let bed = || Testbed::new(["client", "server"]);
    assert_eq!(answered(bed().hit("client", "server", "drop packet 0")), 120);
    assert_eq!(answered(bed().hit("server", "client", "delay 95ms first packet with \"there\"")), 115);
    assert_eq!(answered(bed().on_packet("server", "client", |packet| if packet.number < 2 { Verdict::Drop } else { Verdict::Pass })), 220);
}

proptest! {
    #[test]
    fn each_lost_packet_costs_100_ms_at_most(hits in any_hits(["client", "server"], 2, ["drop"])) {
        prop_assert!(answered(Testbed::new(["client", "server"]).hits(&hits)) <= 420);
    }
}

#[test]
fn a_call_ends_when_the_nat_forgets_it() {
    let bed = Testbed::new(["laptop", "server"]).nat("router", "home udp-timeout 60s", ["laptop"]).links("delay 10ms");
    bed.run(|bed| async move {
        let server = bed.host("server").bind("0.0.0.0:7").unwrap();
        let laptop = bed.host("laptop").bind("0.0.0.0:5000").unwrap();
        laptop.send_to(b"call me", "server:7").await.unwrap();
        let (_, from) = server.recv_from(&mut [0; 7]).await.unwrap();
        assert_eq!(from.to_string(), "10.0.0.3:5000");
        let mappings: Vec<String> = bed.nat("router").mappings().iter().map(ToString::to_string).collect();
        assert_eq!(mappings, ["UDP 192.168.1.1:5000 is 10.0.0.3:5000 for 10.0.0.2:7"]);

        // Calls from outside do not keep the mapping.
        let rings = async || {
            server.send_to(b"ring", from).await.unwrap();
            time::timeout(Duration::from_secs(1), laptop.recv(&mut [0; 4])).await.is_ok()
        };
        assert!(rings().await);
        time::sleep(Duration::from_secs(50)).await;
        assert!(rings().await);
        time::sleep(Duration::from_secs(10)).await;
        assert!(!rings().await);
        assert_eq!(bed.nat("router").filtered(), 1);
    });
}

#[test]
fn the_words_of_a_file_with_nats_are_read() {
    let text = "nat home-a: alice\n\
                nat home-b strict udp-timeout 30s: bob\n\
                firewall office: carol\n\
                all: delay 20ms\n\
                alice -> home-a: delay 2ms\n\
                home-a -> home-b: delay 20ms loss 1%\n";
    let file = cohaptic_testkit::LinkFile::parse(text).unwrap();
    assert_eq!(file.hosts(), ["alice", "bob", "carol"]);
    super::assert_shown(text);
}

#[test]
fn a_phone_leaves_its_home() {
    let bed = Testbed::new(["phone", "server"]).interfaces("phone", ["wifi", "lte"]).nat("home", "home", ["wifi"]).nat("carrier", "cgnat", ["lte"]);
    bed.link_both("home", "server", "delay 10ms").link_both("carrier", "server", "delay 40ms").run(|bed| async move {
        let server = bed.host("server").bind("0.0.0.0:7").unwrap();
        let phone = bed.host("phone");
        let socket = phone.bind("0.0.0.0:0").unwrap();
        let mut seen = Vec::new();
        for uplink in ["wifi", "lte"] {
            phone.uplink(uplink);
            socket.send_to(b"here I am", "server:7").await.unwrap();
            seen.push(server.recv_from(&mut [0; 9]).await.unwrap().1.ip().to_string());
        }
        assert_eq!(seen, ["10.0.0.5", "10.0.0.6"]);
        assert_eq!(bed.now(), Instant::from_nanos(50_000_000));
    });
}
