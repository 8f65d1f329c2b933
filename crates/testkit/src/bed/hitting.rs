//! Laws of a test bed, which hit packets.

use super::Testbed;
use crate::hit::{Hits, PacketLaw, SentPacket, Verdict};

impl Testbed {
    /// Asks a function for the fate of every packet offered to the link from a host to another host: see [`hit`](crate::hit). Every run begins with a clone of
    /// the function.
    ///
    /// ```
    /// use cohaptic_testkit::{Testbed, hit::Verdict, tcp::Flags};
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
    /// If there is no such host, or both hosts are the same.
    #[track_caller]
    pub fn on_packet(mut self, from: &str, to: &str, judge: impl FnMut(&SentPacket<'_>) -> Verdict + Clone + Send + 'static) -> Self {
        self.setup.add_function([from, to], judge);
        self
    }

    /// Asks a law for the fate of every packet offered to the link from a host to another host: see [`PacketLaw`].
    ///
    /// # Panics
    ///
    /// If there is no such host, or both hosts are the same.
    #[track_caller]
    pub fn law(mut self, from: &str, to: &str, law: impl PacketLaw + Clone + Send + 'static) -> Self {
        self.setup.add_law([from, to], law);
        self
    }

    /// Hits packets from a host to another host, as words such as `drop first SYN; delay 30ms packets 3 8` say: see [`hit`](crate::hit).
    ///
    /// # Panics
    ///
    /// If there is no such host, both hosts are the same, or the words make no sense. The message names the place.
    #[track_caller]
    pub fn hit(mut self, from: &str, to: &str, words: &str) -> Self {
        self.setup.add_words([from, to], words);
        self
    }

    /// Hits packets as a value says. A strategy has drawn the value, or a printed test contains it.
    ///
    /// # Panics
    ///
    /// If `hits` names a host that the test bed does not have.
    #[track_caller]
    pub fn hits(mut self, hits: &Hits) -> Self {
        self.setup.add_hits(&hits.all);
        self
    }
}
