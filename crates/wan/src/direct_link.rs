//! A link that decides at once what becomes of a packet, for drivers that keep what is on the way themselves.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::pipeline::{Outcome, Pipeline};
use crate::{DropCause, LinkModel, LinkName};

/// A link in which nothing waits: a constant delay, or outages, loss, delay with jitter and order. A function from a packet to its arrival, with the memory
/// that bursts and correlated delays need.
///
/// It is what [`crate::Network`] compiles such a link to, with the same random numbers at the same addresses, without the queue of what is on the way: a
/// driver that looks at arrivals on a lattice of its own has better ones. Nothing is counted here.
#[derive(Clone, Debug)]
pub struct DirectLink {
    pipeline: Pipeline<()>,
    offered: u64,
}

impl DirectLink {
    /// The link of that model; `None` if it needs an engine: a queue, copies, damage, a trace and whatever else keeps packets.
    #[must_use]
    pub fn new(seed: u64, name: &LinkName, model: &LinkModel) -> Option<Self> {
        model.is_direct().then(|| Self { pipeline: Pipeline::new(seed, name, model.clone(), false), offered: 0 })
    }

    /// The delay of every packet, if the link does nothing but delay.
    #[must_use]
    pub fn constant_delay(&self) -> Option<Duration> {
        match &self.pipeline {
            Pipeline::Constant(nanos, _) => Some(Duration::from_nanos(*nanos)),
            Pipeline::Direct(_) | Pipeline::Engine(_) => None,
        }
    }

    /// The first random words of the next packet, which [`DirectLink::offer`] wants. Asking for those of several links before any other work lets a
    /// processor compute several at once.
    #[must_use]
    #[inline]
    pub fn words(&self) -> [u64; 2] {
        self.pipeline.words(self.offered)
    }

    /// Takes the next packet and says when it arrives, and whether it overtakes: arrives earlier than a packet sent before it.
    ///
    /// Instants must not go back, as everywhere; a link with bursts or outages would not notice.
    ///
    /// # Errors
    ///
    /// Why it never arrives.
    #[inline(always)]
    pub fn offer(&mut self, now: Instant, words: [u64; 2]) -> Result<Arrival, DropCause> {
        let number = self.offered;
        self.offered += 1;
        let latest = self.latest();
        match self.pipeline.offer(now, number, words) {
            Outcome::Arrives(at) => Ok(Arrival { at, overtakes: at < latest }),
            Outcome::Dropped(cause) => Err(cause),
            Outcome::Enters => unreachable!("a link with an engine is no direct link"),
        }
    }

    /// The latest arrival so far.
    #[inline]
    fn latest(&self) -> Instant {
        match &self.pipeline {
            Pipeline::Constant(_, order) => order.latest(),
            Pipeline::Direct(direct) => direct.order.latest(),
            Pipeline::Engine(_) => Instant::ZERO,
        }
    }
}

/// When a packet arrives.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Arrival {
    /// The instant.
    pub at: Instant,
    /// Whether a packet that was sent before it arrives later.
    pub overtakes: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::netem::Netem;
    use crate::{Fate, Link, PacketInfo};
    use cohaptic_units::Bytes;

    fn model(words: &str) -> LinkModel {
        Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap().into()
    }

    #[test]
    fn it_decides_what_a_whole_link_decides() {
        for words in ["delay 5ms", "delay 24ms 9ms loss 10%", "delay 24ms 9ms 50% distribution pareto", "loss gemodel 5% 20%", "delay 3ms 2ms distribution normal"] {
            let name = LinkName::between("a", "b");
            let mut direct = DirectLink::new(7, &name, &model(words)).unwrap();
            let mut link = Link::new(7, &name, model(words));
            let mut latest = Instant::ZERO;
            for number in 0..2_000_u64 {
                let now = Instant::from_nanos(number * 8_000_000);
                let decided = direct.offer(now, direct.words());
                link.handle_packet(now, PacketInfo::from(Bytes::new(64)), number).unwrap();
                let mut found = None;
                // Far beyond any delay of these links; what was offered earlier has been polled already.
                let mut copy = link.clone();
                copy.handle_timeout(now + Duration::from_secs(60)).unwrap();
                while let Some(event) = copy.poll_event() {
                    if event.payload == number {
                        found = Some(event.fate);
                    }
                }
                link.handle_timeout(now).unwrap();
                while link.poll_event().is_some() {}
                match (decided, found.unwrap()) {
                    (Ok(arrival), Fate::Delivered(at)) => {
                        assert_eq!(arrival, Arrival { at, overtakes: at < latest }, "{words}: {number}");
                        latest = latest.max(at);
                    }
                    (Err(cause), Fate::Dropped(dropped)) => assert_eq!(cause, dropped, "{words}: {number}"),
                    (decided, fate) => panic!("{words}: {number}: {decided:?}, {fate:?}"),
                }
            }
        }
    }

    #[test]
    fn what_needs_an_engine_is_none() {
        let name = LinkName::between("a", "b");
        for words in ["rate 1mbit", "duplicate 1%", "delay 10ms limit 5", "corrupt 1%"] {
            assert!(DirectLink::new(1, &name, &model(words)).is_none(), "{words}");
        }
        assert_eq!(DirectLink::new(1, &name, &model("delay 5ms")).unwrap().constant_delay(), Some(Duration::from_millis(5)));
        assert_eq!(DirectLink::new(1, &name, &model("delay 5ms loss 1%")).unwrap().constant_delay(), None);
    }
}
