//! State machines on emulated links.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use bytes::Bytes;
use cohaptic_testkit::node::{Node, NodeRun, Nodes, Packet, Transmit, address};
use cohaptic_testkit::wan::{Chance, Checksum, Corruption, Flips, LinkConfig, NodeId, Path};
use cohaptic_testkit::{Happening, Instant, Lost};
use cohaptic_units::{Ecn, Probability};
use proptest::prelude::*;

const fn ms(count: u64) -> Instant {
    Instant::from_nanos(count * 1_000_000)
}

/// Sender of Go-Back-N: sends numbers from 0, at most `window` unacknowledged ones. Repeats the window after `wait` without an acknowledgement.
struct GoBackN {
    count: u32,
    window: u32,
    wait: Duration,
    /// Least number that is not acknowledged.
    base: u32,
    next: u32,
    deadline: Option<Instant>,
}

impl GoBackN {
    fn new(count: u32, window: u32, wait: Duration) -> Self {
        Self { count, window, wait, base: 0, next: 0, deadline: None }
    }
}

impl Node for GoBackN {
    fn handle_packet(&mut self, now: Instant, packet: Packet) {
        let acknowledged = u32::from_be_bytes(packet.bytes[..].try_into().unwrap());
        if acknowledged > self.base && acknowledged <= self.count {
            self.base = acknowledged;
            self.next = self.next.max(acknowledged);
            self.deadline = (self.base < self.count).then(|| now + self.wait);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.next = self.base;
        self.deadline = Some(now + self.wait);
    }

    fn poll_timeout(&mut self) -> Option<Instant> {
        self.deadline
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        (self.next < self.count.min(self.base + self.window)).then(|| {
            self.deadline.get_or_insert(now + self.wait);
            self.next += 1;
            Transmit::to(1, (self.next - 1).to_be_bytes().to_vec())
        })
    }
}

/// Receiver that accepts numbers in order, and answers with the next number that it expects.
#[derive(Default)]
struct InOrder {
    got: Vec<u32>,
    answers: VecDeque<Transmit>,
}

impl Node for InOrder {
    fn handle_packet(&mut self, _now: Instant, packet: Packet) {
        let number = u32::from_be_bytes(packet.bytes[..].try_into().unwrap());
        if number as usize == self.got.len() {
            self.got.push(number);
        }
        self.answers.push_back(packet.answer((self.got.len() as u32).to_be_bytes().to_vec()));
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        self.answers.pop_front()
    }
}

fn transfer(count: u32, window: u32) -> Nodes {
    Nodes::new().add("a", GoBackN::new(count, window, Duration::from_millis(200))).add("b", InOrder::default())
}

fn is_all_there(run: &NodeRun, count: u32) -> bool {
    run.node::<InOrder>("b").got == (0..count).collect::<Vec<_>>() && run.node::<GoBackN>("a").base == count
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn go_back_n_brings_all_over_any_bad_link(loss in 0_u32..40, copies in 0_u32..30, jitter in 1_u32..9, window in 1_u32..20, seed in any::<u64>()) {
        let words = format!("delay 10ms {jitter}ms loss {loss}% duplicate {copies}%");
        let mut run = transfer(100, window).links(&words).seed(seed).start();
        run.run_while(|run| run.node::<GoBackN>("a").base < 100);
        prop_assert!(is_all_there(&run, 100));
        // The counts of the link and of the nodes agree.
        let stats = run.link_stats("a", "b");
        prop_assert_eq!(stats.offered(), run.counts("a").sent);
        run.run_until_idle();
        prop_assert_eq!(run.link_stats("a", "b").delivered(), run.counts("b").arrived);
    }
}

#[test]
fn on_a_link_that_only_delays_it_takes_a_round_trip_a_window() {
    let mut run = transfer(100, 10).links("delay 24ms").start();
    let done = run.run_while(|run| run.node::<GoBackN>("a").base < 100);
    assert_eq!(done, ms(10 * 48));
    // The timer of the last window was called off.
    assert_eq!(run.run_until_idle(), ms(480));
    assert_eq!((run.counts("a").sent, run.counts("a").timeouts, run.counts("b").arrived), (100, 0, 100));
}

#[test]
fn a_partition_costs_the_timeouts_that_it_lasts() {
    let mut run = transfer(20, 10).links("delay 24ms").recorded().start();
    // The first window has arrived, its acknowledgements are under way.
    run.run_until(ms(30));
    run.partition(&["a"], &["b"]);
    run.run_until(ms(700));
    assert_eq!((run.node::<GoBackN>("a").base, run.counts("b").cut, run.counts("a").timeouts), (0, 10, 3));
    run.mend_all();
    run.run_while(|run| !is_all_there(run, 20));
    // Timeouts at 200, 400, 600 were in vain; that at 800 ms was not.
    assert_eq!(run.now(), ms(800 + 48 + 48));
    let record = run.record();
    let lost = record.trace().events().iter().filter(|event| matches!(event.what, Happening::Lost { why: Lost::Cut, .. })).count();
    assert_eq!(lost as u64, run.counts("a").cut + run.counts("b").cut);
    assert_eq!(lost, 10 + 3 * 10);
    assert!(record.trace().events().iter().any(|event| event.what == Happening::Mended(Path { from: NodeId(0), to: NodeId(1) })));
}

#[test]
fn a_node_that_crashes_loses_what_arrives_and_one_that_restarts_begins_anew() {
    let mut run = transfer(20, 10).links("delay 24ms").start();
    run.run_until(ms(30));
    let lost: InOrder = run.crash("b");
    assert_eq!(lost.got.len(), 10);
    assert!(!run.is_up("b"));
    run.run_until(ms(150));
    // Its acknowledgements were under way; the second window came to nobody.
    assert_eq!((run.node::<GoBackN>("a").base, run.counts("b").while_down), (10, 10));
    run.restart("b", lost);
    run.run_while(|run| !is_all_there(run, 20));
    // The timer was set anew when the first acknowledgement came, at 48 ms.
    assert_eq!(run.now(), ms(48 + 200 + 48));
}

#[test]
fn what_the_test_makes_a_node_send_leaves_at_once_and_links_change_when_they_are_told() {
    let mut run = Nodes::new().add("a", GoBackN::new(0, 4, Duration::from_secs(1))).add("b", InOrder::default()).links("delay 5ms").start();
    assert_eq!(run.next_event(), None);
    run.run_until(Instant::from_nanos(1_234_567));
    run.node_mut::<GoBackN>("a").count = 1;
    // It was sent before the link became another one.
    run.set_link("a", "b", "delay 1s");
    assert_eq!(run.next_event(), Some(Instant::from_nanos(6_234_567)));
    assert!(run.step());
    assert_eq!(run.node::<InOrder>("b").got, [0]);
    assert!(run.step());
    assert_eq!((run.now(), run.step()), (Instant::from_nanos(11_234_567), false));
    run.node_mut::<GoBackN>("a").count = 2;
    run.run_while(|run| run.node::<InOrder>("b").got.len() < 2);
    assert_eq!(run.now(), Instant::from_nanos(1_011_234_567));
}

/// Node that wakes at given instants, and records wake-ups and packets in order.
#[derive(Default)]
struct Watch {
    wakes: VecDeque<Instant>,
    sends: Vec<Transmit>,
    seen: Vec<(Instant, Option<Packet>)>,
}

impl Node for Watch {
    fn handle_packet(&mut self, now: Instant, packet: Packet) {
        self.seen.push((now, Some(packet)));
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.wakes.pop_front();
        self.seen.push((now, None));
    }

    fn poll_timeout(&mut self) -> Option<Instant> {
        self.wakes.front().copied()
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        self.sends.pop()
    }
}

#[test]
fn at_one_instant_packets_come_before_timers_and_late_timers_go_off_now() {
    let transmit = Transmit { to: "[fd00::2]:9".parse().unwrap(), from_port: 7, bytes: Bytes::from_static(b"six"), ecn: Ecn::NotCapable };
    let a = Watch { sends: vec![transmit], ..Watch::default() };
    let b = Watch { wakes: [ms(5), ms(5), ms(2)].into(), ..Watch::default() };
    let mut run = Nodes::new().add("a", a).add("b", b).links("delay 5ms").start();
    run.run_until_idle();
    let packet =
        Packet { from: "[fd00::1]:7".parse().unwrap(), to: "[fd00::2]:9".parse().unwrap(), bytes: Bytes::from_static(b"six"), marked: false };
    assert_eq!(packet.from_place(), 0);
    assert_eq!(run.node::<Watch>("b").seen, [(ms(5), Some(packet)), (ms(5), None), (ms(5), None), (ms(5), None)]);
}

#[test]
fn a_packet_to_oneself_meets_no_link_and_one_to_nobody_is_counted() {
    let a = Watch { sends: vec![Transmit::to(0, "self"), Transmit::to(7, "nobody")], ..Watch::default() };
    let run = Nodes::new().add("a", a).links("delay 5ms").start();
    let seen = &run.node::<Watch>("a").seen;
    assert_eq!((seen.len(), seen[0].0, &seen[0].1.as_ref().unwrap().bytes[..]), (1, Instant::ZERO, &b"self"[..]));
    assert_eq!((run.counts("a").unroutable, run.counts("a").sent, run.counts("a").arrived), (1, 2, 1));
}

#[test]
fn a_link_that_damages_packets_does_so() {
    let bits = Flips::Bits { packets: Chance::independent(Probability::new(0.5).unwrap()), count: 3 };
    let corruption = Corruption { bits, within: None, checksum: Checksum::Passes };
    let link = LinkConfig { corruption: Some(corruption), ..LinkConfig::default() };
    let sends = (0..50).map(|_| Transmit::to(1, vec![0; 100])).collect();
    let mut run = Nodes::new().add("a", Watch { sends, ..Watch::default() }).add("b", Watch::default()).links(link).seed(3).start();
    run.run_until_idle();
    let flipped = |packet: &Packet| packet.bytes.iter().map(|byte| byte.count_ones()).sum::<u32>();
    let damaged: Vec<u32> =
        run.node::<Watch>("b").seen.iter().filter_map(|(_, packet)| Some(flipped(packet.as_ref()?)).filter(|bits| *bits > 0)).collect();
    assert_eq!(damaged.len() as u64, run.link_stats("a", "b").damaged());
    assert!(!damaged.is_empty() && damaged.len() < 50 && damaged.iter().all(|bits| *bits == 3));
}

#[test]
fn what_would_be_lost_is_marked_if_the_ends_understand_it() {
    let transmit = |ecn| Transmit { ecn, ..Transmit::to(1, "x") };
    let sends = (0..40).map(|number| transmit(if number % 2 == 0 { Ecn::Capable1 } else { Ecn::NotCapable })).collect();
    let mut run = Nodes::new().add("a", Watch { sends, ..Watch::default() }).add("b", Watch::default()).links("loss 100% ecn").start();
    run.run_until_idle();
    let seen = &run.node::<Watch>("b").seen;
    assert!(seen.len() == 20 && seen.iter().all(|(_, packet)| packet.as_ref().unwrap().marked));
}

#[test]
fn what_nodes_do_is_done_twice_the_same() {
    let words = "delay 20ms 5ms distribution normal loss 5% duplicate 5%";
    let at = Nodes::run_twice(|| transfer(200, 16).links(words), |run| run.run_while(|run| !is_all_there(run, 200)));
    assert!(at > ms(200 / 16 * 40));
}

fn message(act: impl FnOnce()) -> String {
    let panic = catch_unwind(AssertUnwindSafe(act)).unwrap_err();
    panic.downcast_ref::<String>().cloned().or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap()
}

#[test]
fn two_runs_that_differ_are_told_apart() {
    let calls = std::cell::Cell::new(0);
    let build = || transfer(1, 1).links("delay 5ms");
    let text = message(|| {
        Nodes::run_twice(build, |run| {
            calls.set(calls.get() + 1);
            run.run_until(ms(calls.get()));
            run.note("here");
        });
    });
    assert!(
        text.starts_with("two runs of the nodes are not the same: the runs differ from 0.001 s on, at event 1:\n  first : 0.001 s  note: here"),
        "{text}"
    );
}

/// Node that does one thing without end at a single instant.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wrong {
    Sends,
    Wakes,
    Answers,
}

impl Node for Wrong {
    fn handle_packet(&mut self, _now: Instant, _packet: Packet) {}

    fn poll_timeout(&mut self) -> Option<Instant> {
        (*self == Self::Wakes).then_some(ms(3))
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        (*self == Self::Sends).then(|| Transmit::to(1, ""))
    }
}

#[test]
fn misuse_says_what_to_do() {
    let run = |wrong: Wrong| Nodes::new().add("a", wrong).add("b", Watch::default()).patience(1_000).start();
    assert_eq!(
        message(|| drop(run(Wrong::Sends))),
        "time stands still at 0 s after 1000 packets and timers: node `a` sends without end: `poll_transmit` must give `None` when there is nothing more to \
         send now"
    );
    assert_eq!(
        message(|| _ = run(Wrong::Wakes).run_until_idle()),
        "time stands still at 0.003 s after 1000 packets and timers: node `a` wants to be woken again and again: after `handle_timeout`, `poll_timeout` must \
         give a later instant, or `None`"
    );
    let echo = |patience| {
        #[derive(Default)]
        struct Echo(Vec<Transmit>);
        impl Node for Echo {
            fn handle_packet(&mut self, _now: Instant, packet: Packet) {
                self.0.push(packet.answer(packet.bytes.clone()));
            }
            fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
                self.0.pop()
            }
        }
        let run = Nodes::new().add("a", Echo(vec![Transmit::to(1, "x")])).add("b", Echo::default()).patience(patience).start();
        drop(run);
    };
    // Whether it is a packet sent or one handed over that is one too many.
    for patience in [1_000, 1_001] {
        let text = message(|| echo(patience));
        assert!(text.contains("answers without end over links without delay"), "{text}");
    }
    let mut fine = run(Wrong::Answers);
    assert!(message(|| _ = fine.run_while(|_| true)).starts_with("nothing will ever happen after 0 s"));
    fine.run_until(ms(5));
    assert_eq!(message(|| fine.run_until(ms(4))), "the run cannot go on until 0.004 s: the run is already at 0.005 s; give a later instant");
    assert_eq!(message(|| drop(fine.record())), "the run was not recorded; call `Nodes::recorded` before `start`");
    assert!(message(|| _ = fine.node::<Echo>("a")).starts_with("node `a` is not a `"));
    assert_eq!(message(|| _ = fine.counts("c")), "there is no host `c`; the hosts are a, b");
    assert!(message(|| fine.restart("a", Wrong::Answers)).contains("is up: `crash` the node before"));
    let _: Wrong = fine.crash("a");
    assert!(message(|| _ = fine.crash::<Wrong>("a")).contains("is down; `NodeRun::restart`"));
    assert!(message(|| drop(Nodes::new().start())).contains("the run has no nodes"));
    assert!(message(|| drop(Nodes::new().add("a", Wrong::Sends).add("a", Wrong::Sends))).contains("two hosts have the name `a`"));
    assert!(message(|| _ = fine.link_stats("a", "a")).contains("no link to itself"));
    let mut beats = Nodes::new().add("a", Beat(ms(0))).links("delay 3ms").time_limit(Duration::from_secs(2)).start();
    let text = message(|| _ = beats.run_until_idle());
    assert!(
        text.starts_with("the nodes are not idle at 2.001 s, beyond the time limit") && text.ends_with(". The network:\n  all: delay 3ms"),
        "{text}"
    );
    assert!(message(|| _ = beats.run_while(|_| true)).starts_with("the condition of `run_while` still holds at 2.002 s, beyond the time limit"));
    assert_eq!(address(0, 1).port(), 1);
}

struct Echo;

impl Node for Echo {
    fn handle_packet(&mut self, _now: Instant, _packet: Packet) {}

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        None
    }
}

/// Node that wakes every millisecond.
struct Beat(Instant);

impl Node for Beat {
    fn handle_packet(&mut self, _now: Instant, _packet: Packet) {}

    fn handle_timeout(&mut self, now: Instant) {
        self.0 = now + Duration::from_millis(1);
    }

    fn poll_timeout(&mut self) -> Option<Instant> {
        Some(self.0)
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        None
    }
}
