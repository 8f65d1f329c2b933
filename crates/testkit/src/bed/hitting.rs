//! Packets that a test bed hits.

use std::panic::Location;

use super::{Names, Testbed};
use crate::hit::{Hits, Laws, PacketLaw, PathHit, SentPacket, Verdict};
use crate::words::hits_on;

impl Testbed {
    /// Asks a function what becomes of every packet that is offered to the link from one host to another: see [`hit`](crate::hit). Every run begins with a clone of it.
    ///
    /// ```
    /// use cohaptic_testkit::{Testbed, hit::{Flags, Verdict}};
    ///
    /// // The second packet with SYN; those of a program that answers have ACK too.
    /// let mut syns = 0;
    /// let bed = Testbed::new(["client", "server"]).on_packet("client", "server", move |packet| {
    ///     syns += u32::from(packet.tcp().is_some_and(|segment| segment.flags.has(Flags::SYN)));
    ///     if syns == 2 { Verdict::Drop } else { Verdict::Pass }
    /// });
    /// ```
    ///
    /// # Panics
    ///
    /// If there is no such host, or both are the same.
    #[track_caller]
    pub fn on_packet(mut self, from: &str, to: &str, judge: impl FnMut(&SentPacket<'_>) -> Verdict + Clone + Send + 'static) -> Self {
        add_function(&mut self.settings.laws, &self.names, [from, to], judge);
        self
    }

    /// Asks a law what becomes of every packet that is offered to the link from one host to another: see [`PacketLaw`].
    ///
    /// # Panics
    ///
    /// If there is no such host, or both are the same.
    #[track_caller]
    pub fn law(mut self, from: &str, to: &str, law: impl PacketLaw + Clone + Send + 'static) -> Self {
        add_law(&mut self.settings.laws, &self.names, [from, to], law);
        self
    }

    /// Hits packets from one host to another, in words such as `drop first SYN; delay 30ms packets 3 8`: see [`hit`](crate::hit).
    ///
    /// # Panics
    ///
    /// If there is no such host, both are the same, or the words make no sense, with the place.
    #[track_caller]
    pub fn hit(mut self, from: &str, to: &str, words: &str) -> Self {
        add_words(&mut self.settings.laws, &self.names, [from, to], words);
        self
    }

    /// Hits packets as a value says that a strategy has drawn, or that was pasted back.
    ///
    /// # Panics
    ///
    /// If it names a host that there is not.
    #[track_caller]
    pub fn hits(mut self, hits: &Hits) -> Self {
        add_all(&mut self.settings.laws, &self.names, &hits.all);
        self
    }
}

/// The name of a law that has none: where it was given.
#[track_caller]
fn place() -> String {
    format!("the law of {}", Location::caller())
}

fn checked(names: &Names, [from, to]: [&str; 2]) -> cohaptic_wan::Path {
    let path = names.path(from, to);
    assert!(path.from != path.to, "host `{from}` has no link to itself");
    path
}

#[track_caller]
pub(crate) fn add_function(laws: &mut Laws, names: &Names, ends: [&str; 2], judge: impl FnMut(&SentPacket<'_>) -> Verdict + Clone + Send + 'static) {
    laws.add_function(checked(names, ends), place(), judge);
}

#[track_caller]
pub(crate) fn add_law(laws: &mut Laws, names: &Names, ends: [&str; 2], law: impl PacketLaw + Clone + Send + 'static) {
    laws.add(checked(names, ends), place(), law);
}

#[track_caller]
#[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
pub(crate) fn add_words(laws: &mut Laws, names: &Names, ends: [&str; 2], words: &str) {
    let path = checked(names, ends);
    let hits = hits_on(words).unwrap_or_else(|error| panic!("these are no words of hits: {error}"));
    hits.into_iter().for_each(|hit| laws.add_hit(path, hit));
}

#[track_caller]
pub(crate) fn add_all(laws: &mut Laws, names: &Names, hits: &[PathHit]) {
    for PathHit { from, to, hit } in hits {
        laws.add_hit(checked(names, [from, to]), hit.clone());
    }
}
