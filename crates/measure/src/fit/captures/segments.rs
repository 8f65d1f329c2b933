//! Divides datagrams with several packets.
//!
//! A sender may pass many packets of equal length to the network card as one datagram (UDP segmentation offload, `UDP_SEGMENT` of Linux), and a receiver
//! may join consecutive packets (`UDP_GRO`). Captures show the long datagram, with the sum of the lengths. So an end may show a datagram and the other end
//! its packets, or both ends may show different groups of packets. All packets of a datagram except the last have the same length.

use std::collections::{BTreeMap, BTreeSet};

use super::contents::{Capture, Datagram, hash};
use super::matching::Pairs;

/// Shortest packets of a long datagram \[byte\]. Shorter pieces are often equal by chance.
const SHORTEST: usize = 16;
/// Number of lengths tried, the most frequent first.
const MOST_LENGTHS: usize = 16;

/// Length of the packets in long datagrams, indexed by the destination port.
type Lengths = BTreeMap<u16, usize>;

/// Replaces long datagrams of both captures by their packets, if the other capture shows such packets. Returns whether any datagram was replaced.
pub(super) fn split(sent: &mut Capture, arrived: &mut Capture, pairs: &Pairs) -> bool {
    let whole = |capture: &Capture, is_free: &dyn Fn(usize) -> bool| -> Vec<Datagram> {
        let datagrams = capture.datagrams.iter().enumerate().filter(|(number, datagram)| is_free(*number) && datagram.captured() == datagram.length);
        datagrams.map(|(_, datagram)| datagram.clone()).collect()
    };
    let free_sent = whole(sent, &|number| pairs.arrival_of[number].is_none());
    let free_arrived = whole(arrived, &|number| !pairs.taken[number]);
    let [of_sent, of_arrived] = lengths([(sent, &free_sent), (arrived, &free_arrived)]);
    if of_sent.is_empty() && of_arrived.is_empty() {
        return false;
    }
    // A matched pair is split at both ends or at neither.
    let mut octets = [vec![None; sent.datagrams.len()], vec![None; arrived.datagrams.len()]];
    for (number, datagram) in sent.datagrams.iter().enumerate() {
        octets[0][number] = of_sent.get(&datagram.destination_port).copied();
    }
    for (number, datagram) in arrived.datagrams.iter().enumerate() {
        octets[1][number] = of_arrived.get(&datagram.destination_port).copied();
    }
    for (number, arrival) in pairs.arrival_of.iter().enumerate().filter_map(|(number, arrival)| Some((number, (*arrival)?))) {
        let common = octets[0][number].or(octets[1][arrival]);
        (octets[0][number], octets[1][arrival]) = (common, common);
    }
    let [octets_sent, octets_arrived] = octets;
    // Both captures are split before the results are combined: `||` would skip the second.
    let are_split = [replace(sent, &octets_sent), replace(arrived, &octets_arrived)];
    are_split.contains(&true)
}

/// Replaces datagrams longer than the given number of octets by packets of this length.
fn replace(capture: &mut Capture, octets: &[Option<usize>]) -> bool {
    let mut pieces = Vec::with_capacity(capture.datagrams.len());
    let mut super_packets = 0;
    for (datagram, octets) in capture.datagrams.iter().zip(octets) {
        match octets.filter(|octets| datagram.length > *octets && datagram.captured() == datagram.length) {
            Some(octets) => {
                super_packets += 1;
                pieces.extend(capture.pieces(datagram, octets));
            }
            None => pieces.push(datagram.clone()),
        }
    }
    capture.datagrams = pieces;
    capture.contents.super_packets = super_packets;
    super_packets > 0
}

/// Finds the lengths of packets in the long datagrams of both ends, by destination port, from datagrams without a counterpart.
fn lengths(ends: [(&Capture, &[Datagram]); 2]) -> [Lengths; 2] {
    let mut times: BTreeMap<usize, usize> = BTreeMap::new();
    for datagram in ends.iter().flat_map(|end| end.1).filter(|datagram| datagram.length >= SHORTEST) {
        *times.entry(datagram.length).or_default() += 1;
    }
    let mut tried: Vec<(usize, usize)> = times.into_iter().collect();
    tried.sort_by_key(|&(length, times)| std::cmp::Reverse((times, length)));
    // By destination port: number of octets with a counterpart, the length of this result, and whether datagrams clearly consist of such packets.
    let mut best: [BTreeMap<u16, (usize, usize, bool)>; 2] = Default::default();
    let is_shorter = |octets: &usize| ends.iter().flat_map(|end| end.1).any(|datagram| datagram.length > *octets);
    for octets in tried.iter().take(MOST_LENGTHS).map(|tried| tried.0).filter(is_shorter) {
        let known = ends.map(|(capture, datagrams)| hashes(capture, datagrams, octets));
        for end in 0..2 {
            for (port, (matched, is_clear)) in matched(ends[end], octets, &known[1 - end]) {
                let found = best[end].entry(port).or_default();
                // Of two lengths that explain the same octets, the larger one leaves packets whole.
                *found = (*found).max((matched, octets, is_clear));
            }
        }
    }
    best.map(|best| best.into_iter().filter(|(_, best)| best.2).map(|(port, best)| (port, best.1)).collect())
}

/// Returns the sorted hashes of all pieces of the given length.
fn hashes(capture: &Capture, datagrams: &[Datagram], octets: usize) -> Vec<u64> {
    let mut hashes: Vec<u64> = datagrams.iter().flat_map(|datagram| capture.payload(datagram).chunks(octets).map(hash)).collect();
    hashes.sort_unstable();
    hashes
}

/// Returns, by destination port, the number of octets in pieces known to the other end, and whether a datagram clearly consists of such pieces.
fn matched((capture, datagrams): (&Capture, &[Datagram]), octets: usize, known: &[u64]) -> BTreeMap<u16, (usize, bool)> {
    let mut found: BTreeMap<u16, (usize, bool)> = BTreeMap::new();
    for datagram in datagrams {
        let payload = capture.payload(datagram);
        let is_known = |piece: &[u8]| known.binary_search(&hash(piece)).is_ok();
        // Equal pieces, for example padding, count once.
        let pieces: BTreeSet<&[u8]> = payload.chunks(octets).filter(|piece| is_known(piece)).collect();
        let sum = found.entry(datagram.destination_port).or_default();
        sum.0 += pieces.iter().map(|piece| piece.len()).sum::<usize>();
        // Clear means two different known pieces, one of which is the first, with the parts that distinguish datagrams. Equal parts of two datagrams alone
        // prove nothing.
        sum.1 |= datagram.length > octets && pieces.len() >= 2 && payload.chunks(octets).next().is_some_and(is_known);
    }
    found
}
