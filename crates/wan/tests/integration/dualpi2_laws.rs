//! Laws of DualPI2 on fixed runs. Each packet is its own sender here, and reacts to nothing.

use cohaptic_units::{Bytes, Ecn, Instant};
use cohaptic_wan::{Bottleneck, Discipline, DropCause, DualPi2, Fate, Link, LinkConfig, LinkName, Loss, PacketEvent, PacketInfo, Pattern};

use crate::random_links::{Payload, rate};

const MICRO: u64 = 1_000;
const MILLI: u64 = 1_000_000;

/// Instant \[ns\], size \[bytes\] and codepoint of an offered packet.
type Offered = (u64, u64, Ecn);

/// Returns the events of a link of 8 Mbit/s, on which a byte takes a microsecond, in the order of the offers. The payload of a packet has the two bits of its
/// codepoint.
fn events(dualpi2: DualPi2, offered: impl IntoIterator<Item = Offered>) -> Vec<PacketEvent<Payload>> {
    events_behind(LinkConfig::default(), dualpi2, offered)
}

/// Like [`events`], with the other stages of `config`.
fn events_behind(config: LinkConfig, dualpi2: DualPi2, offered: impl IntoIterator<Item = Offered>) -> Vec<PacketEvent<Payload>> {
    let bottleneck = Some(Bottleneck { discipline: Discipline::DualPi2(dualpi2), ..Bottleneck::at_rate(rate(8_000_000)) });
    let mut link = Link::new(68, &LinkName::between("a", "b"), LinkConfig { bottleneck, ..config });
    let mut offered: Vec<Offered> = offered.into_iter().collect();
    offered.sort_by_key(|(at, ..)| *at);
    for (at, size, ecn) in offered {
        link.handle_packet(Instant::from_nanos(at), PacketInfo { size: Bytes::new(size), ecn }, ecn.bits().into()).unwrap();
    }
    link.handle_timeout(Instant::MAX).unwrap();
    let mut events: Vec<PacketEvent<Payload>> = std::iter::from_fn(|| link.poll_event()).collect();
    events.sort_by_key(|event| event.sequence);
    events
}

/// Time of a delivered packet between its offer and the begin of its transmission \[ns\].
fn wait(event: &PacketEvent<Payload>) -> Option<u64> {
    let Fate::Delivered(at) = event.fate else { return None };
    Some(at.as_nanos() - event.offered.as_nanos() - event.size.get() * MICRO)
}

fn mean(values: impl IntoIterator<Item = u64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0, 0), |(sum, count), value| (sum + value, count + 1));
    sum as f64 / f64::from(count)
}

fn share(events: &[&PacketEvent<Payload>], is_so: impl Fn(&PacketEvent<Payload>) -> bool) -> f64 {
    events.iter().filter(|event| is_so(event)).count() as f64 / events.len() as f64
}

/// Without the controller, packets that wait more than a millisecond are marked, one behind another. 100 bytes take 0.1 ms, so packet 10 waits just a
/// millisecond. The likelihood is counted out: packet 11 makes it 1, and packet 12 is the first one beyond. Behind packet 29 no other packet waits.
#[test]
fn packets_that_wait_longer_than_the_step_are_marked() {
    let events = events(DualPi2 { alpha: 0.0, beta: 0.0, ..DualPi2::default() }, (0..30).map(|_| (0, 100, Ecn::Capable1)));
    let marked: Vec<u64> = events.iter().filter(|event| event.marked).map(|event| event.sequence).collect();
    assert_eq!(marked, (12..29).collect::<Vec<u64>>());
}

/// Without ECN, with ECT(0), with ECT(1) and with CE: the last two pass the first two, and each class stays in order.
#[test]
fn the_codepoint_chooses_the_queue() {
    let codepoints = [Ecn::NotCapable, Ecn::NotCapable, Ecn::Capable0, Ecn::Congestion, Ecn::NotCapable, Ecn::Capable1];
    let events =
        events(DualPi2 { classic_protection: crate::random_links::probability(0.0), ..DualPi2::default() }, codepoints.map(|ecn| (0, 1000, ecn)));
    let mut order: Vec<(u64, u64)> = events.iter().map(|event| (wait(event).unwrap() / MILLI, event.sequence)).collect();
    order.sort_unstable();
    assert_eq!(order.iter().map(|(_, sequence)| *sequence).collect::<Vec<u64>>(), [0, 3, 5, 1, 2, 4]);
}

/// A packet with ECT(0) that another stage has marked has CE, and goes to the L queue.
#[test]
fn a_mark_from_before_counts() {
    let loss = Loss::Pattern(Pattern::of_packets(std::iter::once(2..3).collect(), None).unwrap());
    let config = LinkConfig { loss, marks_instead_of_loss: true, ..LinkConfig::default() };
    let codepoints = [Ecn::NotCapable, Ecn::Capable0, Ecn::Capable0];
    let waits: Vec<u64> =
        events_behind(config, DualPi2::default(), codepoints.map(|ecn| (0, 1000, ecn))).iter().map(|event| wait(event).unwrap() / MILLI).collect();
    assert_eq!(waits, [0, 2, 1]);
}

/// While packets wait in both queues, the C queue gets its share of the bytes: the credit never leaves one packet on each side of zero.
#[test]
fn the_classic_queue_keeps_its_share() {
    for protection in [0.0, 0.1, 0.25, 0.5, 1.0] {
        let dualpi2 = DualPi2 { alpha: 0.0, beta: 0.0, classic_protection: crate::random_links::probability(protection), ..DualPi2::default() };
        let offered = (0..2_000).flat_map(|_| [(0, 300, Ecn::Capable1), (0, 1500, Ecn::NotCapable)]);
        let mut events = events(dualpi2, offered);
        events.sort_by_key(|event| event.at);
        let (mut low, mut classic) = (0.0, 0.0);
        // The first packet met an idle line.
        for event in &events[1..] {
            let sum = if event.payload == u64::from(Ecn::Capable1.bits()) { &mut low } else { &mut classic };
            *sum += event.size.get() as f64;
            if low >= 300.0 * 1_998.0 || classic >= 1_500.0 * 1_998.0 {
                break;
            }
            let credit: f64 = protection * low - (1.0 - protection) * classic;
            assert!((-1_500.0..=300.0).contains(&credit), "{protection}: {credit} after {low} and {classic} bytes");
        }
        assert!(low + classic > 500_000.0, "{protection}");
    }
}

/// Classic packets that need 1.25 of the line, beside small packets of the other queue. What the line does not carry is dropped, so p′² is known, and with it
/// the marks 2·p′. The classic packets wait for about 15 ms, and the others for the packet on the line and at times for one more, which their share of
/// protection lets pass.
#[test]
fn the_marks_of_one_queue_are_the_root_of_the_drops_of_the_other() {
    let classic = (0..100_000).map(|number| (number * 800 * MICRO, 1_000, Ecn::NotCapable));
    let low = (0..8_000).map(|number| (number * 10 * MILLI + 37 * MICRO, 100, Ecn::Capable1));
    let events = events(DualPi2::default(), classic.chain(low));
    let late = |ecn: Ecn| -> Vec<&PacketEvent<Payload>> {
        events.iter().filter(|event| event.payload == u64::from(ecn.bits()) && event.offered.as_nanos() > 20_000 * MILLI).collect()
    };
    let (classic, low) = (late(Ecn::NotCapable), late(Ecn::Capable1));
    let dropped = share(&classic, |event| event.fate == Fate::Dropped(DropCause::DualPi2));
    let marked = share(&low, |event| event.marked);
    // The small packets take a hundredth of the line.
    assert!((dropped - (1.0 - 0.99 / 1.25)).abs() < 0.001, "{dropped}");
    assert!((marked - 2.0 * dropped.sqrt()).abs() < 0.005, "{marked} marked, {dropped} dropped");
    let waits = mean(classic.iter().filter_map(|event| wait(event)));
    assert!((waits / MILLI as f64 - 15.0).abs() < 1.0, "{waits}");
    assert!(low.iter().all(|event| wait(event).unwrap() <= 2 * MILLI));
    assert!(mean(low.iter().filter_map(|event| wait(event))) < 0.6 * MILLI as f64);
}

/// A sender of marked packets that does not react cannot hold the line: from p′ = 1/2 on its packets are dropped too, and wait for about 15 ms.
#[test]
fn a_flood_with_ect_1_is_dropped_under_overload() {
    let events = events(DualPi2::default(), (0..160_000).map(|number| (number * 500 * MICRO, 1_000, Ecn::Capable1)));
    let late: Vec<&PacketEvent<Payload>> = events.iter().filter(|event| event.offered.as_nanos() > 20_000 * MILLI).collect();
    let dropped = share(&late, |event| event.fate == Fate::Dropped(DropCause::DualPi2));
    assert!((dropped - 0.5).abs() < 0.001, "{dropped}");
    assert!(late.iter().all(|event| event.marked || wait(event).is_none()));
    let waits = mean(late.iter().filter_map(|event| wait(event)));
    assert!((waits / MILLI as f64 - 15.0).abs() < 1.0, "{waits}");
}

/// Packets with ECT(0) are marked, not dropped, as long as a mark can be enough: at a constant p′ of 0.1 a hundredth of the packets.
#[test]
fn classic_packets_with_ecn_are_marked() {
    // Without alpha and with a beta of 1 the steps of p′ add up to the wait \[s\].
    let dualpi2 = DualPi2 { alpha: 0.0, beta: 1.0, ..DualPi2::default() };
    // The line holds a packet and the queue 100 ms. Each packet that leaves is replaced.
    let standing = (0..101).map(|_| (0, 1_000, Ecn::Capable0));
    let steady = (1..20_000).map(|number| (number * MILLI, 1_000, Ecn::Capable0));
    let events = events(dualpi2, standing.chain(steady));
    let late: Vec<&PacketEvent<Payload>> = events.iter().filter(|event| event.offered.as_nanos() > 1_000 * MILLI).collect();
    assert!(late.iter().all(|event| wait(event).is_some()));
    let marked = share(&late, |event| event.marked);
    assert!((marked - 0.01).abs() < 0.0006, "{marked}");
}
