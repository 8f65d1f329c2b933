//! NATs in link files, in records and in printed tests.

use std::fs;

use cohaptic_testkit::{Bed, Instant, LinkFile, Testbed};

use super::{bind, heard_from};

const FILE: &str = "seed: 5\nhosts: alice bob meet\nnat home-a: alice\nnat home-b strict udp-timeout 30s: bob\nfirewall wall: meet\n\
                    alice -> home-a: delay 2ms\nhome-a -> wall: delay 20ms\nwall -> meet: delay 1ms\n";

async fn ask(bed: Bed) -> (String, Instant) {
    let meet = bind(&bed.host("meet"), "0.0.0.0:7");
    meet.send_to(b"?", "10.0.0.4:5000").await.unwrap();
    let alice = bind(&bed.host("alice"), "0.0.0.0:5000");
    alice.send_to(b"over here", "meet:7").await.unwrap();
    (heard_from(&meet).await.unwrap().to_string(), bed.now())
}

#[test]
fn nats_of_a_file_are_those_of_the_test_bed() {
    let file = LinkFile::parse(FILE).unwrap();
    assert_eq!((file.hosts(), file.between(0, 3).mean_delay().as_millis()), (&["alice", "bob", "meet"].map(String::from)[..], 2));
    let bed = Testbed::from(LinkFile::parse(&FILE.replace("firewall wall: meet\n", "firewall wall filter endpoint-independent: meet\n")).unwrap());
    assert_eq!(bed.hosts(), ["alice", "bob", "meet"]);
    let (from, at) = bed.run(ask);
    assert_eq!((&*from, at.as_nanos()), ("10.0.0.4:5000", 23_000_000));
}

#[test]
fn a_record_has_the_translations_and_is_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("kept");
    let bed = || Testbed::new(["alice", "bob", "meet"]).nat("home-a", "home", ["alice"]).nat("home-b", "cgnat", ["bob"]).links("delay 20ms 5ms");
    let (heard, record) = bed().seed(3).run_recorded(ask);
    record.write(&kept).unwrap();
    let links = fs::read_to_string(kept.join("links.txt")).unwrap();
    assert!(links.contains("hosts: alice bob meet\nnat home-a home: alice\nnat home-b cgnat: bob\nalice -> home-a: replay"), "{links}");
    assert_eq!(Testbed::from_file(kept.join("links.txt")).run(ask), heard);
    let trace = fs::read_to_string(kept.join("trace.txt")).unwrap();
    assert!(trace.contains("meet -> home-a  packet 0 lost: no mapping"), "{trace}");
    // Each link's capture has the addresses of that link.
    for (link, source) in [("alice-to-home-a", [192, 168, 1, 1]), ("home-a-to-meet", [10, 0, 0, 4])] {
        let capture = fs::read(kept.join(format!("packets-{link}.pcapng"))).unwrap();
        let headers: Vec<u8> = [&source[..], &[10, 0, 0, 3, 0x13, 0x88, 0, 7]].concat();
        assert!(capture.windows(headers.len()).any(|window| window == headers), "{link}");
    }
}
