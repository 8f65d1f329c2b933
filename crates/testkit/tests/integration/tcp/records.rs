//! Records of TCP, and messages about programs that wait for ever.

use std::io::ErrorKind;
use std::panic::{AssertUnwindSafe, catch_unwind};

use cohaptic_testkit::tcp::{Keepalive, TcpConfig};
use cohaptic_testkit::{Bed, Testbed};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::tcp::ends::pair;
use crate::tcp::{DAY, beds, octets, read_all, send_all};

#[test]
fn the_trace_shows_flags_relative_numbers_and_windows() {
    let ((), record) = Testbed::new(["a", "b"]).links("delay 50ms").seed(1).run_recorded(|bed| async move {
        let (mut client, _server, _listener) = pair(&bed).await;
        client.write_all(b"hello").await.unwrap();
    });
    let trace = record.trace();
    let segments = trace.events().iter().map(|event| trace.words(event).to_string()).filter(|line| line.contains(" octets"));
    let lines: Vec<_> = segments.collect();
    // Then both streams are dropped.
    assert_eq!(
        lines[..4],
        [
            "0 s  a -> b  packet 0 is SYN 49152 > 80, sequence 0, 0 octets, window 64240",
            "0.05 s  b -> a  packet 0 is SYN|ACK 80 > 49152, sequence 0, 0 octets, acknowledges 1, window 65160",
            "0.1 s  a -> b  packet 1 is ACK 49152 > 80, sequence 1, 0 octets, acknowledges 1, window 64256",
            "0.5 s  a -> b  packet 2 is PSH|ACK 49152 > 80, sequence 1, 5 octets, acknowledges 1, window 64256",
        ]
    );
    // With headers: 20 of IP, 20 of TCP and 12 of timestamps.
    let sizes: Vec<_> = record.fates("a", "b").records().iter().map(|record| record.size.get()).collect();
    assert_eq!(sizes[..3], [60, 52, 57]);
}

#[test]
fn refusals_count_from_the_syns_of_what_they_refuse() {
    let ((), record) = Testbed::new(["a", "b"]).links("delay 50ms").seed(1).run_recorded(|bed| async move {
        assert!(bed.host("a").connect("10.0.0.2:81").await.is_err());
        let (mut client, _server, _listener) = pair(&bed).await;
        bed.host("b").crash();
        bed.host("b").restart();
        client.write_all(b"hello").await.unwrap();
        assert_eq!(client.read(&mut [0]).await.unwrap_err().kind(), ErrorKind::ConnectionReset);
    });
    let trace = record.trace();
    let lines: Vec<_> = trace.events().iter().map(|event| trace.words(event).to_string()).filter(|line| line.contains(" is RST")).collect();
    assert_eq!(
        lines,
        [
            "0.05 s  b -> a  packet 0 is RST|ACK 81 > 49152, sequence 0, 0 octets, acknowledges 1, window 0",
            "0.55 s  b -> a  packet 2 is RST 80 > 49153, sequence 1, 0 octets, window 0",
        ]
    );
}

/// Returns the frames of a capture: enhanced packet blocks (type 6), whose data begins after 28 octets.
#[cfg(feature = "pcapng")]
fn frames(mut capture: &[u8]) -> Vec<&[u8]> {
    let mut frames = Vec::new();
    while !capture.is_empty() {
        let word = |at: usize| u32::from_le_bytes(capture[at..at + 4].try_into().unwrap()) as usize;
        if word(0) == 6 {
            frames.push(&capture[28..28 + word(20)]);
        }
        capture = &capture[word(4)..];
    }
    frames
}

#[cfg(feature = "pcapng")]
#[test]
fn a_capture_holds_the_packets_themselves_beside_datagrams() {
    let folder = tempfile::tempdir().unwrap();
    let ((), record) = Testbed::new(["a", "b"]).links("delay 50ms").seed(1).run_recorded(|bed| async move {
        let (mut client, _server, _listener) = pair(&bed).await;
        client.write_all(b"hello").await.unwrap();
        bed.host("a").bind("0.0.0.0:0").unwrap().send_to(b"datagram", "b:5").await.unwrap();
    });
    record.write(folder.path()).unwrap();
    let capture = std::fs::read(folder.path().join("packets-a-to-b.pcapng")).unwrap();
    let frames = frames(&capture);
    let protocols: Vec<_> = frames.iter().map(|frame| frame[9]).collect();
    assert_eq!(protocols[..4], [6, 6, 6, 17]);
    for frame in &frames[..3] {
        let segment = cohaptic_tcp::Segment::parse(frame).unwrap();
        assert_eq!((segment.source.to_string(), segment.destination.to_string()), ("10.0.0.1:49152".into(), "10.0.0.2:80".into()));
    }
    assert!(frames[2].ends_with(b"hello"));
}

#[test]
fn links_of_a_failure_are_replayed_with_tcp() {
    let folder = tempfile::tempdir().unwrap();
    let program = |bed: Bed| async move {
        let (mut client, mut server, _listener) = pair(&bed).await;
        let writing = bed.host("a").spawn(async move { send_all(&mut client, 100_000).await });
        read_all(&mut server, 100_000).await;
        writing.await.unwrap();
        bed.now()
    };
    let words = "delay 20ms 9ms loss 10% duplicate 5%";
    let (ended, record) = Testbed::new(["a", "b"]).links(words).seed(5).run_recorded(program);
    record.write(folder.path().join("kept")).unwrap();
    let replayed = Testbed::from_file(folder.path().join("kept/links.txt")).run(program);
    assert_eq!(replayed, ended);
}

#[test]
fn initial_sequence_numbers_follow_the_seed() {
    let first = |seed| {
        let ((), record) = Testbed::new(["a", "b"]).seed(seed).run_recorded(|bed| async move {
            let _listener = bed.host("b").listen("0.0.0.0:80").unwrap();
            bed.host("a").connect("b:80").await.unwrap();
        });
        record.trace().events().iter().map(|event| record.trace().words(event).to_string()).next()
    };
    assert_eq!(first(1), first(1));
    assert_ne!(first(1), first(2));
}

fn complaint(bed: Testbed, program: impl AsyncFnOnce(Bed) + 'static) -> String {
    let run = AssertUnwindSafe(|| bed.run(|bed| async move { program(bed).await }));
    *catch_unwind(run).unwrap_err().downcast::<String>().unwrap()
}

fn says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}

#[test]
fn what_each_socket_waits_for_is_told() {
    for bed in beds() {
        let text = complaint(bed, async |bed| {
            let (mut client, server, listener) = pair(&bed).await;
            drop(bed.host("b").spawn(async move { listener.accept().await.map(|_| server) }));
            let socket = bed.host("a").bind("0.0.0.0:1").unwrap();
            drop(bed.host("a").spawn(async move { socket.recv(&mut [0; 1]).await }));
            client.read_exact(&mut [0; 1]).await.unwrap();
        });
        says(
            &text,
            &[
                "nothing will ever happen after ",
                "host `a`: UDP 0.0.0.0:1 waits for a datagram",
                "host `b`: the TCP listener at 0.0.0.0:80 waits for a connection",
                "host `a`: TCP 10.0.0.1:49152 to 10.0.0.2:80 (Established) waits to read",
            ],
        );
    }
}

#[test]
fn two_ends_that_write_and_do_not_read_are_stuck_and_named() {
    let config = TcpConfig { receive_buffer: Some(20_000), least_send_buffer: 20_000, send_buffer: 20_000, ..TcpConfig::default() };
    for bed in beds() {
        let text = complaint(bed.tcp(config.clone()), async |bed| {
            let (mut client, mut server, _listener) = pair(&bed).await;
            let other = bed.host("b").spawn(async move { server.write_all(&octets(100_000)).await });
            client.write_all(&octets(100_000)).await.unwrap();
            other.await.unwrap().unwrap();
        });
        says(
            &text,
            &[
                "host `a`: TCP 10.0.0.1:49152 to 10.0.0.2:80 (Established) waits to write; 14752 octets wait, because the program of host `b` does not read",
                "host `b`: TCP 10.0.0.2:80 to 10.0.0.1:49152 (Established) waits to write; 14752 octets wait, because the program of host `a` does not read",
                "20000 octets are there to be read",
            ],
        );
    }
}

#[test]
fn idle_connections_that_are_kept_alive_are_stuck_too() {
    for bed in beds() {
        let text = complaint(bed.time_limit(DAY), async |bed| {
            let (mut client, server, _listener) = pair(&bed).await;
            for stream in [&client, &server] {
                stream.set_keepalive_times(Some(Keepalive::default())).unwrap();
            }
            client.read_exact(&mut [0; 1]).await.unwrap();
        });
        says(&text, &["nothing will ever happen after ", "waits to read"]);
    }
}

#[test]
fn a_closed_window_is_no_reason_to_give_up_while_a_program_waits_for_time() {
    let config = TcpConfig { receive_buffer: Some(20_000), ..TcpConfig::default() };
    for bed in beds() {
        bed.tcp(config.clone()).time_limit(DAY).run(|bed| async move {
            let (mut client, mut server, _listener) = pair(&bed).await;
            let writing = bed.host("a").spawn(async move { send_all(&mut client, 200_000).await });
            if tokio::runtime::Handle::try_current().is_ok() {
                tokio::time::sleep(std::time::Duration::from_secs(7200)).await;
            } else {
                cohaptic_testkit::time::sleep(std::time::Duration::from_secs(7200)).await;
            }
            read_all(&mut server, 200_000).await;
            writing.await.unwrap();
            assert!(bed.now() < crate::tcp::millis(7_210_000), "{}", bed.now());
        });
    }
}
