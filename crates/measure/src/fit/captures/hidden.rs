//! Pairs super-packets cut by the capture, of which only the first packet is visible.

use std::collections::{BTreeMap, VecDeque};

use super::contents::{Capture, hash};
use super::matching::Pairs;

/// Fewest common octets that distinguish packets.
const SHORTEST: usize = 8;

/// Pairs cut long datagrams with their first packet in the other capture, by identification and by the octets in both files. If the receiver's capture has
/// a long datagram, the sender's further packets of this datagram are marked as hidden, because their arrival cannot be seen.
pub(super) fn pair(sent: &mut Capture, arrived: &mut Capture, pairs: &mut Pairs) {
    // Only datagrams without a counterpart take part.
    let free_sent: Vec<usize> = (0..sent.datagrams.len()).filter(|number| pairs.arrival_of[*number].is_none() && !pairs.is_again[*number]).collect();
    let free_arrived: Vec<usize> = (0..arrived.datagrams.len()).filter(|number| !pairs.taken[*number]).collect();
    for (first, number) in first_packets((sent, &free_sent), (arrived, &free_arrived)) {
        if pairs.arrival_of[number].is_none() && !pairs.taken[first] {
            (pairs.arrival_of[number], pairs.taken[first]) = (Some(first), true);
            sent.contents.super_packets += 1;
        }
    }
    for (first, number) in first_packets((arrived, &free_arrived), (sent, &free_sent)) {
        if pairs.arrival_of[first].is_some() || pairs.taken[number] {
            continue;
        }
        (pairs.arrival_of[first], pairs.taken[number]) = (Some(number), true);
        arrived.contents.super_packets += 1;
        // The number of packets follows from the lengths; the next free packets to the same port are taken for the others.
        let packet = &sent.datagrams[first];
        let others = arrived.datagrams[number].length.div_ceil(packet.length.max(1)) - 1;
        let follows = |other: &&usize| **other > first && sent.datagrams[**other].destination_port == packet.destination_port;
        let unseen: Vec<usize> = free_sent
            .iter()
            .filter(follows)
            .filter(|other| pairs.arrival_of[**other].is_none() && !pairs.is_hidden[**other])
            .copied()
            .take(others)
            .collect();
        unseen.into_iter().for_each(|other| pairs.is_hidden[other] = true);
    }
}

/// Finds cut long datagrams with their first packets. Returns pairs (number of the packet in the other capture, number of the long datagram).
fn first_packets((capture, long): (&Capture, &[usize]), (other, packets): (&Capture, &[usize])) -> Vec<(usize, usize)> {
    let is_cut = |number: &&usize| capture.datagrams[**number].captured() < capture.datagrams[**number].length;
    // All comparisons use the octets that every compared datagram has.
    let captured = long.iter().filter(is_cut).map(|number| capture.datagrams[*number].captured());
    let octets =
        captured.chain(packets.iter().map(|number| other.datagrams[*number].captured()).filter(|octets| *octets >= SHORTEST)).min().unwrap_or(0);
    if octets < SHORTEST {
        return Vec::new();
    }
    let mut waiting: BTreeMap<(Option<u16>, u64), VecDeque<usize>> = BTreeMap::new();
    for number in packets {
        let packet = &other.datagrams[*number];
        if let Some(prefix) = other.payload(packet).get(..octets) {
            waiting.entry((packet.own_identification(), hash(prefix))).or_default().push_back(*number);
        }
    }
    // Without an identification, a beginning shared by several long datagrams is ambiguous.
    let mut times: BTreeMap<u64, usize> = BTreeMap::new();
    let beginning = |number: usize| hash(&capture.payload(&capture.datagrams[number])[..octets]);
    long.iter().filter(is_cut).for_each(|number| *times.entry(beginning(*number)).or_default() += 1);
    let mut found = Vec::new();
    for number in long.iter().filter(is_cut) {
        let datagram = &capture.datagrams[*number];
        let Some(queue) = waiting.get_mut(&(datagram.own_identification(), beginning(*number))) else { continue };
        if datagram.own_identification().is_none() && (queue.len() > 1 || times.get(&beginning(*number)).is_some_and(|times| *times > 1)) {
            continue;
        }
        let common = |packet: &usize| {
            let packet = &other.datagrams[*packet];
            let octets = packet.captured().min(datagram.captured());
            packet.length < datagram.length && other.payload(packet)[..octets] == capture.payload(datagram)[..octets]
        };
        if queue.front().is_some_and(common) {
            found.extend(queue.pop_front().map(|packet| (packet, *number)));
        }
    }
    found
}
