//! Captures as made in practice: begun at different times, with cut, doubled or joined frames.

use super::super::{CaptureError, Matched, between};
use super::build::{Octets, Shot, cut, enhanced, ethernet, file, interface, ipv4, ipv6, packet, section, shot, udp};

const MS: u64 = 1_000_000;

/// Payload of a packet: its number, and octets that follow from the number.
fn payload(number: u32, length: usize) -> Vec<u8> {
    let mut state = number;
    let more = std::iter::repeat_with(|| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.to_be_bytes()[0]
    });
    number.to_be_bytes().into_iter().chain(more).take(length).collect()
}

fn id(number: u32) -> u16 {
    u16::try_from(number + 1).unwrap()
}

/// A sent packet, one per millisecond.
fn sent(number: u32) -> Shot {
    packet(u64::from(number) * MS, id(number), &payload(number, 64))
}

/// The arrival of a packet, 20 ms later.
fn arrived(number: u32) -> Shot {
    Shot { nanos: (u64::from(number) + 20) * MS, ..sent(number) }
}

fn read(sender: &[Shot], receiver: &[Shot]) -> Matched {
    between(file(sender).as_slice(), file(receiver).as_slice(), None).unwrap_or_else(|error| panic!("{error}"))
}

/// Number of lost packets, and the delays of the others \[ms\].
fn summary(matched: &Matched) -> (usize, Vec<u32>) {
    let delays = matched.measurements.packets().iter().filter_map(|packet| packet.delay_s);
    (matched.unmatched_sent, delays.map(|delay| (0..100).find(|ms| (delay - f64::from(*ms) * 1e-3).abs() < 1e-9).unwrap()).collect())
}

/// Of 100 packets, 10 are lost and 90 delivered. The receiver's capture misses the first 30 and the last 20 packets.
#[test]
fn loss_is_judged_where_both_captures_ran() {
    let all: Vec<Shot> = (0..100).map(sent).collect();
    let received: Vec<Shot> = (30..80).filter(|number| number % 10 != 3).map(arrived).collect();
    let matched = read(&all, &received);
    assert_eq!(matched.left_out, [30, 20]);
    assert_eq!((summary(&matched), matched.measurements.packets().len()), ((5, vec![20; 45]), 50));
    assert_eq!(matched.measurements.packets()[0].sent_s, 0.0);
    // Other frames show that the capture ran, so packets at both ends were lost. The first 10 would have arrived before the first frame.
    let other = |nanos| shot(nanos, ethernet(0x0806, &[0; 28]));
    let busy: Vec<Shot> = [vec![other(30 * MS)], received, vec![other(300 * MS)]].concat();
    let matched = read(&all, &busy);
    assert_eq!((matched.left_out, matched.unmatched_sent, matched.measurements.packets().len()), ([10, 0], 45, 90));
}

#[test]
fn captures_of_other_packets_are_refused() {
    let error = between(file(&[sent(1), sent(2)]).as_slice(), file(&[arrived(3)]).as_slice(), None).unwrap_err();
    assert_eq!(error, CaptureError::NoneMatched { sent: 2, arrived: 1 });
    assert!(error.to_string().starts_with("none of 2 datagrams of the sender is among the 1 of the receiver"), "{error}");
}

/// A capture of a bridge and of a port of the bridge: two interfaces in a file, each showing every packet.
#[test]
fn a_packet_that_two_interfaces_show_is_one_packet() {
    for with_identification in [true, false] {
        let order = Octets::Little;
        // IPv6 has no identification.
        let frame = |number: u32| {
            let datagram = udp(5000, &payload(number, 64));
            if with_identification { sent(number) } else { shot(0, ethernet(0x86DD, &ipv6(17, &datagram))) }
        };
        let mut doubled = [section(order), interface(order, 1, 0, &[]), interface(order, 1, 0, &[])].concat();
        for number in 0..100 {
            let micros = u64::from(number) * 1_000;
            doubled.extend(enhanced(order, 0, micros, &frame(number), &[]));
            doubled.extend(enhanced(order, 1, micros + 30, &frame(number), &[]));
        }
        let received: Vec<Shot> =
            (0..100).filter(|number| number % 10 != 3).map(|number| Shot { nanos: arrived(number).nanos, ..frame(number) }).collect();
        let matched = between(doubled.as_slice(), file(&received).as_slice(), None).unwrap();
        assert_eq!((summary(&matched), matched.sender.seen_again), ((10, vec![20; 90]), 100), "{with_identification}");
        // In the other direction, the second views do not count as copies.
        let matched = between(file(&received).as_slice(), doubled.as_slice(), None).unwrap();
        assert_eq!((matched.unmatched_sent, matched.unmatched_arrived, matched.receiver.seen_again), (0, 10, 100));
    }
}

/// A mirrored port shows each frame twice. Twenty of a hundred packets are lost.
#[test]
fn a_frame_that_is_shown_twice_is_one_packet() {
    for with_identification in [true, false] {
        let frame = |number: u32, nanos: u64| packet(nanos, if with_identification { id(number) } else { 0 }, &payload(number, 64));
        let twice: Vec<Shot> = (0..100).flat_map(|number| [0, 40_000].map(|later| frame(number, u64::from(number) * MS + later))).collect();
        let received: Vec<Shot> = (0..100).filter(|number| number % 5 != 3).map(|number| frame(number, (u64::from(number) + 20) * MS)).collect();
        let matched = read(&twice, &received);
        assert_eq!((summary(&matched), matched.sender.seen_again), ((20, vec![20; 80]), 100), "{with_identification}");
    }
}

/// A second view at the receiver has the payload of the lost packet after it, and must not be taken for that packet.
#[test]
fn a_second_view_does_not_hide_a_loss() {
    let state = |nanos, number| packet(nanos, number, b"the same state");
    let sent = [state(0, 1), state(MS, 2), state(2 * MS, 3)];
    let arrived = [state(20 * MS, 1), state(20 * MS + 5_000, 1), state(22 * MS, 3)];
    let matched = read(&sent, &arrived);
    assert_eq!((summary(&matched), matched.unmatched_arrived), ((1, vec![20, 20]), 1));
}

/// A program that sends each packet twice sends two packets. Both, one or neither can arrive.
#[test]
fn a_packet_that_is_sent_twice_is_two_packets() {
    let sent: Vec<Shot> =
        (0..50).flat_map(|number| [0, 1].map(|copy| packet(u64::from(number) * MS, id(number) + 1_000 * copy, &payload(number, 64)))).collect();
    let received: Vec<Shot> =
        sent.iter().enumerate().filter(|(place, _)| place % 7 != 3).map(|(_, shot)| Shot { nanos: shot.nanos + 20 * MS, ..shot.clone() }).collect();
    assert_eq!(summary(&read(&sent, &received)), (14, vec![20; 86]));
}

/// Frames are cut at 96 octets by the sender, and at 60 and 68 by the receiver: 18 octets of payload are common to all.
#[test]
fn frames_that_were_cut_are_matched_by_what_both_hold() {
    let long = |number: u32, nanos: u64, identification: u16| packet(nanos, identification, &payload(number, 800));
    for (identified, lengths) in [(true, [96, 60, 60]), (false, [96, 60, 68]), (true, [2_000, 60, 2_000]), (false, [60, 2_000, 60])] {
        let own = |number: u32| if identified { id(number) } else { 0 };
        let sent: Vec<Shot> = (0..100).map(|number| cut(&long(number, u64::from(number) * MS, own(number)), lengths[0])).collect();
        let received = (0..100).filter(|number| number % 10 != 3).map(|number| {
            let whole = long(number, (u64::from(number) + 20) * MS, own(number));
            cut(&whole, lengths[1 + usize::from(number % 2 == 0)])
        });
        let matched = read(&sent, &received.collect::<Vec<_>>());
        assert_eq!((summary(&matched), matched.ambiguous), ((10, vec![20; 90]), 0), "{lengths:?}");
    }
    // Datagrams with the same beginning and other lengths are different datagrams.
    let [short, longer] = [700, 900].map(|length| cut(&packet(0, 0, &payload(1, length)), 70));
    let twice = |shot: &Shot| file(&[shot.clone(), shot.clone()]);
    assert!(between(twice(&short).as_slice(), twice(&longer).as_slice(), None).is_err());
}

/// Whole frames with only the first octets in common are different datagrams, even if other frames were cut.
#[test]
fn a_common_beginning_is_not_enough_where_more_is_held() {
    let with_end = |end: u8| [&payload(1, 300)[..], &[end]].concat();
    let cut_one = |nanos| cut(&packet(nanos, 0, &payload(2, 301)), 62);
    let sent = [packet(0, 0, &with_end(1)), cut_one(MS)];
    // Begins with a frame of another kind, so that the first datagram is judged.
    let arrived = [shot(0, ethernet(0x0806, &[0; 28])), cut_one(2 * MS), packet(20 * MS, 0, &with_end(2)), cut_one(60 * MS)];
    let matched = read(&sent, &arrived);
    assert_eq!((matched.left_out, matched.unmatched_sent), ([0, 0], 1));
}

/// Makes packets of 100 octets in groups. A group is a datagram with the identification of its first packet. The last of 60 packets has 40 octets.
fn groups(sizes: &[usize], nanos: impl Fn(u32) -> u64, is_lost: impl Fn(u32) -> bool, identified: bool) -> Vec<Shot> {
    let mut number = 0;
    let mut shots = Vec::new();
    for size in sizes.iter().cycle() {
        let members: Vec<u32> = (number..60.min(number + u32::try_from(*size).unwrap())).filter(|number| !is_lost(*number)).collect();
        number += u32::try_from(*size).unwrap();
        if let Some(first) = members.first() {
            let content: Vec<u8> = members.iter().flat_map(|number| payload(*number, if *number == 59 { 40 } else { 100 })).collect();
            shots.push(packet(nanos(*first), if identified { id(*first) } else { 0 }, &content));
        }
        if number >= 60 {
            return shots;
        }
    }
    shots
}

/// The sender passes five packets at once to the network card. The receiver shows single packets, or joins two.
#[test]
fn super_packets_are_matched_with_the_packets_that_they_become() {
    for identified in [true, false] {
        for (ours, theirs) in [(&[5][..], &[1][..]), (&[5], &[2]), (&[1], &[3]), (&[4, 1], &[1, 2])] {
            let is_lost = |number: u32| number % 15 == 7;
            // A datagram shown as one by both ends arrives as one.
            let sent = groups(ours, |number| u64::from(number / 5 * 5) * MS, |_| false, identified);
            let received = groups(theirs, |number| u64::from(number / 5 * 5 + 20) * MS, is_lost, identified);
            let matched = read(&sent, &received);
            assert_eq!((matched.measurements.packets().len(), matched.unmatched_sent, matched.unmatched_arrived), (60, 4, 0), "{ours:?} {theirs:?}");
            let supers = |shots: &[Shot]| shots.iter().filter(|shot| shot.octets.len() > 142).count();
            assert_eq!((matched.sender.super_packets, matched.receiver.super_packets), (supers(&sent), supers(&received)), "{ours:?} {theirs:?}");
        }
    }
}

/// Cut frames show only the first packet of a long datagram. Of 12 datagrams with 5 packets each, every fourth is lost at the first packet.
#[test]
fn of_super_packets_that_were_cut_the_first_packet_is_judged() {
    for identified in [true, false] {
        let is_lost = |number: u32| number % 20 == 5;
        let short = |shots: Vec<Shot>| -> Vec<Shot> { shots.iter().map(|shot| cut(shot, 80)).collect() };
        let sent = short(groups(&[5], |number| u64::from(number) * MS, |_| false, identified));
        let received = short(groups(&[1], |number| u64::from(number / 5 * 5 + 20) * MS, is_lost, identified));
        let matched = read(&sent, &received);
        assert_eq!((summary(&matched), matched.sender.super_packets), ((3, vec![20; 9]), 9));
        // The receiver joins packets. Packets after the first count neither as lost nor as delivered.
        let sent = short(groups(&[1], |number| u64::from(number) * MS, |_| false, identified));
        let received = short(groups(&[5], |number| u64::from(number + 20) * MS, |_| false, identified));
        let matched = read(&sent, &received);
        assert_eq!((summary(&matched), matched.receiver.super_packets, matched.left_out), ((0, vec![20; 12]), 12, [0, 0]));
    }
}

/// Large lost packets ending in zeros, foreign packets with the same ends, and small packets of zeros: no datagram is split.
#[test]
fn padding_makes_no_super_packets() {
    let padded = |number: u32, length: usize| [&payload(number, 16)[..], &vec![0; length - 16]].concat();
    let sent: Vec<Shot> =
        (0..60).map(|number| packet(u64::from(number) * MS, id(number), &padded(number, if number % 3 == 0 { 64 } else { 1_024 }))).collect();
    let received = sent.iter().enumerate().filter(|(place, _)| place % 4 != 1).map(|(_, shot)| Shot { nanos: shot.nanos + 20 * MS, ..shot.clone() });
    let foreign = (0..20).map(|number| packet((u64::from(number) + 21) * MS, 0, &padded(1_000 + number, 1_024)));
    let matched = read(&sent, &received.chain(foreign).chain([packet(50 * MS, 0, &[0; 64])]).collect::<Vec<_>>());
    assert_eq!((matched.sender.super_packets, matched.unmatched_sent, matched.unmatched_arrived), (0, 15, 21));
}

#[test]
fn fragments_are_named_beside_the_datagrams_that_are_read() {
    let mut fragment = ipv4(9, 17, &udp(5000, &[1; 64]));
    fragment[6] = 0x20;
    let matched = read(&[sent(0), sent(1)], &[arrived(0), shot(20 * MS, ethernet(0x0800, &fragment)), arrived(1)]);
    assert_eq!(matched.receiver.to_string(), "3 frames: UDP 2, fragments of IPv4 1");
    assert_eq!(matched.receiver.frames, 3);
}
