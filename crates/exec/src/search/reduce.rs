//! Reduction of a set of lost packets, in the manner of delta debugging (Zeller and Hildebrandt, 2002).

use std::collections::BTreeSet;

use crate::lost::{LostPacket, LostPackets};

/// Largest number of tried sets, so that a reduction ends within minutes.
const MOST_TRIED: usize = 200;
/// Number of low numbers, from 0, tried in the place of a packet's number.
const LOW_NUMBERS: u64 = 16;

/// Returns the smallest found set with a failing program: `start`, or a set with fewer packets or lower numbers.
///
/// # Errors
///
/// The first error of `fails`.
pub(super) fn reduce<E>(start: LostPackets, mut fails: impl FnMut(&LostPackets) -> Result<bool, E>) -> Result<LostPackets, E> {
    // A set is not tried twice: each trial takes the time of a run.
    let mut tried = BTreeSet::from([start.clone()]);
    let mut best = start;
    loop {
        let mut smaller = None;
        for candidate in candidates(&best) {
            if tried.len() > MOST_TRIED {
                break;
            }
            if tried.insert(candidate.clone()) && fails(&candidate)? {
                smaller = Some(candidate);
                break;
            }
        }
        // An accepted set has fewer packets, or as many with a lower sum of numbers, so the loop ends.
        let Some(smaller) = smaller else { return Ok(best) };
        best = smaller;
    }
}

/// Returns the sets to be tried in place of a set, the simplest first.
fn candidates(of: &LostPackets) -> impl Iterator<Item = LostPackets> + '_ {
    let all: Vec<LostPacket> = of.iter().collect();
    std::iter::once(LostPackets::default())
        .chain(single(of))
        .chain(without_parts(all.clone()))
        .chain(all.clone().into_iter().map(move |gone| renumbered(of, gone)))
        .chain(all.into_iter().flat_map(move |packet| lowered(of, packet)))
}

/// Returns the sets of one packet with a low number, on the links of the set. Most failures need one packet, and few trials find that packet. A set of one
/// packet has no such candidates: lower numbers are tried for every set.
fn single(of: &LostPackets) -> impl Iterator<Item = LostPackets> + '_ {
    let links = of.by_link();
    let numbers = 0..if of.len() > 1 { LOW_NUMBERS } else { 0 };
    numbers.flat_map(move |number| {
        let packets: Vec<LostPacket> = links.iter().map(|((from, to), _)| LostPacket { from: *from, to: *to, number }).collect();
        packets.into_iter().map(|packet| [packet].into_iter().collect())
    })
}

/// Returns the sets without each half, without each quarter and so on, down to the sets without one packet.
fn without_parts(all: Vec<LostPacket>) -> impl Iterator<Item = LostPackets> {
    let count = all.len();
    let sizes = std::iter::successors(Some(count.div_ceil(2)).filter(|half| *half > 0), |size| Some(size.div_ceil(2)).filter(|next| next < size));
    sizes.flat_map(move |size| {
        let all = all.clone();
        (0..count).step_by(size).map(move |begin| {
            let is_kept = |place: usize| place < begin || place >= begin + size;
            all.iter().enumerate().filter(|(place, _)| is_kept(*place)).map(|(_, packet)| *packet).collect()
        })
    })
}

/// Returns the set without a packet, with the next number below for later packets of its link: a delivered packet is not sent again, so that all
/// later packets have lower numbers.
fn renumbered(of: &LostPackets, gone: LostPacket) -> LostPackets {
    let lower =
        |packet: LostPacket| if packet.is_beside(&gone) && packet > gone { LostPacket { number: packet.number - 1, ..packet } } else { packet };
    of.iter().filter(|packet| *packet != gone).map(lower).collect()
}

/// Returns the sets with lower numbers for a packet, from 0: little has happened before a packet with a low number, so that the packet exists in
/// most trials.
fn lowered(of: &LostPackets, packet: LostPacket) -> impl Iterator<Item = LostPackets> + '_ {
    let lower = (0..packet.number.min(LOW_NUMBERS)).map(move |number| LostPacket { number, ..packet });
    lower.filter(|lower| !of.contains(lower)).map(move |lower| of.iter().filter(|other| *other != packet).chain([lower]).collect())
}
