//! Packets that the laws of a test hit: the packets chosen, the effect, and the records of the effect.

use std::fs;
use std::time::Duration;

use cohaptic_testkit::hit::{Draws, Hits, PacketLaw, SentPacket, Verdict};
use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};
use cohaptic_testkit::wan::{DropCause, Fate};
use cohaptic_testkit::{Bed, Happening, Instant, Record, Testbed, time};

/// Returns the instant `count` milliseconds after the beginning.
const fn ms(count: u64) -> Instant {
    Instant::from_nanos(count * 1_000_000)
}

/// Sends the bytes 0, 1, 2 ... from `a` to `b`, one per millisecond. Returns the bytes that have arrived, with the instants of arrival.
async fn count_up(bed: Bed, until: u8) -> Vec<(Instant, u8)> {
    let (from, to) = (bed.host("a").bind("0.0.0.0:1").unwrap(), bed.host("b").bind("0.0.0.0:1").unwrap());
    for byte in 0..until {
        from.send_to(&[byte], "b:1").await.unwrap();
        time::sleep(Duration::from_millis(1)).await;
    }
    let mut came = Vec::new();
    while let Ok(Ok((_, _, at, byte))) = time::timeout(Duration::from_secs(1), async {
        let mut buffer = [0; 1];
        to.recv_from_at(&mut buffer).await.map(|(len, from, at)| (len, from, at, buffer[0]))
    })
    .await
    {
        came.push((at, byte));
    }
    came
}

fn bed() -> Testbed {
    Testbed::new(["a", "b"]).links("delay 10ms").seed(1)
}

fn both(bed: Testbed) -> [Testbed; 2] {
    [bed.clone(), bed.on_tokio()]
}

#[test]
fn every_action_does_what_it_says_to_the_nanosecond() {
    // When [ns] which byte comes.
    for (words, expected) in [
        ("drop packet 1", vec![(10_000_000, 0), (12_000_000, 2), (13_000_000, 3)]),
        ("delay 5ms packet 1", vec![(10_000_000, 0), (12_000_000, 2), (13_000_000, 3), (16_000_000, 1)]),
        ("delay 500ns packet 1", vec![(10_000_000, 0), (11_000_500, 1), (12_000_000, 2), (13_000_000, 3)]),
        ("duplicate packet 1", vec![(10_000_000, 0), (11_000_000, 1), (11_000_000, 1), (12_000_000, 2), (13_000_000, 3)]),
        // At one instant in the order of their numbers, as from a link.
        ("duplicate 3ms packet 0", vec![(10_000_000, 0), (11_000_000, 1), (12_000_000, 2), (13_000_000, 0), (13_000_000, 3)]),
        ("behind 1 packet 0", vec![(11_000_000, 1), (11_000_001, 0), (12_000_000, 2), (13_000_000, 3)]),
        ("behind 2 packet 1", vec![(10_000_000, 0), (12_000_000, 2), (13_000_000, 3), (13_000_001, 1)]),
        ("behind 3 packet 1", vec![(10_000_000, 0), (12_000_000, 2), (13_000_000, 3)]),
        ("behind 1 packets 0 1", vec![(12_000_000, 2), (12_000_001, 0), (12_000_001, 1), (13_000_000, 3)]),
        ("drop 2nd packet; drop every packet with 0x03", vec![(10_000_000, 0), (12_000_000, 2)]),
        // The first that has something to say says what happens.
        ("delay 1ms packet 3; drop packets 2-3", vec![(10_000_000, 0), (11_000_000, 1), (14_000_000, 3)]),
        ("drop every retransmission; drop first SYN", vec![(10_000_000, 0), (11_000_000, 1), (12_000_000, 2), (13_000_000, 3)]),
    ] {
        for bed in both(bed()) {
            let came = bed.hit("a", "b", words).run_twice(|bed| count_up(bed, 4));
            let came: Vec<(u64, u8)> = came.iter().map(|(at, byte)| (at.as_nanos(), *byte)).collect();
            assert_eq!(came, expected, "{words}");
        }
    }
}

#[test]
fn one_bit_is_flipped() {
    let came = bed().hit("a", "b", "corrupt packets 0-3").run(|bed| count_up(bed, 5));
    let flipped: Vec<u32> = came.iter().map(|(at, byte)| (u8::try_from(at.as_nanos() / 1_000_000 - 10).unwrap() ^ byte).count_ones()).collect();
    assert_eq!(flipped, [1, 1, 1, 1, 0]);
    let came = bed().on_packet("a", "b", |packet| if packet.number == 1 { Verdict::Corrupt(9) } else { Verdict::Pass }).run(|bed| count_up(bed, 3));
    assert_eq!(came.iter().map(|(_, byte)| *byte).collect::<Vec<_>>(), [0, 1 ^ 0b10, 2]);
}

#[test]
fn a_function_sees_the_packet_and_begins_anew_with_each_run() {
    let mut asked = 0;
    let bed = bed().on_packet("a", "b", move |packet| {
        asked += 1;
        assert_eq!((packet.from, packet.to, packet.number, packet.at), ("a", "b", asked - 1, ms(asked - 1)));
        assert_eq!((packet.bytes, packet.tcp(), packet.is_retransmission), (&[u8::try_from(packet.number).unwrap()][..], None, false));
        if asked == 3 { Verdict::Drop } else { Verdict::Pass }
    });
    for _ in 0..2 {
        assert_eq!(bed.clone().run(|bed| count_up(bed, 4)).len(), 3);
    }
}

/// Law that drops a packet with this probability.
#[derive(Clone)]
struct Chance(f64);

impl PacketLaw for Chance {
    fn judge(&mut self, packet: &SentPacket<'_>, draws: &mut Draws) -> Verdict {
        let is_hit = draws.next_unit() < self.0;
        if is_hit && packet.number.is_multiple_of(2) { Verdict::Drop } else { Verdict::Pass }
    }
}

#[test]
fn a_law_of_ones_own_draws_by_packet_and_seed() {
    let came = |bed: Testbed| bed.run(|bed| count_up(bed, 100)).into_iter().map(|(_, byte)| byte).collect::<Vec<_>>();
    let half = came(bed().law("a", "b", Chance(0.5)));
    assert!((60..90).contains(&half.len()), "{}", half.len());
    assert_eq!(half, came(bed().law("a", "b", Chance(0.5))));
    assert_ne!(half, came(bed().seed(2).law("a", "b", Chance(0.5))));
    // The second law of a path draws for itself, and what the first does changes nothing.
    let second = |first: &str| came(bed().hit("a", "b", first).law("a", "b", Chance(0.5)));
    let without = |all: Vec<u8>| all.into_iter().filter(|byte| *byte != 3).collect::<Vec<_>>();
    assert_ne!(second("drop packet 200"), half);
    assert_eq!(second("drop packet 3"), without(second("drop packet 200")));
}

/// Returns the fates of the packets from `a` to `b`, except of those with the sequence numbers `without`.
fn fates_without(record: &Record, without: &[u64]) -> Vec<(u64, Fate)> {
    let log = record.fates("a", "b");
    log.records().iter().filter(|record| !without.contains(&record.sequence)).map(|record| (record.sequence, record.fate)).collect()
}

#[test]
fn what_is_hit_changes_no_other_packet() {
    let bed = || Testbed::new(["a", "b"]).links("delay 10ms 3ms loss 10% duplicate 10%").seed(5);
    let run = |bed: Testbed| bed.run_recorded(|bed| count_up(bed, 100)).1;
    let before = run(bed());
    let hit = [7, 20, 21, 50];
    for words in ["drop packets 7 20-21 50", "delay 40ms packets 7 20-21 50", "duplicate 1ms packets 7 20-21 50", "behind 9 packets 7 20-21 50"] {
        let after = run(bed().hit("a", "b", words));
        assert_eq!(fates_without(&after, &hit), fates_without(&before, &hit), "{words}");
        assert_ne!(fates_without(&after, &[]), fates_without(&before, &[]), "{words}");
    }
}

#[test]
fn what_was_hit_is_recorded_counted_and_replayed_without_the_laws() {
    let words = "drop packet 3; delay 40ms packets 7 9; duplicate 1ms packets 8 20-30; behind 4 packet 11; behind 9 packet 98; drop first SYN";
    let bed = Testbed::new(["a", "b"]).links("delay 10ms 3ms loss 10% duplicate 10%").seed(5).hit("a", "b", words);
    let program = |bed: Bed| async move {
        let came = count_up(bed.clone(), 100).await;
        (came, bed.hits("a", "b"), bed.hits("b", "a"))
    };
    let ((came, hits, none), record) = bed.run_recorded(program);
    assert_eq!((hits, none), (17, 0));
    let noted = record.trace().events().iter().filter(|event| matches!(event.what, Happening::Hit { .. })).count();
    assert_eq!(noted, 17);
    assert_eq!(record.fates("a", "b").of_packet(3)[0].fate, Fate::Dropped(DropCause::Filter));
    // It waits for more than come: it has not arrived.
    assert_eq!(record.fates("a", "b").of_packet(98)[0].fate, Fate::Dropped(DropCause::Filter));
    assert_eq!(record.fates("a", "b").packets(), 100);
    let base = tempfile::tempdir().unwrap();
    let folder = base.path().join("kept");
    record.write(&folder).unwrap();
    let ((again, hits, _), _) = Testbed::from_file(folder.join("links.txt")).seed(9).run_recorded(program);
    assert_eq!((again, hits), (came, 0));
    let summary = fs::read_to_string(folder.join("summary.txt")).unwrap();
    assert!(summary.contains("\n  a -> b: delay 40ms packets 7 9 (packet 98 waits for "), "{summary}");
    assert!(summary.contains("drop first SYN") && summary.contains(": hit nothing of 100 packets\n"), "{summary}");
    let trace = fs::read_to_string(folder.join("trace.txt")).unwrap();
    for line in [
        "0.003 s  a -> b  packet 3 hit: dropped\n0.003 s  a -> b  packet 3 lost: filter\n",
        "packet 7 hit: delayed by 40ms\n",
        "packet 8 hit: copied, the copy 1ms later\n",
        "packet 11 hit: held until 4 later packets have passed\n",
    ] {
        assert!(trace.contains(line), "{line}");
    }
}

#[test]
fn packets_that_are_late_at_the_end_are_followed() {
    let ((), record) = bed().hit("a", "b", "delay 1s packet 0; duplicate 2s packet 1").run_recorded(|bed| async move {
        let socket = bed.host("a").bind("0.0.0.0:1").unwrap();
        socket.send_to(b"0", "b:1").await.unwrap();
        socket.send_to(b"1", "b:1").await.unwrap();
        time::sleep(Duration::from_millis(20)).await;
    });
    let fates: Vec<_> = record.fates("a", "b").records().iter().map(|record| (record.sequence, record.copy, record.fate)).collect();
    let arrived = |at| Fate::Delivered(ms(at));
    assert_eq!(fates, [(0, 0, arrived(1010)), (1, 0, arrived(10)), (1, 1, Fate::Duplicated), (1, 1, arrived(2010))]);
}

#[test]
fn a_file_says_hits_and_a_value_does() {
    let base = tempfile::tempdir().unwrap();
    let path = base.path().join("bad.links");
    fs::write(&path, "a <-> b: delay 10ms\nhit a -> b: drop packet 1; delay 1ms packet 2\n").unwrap();
    let expected = [(ms(10), 0), (ms(13), 2), (ms(13), 3)];
    let mut came = Testbed::from_file(&path).run(|bed| count_up(bed, 4));
    came.sort_unstable();
    assert_eq!(came, expected);
    let hits = Hits::words("a -> b: drop packet 1; delay 1ms packet 2");
    let mut came = bed().hits(&hits).run(|bed| count_up(bed, 4));
    came.sort_unstable();
    assert_eq!(came, expected);
}

/// Node with packets to send, and with the bytes of all packets that have arrived.
#[derive(Default)]
struct Counter(Vec<Transmit>, Vec<u8>);

impl Node for Counter {
    fn handle_packet(&mut self, _now: Instant, packet: Packet) {
        self.1.extend(&packet.bytes);
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        self.0.pop()
    }
}

#[test]
fn packets_of_nodes_are_hit_too() {
    let sends = (0..5).rev().map(|byte| Transmit::to(1, vec![byte])).collect();
    let nodes = Nodes::new().add("a", Counter(sends, Vec::new())).add("b", Counter::default()).links("delay 1ms");
    let nodes =
        nodes.hit("a", "b", "drop packet 1").on_packet("a", "b", |packet| if packet.number == 2 { Verdict::Behind(2) } else { Verdict::Pass });
    let mut run = nodes.start();
    run.run_until_idle();
    assert_eq!(run.node::<Counter>("b").1, [0, 3, 4, 2]);
}

#[test]
fn segments_of_tcp_are_known() {
    use cohaptic_testkit::tcp::{Flags, Segment};
    // As a raw packet in a datagram: what sockets of TCP put on the wire.
    let segment = |sequence: u32, flags: Flags, data: &[u8]| {
        let mut packet = vec![0x45, 0, 0, 0, 0, 0, 0x40, 0, 64, 6, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2];
        let [one, two, three, four] = sequence.to_be_bytes();
        packet.extend([0, 80, 0, 81, one, two, three, four, 0, 0, 0, 0, 0x50, flags.bits(), 0, 0, 0, 0, 0, 0]);
        packet.extend(data);
        packet
    };
    let with_checksums = |mut packet: Vec<u8>| {
        let sum = |bytes: &[u8]| bytes.chunks(2).map(|pair| u32::from(pair[0]) << 8 | u32::from(*pair.get(1).unwrap_or(&0))).sum::<u32>();
        let fold = |sum: u32| !u16::try_from((sum & 0xffff) + (sum >> 16)).unwrap();
        let len = u16::try_from(packet.len()).unwrap();
        packet[2..4].copy_from_slice(&len.to_be_bytes());
        let header = fold(sum(&packet[..20]));
        packet[10..12].copy_from_slice(&header.to_be_bytes());
        let tcp = fold(sum(&packet[12..20]) + 6 + u32::from(len - 20) + sum(&packet[20..]));
        packet[36..38].copy_from_slice(&tcp.to_be_bytes());
        packet
    };
    let sent: Vec<Vec<u8>> = [
        (9, Flags::SYN, &b""[..]),
        (9, Flags::SYN, b""),
        (10, Flags::ACK, b""),
        (10, Flags::ACK, b"GET /"),
        (15, Flags::ACK, b"more"),
        (10, Flags::ACK, b"GET /"),
        (19, Flags::FIN | Flags::ACK, b""),
    ]
    .into_iter()
    .map(|(sequence, flags, data)| with_checksums(segment(sequence, flags, data)))
    .collect();
    assert!(Segment::parse(&sent[3]).is_ok());
    for (words, lost) in [
        ("drop first SYN", vec![0]),
        ("drop 2nd syn", vec![1]),
        ("drop every retransmission", vec![1, 5]),
        ("drop every segment with \"GET\"", vec![3, 5]),
        ("drop 2nd segment", vec![4]),
        ("drop first FIN; drop first RST", vec![6]),
    ] {
        let sent = sent.clone();
        let ((), record) = bed().hit("a", "b", words).run_recorded(|bed| async move {
            let socket = bed.host("a").bind("0.0.0.0:1").unwrap();
            for packet in &sent {
                socket.send_to(packet, "b:1").await.unwrap();
            }
        });
        let log = record.fates("a", "b");
        let dropped: Vec<u64> =
            log.records().iter().filter(|record| record.fate == Fate::Dropped(DropCause::Filter)).map(|record| record.sequence).collect();
        assert_eq!(dropped, lost, "{words}");
    }
}

#[cfg(feature = "strategies")]
#[test]
fn a_failing_set_of_packets_shrinks_to_the_least() {
    use cohaptic_testkit::strategies::any_hits;

    use crate::strategies::{sample, shrink};

    // It fails if the packets 4 and 11 of a path, whatever is done to them, and any of the first three of the other are hit.
    let strategy = any_hits(["a", "b"], 16, ["drop", "delay 30ms", "behind 2"]);
    let hit = |hits: &Hits, from: &str, number: u64| {
        let at = |line: &str| line.starts_with(&format!("{from} -> ")) && numbers(line).contains(&number);
        hits.to_string().lines().any(at)
    };
    let mut found = 0;
    for seed in 0..30 {
        let fails = |hits: &Hits| hit(hits, "a", 4) && hit(hits, "a", 11) && (0..3).any(|number| hit(hits, "b", number));
        let Some(shrunk) = shrink(&strategy, seed, fails) else { continue };
        found += 1;
        let text = shrunk.least.to_string();
        let (one, other) = text.split_once('\n').unwrap();
        assert_eq!(one, "a -> b: drop packets 4 11", "from {}", shrunk.first);
        assert!(other.starts_with("b -> a: drop packet ") && other.len() == "b -> a: drop packet 0".len(), "{other}");
        assert!(shrunk.asked < 80, "{}", shrunk.asked);
    }
    assert_eq!(found, 30);
    let drawn = sample(&strategy, 1, 300);
    assert!(drawn.iter().all(|hits| hits.to_string().parse::<Hits>().as_ref() == Ok(hits)));
    assert!(drawn.iter().any(|hits| hits.to_string().contains("behind 2 packets")));
}

/// Returns the numbers of all packets that a printed line names as hit.
#[cfg(feature = "strategies")]
fn numbers(line: &str) -> Vec<u64> {
    let lists = line.split("packet").skip(1).map(|list| list.trim_start_matches('s').split(';').next().unwrap());
    let ranges = lists.flat_map(str::split_whitespace).map(|word| word.split_once('-').unwrap_or((word, word)));
    ranges.flat_map(|(first, last)| first.parse().unwrap()..=last.parse().unwrap()).collect()
}
