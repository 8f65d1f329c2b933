//! Many links in which packets wait, each driven from one offer to the next, for drivers that keep the packets on the way themselves.

use alloc::vec::Vec;

use cohaptic_units::Instant;

use super::id::LinkId;
use crate::fates::fate::Fate;
use crate::fates::stats::LinkStats;
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::Outcome;
use crate::line::{Line, Sink};
use crate::packet::{Marks, Outputs, PacketInfo};

/// Links of any kind, for a driver that knows when it will offer the next packet to each.
///
/// What a queue does with a packet may depend on those that come later, but never before they come. So a link that is told when its next packet comes decides at
/// once all that happens until then: no queue of events wakes it. It does what [`crate::Network`] does with such links, with the same random numbers at the
/// same addresses and the same counters. Packets of type `T` come out in no order of time, each with the word whether one that came out before it arrives later
/// or at the same instant.
///
/// Links are numbered from 0 as they are added.
#[derive(Clone, Debug)]
pub struct SteppedLinks<T> {
    until: Instant,
    lines: Vec<Stepped<T>>,
    outputs: Outputs<Sent<T>>,
    arrivals: Vec<(Instant, Sent<T>)>,
}

/// A link, and the latest arrival over it so far.
#[derive(Clone, Debug)]
struct Stepped<T> {
    line: Line<(), Sent<T>>,
    latest: Instant,
}

/// A packet and when it was offered.
#[derive(Clone, Debug)]
struct Sent<T> {
    at: Instant,
    item: T,
}

impl SteppedLinks<()> {
    /// Whether such a link can be added: one that damages packets, or counts those inside until they arrive, cannot.
    #[must_use]
    pub fn takes(model: &LinkModel) -> bool {
        let takes = |config: &crate::LinkConfig| config.corruption.is_none() && config.limit.is_none();
        match model {
            LinkModel::Fixed(config) => takes(config),
            LinkModel::Modulated(modulated) => modulated.configs().iter().all(takes),
            LinkModel::Replay(_) | LinkModel::Kernel(_) => false,
        }
    }
}

impl<T: Clone> SteppedLinks<T> {
    /// No links; packets that arrive by `until` will count as delivered.
    #[must_use]
    pub const fn new(until: Instant) -> Self {
        Self { until, lines: Vec::new(), outputs: Vec::new(), arrivals: Vec::new() }
    }

    /// Adds a link that can be [taken](SteppedLinks::takes).
    pub fn add(&mut self, seed: u64, name: &LinkName, model: LinkModel) {
        self.lines.push(Stepped { line: Line::new(seed, name, model, false), latest: Instant::ZERO });
    }

    /// The number of the next packet of a link.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[must_use]
    pub fn offered(&self, link: LinkId) -> u64 {
        self.lines[link.index()].line.offered()
    }

    /// Offers a packet to a link, and says until when nothing else is offered to it. `arrives` is told of each packet that leaves the link's stages until then,
    /// when it arrives, and whether it does not arrive after all that left them before. Instants must not go back.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[inline]
    pub fn offer(&mut self, (now, next): (Instant, Instant), link: LinkId, info: PacketInfo, item: T, mut arrives: impl FnMut(Instant, bool, T)) {
        let Self { until, lines, outputs, arrivals } = self;
        let Stepped { line, latest } = &mut lines[link.index()];
        let fate = match line.offer(now, None) {
            Outcome::Arrives(at) => Some(Ok(at)),
            Outcome::Dropped(cause) => Some(Err(cause)),
            // Most packets find an idle line. To lead them through its stages took more than half of their time.
            Outcome::Enters => line.enter_at_once(now, info, next.min(*until)),
        };
        match fate {
            Some(Ok(at)) => {
                line.deliver_by(*until, now, at);
                arrives(at, at <= *latest, item);
                *latest = at.max(*latest);
            }
            Some(Err(cause)) => line.drop(cause),
            None => {
                line.enter(now, info, Marks::default(), Sent { at: now, item }, outputs, &mut Arriving(arrivals));
                self.pass(next, link, arrives);
            }
        }
    }

    /// Lets time pass on a link until `next`, before which nothing is offered to it.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    pub fn pass(&mut self, next: Instant, link: LinkId, mut arrives: impl FnMut(Instant, bool, T)) {
        let Self { until, lines, outputs, arrivals } = self;
        let Stepped { line, latest } = &mut lines[link.index()];
        // What happens after the end is not counted.
        let next = next.min(*until);
        if line.next_wake().is_some_and(|wake| wake <= next) {
            line.wake(next, outputs, &mut Arriving(arrivals));
        }
        for (at, Sent { at: sent, item }) in arrivals.drain(..) {
            line.deliver_by(*until, sent, at);
            arrives(at, at <= *latest, item);
            *latest = at.max(*latest);
        }
    }

    /// Changes the model of a link, of which `seed` and `name` are those that it was added with; see [`crate::Network::set_link`]. Until then time has passed on it.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    pub fn set_model(
        &mut self,
        now: Instant,
        link: LinkId,
        (seed, name): (u64, &LinkName),
        model: LinkModel,
        mut arrives: impl FnMut(Instant, bool, T),
    ) {
        self.pass(now, link, &mut arrives);
        let Self { lines, outputs, arrivals, .. } = self;
        lines[link.index()].line.reconfigure(now, seed, name, model, outputs, &mut Arriving(arrivals));
        self.pass(now, link, arrives);
    }

    /// Takes back that a packet is delivered: nobody will look when it arrives.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    pub fn forget(&mut self, link: LinkId, sent: Instant, arrival: Instant) {
        if arrival <= self.until {
            self.lines[link.index()].line.forget(sent, arrival);
        }
    }

    /// The counters of a link.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[must_use]
    pub fn stats(&self, link: LinkId) -> LinkStats {
        self.lines[link.index()].line.stats()
    }
}

/// Where packets that leave a line's stages go.
struct Arriving<'a, T>(&'a mut Vec<(Instant, Sent<T>)>);

impl<T> Sink<Sent<T>> for Arriving<'_, T> {
    fn arrives(&mut self, at: Instant, packet: Sent<T>, _copy: u8, _marks: Marks) {
        self.0.push((at, packet));
    }

    fn happened(&mut self, _at: Instant, _fate: Fate, _packet: Sent<T>, _copy: u8, _marks: Marks) {}
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use cohaptic_units::{Bytes, Probability, Rate};

    use super::*;
    use crate::link::Link;
    use crate::stages::config::{Layout, LinkConfig};
    use crate::stages::delay::{Delay, Jitter};
    use crate::stages::loss::Loss;
    use crate::stages::queue::{Bottleneck, CoDel, Discipline, QueueLimit, Red};

    /// Packets of 64 bytes take 5.12 ms and come in bursts of 40 that are 3 ms apart, then 120 that are 8 ms apart: most find an idle line, some a queue, and some leave
    /// just when the next one comes. Then the discipline is another one.
    #[test]
    fn they_decide_what_whole_links_decide() {
        let (name, millis) = (LinkName::between("a", "b"), |n: u64| Instant::from_nanos(n * 1_000_000));
        let codel = CoDel { target: Duration::from_millis(5), interval: Duration::from_millis(30), mtu: Bytes::new(64), ecn: false };
        let red = Red::new(Bytes::new(64), Bytes::new(320), Probability::new(0.5).unwrap(), 0.1, Bytes::new(64), false).unwrap();
        let disciplines = [Discipline::TailDrop, Discipline::HeadDrop, Discipline::CoDel(codel), Discipline::Red(red)];
        let model = |discipline, bits, layout| -> LinkModel {
            let limit = if matches!(discipline, Discipline::Red(_)) { QueueLimit::Bytes(Bytes::new(640)) } else { QueueLimit::Packets(6) };
            let bottleneck = Bottleneck { limit: Some(limit), discipline, ..Bottleneck::at_rate(Rate::bits_per_sec(bits).unwrap()) };
            let delay = Delay::with_jitter(Duration::from_millis(24), Jitter::new(Duration::from_millis(6), Default::default())).unwrap();
            let loss = Loss::Independent(Probability::new(0.1).unwrap());
            LinkConfig { bottleneck: Some(bottleneck), delay, loss, layout, ..LinkConfig::default() }.into()
        };
        let (until, info) = (millis(2_900), PacketInfo::from(Bytes::new(64)));
        let instants: Vec<Instant> =
            (0..320).map(|n: u64| millis(n / 160 * 1_500 + (n % 160).min(40) * 3 + (n % 160).saturating_sub(40) * 8)).collect();
        // At 64 kbit/s a packet takes 8 ms, and leaves when the next one comes.
        for (discipline, bits, layout) in disciplines.into_iter().flat_map(|discipline| {
            [(discipline, 100_000, Layout::Physical), (discipline, 64_000, Layout::Physical), (discipline, 100_000, Layout::Netem)]
        }) {
            let then = |now| if now < millis(1_500) { discipline } else { disciplines[3] };
            let (mut whole, mut stepped) = (Link::new(7, &name, model(discipline, bits, layout)), SteppedLinks::new(until));
            stepped.add(7, &name, model(discipline, bits, layout));
            let mut arrivals = Vec::new();
            for (place, now) in instants.iter().enumerate() {
                if place == 160 {
                    whole.set_model(*now, model(then(*now), bits, layout)).unwrap();
                    stepped.set_model(*now, LinkId(0), (7, &name), model(then(*now), bits, layout), |at, _, n| arrivals.push((at, n)));
                }
                whole.handle_packet(*now, info, place as u64).unwrap();
                let next = instants.get(place + 1).copied().unwrap_or(Instant::MAX);
                stepped.offer((*now, next), LinkId(0), info, place as u64, |at, is_late, n| {
                    assert_eq!(is_late, arrivals.iter().any(|(other, _)| *other >= at));
                    arrivals.push((at, n));
                });
            }
            whole.handle_timeout(until).unwrap();
            let events = core::iter::from_fn(|| whole.poll_event());
            let delivered: Vec<(Instant, u64)> =
                events.filter(|event| matches!(event.fate, Fate::Delivered(_))).map(|event| (event.at, event.sequence)).collect();
            arrivals.retain(|(at, _)| *at <= until);
            arrivals.sort_unstable();
            assert_eq!(delivered, arrivals, "{discipline:?}, {bits}, {layout:?}");
            assert_eq!(stepped.stats(LinkId(0)), whole.stats(), "{discipline:?}, {bits}, {layout:?}");
        }
    }
}
