//! Matches datagrams of the sender's capture with datagrams of the receiver's capture.

use std::collections::{BTreeMap, VecDeque};

use super::contents::{Capture, Datagram, agree, hash};
use super::views;

/// Matched datagrams of both captures.
#[derive(Debug)]
pub(super) struct Pairs {
    /// Number of the receiver's datagram, indexed by the sender's datagram; `None` without a counterpart.
    pub(super) arrival_of: Vec<Option<usize>>,
    /// `true` if a datagram of the sender shows a packet already shown by another. Such a datagram does not count as a packet.
    pub(super) is_again: Vec<bool>,
    /// `true` if a datagram of the sender may have arrived inside a long datagram of which the receiver's capture shows only the first packet.
    pub(super) is_hidden: Vec<bool>,
    /// `true` if a datagram of the receiver has a counterpart.
    pub(super) taken: Vec<bool>,
    /// `true` if a datagram of the receiver shows a packet again and must not be matched.
    is_copy: Vec<bool>,
    /// `true` if a datagram of the sender equals another in everything compared.
    pub(super) is_ambiguous: Vec<bool>,
}

/// Largest number of datagrams of equal content compared per arrival, for captures with different parts of the payloads.
const MOST_COMPARED: usize = 64;

impl Pairs {
    /// Matches datagrams in four rounds, from strict to loose: whole payload and identification, beginning and identification, whole payload, beginning.
    pub(super) fn of(sent: &Capture, arrived: &Capture) -> Self {
        let (sent_count, arrived_count) = (sent.datagrams.len(), arrived.datagrams.len());
        let mut pairs = Self {
            arrival_of: vec![None; sent_count],
            is_again: vec![false; sent_count],
            is_hidden: vec![false; sent_count],
            taken: vec![false; arrived_count],
            is_copy: vec![false; arrived_count],
            is_ambiguous: vec![false; sent_count],
        };
        pairs.pair(sent, arrived, true, |_, datagram| Some((datagram.length, datagram.captured(), datagram.hash, datagram.identification)));
        let prefixes = pairs.prefixes(sent, arrived);
        let prefix = |capture: &Capture, datagram: &Datagram| {
            let octets = *prefixes.get(&datagram.length)?;
            Some((datagram.length, hash(&capture.payload(datagram)[..octets.min(datagram.captured())])))
        };
        pairs.pair(sent, arrived, true, |capture, datagram| Some((prefix(capture, datagram)?, datagram.identification)));
        // Marked before the loose rounds, because a second view of a packet could take the place of a lost packet of the same content.
        let is_again = views::again(sent, |number| pairs.arrival_of[number].is_some());
        let is_copy = views::again(arrived, |number| pairs.taken[number]);
        (pairs.is_again, pairs.is_copy) = (is_again, is_copy);
        // Some paths rewrite identifications, so the last rounds ignore them.
        pairs.pair(sent, arrived, false, |_, datagram| Some((datagram.length, datagram.captured(), datagram.hash)));
        pairs.pair(sent, arrived, false, prefix);
        pairs
    }

    /// Matches free datagrams with equal keys, in the order of occurrence. With `tells`, sender's datagrams with equal keys are marked as ambiguous.
    fn pair<K: Ord>(&mut self, sent: &Capture, arrived: &Capture, tells: bool, key: impl Fn(&Capture, &Datagram) -> Option<K>) {
        let mut waiting: BTreeMap<K, VecDeque<usize>> = BTreeMap::new();
        for (number, datagram) in sent.datagrams.iter().enumerate().filter(|(number, _)| self.arrival_of[*number].is_none()) {
            if let Some(key) = key(sent, datagram).filter(|_| !self.is_again[number]) {
                waiting.entry(key).or_default().push_back(number);
            }
        }
        if tells {
            waiting.values().filter(|numbers| numbers.len() > 1).flatten().for_each(|number| self.is_ambiguous[*number] = true);
        }
        for (number, datagram) in arrived.datagrams.iter().enumerate() {
            if !self.taken[number]
                && !self.is_copy[number]
                && let Some(numbers) = key(arrived, datagram).and_then(|key| waiting.get_mut(&key))
                && let Some(place) = numbers.iter().take(MOST_COMPARED).position(|first| agree(sent, *first, arrived, number))
                && let Some(first) = numbers.remove(place)
            {
                self.arrival_of[first] = Some(number);
                self.taken[number] = true;
            }
        }
    }

    /// Returns, by length of the payload, the number of octets captured of every free datagram in both captures. Lengths with all datagrams captured whole
    /// are left out.
    fn prefixes(&self, sent: &Capture, arrived: &Capture) -> BTreeMap<usize, usize> {
        let mut octets: BTreeMap<usize, usize> = BTreeMap::new();
        let of_sent = sent.datagrams.iter().enumerate().filter(|(number, _)| self.arrival_of[*number].is_none());
        let of_arrived = arrived.datagrams.iter().enumerate().filter(|(number, _)| !self.taken[*number]);
        for (_, datagram) in of_sent.chain(of_arrived) {
            let least = octets.entry(datagram.length).or_insert(usize::MAX);
            *least = (*least).min(datagram.captured());
        }
        octets.retain(|length, octets| *octets < *length);
        octets
    }
}
