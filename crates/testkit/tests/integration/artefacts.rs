//! Files that a failing test writes.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};
use cohaptic_testkit::wan::{DropCause, Fate, FateLog, LinkModel};
use cohaptic_testkit::{ARTEFACTS_VARIABLE, Bed, Happening, Instant, Record, SEED_VARIABLE, Testbed, WriteError, time};

const WORDS: &str = "delay 30ms 9ms loss 20% duplicate 20%";

/// Sends fifty numbers, one per millisecond, which an echo server sends back. Then fails if `fails` is set, while packets are in flight.
async fn program(bed: Bed, fails: bool) {
    let echo = bed.host("b").bind("0.0.0.0:7").unwrap();
    bed.host("b").spawn(async move {
        let mut buffer = [0; 4];
        loop {
            let (len, from) = echo.recv_from(&mut buffer).await.unwrap();
            echo.send_to(&buffer[..len], from).await.unwrap();
        }
    });
    let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
    for number in 0_u32..50 {
        socket.send_to(&number.to_be_bytes(), "b:7").await.unwrap();
        time::sleep(Duration::from_millis(1)).await;
    }
    bed.note("about to fail");
    assert!(!fails, "it fails");
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn log(folder: &Path, name: &str) -> FateLog {
    FateLog::parse(&fs::read_to_string(folder.join(name)).unwrap()).unwrap()
}

const FILES: [&str; 7] =
    ["fates-a-to-b.csv", "fates-b-to-a.csv", "links.txt", "packets-a-to-b.pcapng", "packets-b-to-a.pcapng", "summary.txt", "trace.txt"];

#[test]
fn a_run_that_fails_leaves_all_that_happened() {
    let base = tempfile::tempdir().unwrap();
    let folder = base.path().join("kept");
    let bed = || Testbed::new(["a", "b", "c"]).links(WORDS).seed(5);
    let panic = catch_unwind(AssertUnwindSafe(|| bed().artefacts(&folder).run(|bed| program(bed, true)))).unwrap_err();
    assert_eq!(panic.downcast_ref::<&str>(), Some(&"it fails"));
    assert_eq!((names(base.path()), names(&folder)), (vec!["kept".to_owned()], FILES.map(String::from).to_vec()));
    // A run that does not fail has the same fates, whose packets were followed to their end.
    let ((), record) = bed().run_recorded(|bed| program(bed, false));
    let logs = [log(&folder, "fates-a-to-b.csv"), log(&folder, "fates-b-to-a.csv")];
    assert_eq!(logs, [record.fates("a", "b"), record.fates("b", "a")]);
    assert_eq!((logs[0].packets(), record.fates("a", "c").packets()), (50, 0));
    assert!(logs[0].records().iter().any(|record| record.at > Instant::from_nanos(50_000_000)), "some were on their way");
    assert!(logs[0].records().iter().any(|record| record.copy == 1));
    let trace = fs::read_to_string(folder.join("trace.txt")).unwrap();
    assert_eq!(trace.lines().count(), record.trace().events().len());
    assert!(trace.starts_with("0 s  a -> b  packet 0 sent, 4 bytes, digest "), "{trace}");
    assert!(trace.ends_with("0.05 s  note: about to fail\n"), "{trace}");
    let summary = fs::read_to_string(folder.join("summary.txt")).unwrap();
    let lost = logs[0].records().iter().filter(|record| record.fate == Fate::Dropped(DropCause::Loss)).count();
    let copied = logs[0].records().iter().filter(|record| record.fate == Fate::Duplicated).count();
    let line = format!("  a -> b: 50 packets, {} arrived, {copied} copied, {lost} lost (loss)\n", 50 + copied - lost);
    assert!(
        summary.contains(&line) && summary.contains("which ended at 0.05 s") && summary.contains("COHAPTIC_TEST_SEED=5 repeats the run"),
        "{summary}"
    );
    // As long as a capture has frames: one for each record.
    let capture = fs::read(folder.join("packets-a-to-b.pcapng")).unwrap();
    assert_eq!(frames(&capture), logs[0].records().len());
}

/// Returns the number of enhanced packet blocks (type 6) of a capture.
fn frames(mut capture: &[u8]) -> usize {
    let mut frames = 0;
    while !capture.is_empty() {
        let word = |at: usize| u32::from_le_bytes(capture[at..at + 4].try_into().unwrap());
        frames += usize::from(word(0) == 6);
        capture = &capture[word(4) as usize..];
    }
    frames
}

/// Returns the packets sent and received. The order in which a link reports losses and copies of one instant is not specified, so these are left out.
fn met(record: &Record) -> Vec<(Instant, Happening)> {
    let events = record.trace().events().iter().filter(|event| matches!(event.what, Happening::Sent { .. } | Happening::Arrived { .. }));
    events.map(|event| (event.at, event.what.clone())).collect()
}

#[test]
fn the_links_of_a_failure_are_replayed_with_whatever_seed() {
    let base = tempfile::tempdir().unwrap();
    let folder = base.path().join("kept");
    let ((), record) = Testbed::new(["a", "b"]).links(WORDS).seed(6).run_recorded(|bed| program(bed, false));
    record.write(&folder).unwrap();
    let again = Testbed::from_file(folder.join("links.txt"));
    assert_eq!(again.hosts(), ["a", "b"]);
    let ((), replayed) = again.seed(7).run_recorded(|bed| program(bed, false));
    assert!(met(&record).len() > 60);
    assert_eq!(met(&replayed), met(&record));
    assert_eq!(replayed.fates("a", "b"), record.fates("a", "b"));
}

#[test]
fn what_an_earlier_failure_left_is_replaced_and_a_run_that_holds_leaves_it() {
    let base = tempfile::tempdir().unwrap();
    let folder = base.path().join("kept");
    let run = |hosts: &[&str], fails| {
        let bed = Testbed::new(hosts.to_vec()).links("delay 1ms").artefacts(&folder);
        catch_unwind(AssertUnwindSafe(|| bed.run(move |bed| program(bed, fails)))).is_ok()
    };
    assert!(run(&["a", "b"], false) && !folder.exists());
    assert!(!run(&["a", "b"], true) && folder.join("trace.txt").exists());
    let before = fs::read_to_string(folder.join("links.txt")).unwrap();
    assert!(run(&["a", "b"], false));
    assert_eq!(fs::read_to_string(folder.join("links.txt")).unwrap(), before);
    assert!(!run(&["a", "b", "new"], true));
    assert!(fs::read_to_string(folder.join("links.txt")).unwrap().contains("hosts: a b new\n"));
}

#[test]
fn what_cannot_be_written_does_not_hide_why_the_test_failed() {
    let base = tempfile::tempdir().unwrap();
    fs::write(base.path().join("precious"), "mine").unwrap();
    for folder in [base.path().to_path_buf(), base.path().join("precious/below"), PathBuf::from("..")] {
        let bed = Testbed::new(["a", "b"]).artefacts(folder);
        let panic = catch_unwind(AssertUnwindSafe(|| bed.run(|bed| program(bed, true)))).unwrap_err();
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"it fails"));
    }
    assert_eq!((names(base.path()), fs::read_to_string(base.path().join("precious")).unwrap()), (vec!["precious".to_owned()], "mine".to_owned()));
    let ((), record) = Testbed::new(["a", "b"]).run_recorded(|bed| program(bed, false));
    assert!(matches!(record.write(base.path()), Err(WriteError::NotOurs { .. })));
}

/// Node that sends a packet every millisecond, without end.
struct Beat(Instant);

impl Node for Beat {
    fn handle_packet(&mut self, _now: Instant, _packet: Packet) {}

    fn poll_timeout(&mut self) -> Option<Instant> {
        Some(self.0)
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        (now >= self.0).then(|| {
            self.0 = now + Duration::from_millis(1);
            Transmit::to(1, "beat")
        })
    }
}

#[test]
fn nodes_leave_the_same_when_the_test_fails_while_they_run() {
    let base = tempfile::tempdir().unwrap();
    let folder = base.path().join("kept");
    let result = catch_unwind(AssertUnwindSafe(|| {
        let nodes = Nodes::new().add("a", Beat(Instant::ZERO)).add("b", Beat(Instant::MAX)).links("delay 24ms loss 10%").seed(4);
        let mut run = nodes.artefacts(&folder).start();
        run.run_until(Instant::from_nanos(30_500_000));
        assert_eq!(run.counts("b").arrived, 1_000);
    }));
    assert!(result.is_err());
    assert_eq!(names(&folder), ["fates-a-to-b.csv", "links.txt", "packets-a-to-b.pcapng", "summary.txt", "trace.txt"]);
    // At 0, 1, ... 30 ms.
    let log = log(&folder, "fates-a-to-b.csv");
    assert_eq!(log.packets(), 31);
    assert!(
        log.records().iter().all(|record| record.fate == Fate::Dropped(DropCause::Loss) || record.at == record.offered + Duration::from_millis(24))
    );
}

#[test]
fn a_host_that_did_not_hear_a_packet_is_in_the_trace_and_not_in_the_fates() {
    let ((), record) = Testbed::new(["a", "b"]).links("delay 5ms").run_recorded(|bed| async move {
        let socket = bed.host("a").bind("0.0.0.0:0").unwrap();
        socket.send_to(b"one", "b:7").await.unwrap();
        time::sleep(Duration::from_millis(1)).await;
        bed.host("b").crash();
        bed.cut("a", "b");
        socket.send_to(b"two", "b:7").await.unwrap();
        time::sleep(Duration::from_millis(20)).await;
    });
    assert_eq!(
        record.fates("a", "b").records().iter().map(|record| record.fate).collect::<Vec<_>>(),
        [Fate::Delivered(Instant::from_nanos(5_000_000))]
    );
    let lost = record.trace().events().iter().filter(|event| matches!(event.what, Happening::Lost { .. })).count();
    assert_eq!(lost, 2);
    let replayed = LinkModel::Replay(std::sync::Arc::new(record.fates("a", "b")));
    let _ = Testbed::new(["a", "b"]).links(replayed);
}

/// Variable whose presence makes the test in the child process fail.
const CHILD: &str = "COHAPTIC_TESTKIT_CHILD";

#[test]
fn fails_in_a_child_of_this_process_only() {
    if std::env::var_os(CHILD).is_some() {
        Testbed::new(["a", "b"]).links(WORDS).run(|bed| program(bed, true));
    }
}

#[test]
fn the_environment_asks_for_the_artefacts_of_every_test_that_fails_and_sets_its_seed() {
    let base = tempfile::tempdir().unwrap();
    let test = "artefacts::fails_in_a_child_of_this_process_only";
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture"])
        .env(CHILD, "1")
        .env(ARTEFACTS_VARIABLE, base.path().join("all"))
        .env(SEED_VARIABLE, "77")
        .output()
        .unwrap();
    assert!(!output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    // With one test thread it is named by its function.
    let [name] = &names(&base.path().join("all"))[..] else { panic!("one folder is expected") };
    assert!(
        name == "artefacts__fails_in_a_child_of_this_process_only" || name == "integration__artefacts__fails_in_a_child_of_this_process_only",
        "{name}"
    );
    let folder = base.path().join("all").join(name);
    assert!(
        said.contains(&format!("the record of the run is in {}\n", folder.display()))
            && said.contains("seed 77; COHAPTIC_TEST_SEED=77 runs it again"),
        "{said}"
    );
    assert_eq!(names(&folder), FILES);
    assert!(fs::read_to_string(folder.join("summary.txt")).unwrap().contains("The seed was 77:"));
}
