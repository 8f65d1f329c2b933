//! Tests against files of links in plain words.

use std::fs;
use std::panic::catch_unwind;
use std::path::Path;
use std::time::Duration;

use cohaptic_testkit::node::{Nodes, Transmit};
use cohaptic_testkit::{Instant, LinkFile, LinkFileError, Testbed, ToLink, time};

use crate::once::Once;

fn file(folder: &Path, name: &str, text: &str) -> std::path::PathBuf {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn hosts_links_and_seed_are_those_of_the_file() {
    let base = tempfile::tempdir().unwrap();
    let text = "seed: 3\nhosts: x y z\nall: delay 5ms\nx -> y: delay 3ms 1ms loss 30%\n";
    let path = file(base.path(), "bad.links", text);
    let trace = |bed: Testbed| {
        let ((), record) = bed.run_recorded(|bed| async move {
            let socket = bed.host("x").bind("0.0.0.0:1").unwrap();
            for _ in 0..100 {
                socket.send_to(b"hello", "y:1").await.unwrap();
                socket.send_to(b"hello", "z:1").await.unwrap();
                time::sleep(Duration::from_millis(1)).await;
            }
        });
        record.trace().clone()
    };
    let said = Testbed::new(["x", "y", "z"]).links("delay 5ms").link("x", "y", "delay 3ms 1ms loss 30%").seed(3);
    let (said, read) = (trace(said), trace(Testbed::from_file(&path)));
    assert_eq!(said, read);
    assert_ne!(said, trace(Testbed::from_file(&path).seed(4)));
    let links = LinkFile::parse(text).unwrap();
    assert_eq!(links.hosts(), ["x", "y", "z"]);
    assert_eq!((links.between(0, 1), links.between(1, 0)), (&"delay 3ms 1ms loss 30%".to_link(), &"delay 5ms".to_link()));
}

/// A datagram waits for the cross packets of the words, each 1.2 ms long, and for none where the words have none. Both forms of the words are one link.
#[test]
fn cross_packets_of_the_words_keep_datagrams_waiting() {
    let delays = |words: &str| {
        let bed = Testbed::new(["a", "b"]).link("a", "b", words).seed(5);
        bed.run(|bed| async move {
            let (sender, receiver) = (bed.host("a").bind("0.0.0.0:1").unwrap(), bed.host("b").bind("0.0.0.0:1").unwrap());
            let mut delays = Vec::new();
            for _ in 0..200 {
                let begin = time::now();
                sender.send_to(b"hello", "b:1").await.unwrap();
                receiver.recv_from(&mut [0; 8]).await.unwrap();
                delays.push(time::now() - begin);
            }
            delays
        })
    };
    let (alone, beside) = (delays("delay 20ms rate 10mbit"), delays("delay 20ms rate 10mbit cross poisson 8mbit"));
    assert!(alone.iter().all(|delay| *delay == alone[0]));
    // The line is free for a fifth of the time, and a wait has a mean of two cross packets.
    let free = beside.iter().filter(|delay| **delay == alone[0]).count();
    let mean = beside.iter().sum::<Duration>() / 200;
    assert!((20..80).contains(&free) && (1_500..3_500).contains(&(mean - alone[0]).as_micros()), "{free} met a free line, mean {mean:?}");
    let links = LinkFile::parse("a -> b: rate 10mbit cross on-off 10 2mbit 200ms 800ms size 500\n").unwrap();
    assert_eq!(links.between(0, 1), &"cross on-off 10 2mbit 0.2s 0.8s 1.5 size 500 rate 10mbit".to_link());
    for (words, expected) in [
        ("a -> b: delay 1ms cross poisson 8mbit", "1:19: cross packets share a line: expected rate too"),
        ("a -> b: rate 1mbit cross poisson 8mbit", "1:20: cross packets alone need the whole line"),
        ("a -> b: rate 1mbit cross poison 8kbit", "1:26: \"poison\" is not what cross takes here: expected poisson RATE or on-off"),
    ] {
        let error = LinkFile::parse(words).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

fn message(act: impl FnOnce() + std::panic::UnwindSafe) -> String {
    catch_unwind(act).unwrap_err().downcast_ref::<String>().unwrap().clone()
}

#[test]
fn a_file_that_makes_no_sense_fails_the_test_with_its_place() {
    let base = tempfile::tempdir().unwrap();
    let path = file(base.path(), "bad.links", "a -> b: delay 24ms\n\nb -> a: loss 250%\n");
    let expected = format!(
        "{}:3:14: \"250%\" is not what loss takes here: expected a percentage from 0 to 100\n  |\n3 | b -> a: loss 250%\n  |              ^^^^",
        path.display()
    );
    assert_eq!(message(|| drop(Testbed::from_file(&path))), expected);
    let path = file(base.path(), "log.links", "a -> b: replay fates.csv\n");
    assert!(message(|| drop(Testbed::from_file(&path))).contains("log.links:1:16: cannot be read: "));
    file(base.path(), "fates.csv", "sequence\n");
    assert!(message(|| drop(Testbed::from_file(&path))).contains("log.links:1:16: line 1: found \"sequence\", expected the header"));
    let path = base.path().join("none.links");
    assert!(message(|| drop(Testbed::from_file(&path))).starts_with(&format!("{}: cannot be read: ", path.display())));
    assert!(matches!(LinkFile::read(&path), Err(LinkFileError::Io { .. })));
    let path = file(base.path(), "bytes.links", "");
    fs::write(&path, [0xff, 0xfe]).unwrap();
    assert!(message(|| drop(Testbed::from_file(&path))).contains("cannot be read: it is not a text: expected UTF-8"));
    assert!(LinkFile::parse("a -> b: replay x.csv").unwrap_err().to_string().starts_with("1:16: a text without a file of its own cannot name files"));
}

#[test]
fn nodes_take_the_links_of_a_file_by_name() {
    let base = tempfile::tempdir().unwrap();
    let path = file(base.path(), "two.links", "b -> a: delay 7ms\na -> b: delay 3ms\n");
    let sender = || Once::sending(Transmit::to(1, "x"));
    let mut run = Nodes::new().add("a", sender()).add("b", Once::default()).links_from_file(&path).start();
    run.run_until_idle();
    assert_eq!(run.node::<Once>("b").came, Some(Instant::from_nanos(3_000_000)));
    let nodes = || drop(Nodes::new().add("a", sender()).links_from_file(&path));
    assert_eq!(message(std::panic::AssertUnwindSafe(nodes)), "there is no host `b`; the hosts are a");
}
