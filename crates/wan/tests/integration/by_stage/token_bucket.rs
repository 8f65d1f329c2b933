//! Token bucket, against a model that adds tokens span by span and serves the queue from its head.

use cohaptic_tests_common::properties;
use cohaptic_wan::{DropCause, LinkConfig, QueueLimit, TokenBucket};
use proptest::prelude::*;

use super::{Act, Packet, Said, Script, delivered, dropped, said, script, sorted};
use crate::any_link::token_bucket;
use crate::random_links::cases;

/// One byte in units of 10⁻⁹ bit.
const BYTE: u128 = 8_000_000_000;

/// Buckets of the mean rate and of the peak rate, each as rate [bit/s], size and present tokens \[10⁻⁹ bit\].
#[derive(Clone)]
struct Buckets {
    all: Vec<(u128, u128, u128)>,
    now: u64,
}

impl Buckets {
    fn words(config: &TokenBucket) -> Vec<(u128, u128)> {
        let words = |rate: cohaptic_units::Rate, burst: cohaptic_units::Bytes| (u128::from(rate.as_bits_per_sec()), u128::from(burst.get()) * BYTE);
        [Some(words(config.rate, config.burst)), config.peak.map(|peak| words(peak.rate, peak.burst))].into_iter().flatten().collect()
    }

    fn pass(&mut self, until: u64) {
        for (rate, size, tokens) in &mut self.all {
            *tokens = (*tokens + *rate * u128::from(until - self.now)).min(*size);
        }
        self.now = until;
    }

    /// Returns the instant \[ns\] at which every bucket holds `needed` tokens.
    fn ready(&self, needed: u128) -> u64 {
        let wait = self.all.iter().map(|(rate, _, tokens)| needed.saturating_sub(*tokens).div_ceil(*rate)).max().unwrap();
        self.now + u64::try_from(wait).unwrap()
    }

    fn take(&mut self, needed: u128) -> bool {
        let there = self.all.iter().all(|(_, _, tokens)| *tokens >= needed);
        if there {
            self.all.iter_mut().for_each(|(_, _, tokens)| *tokens -= needed);
        }
        there
    }
}

fn model(script: &Script<TokenBucket>) -> Vec<Said> {
    let Act::Change(mut config) = script[0].1 else { unreachable!("a script begins with a configuration") };
    let needed = |config: &TokenBucket, packet: &Packet| u128::from(config.framing.on_the_line(cohaptic_units::Bytes::new(packet.size)).get()) * BYTE;
    let mut buckets = Buckets { all: Buckets::words(&config).into_iter().map(|(rate, size)| (rate, size, size)).collect(), now: 0 };
    let mut queue: Vec<Packet> = Vec::new();
    let mut said = Vec::new();
    let pass = |buckets: &mut Buckets, queue: &mut Vec<Packet>, config: &TokenBucket, until: Option<u64>, said: &mut Vec<Said>| {
        while let Some(head) = queue.first().copied() {
            let needed = needed(config, &head);
            let ready = buckets.ready(needed);
            if until.is_some_and(|until| ready > until) {
                break;
            }
            queue.remove(0);
            buckets.pass(ready);
            assert!(buckets.take(needed), "ready is when they hold it");
            said.push(delivered(head, ready, false));
        }
        if let Some(until) = until {
            buckets.pass(until);
        }
    };
    for (now, act) in &script[1..] {
        pass(&mut buckets, &mut queue, &config, Some(*now), &mut said);
        match act {
            Act::Offer(packet) => {
                let bits = needed(&config, packet);
                let too_large = buckets.all.iter().any(|(_, size, _)| bits > *size);
                let full = match config.limit {
                    _ if too_large => false,
                    None => false,
                    Some(QueueLimit::Packets(limit)) => queue.len() as u64 + 1 > limit,
                    Some(QueueLimit::Bytes(limit)) => queue.iter().map(|packet| packet.size).sum::<u64>() + packet.size > limit.get(),
                    Some(QueueLimit::Time(limit)) => {
                        // What would happen if it were taken and nothing else came.
                        let (mut buckets, mut queue, mut future) = (buckets.clone(), [&queue[..], &[*packet]].concat(), Vec::new());
                        pass(&mut buckets, &mut queue, &config, None, &mut future);
                        (future.last().unwrap().2 - crate::random_links::at(*now)) > limit
                    }
                };
                if too_large {
                    said.push(dropped(*packet, *now, DropCause::Mtu, false));
                } else if queue.is_empty() && buckets.take(bits) {
                    said.push(delivered(*packet, *now, false));
                } else if full {
                    said.push(dropped(*packet, *now, DropCause::QueueFull, false));
                } else {
                    queue.push(*packet);
                }
            }
            Act::Change(new) => {
                // Tokens stay as far as they fit; a bucket that was not there is full.
                let words = Buckets::words(new);
                let old = buckets.all.clone();
                buckets.all = words
                    .into_iter()
                    .enumerate()
                    .map(|(place, (rate, size))| (rate, size, old.get(place).map_or(size, |old| old.2.min(size))))
                    .collect();
                config = *new;
                // What no bucket will ever hold is dropped now.
                let least = buckets.all.iter().map(|(_, size, _)| *size).min().unwrap();
                queue.retain(|packet| {
                    let stays = needed(&config, packet) <= least;
                    if !stays {
                        said.push(dropped(*packet, *now, DropCause::Mtu, false));
                    }
                    stays
                });
            }
        }
    }
    pass(&mut buckets, &mut queue, &config, None, &mut said);
    sorted(said)
}

properties! {
    #![proptest_config(cases(1_000))]

    #[test]
    fn a_token_bucket_with_peak_framing_and_limits(script in script(token_bucket())) {
        prop_assert_eq!(said(&script, |bucket| LinkConfig { token_bucket: Some(bucket), ..LinkConfig::default() }), model(&script));
    }

    /// No span t of departures carries more than B + R·t, for both buckets. No packet waits in vain: a nanosecond earlier, a packet that waited would exceed one of
    /// the two bounds, or would leave before the packet ahead of it.
    #[test]
    fn departures_conform_and_could_not_be_earlier(mut bucket in token_bucket(), script in script(Just(()).boxed())) {
        bucket.limit = None;
        let link = |()| LinkConfig { token_bucket: Some(bucket), ..LinkConfig::default() };
        let words = Buckets::words(&bucket);
        let sizes: Vec<(u64, u128)> = script.iter().filter_map(|(now, act)| match act {
            Act::Offer(packet) => Some((*now, u128::from(bucket.framing.on_the_line(cohaptic_units::Bytes::new(packet.size)).get()) * BYTE)),
            Act::Change(()) => None,
        }).collect();
        let departures: Vec<(u64, u64, u128)> = said(&script, link).into_iter()
            .filter(|(_, _, _, fate, _)| matches!(fate, cohaptic_wan::Fate::Delivered(_)))
            .map(|(number, _, left, _, _)| {
                let (came, size) = sizes[usize::try_from(number).unwrap()];
                (came, left.as_nanos(), size)
            })
            .collect();
        let conforms = |upto: usize, at: u64| words.iter().all(|(rate, size)| {
            let mut bits = 0;
            departures[..=upto].iter().enumerate().rev().all(|(place, (_, left, needed))| {
                bits += needed;
                let since = if place == upto { at } else { *left };
                bits <= size + rate * u128::from(at - since)
            })
        });
        for (place, (came, left, _)) in departures.iter().enumerate() {
            prop_assert!(conforms(place, *left), "departure {} at {} ns", place, left);
            let before = if place == 0 { 0 } else { departures[place - 1].1 };
            prop_assert!(left == came || *left == before || !conforms(place, left - 1), "departure {} at {} ns could be earlier", place, left);
        }
    }
}
