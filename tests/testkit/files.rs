//! Test beds whose links are those of scene files and relay files.

use std::fs;
use std::time::Duration;

use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};
use cohaptic_testkit::{Happening, Instant, LinkFile, LinkFileError, Testbed, time};

use crate::testkit::message;

const RELAY: &str = r#"
relay = { seed = 9 }
programs = [
    { name = "left", port = "127.0.0.1:7001" },
    { name = "right", port = "127.0.0.1:7002" },
    { name = "third", port = "127.0.0.1:7003" },
]
link = { delay = "24ms" }
links = [{ from = "right", to = "left", delay = "40ms" }]

[[timeline]]
at = "1s"
link = { from = "left", to = "right" }
set = { delay = "30ms" }

[[timeline]]
at = "2s"
link = "all"
set = { delay = "5ms" }
"#;

/// How long packets take from one host to another that are sent after half a second, one and a half, and two and a half.
fn delays(bed: Testbed, from: &'static str, to: &'static str) -> Vec<Duration> {
    bed.run(move |bed| async move {
        let (sender, receiver) = (bed.host(from).bind("0.0.0.0:1").unwrap(), bed.host(to).bind("0.0.0.0:1").unwrap());
        let mut delays = Vec::new();
        for millis in [500, 1_500, 2_500] {
            let at = Instant::from_nanos(millis * 1_000_000);
            time::sleep_until(at).await;
            sender.send_to(b"x", (bed.host(to).ip(), 1)).await.unwrap();
            receiver.recv(&mut [0]).await.unwrap();
            delays.push(time::now() - at);
        }
        delays
    })
}

#[test]
fn programs_of_a_relay_file_are_hosts_and_its_links_change_when_it_says() {
    let base = tempfile::tempdir().unwrap();
    let path = base.path().join("mesh.toml");
    fs::write(&path, RELAY).unwrap();
    assert_eq!(Testbed::from_file(&path).hosts(), ["left", "right", "third"]);
    let millis = |list: [u64; 3]| list.map(Duration::from_millis).to_vec();
    for (from, to, expected) in [("left", "right", [24, 30, 5]), ("right", "left", [40, 40, 5]), ("third", "left", [24, 24, 5])] {
        assert_eq!(delays(Testbed::from_file(&path), from, to), millis(expected));
        assert_eq!(delays(Testbed::from_file(&path).on_tokio(), from, to), millis(expected));
    }
    // A change that comes takes no part in whether something will ever happen.
    let text = message(|| {
        Testbed::from_file(&path).run(|bed| async move {
            let _ = bed.host("left").bind("0.0.0.0:1").unwrap().recv(&mut [0]).await;
        });
    });
    assert!(text.starts_with("nothing will ever happen after 2 s"), "{text}");
}

#[test]
fn peers_of_a_scene_file_are_hosts() {
    let links = LinkFile::read("../scenarios/network/per-pair-links.toml").unwrap();
    let bed = Testbed::from(links.clone());
    assert_eq!(bed.hosts(), links.hosts());
    assert!(links.hosts().len() >= 2);
    let timeline = Testbed::from_file("../scenarios/network/timeline.toml");
    let (_, record) = timeline.run_recorded(|_| time::sleep(Duration::from_secs(60)));
    assert!(record.trace().events().iter().any(|event| matches!(event.what, Happening::Relinked(..))));
}

/// A datagram of one byte takes 29 bytes on the access lines of `left`: 453.125 µs at 512 kbit/s up, and 116 µs at 2 Mbit/s down. The links take 10 ms.
#[test]
fn access_lines_of_a_scene_file_are_those_of_the_hosts() {
    for (from, to, nanos) in [("left", "right", 10_453_125), ("right", "left", 10_116_000), ("right", "third", 10_000_000)] {
        let bed = Testbed::from_file("../scenarios/network/shared-access-line.toml");
        assert_eq!(delays(bed, from, to), [Duration::from_nanos(nanos); 3]);
    }
}

#[test]
fn what_links_cannot_stand_for_is_refused() {
    let base = tempfile::tempdir().unwrap();
    let path = base.path().join("bad.toml");
    let shared = fs::read_to_string("../scenarios/network/shared-access-line.toml").unwrap();
    fs::write(&path, shared.replace("uplink = {", "uplink = { duplicate = \"1%\",")).unwrap();
    let text = message(|| drop(Testbed::from_file(&path)));
    assert!(
        text.ends_with("bad.toml: an access line of peer `left` copies packets; expected an access line without duplicate, netem and replay"),
        "{text}"
    );
    for (text, expected) in [
        (RELAY.replace("24ms", "24 parsecs"), "bad.toml:8:18: link.delay: unknown unit \"parsecs\""),
        (RELAY.replace("\"third\"", "\"left\""), "bad.toml:6:"),
        ("= 1".to_owned(), "bad.toml:1:1: "),
        ("scene = { }".to_owned(), "bad.toml:1:"),
    ] {
        fs::write(&path, text).unwrap();
        let text = message(|| drop(Testbed::from_file(&path)));
        assert!(text.contains(expected) && text.contains(" | "), "{text}");
        assert!(matches!(LinkFile::read(&path), Err(LinkFileError::Document(_))));
    }
}

/// Sends one packet at every instant of a list, and keeps when packets came.
struct Node1 {
    sends: Vec<Instant>,
    came: Vec<Instant>,
}

impl Node for Node1 {
    fn handle_packet(&mut self, now: Instant, _packet: Packet) {
        self.came.push(now);
    }

    fn poll_timeout(&mut self) -> Option<Instant> {
        self.sends.last().copied()
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        (self.sends.last() == Some(&now)).then(|| {
            self.sends.pop();
            Transmit::to(1, "x")
        })
    }
}

#[test]
fn nodes_meet_the_changes_of_a_file_too() {
    let base = tempfile::tempdir().unwrap();
    let path = base.path().join("mesh.toml");
    fs::write(&path, RELAY).unwrap();
    let ms = |millis: u64| Instant::from_nanos(millis * 1_000_000);
    let node = |sends: Vec<Instant>| Node1 { sends, came: Vec::new() };
    // A change comes before what happens at its instant.
    let nodes = Nodes::new().add("left", node(vec![ms(2_000), ms(1_000), ms(0)])).add("right", node(vec![])).add("third", node(vec![]));
    let mut run = nodes.links_from_file(&path).start();
    run.run_until_idle();
    assert_eq!(run.node::<Node1>("right").came, [ms(24), ms(1_030), ms(2_005)]);
    assert_eq!(LinkFile::read(&path).unwrap().between(1, 0).mean_delay(), Duration::from_millis(40));
}
