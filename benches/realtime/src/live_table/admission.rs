//! The cost of admission.

use std::error::Error;
use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_benches_realtime::machine;
use cohaptic_live::client::{Joined, Joining};
use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, AdmissionStats, MAX_DATAGRAM, Place, Refusal, Seat, SessionKey, SystemEntropy};
use cohaptic_peer::State;
use cohaptic_peer::wire::{MAX_LEN, Sample};
use cohaptic_units::Instant;

/// The number of datagrams that are decided about in a round.
pub(crate) const COUNT: u32 = 10_000;

/// The rounds of which the median is taken.
pub(crate) const ROUNDS: usize = 21;

const AXES: usize = 3;
const SESSION: u64 = 31;
const SEAT: Place = Place(1);

/// What one kind of datagram costs.
#[derive(Debug)]
pub(crate) struct Cost {
    pub(crate) datagram: &'static str,
    pub(crate) fate: &'static str,
    pub(crate) each: Duration,
}

type Datagram = ([u8; MAX_DATAGRAM], usize);

/// An admission control whose seat is taken, and the peer that has it.
struct Subject {
    door: AdmissionControl,
    joined: Option<Joined>,
    key: Option<SessionKey>,
    /// The number of the next sample.
    next: u64,
}

pub(crate) fn costs() -> Result<Vec<Cost>, Box<dyn Error>> {
    let key = || SessionKey::generate(&mut SystemEntropy);
    let (mut open, mut keyed) = (Subject::new(None)?, Subject::new(Some(key()?))?);
    let (owner, stranger) = (address(7400), address(7401));
    let costs = [
        Cost { datagram: "a sample, without a key", fate: "let in", each: open.take(owner, 0, |stats| stats.admitted)? },
        Cost { datagram: "a sealed sample", fate: "let in", each: keyed.take(owner, 0, |stats| stats.admitted)? },
        Cost { datagram: "the same with one wrong bit, from the address of the seat", fate: "forged", each: keyed.take(owner, 1, forged)? },
        Cost { datagram: "the same, from another address", fate: "forged", each: keyed.take(stranger, 1, forged)? },
        Cost { datagram: "a hello with one wrong bit", fate: "forged", each: keyed.hello(stranger, 1, forged)? },
        Cost { datagram: "a hello", fate: "answered", each: keyed.hello(stranger, 0, |stats| stats.welcomed)? },
        Cost { datagram: "a sample to the seat, without a key", fate: "made ready", each: open.give()? },
        Cost { datagram: "a sample to the seat, with a key", fate: "sealed", each: keyed.give()? },
    ];
    Ok(costs.into())
}

const fn forged(stats: &AdmissionStats) -> u64 {
    stats.refused(Refusal::Forged)
}

impl Subject {
    fn new(key: Option<SessionKey>) -> Result<Self, Box<dyn Error>> {
        let seat = Seat { place: SEAT, name: "program".to_owned(), tick: Duration::from_millis(1) };
        let config = AdmissionConfig::new(SESSION, AXES, 3, Duration::from_millis(8), vec![seat]).with_key(key.clone());
        let mut door = AdmissionControl::new(config, &mut SystemEntropy)?;
        let joined = match &key {
            None => None,
            Some(key) => {
                let joining = Joining::draw(SESSION, SEAT, key, &mut SystemEntropy)?;
                let Admission::Reply { bytes, .. } = door.handle_datagram(Instant::ZERO, address(7400), &joining.hello()) else {
                    return Err("a hello was not answered".into());
                };
                Some(joining.handle_welcome(&bytes)?)
            }
        };
        let mut subject = Self { door, joined, key, next: 0 };
        let (bytes, len) = subject.sample()?;
        let admission = subject.door.handle_datagram(Instant::ZERO, address(7400), &bytes[..len]);
        if matches!(admission, Admission::Sample { joined: true, .. }) { Ok(subject) } else { Err("a sample did not join".into()) }
    }

    /// The next sample of the peer, as it sends it.
    fn sample(&mut self) -> Result<Datagram, Box<dyn Error>> {
        let state = State { position: [0.01, -0.02, 0.03], velocity: [0.1, 0.2, -0.3] };
        let sample = Sample { session: SESSION, sender: SEAT.0, sequence: self.next, sent: Instant::ZERO, state };
        self.next += 1;
        let (mut plain, mut out) = ([0; MAX_LEN], [0; MAX_DATAGRAM]);
        let len = sample.encode(AXES, &mut plain);
        let len = match &self.joined {
            Some(joined) => joined.seal(&plain[..len], &mut out).ok_or("a sample is too long")?,
            None => {
                out[..len].copy_from_slice(&plain[..len]);
                len
            }
        };
        Ok((out, len))
    }

    /// Decides about samples, of which the last bit is flipped if asked. All must be counted under `fate`.
    fn take(&mut self, from: SocketAddr, flip: u8, fate: impl Fn(&AdmissionStats) -> u64) -> Result<Duration, Box<dyn Error>> {
        let mut rounds = Vec::new();
        for _ in 0..ROUNDS {
            let mut datagrams = (0..COUNT).map(|_| self.sample()).collect::<Result<Vec<Datagram>, _>>()?;
            datagrams.iter_mut().for_each(|(bytes, len)| bytes[*len - 1] ^= flip);
            rounds.push(self.decide(from, &datagrams, &fate)?);
        }
        Ok(median(rounds))
    }

    /// Decides about hellos.
    fn hello(&mut self, from: SocketAddr, flip: u8, fate: impl Fn(&AdmissionStats) -> u64) -> Result<Duration, Box<dyn Error>> {
        let key = self.key.clone().ok_or("a hello needs a key")?;
        let hello = Joining::draw(SESSION, SEAT, &key, &mut SystemEntropy)?.hello();
        let mut bytes = [0; MAX_DATAGRAM];
        bytes[..hello.len()].copy_from_slice(&hello);
        bytes[hello.len() - 1] ^= flip;
        let datagrams = vec![(bytes, hello.len()); COUNT as usize];
        let rounds = (0..ROUNDS).map(|_| self.decide(from, &datagrams, &fate)).collect::<Result<Vec<_>, _>>()?;
        Ok(median(rounds))
    }

    fn decide(&mut self, from: SocketAddr, datagrams: &[Datagram], fate: &impl Fn(&AdmissionStats) -> u64) -> Result<Duration, Box<dyn Error>> {
        let counted = fate(self.door.stats());
        let before = machine::thread_time();
        for (bytes, len) in datagrams {
            core::hint::black_box(self.door.handle_datagram(Instant::ZERO, from, &bytes[..*len]));
        }
        let spent = machine::thread_time() - before;
        let counted = fate(self.door.stats()) - counted;
        if counted == datagrams.len() as u64 {
            Ok(spent)
        } else {
            Err(format!("{counted} of {} datagrams met the fate that was meant", datagrams.len()).into())
        }
    }

    /// Makes samples of another peer ready for the seat.
    fn give(&mut self) -> Result<Duration, Box<dyn Error>> {
        let state = State { position: [0.01, -0.02, 0.03], velocity: [0.1, 0.2, -0.3] };
        let (mut plain, mut out) = ([0; MAX_LEN], [0; MAX_DATAGRAM]);
        let len = Sample { session: SESSION, sender: 0, sequence: 1, sent: Instant::ZERO, state }.encode(AXES, &mut plain);
        let mut rounds = Vec::new();
        for _ in 0..ROUNDS {
            let (sent, before) = (self.door.stats().sent, machine::thread_time());
            for _ in 0..COUNT {
                core::hint::black_box(self.door.seal(Instant::ZERO, SEAT, &plain[..len], &mut out));
            }
            rounds.push(machine::thread_time() - before);
            if self.door.stats().sent - sent != u64::from(COUNT) {
                return Err("nobody has the seat".into());
            }
        }
        Ok(median(rounds))
    }
}

/// Of one datagram, in the median round.
fn median(mut rounds: Vec<Duration>) -> Duration {
    rounds.sort_unstable();
    rounds[rounds.len() / 2] / COUNT
}

const fn address(port: u16) -> SocketAddr {
    SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), port)
}

#[cfg(test)]
mod tests {
    /// Of every row it is counted whether all its datagrams met the fate that the row names.
    #[test]
    fn every_row_measures_what_it_says() {
        assert_eq!(super::costs().unwrap().len(), 8);
    }
}
