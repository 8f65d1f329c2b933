//! Instants and spans at the edge of what 64 bits count: 2⁶⁴ − 1 ns, 584.5 years. The rule: what is computed saturates at the last instant, or is `None`; what is
//! read from a file is refused with the place. Nothing wraps, nothing panics.

use std::time::Duration;

use cohaptic_harness::{Ending, Model, Simulation};
use cohaptic_peer::{Clock, Drift};
use cohaptic_scene::Scene;
use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};
use cohaptic_tests::{Log, first_difference, run};
use cohaptic_tests_common::{properties, same_cases};
use cohaptic_units::{Bytes, Instant, Rate};
use cohaptic_wan::{Delay, DropCause, Event, EventQueue, Fate, LinkConfig};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use crate::hard::ROUNDING;

/// Spans at the edges of 64 bits, of a signed one, and of a `Duration` itself.
fn span() -> BoxedStrategy<Duration> {
    let edges = [0, 1, 2, 1_000_000, 1 << 62, i64::MAX as u64, (1 << 63) + 1, u64::MAX - 1, u64::MAX].map(Duration::from_nanos);
    prop_oneof![3 => select(edges.to_vec()), 1 => Just(Duration::MAX), 1 => any::<u64>().prop_map(Duration::from_nanos)].boxed()
}

properties! {
    #![proptest_config(same_cases(20_000, 0x0065_6467))]

    /// Tick k is offset + t with t·(10⁹ + d) ≤ k·Tc·10⁹ < (t + 1)·(10⁹ + d), and `None` exactly if that is beyond the last instant.
    #[test]
    fn a_tick_is_exact_up_to_the_last_instant_and_none_after(
        tick in span().prop_filter("a tick takes time", |tick| !tick.is_zero()), offset in span(),
        k in prop_oneof![0..100_u64, any::<u64>(), Just(u64::MAX)], ppb in -100_000_000..=100_000_000_i64,
    ) {
        let drift = Drift::from_fraction(ppb as f64 * 1e-9).unwrap();
        prop_assert_eq!(drift.parts_per_billion(), ppb);
        let clock = Clock { tick, offset, drift };
        // Never more than 2^94·2^64, which 128 bits do not hold: then it is beyond the end, at a tenth more than which products are looked at.
        let local = tick.as_nanos().checked_mul(k.into()).filter(|local| *local < 1 << 66);
        let speed = u128::from(1_000_000_000_u64.saturating_add_signed(ppb));
        let expected = local.map(|local| local * 1_000_000_000 / speed + offset.as_nanos()).and_then(|at| u64::try_from(at).ok());
        let actual = clock.instant(k).map(Instant::as_nanos);
        prop_assert_eq!(actual, expected);
        if let (Some(at), Some(local)) = (actual, local) {
            let t = u128::from(at) - offset.as_nanos();
            prop_assert!(t * speed <= local * 1_000_000_000 && local * 1_000_000_000 < (t + 1) * speed);
        }
        prop_assert_eq!(u128::from(clock.local_time(k).as_nanos()), local.unwrap_or(u128::MAX).min(u64::MAX.into()));
        let (short, long) = clock.spans();
        prop_assert!(short <= long && long - short <= Duration::from_nanos(1));
    }

    /// 8·size/rate seconds, up to a nanosecond: t is the least whole number with t·rate ≥ 8·10⁹·size, or the last one there is.
    #[test]
    fn a_serialisation_takes_as_long_as_it_takes_or_for_ever(size in prop_oneof![any::<u64>(), Just(u64::MAX), 0..2000_u64], bits in prop_oneof![1..10_u64, any::<u64>(), Just(u64::MAX)]) {
        let bits = bits.max(1);
        let rate = Rate::bits_per_sec(bits).unwrap();
        let (t, work) = (rate.serialisation_time(Bytes::new(size)).as_nanos(), u128::from(size) * 8_000_000_000);
        if t < u128::from(u64::MAX) {
            prop_assert!(t * u128::from(bits) >= work && (t == 0 || (t - 1) * u128::from(bits) < work));
        } else {
            prop_assert!((t - 1) * u128::from(bits) < work);
        }
        prop_assert_eq!(rate.transmission_time(u128::MAX), Duration::from_nanos(u64::try_from(u128::MAX.div_ceil(bits.into())).unwrap_or(u64::MAX)));
    }

    #[test]
    fn instants_saturate_or_say_none(at in any::<u64>(), span in span()) {
        let (instant, sum) = (Instant::from_nanos(at), u128::from(at) + span.as_nanos());
        prop_assert_eq!(instant.checked_add(span).map(|at| u128::from(at.as_nanos())), Some(sum).filter(|sum| *sum <= u64::MAX.into()));
        prop_assert_eq!(u128::from(instant.saturating_add(span).as_nanos()), sum.min(u64::MAX.into()));
    }
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Numbered(Instant, u32);

impl Event for Numbered {
    type Key = Self;

    fn at(&self) -> Instant {
        self.0
    }

    fn key(&self) -> Self {
        *self
    }
}

properties! {
    #![proptest_config(same_cases(500, 0x0071_7565))]

    /// Events around the end of time, and some at its beginning, come out as sorting says, whenever they are put in and taken.
    #[test]
    fn events_at_the_end_of_time_come_in_order(ops in vec((0..64_u32, any::<u64>(), any::<bool>()), 1..300)) {
        let (mut queue, mut naive) = (EventQueue::new(), std::collections::BTreeSet::new());
        for (number, (shift, word, takes)) in (0..).zip(ops) {
            // All distances from the end, on a scale of powers of two.
            let at = Instant::from_nanos(u64::MAX - (word >> shift));
            if takes {
                let first = naive.first().copied().filter(|event: &Numbered| event.0 <= at);
                prop_assert_eq!(queue.pop_due(at), first);
                first.map(|first| naive.remove(&first));
            } else {
                queue.push(Numbered(at, number));
                naive.insert(Numbered(at, number));
            }
            prop_assert_eq!(queue.next_at(), naive.first().map(|event| event.0));
        }
        while let Some(first) = naive.pop_first() {
            prop_assert_eq!(queue.pop_due(Instant::MAX), Some(first));
        }
        prop_assert!(queue.is_empty());
    }
}

/// Two peers for the whole of time, with these ticks, keys of links and changes.
fn scene(tick: &str, link: &str, more: &str) -> Scene {
    let text = format!(
        "scene = {{ duration = \"18446744073709551615ns\", count = 2 }}\nobject = {{ mass = 1.0, velocity = [1e-6] }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 0.0, update = \"{tick}\" }}\n\
         peer = {{ tick = \"{tick}\", contact = \"none\", device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = 0.0 }} }}\nlink = {{ {link} }}\n{more}"
    );
    Scene::parse(&text, "end.toml".as_ref(), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs by either model, which must agree.
fn either(scene: &Scene) -> Log {
    let [least, general] = [Model::Least, Model::General].map(|model| run(scene, model));
    assert_eq!(first_difference(&least, &general), None);
    assert_eq!(least.summary.ending, Ending::Complete);
    least
}

const QUARTER: u64 = 1 << 62;

/// Ticks of 2⁶² ns = 146 years: at 0, 1, 2 and 3 of them; the next would be past the end. A copy moves by h·v a tick, rounded as in any other scene: h and its
/// product once each and the position once a tick, 4 ticks: 10u of where it is.
#[test]
fn a_scene_as_long_as_time_has_the_ticks_that_there_are() {
    let log = either(&scene("4611686018427387904ns", "delay = \"18446744073709551615ns\"", ""));
    assert_eq!(log.of(0).iter().map(|tick| tick.at.as_nanos()).collect::<Vec<_>>(), [0, QUARTER, 2 * QUARTER, 3 * QUARTER]);
    for (k, tick) in log.of(1).into_iter().enumerate() {
        let expected = k as f64 * (QUARTER as f64 * 1e-9) * 1e-6;
        assert!((tick.object.position[0] - expected).abs() <= 10.0 * ROUNDING * expected, "{tick:?}");
    }
    // A delay as long as time: what left at 0 is there at its end, and all that left later is, too, which is where it stops.
    for packet in &log.packets {
        assert_eq!(packet.fate, Fate::Delivered(Instant::MAX));
    }
    assert_eq!((log.packets.len(), log.summary.duration), (8, Duration::from_nanos(u64::MAX)));
    assert!(log.summary.links.iter().all(|link| (link.stats.delivered(), link.stats.in_flight()) == (4, 0)));
}

#[test]
fn a_tick_as_long_as_time_happens_once() {
    let log = either(&scene("18446744073709551615ns", "delay = \"1ns\"", ""));
    assert_eq!((log.ticks.len(), log.summary.ticks, log.packets.len()), (2, 1, 2));
    assert_eq!(log.packets[0].fate, Fate::Delivered(Instant::from_nanos(1)));
}

/// One bit per second: a sample of 64 B takes 512 s, and one of the largest overhead 512 s more for each 64 B of it. 146 years between samples are enough for
/// each; 1 bit/s and 2³¹ − 1 B of overhead, 545 years, are not: the second waits for the first, and leaves when time ends.
#[test]
fn a_bit_a_second_takes_until_the_end_of_time_and_no_longer() {
    let quarters = |log: &Log| log.packets.iter().filter(|row| row.path.from.index() == 0).map(|row| row.at.as_nanos()).collect::<Vec<_>>();
    let log = either(&scene("4611686018427387904ns", "rate = \"1bit\"", ""));
    assert_eq!(quarters(&log), [0, 1, 2, 3].map(|k| k * QUARTER + 512_000_000_000));
    let log = either(&scene("4611686018427387904ns", "rate = \"1bit\", overhead = \"2147483647B\"", ""));
    let first = (64 + 2_147_483_647) * 8 * 1_000_000_000;
    assert_eq!(quarters(&log)[0], first);
    assert!(quarters(&log)[1..].iter().all(|at| *at == u64::MAX), "{:?}", quarters(&log));
}

/// An outage until the last instant of all drops everything; a change at the last instant is made, after all that matters.
#[test]
fn an_outage_until_the_end_and_a_change_at_the_end() {
    let outage = "outage = [{ from = \"4611686018427387905ns\", to = \"18446744073709551615ns\" }]";
    let change = "[[timeline]]\nat = \"18446744073709551614ns\"\nlink = \"all\"\nset = { delay = \"1ns\" }\n";
    let log = either(&scene("4611686018427387904ns", outage, change));
    let fates: Vec<Fate> = log.packets.iter().filter(|row| row.path.from.index() == 0).map(|row| row.fate).collect();
    let at = |nanos| Fate::Delivered(Instant::from_nanos(nanos));
    assert_eq!(fates, [at(0), at(QUARTER), Fate::Dropped(DropCause::Outage), Fate::Dropped(DropCause::Outage)]);
}

/// A clock that is late by all of time but a nanosecond ticks once, or never.
#[test]
fn a_clock_as_late_as_time_ticks_at_its_end_or_never() {
    let peers = |offset: &str| format!("[[peers]]\nname = \"a\"\n[[peers]]\nname = \"b\"\nclock = {{ offset = \"{offset}\", drift = 0.1 }}\n");
    let ticks = |offset: &str| {
        let text = scene_text_of_peers(&peers(offset));
        let scene = Scene::parse(&text, "late.toml".as_ref(), &[]).unwrap_or_else(|error| panic!("{error}"));
        either(&scene).of(1).iter().map(|tick| tick.at.as_nanos()).collect::<Vec<_>>()
    };
    assert_eq!(ticks("18446744073709551614ns"), [u64::MAX - 1]);
    // The end itself is no time for a tick.
    assert_eq!(ticks("18446744073709551615ns"), [0; 0]);
    assert_eq!(ticks("1ns")[..2], [1, 1 + (u128::from(QUARTER) * 10 / 11) as u64]);
}

fn scene_text_of_peers(peers: &str) -> String {
    format!(
        "scene = {{ duration = \"18446744073709551615ns\" }}\nobject = {{ mass = 1.0 }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 0.0, update = \"4611686018427387904ns\" }}\n\
         peer = {{ tick = \"4611686018427387904ns\", contact = \"none\", device = {{ mass = 0.1 }}, coupling = {{ stiffness = 0.0 }} }}\nlink = {{ delay = \"0s\" }}\n{peers}"
    )
}

/// A nanosecond more than there are is refused where it stands, with what was expected.
#[test]
fn a_span_beyond_the_end_of_time_is_refused_where_it_stands() {
    let text = scene_text_of_peers("[[peers]]\nname = \"a\"\n[[peers]]\nname = \"b\"\n");
    for (key, value) in [
        ("scene.duration", "18446744073709551616ns"),
        ("scene.duration", "999999999999h"),
        ("coordination.update", "18446744073709551616ns"),
        ("peer.tick", "18446744073.709551616s"),
        ("link.delay", "18446744073709551616ns"),
    ] {
        let error = Scene::parse(&text, "late.toml".as_ref(), &[format!("{key} = \"{value}\"")]).unwrap_err().to_string();
        assert!(error.contains(key.split('.').next_back().unwrap()) && error.contains("expected") && error.contains(value), "{key}: {error}");
    }
    let Ok(_) = Simulation::new(&Scene::parse(&text, "late.toml".as_ref(), &[]).unwrap(), Model::Least).run(&mut cohaptic_harness::NoObserver);
}

/// A node that wants to be woken at that instant, and counts packets.
struct Waits {
    until: Instant,
    woken: Vec<Instant>,
    got: Vec<Instant>,
    sends: bool,
}

impl Node for Waits {
    fn handle_packet(&mut self, now: Instant, _packet: Packet) {
        self.got.push(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.woken.push(now);
    }

    fn poll_timeout(&mut self) -> Option<Instant> {
        self.woken.is_empty().then_some(self.until)
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        std::mem::take(&mut self.sends).then(|| Transmit::to(1, "late"))
    }
}

/// The last instant stands for never: a timer a nanosecond before it goes off, one at it does not, though a packet that takes as long as time is there then.
#[test]
fn the_last_instant_is_never_for_a_timer_and_the_end_for_a_packet() {
    let waits = |until, sends| Waits { until, woken: Vec::new(), got: Vec::new(), sends };
    let nearly = Instant::from_nanos(u64::MAX - 1);
    let forever = LinkConfig { delay: Delay::constant(Duration::MAX), ..LinkConfig::default() };
    let mut run =
        Nodes::new().add("a", waits(nearly, true)).add("b", waits(Instant::MAX, false)).add("c", waits(Instant::MAX, false)).links(forever).start();
    run.run_until(nearly);
    assert_eq!((run.node::<Waits>("a").woken.as_slice(), run.counts("b").arrived), (&[nearly][..], 0));
    run.run_until(Instant::MAX);
    assert_eq!((run.now(), run.next_event()), (Instant::MAX, None));
    assert_eq!(run.node::<Waits>("b").got, [Instant::MAX]);
    assert!(["b", "c"].into_iter().all(|node| run.node::<Waits>(node).woken.is_empty()));
}
