//! Datagrams that hold several packets.
//!
//! A sender may hand many packets of one length to the network card as one datagram (UDP segmentation offload, `UDP_SEGMENT` of Linux), and a receiver may
//! join packets that follow each other (`UDP_GRO`). Captures show the long datagram with the sum of the lengths. So one end shows one datagram where the
//! other shows its packets, or both show different groups of packets. All packets of a datagram but the last have one length.

use std::collections::{BTreeMap, BTreeSet};

use super::contents::{Capture, Datagram, hash};
use super::matching::Pairs;

/// Packets of a datagram are not shorter than this \[byte\]; shorter ones are too easily equal by chance.
const SHORTEST: usize = 16;
/// Lengths that are tried, the most frequent ones.
const MOST_LENGTHS: usize = 16;

/// Length of the packets in long datagrams, indexed by the destination port.
type Lengths = BTreeMap<u16, usize>;

/// Replaces datagrams of both captures by the packets that they hold, where the other capture shows packets of them. Gives whether there were any.
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
    // A pair of equal datagrams is split at both ends or at none.
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
    // Each capture is split, whatever is found in the first.
    let are_split = [replace(sent, &octets_sent), replace(arrived, &octets_arrived)];
    are_split.contains(&true)
}

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

/// The lengths of packets in the long datagrams of both ends, from datagrams that have no counterpart.
fn lengths(ends: [(&Capture, &[Datagram]); 2]) -> [Lengths; 2] {
    let mut times: BTreeMap<usize, usize> = BTreeMap::new();
    for datagram in ends.iter().flat_map(|end| end.1).filter(|datagram| datagram.length >= SHORTEST) {
        *times.entry(datagram.length).or_default() += 1;
    }
    let mut tried: Vec<(usize, usize)> = times.into_iter().collect();
    tried.sort_by_key(|&(length, times)| std::cmp::Reverse((times, length)));
    // For each destination port the octets that have a counterpart, the length for which they have, and whether datagrams are clearly made of such packets.
    let mut best: [BTreeMap<u16, (usize, usize, bool)>; 2] = Default::default();
    let is_shorter = |octets: &usize| ends.iter().flat_map(|end| end.1).any(|datagram| datagram.length > *octets);
    for octets in tried.iter().take(MOST_LENGTHS).map(|tried| tried.0).filter(is_shorter) {
        let known = ends.map(|(capture, datagrams)| hashes(capture, datagrams, octets));
        for end in 0..2 {
            for (port, (matched, is_clear)) in matched(ends[end], octets, &known[1 - end]) {
                let found = best[end].entry(port).or_default();
                // Of two lengths that explain the same octets, the greater one leaves packets whole.
                *found = (*found).max((matched, octets, is_clear));
            }
        }
    }
    best.map(|best| best.into_iter().filter(|(_, best)| best.2).map(|(port, best)| (port, best.1)).collect())
}

/// Sorted hashes of all pieces.
fn hashes(capture: &Capture, datagrams: &[Datagram], octets: usize) -> Vec<u64> {
    let mut hashes: Vec<u64> = datagrams.iter().flat_map(|datagram| capture.payload(datagram).chunks(octets).map(hash)).collect();
    hashes.sort_unstable();
    hashes
}

/// Octets of pieces that the other end knows, and whether a datagram is clearly made of such pieces, by destination port.
fn matched((capture, datagrams): (&Capture, &[Datagram]), octets: usize, known: &[u64]) -> BTreeMap<u16, (usize, bool)> {
    let mut found: BTreeMap<u16, (usize, bool)> = BTreeMap::new();
    for datagram in datagrams {
        let payload = capture.payload(datagram);
        let is_known = |piece: &[u8]| known.binary_search(&hash(piece)).is_ok();
        // Equal pieces, as of padding, count once.
        let pieces: BTreeSet<&[u8]> = payload.chunks(octets).filter(|piece| is_known(piece)).collect();
        let sum = found.entry(datagram.destination_port).or_default();
        sum.0 += pieces.iter().map(|piece| piece.len()).sum::<usize>();
        // Two different pieces, and the first one, which holds what tells datagrams apart: equal parts of two datagrams are no packets.
        sum.1 |= datagram.length > octets && pieces.len() >= 2 && payload.chunks(octets).next().is_some_and(is_known);
    }
    found
}
