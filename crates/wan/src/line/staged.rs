//! All stages of a link, for waiting, copied, marked or damaged packets.
//!
//! ```text
//! physical   mtu ► outage ► loss ► duplication ► corruption ► limit ► bucket ► bottleneck ► slots ► reorder, trace, delay, order
//! netem      mtu ► outage ► duplication ► loss ► corruption ► limit ► reorder, trace, delay, order ► bucket ► bottleneck ► slots
//! ```
//!
//! A stage without configuration is `None`, and is not on the route of packets. A packet walks from stage to stage until a stage keeps the packet, drops the
//! packet, or lets the packet out.

mod propagation;
mod route;

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;
use core::time::Duration;

use cohaptic_units::{Bytes, Instant};

use propagation::Propagation;
use route::{NETEM, PHYSICAL, Route, Stage};

use crate::fates::fate::DropCause;
use crate::fates::stats::CrossCounts;
use crate::laws::chance::ChanceStage;
use crate::line::direct::Direct;
use crate::packet::{Carried, Exit, Output, Outputs, PacketInfo};
use crate::random::Purpose;
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::corruption::{Checksum, CorruptionStage};
use crate::stages::list::ImpairmentStages;
use crate::stages::modulation::ModulationStage;
use crate::stages::path_trace::PathTrace;
use crate::stages::queue::{BottleneckStage, CrossStage, TokenBucketStage};
use crate::stages::reorder::{Placed, ReorderStage};
use crate::stages::slots::SlotStage;

/// The stages of one line and the packets in them. Rarely configured stages are boxed: a large mesh has many lines, and each must stay small.
#[derive(Clone, Debug)]
pub(crate) struct Staged<T> {
    layout: &'static [Stage; 10],
    route: Route,
    mtu: Option<Bytes>,
    /// Outages, loss, delay and order.
    direct: Direct,
    marks_instead_of_loss: bool,
    duplication: Option<ChanceStage>,
    corruption: Option<Box<CorruptionStage>>,
    /// Number of packets inside the line, at most.
    limit: Option<u64>,
    bucket: Option<Box<TokenBucketStage<T>>>,
    bottleneck: Option<BottleneckStage<T>>,
    /// Cross-traffic of the bottleneck. Stays without a bottleneck and without a configuration.
    cross: Option<Box<CrossStage>>,
    /// Whether the line has a bottleneck in the physical layout, and no other stage that keeps, copies, marks or damages packets. See
    /// [`Staged::offer_at_once`].
    is_plain: bool,
    slots: Option<Box<SlotStage<T>>>,
    reorder: ReorderStage<T>,
    trace: Option<PathTrace>,
    listed: Option<Box<ImpairmentStages>>,
    /// Packets in propagation. Used only in layouts with stages after propagation (netem).
    line: Propagation<T>,
    modulation: Option<Box<ModulationStage>>,
    /// Next event and its stage, and (below) the next change of state. Both are computed by `look_ahead` after each change of the stages, because reads are
    /// more frequent than changes.
    next: Option<(Instant, Stage)>,
    next_change: Option<Instant>,
    /// Buffer for packets on their way out of a stage, kept for the reuse of its memory. Empty between calls.
    released: VecDeque<Carried<T>>,
}

impl<T> Staged<T> {
    /// Returns the counts of the cross-traffic.
    pub(crate) fn crossed(&self) -> CrossCounts {
        self.cross.as_ref().map_or_else(CrossCounts::default, |cross| cross.reported())
    }
}

impl<T: Clone> Staged<T> {
    /// Makes the stages of this configuration. `direct` holds the stages with immediate decisions, possibly with state from before.
    pub(crate) fn new(now: Instant, direct: Direct, config: LinkConfig, modulation: Option<ModulationStage>) -> Self {
        let mut stages = Self {
            layout: &PHYSICAL,
            route: Route::new(&PHYSICAL, |_| false),
            mtu: None,
            direct,
            marks_instead_of_loss: false,
            duplication: None,
            corruption: None,
            limit: None,
            bucket: None,
            bottleneck: None,
            cross: None,
            is_plain: false,
            slots: None,
            reorder: ReorderStage::new(),
            trace: None,
            listed: None,
            line: Propagation::new(),
            modulation: None,
            next: None,
            next_change: None,
            released: VecDeque::new(),
        };
        // No packet is inside, so `apply` has no outputs.
        stages.apply(now, config, &mut Vec::new());
        stages.modulation = modulation.map(Box::new);
        stages.look_ahead();
        stages
    }

    /// Makes the stages of a line with the packets of `bottleneck` and the state of `direct`.
    pub(crate) fn resumed(now: Instant, direct: Direct, config: LinkConfig, bottleneck: BottleneckStage<T>) -> Self {
        // `new` configures the stages in `direct` with their present configuration, without effect.
        let mut stages = Self { bottleneck: Some(bottleneck), ..Self::new(now, direct, config, None) };
        stages.look_ahead();
        stages
    }

    /// Returns the order of the stages.
    pub(crate) fn layout(&self) -> Layout {
        // The physical layout alone ends with propagation.
        if self.layout[self.layout.len() - 1] == Stage::Propagation { Layout::Physical } else { Layout::Netem }
    }

    /// Returns the stages with immediate decisions, with their state.
    pub(crate) const fn direct(&self) -> &Direct {
        &self.direct
    }

    /// Offers a packet with `inside` further packets inside the line.
    pub(crate) fn offer(&mut self, now: Instant, packet: Carried<T>, inside: u64, outputs: &mut Outputs<T>) {
        // Events due come first, so departures make room. The pass after the walk lets out packets with a departure at `now`.
        self.pass(now, outputs);
        self.walk(0, now, packet, inside, outputs);
        self.look_ahead();
        self.pass(now, outputs);
    }

    /// Takes packet number `number` if its fate is certain at once, and returns its arrival or the cause of its drop. The fate is certain if no packet is
    /// inside and the packet leaves the bottleneck by `until`, before any further packet. In all other cases, returns `None` and takes no packet.
    #[inline]
    pub(crate) fn offer_at_once(&mut self, now: Instant, number: u64, info: PacketInfo, until: Instant) -> Option<Result<Instant, DropCause>> {
        // A next event means that a packet is inside, and a modulator may change a stage before the packet leaves.
        if !self.is_plain || self.next.is_some() || self.modulation.is_some() {
            return None;
        }
        let bottleneck = self.bottleneck.as_mut()?;
        let departure = bottleneck.departure_if_idle(now, info.size).filter(|departure| *departure <= until)?;
        // From here on the packet is taken, and the stages change their state.
        let words = self.direct.words(number);
        Some(self.direct.offer_through(now, number, words, |_| Ok(departure)))
    }

    /// Returns the instant of the next call of [`Staged::pass`], or `None` if no packet waits.
    pub(crate) fn next_at(&self) -> Option<Instant> {
        let (next, _) = self.next?;
        // While a packet waits, a change of state may change the packet's departure.
        Some(self.next_change.map_or(next, |change| change.min(next)))
    }

    /// Lets everything due by `now` happen. Mostly nothing is due.
    #[inline]
    pub(crate) fn pass(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        if self.next.is_some_and(|(at, _)| at <= now) || self.next_change.is_some_and(|at| at <= now) {
            self.let_happen(now, outputs);
        }
    }

    /// Computes the cross packets up to `now`, if no packet of the line is at the bottleneck. Without this call the next packet has to wait for the computation.
    /// No fate and no count depends on this call.
    pub(crate) fn catch_up(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        // Changes of state up to `now` come first, because each state has cross-traffic of its own.
        self.pass(now, outputs);
        if let (Some(bottleneck), Some(cross)) = (&mut self.bottleneck, &mut self.cross)
            && !bottleneck.has_own()
        {
            bottleneck.catch_up(now, cross, outputs);
        }
    }

    #[inline(never)]
    fn let_happen(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        loop {
            let event = self.next.filter(|(at, _)| *at <= now);
            let change = self.next_change.filter(|at| *at <= now);
            match (event, change) {
                // A departure at the instant of a change comes before the change.
                (Some((at, stage)), change) if change.is_none_or(|change| at <= change) => self.release(at, stage, outputs),
                (_, Some(change)) => self.change(change, outputs),
                _ => return,
            }
            // The packet may now be in a further stage, with a next event at the same instant.
            self.look_ahead();
        }
    }

    /// Changes the configuration. Packets in propagation keep their delay. Packets in a removed stage go on at once.
    pub(crate) fn reconfigure(&mut self, now: Instant, config: LinkConfig, modulation: Option<ModulationStage>, outputs: &mut Outputs<T>) {
        // The old configuration applies up to and including `now`.
        self.pass(now, outputs);
        self.modulation = modulation.map(Box::new);
        self.apply(now, config, outputs);
        self.look_ahead();
    }

    fn look_ahead(&mut self) {
        self.next = self.next_event();
        self.next_change = self.modulation.as_ref().and_then(|modulation| modulation.next_change());
    }

    fn change(&mut self, at: Instant, outputs: &mut Outputs<T>) {
        if let Some(modulation) = &mut self.modulation {
            modulation.change();
            let config = modulation.config().clone();
            self.apply(at, config, outputs);
        }
    }

    fn apply(&mut self, now: Instant, config: LinkConfig, outputs: &mut Outputs<T>) {
        self.direct.reconfigure(now, &config);
        self.layout = match config.layout {
            Layout::Physical => &PHYSICAL,
            Layout::Netem => &NETEM,
        };
        self.mtu = config.mtu;
        self.marks_instead_of_loss = config.marks_instead_of_loss;
        self.duplication = ChanceStage::reconfigured(self.duplication, config.duplication);
        self.corruption = CorruptionStage::reconfigured(self.corruption.take().map(|stage| *stage), config.corruption).map(Box::new);
        self.limit = config.limit;
        self.trace = config.trace;
        self.listed = ImpairmentStages::reconfigured(self.listed.take(), now, &config.listed, self.direct.draws);
        // Packets of removed stages, with the stage left. The later stages of the physical order come first, so older packets go on before newer packets.
        let mut given_up: Vec<(Stage, Carried<T>)> = Vec::new();
        self.slots = match (self.slots.take(), config.slots) {
            (None, new) => new.map(|new| Box::new(SlotStage::new(new))),
            (Some(mut stage), Some(new)) => {
                stage.reconfigure(new);
                Some(stage)
            }
            (Some(stage), None) => {
                given_up.extend(stage.dismantle().map(|packet| (Stage::Slots, packet)));
                None
            }
        };
        // The old cross-traffic meets the old queue up to the change.
        if let (Some(bottleneck), Some(cross)) = (&mut self.bottleneck, &mut self.cross) {
            bottleneck.catch_up(now, cross, outputs);
        }
        let cross_traffic = config.cross_traffic.filter(|_| config.bottleneck.is_some());
        self.cross = CrossStage::reconfigured(self.cross.take(), now, cross_traffic, self.direct.draws);
        self.bottleneck = match (self.bottleneck.take(), config.bottleneck) {
            (None, new) => new.map(BottleneckStage::new),
            (Some(mut stage), Some(new)) => {
                stage.reconfigure(now, new);
                Some(stage)
            }
            (Some(stage), None) => {
                given_up.extend(stage.dismantle().map(|packet| (Stage::Bottleneck, packet)));
                None
            }
        };
        self.bucket = match (self.bucket.take(), config.token_bucket) {
            (None, new) => new.map(|new| Box::new(TokenBucketStage::new(now, new))),
            (Some(mut stage), Some(new)) => {
                stage.reconfigure(now, new, outputs);
                Some(stage)
            }
            (Some(stage), None) => {
                given_up.extend(stage.dismantle().map(|packet| (Stage::Bucket, packet)));
                None
            }
        };
        // The route must follow the new configuration before any packet goes on.
        self.route = Route::new(self.layout, |stage| self.has(stage));
        // Packets held back by the reorder stage go on with their delay, because no later packet would release them.
        if config.reorder.is_none() {
            for packet in self.reorder.dismantle() {
                self.propagate(now, packet, Travel::InOrder, outputs);
            }
        }
        self.reorder.configure(config.reorder);
        // In a plain line only the bottleneck keeps packets, and the direct stages decide at once.
        let decides = |stage: &Stage| matches!(stage, Stage::Outage | Stage::Loss | Stage::Bottleneck | Stage::Propagation);
        self.is_plain = self.bottleneck.is_some()
            && self.cross.is_none()
            && self.layout() == Layout::Physical
            && self.route.stages[..usize::from(self.route.count)].iter().all(decides)
            && self.trace.is_none()
            && self.listed.is_none()
            && !self.marks_instead_of_loss
            && self.reorder.is_idle();
        for (stage, packet) in given_up {
            self.walk_on(stage, now, packet, outputs);
        }
    }

    fn has(&self, stage: Stage) -> bool {
        match stage {
            Stage::Mtu => self.mtu.is_some(),
            Stage::Outage => self.direct.has_outages(),
            // A trace and listed impairments lose packets too, at the same place.
            Stage::Loss => self.direct.loss.is_some() || self.trace.is_some() || self.listed.is_some(),
            Stage::Duplication => self.duplication.is_some(),
            Stage::Corruption => self.corruption.is_some(),
            Stage::Limit => self.limit.is_some(),
            Stage::Bucket => self.bucket.is_some(),
            Stage::Bottleneck => self.bottleneck.is_some(),
            Stage::Slots => self.slots.is_some(),
            Stage::Propagation => true,
        }
    }

    /// Returns the next event and its stage, or `None` if no packet waits. Of simultaneous events the event in the last stage of the route comes first, so a
    /// departure makes room for packets from stages before.
    fn next_event(&self) -> Option<(Instant, Stage)> {
        let mut next: Option<(Instant, Stage)> = None;
        // Reversed, so the comparison with `<` keeps the last stage among simultaneous events.
        for &stage in self.route.keeping().iter().rev() {
            let at = match stage {
                Stage::Bucket => self.bucket.as_ref().and_then(|bucket| bucket.next_at()),
                Stage::Bottleneck => self.bottleneck.as_ref().and_then(|bottleneck| bottleneck.next_at(self.cross.as_deref())),
                Stage::Slots => self.slots.as_ref().and_then(|slots| slots.next_at()),
                Stage::Propagation => {
                    let held = self.reorder.next_at();
                    let line = self.line.next_at();
                    line.map_or(held, |line| Some(held.map_or(line, |held| held.min(line))))
                }
                Stage::Mtu | Stage::Outage | Stage::Loss | Stage::Duplication | Stage::Corruption | Stage::Limit => None,
            };
            if let Some(at) = at
                && next.is_none_or(|(earliest, _)| at < earliest)
            {
                next = Some((at, stage));
            }
        }
        next
    }

    fn release(&mut self, now: Instant, stage: Stage, outputs: &mut Outputs<T>) {
        // Taken out of `self`, because `walk_on` borrows `self` during the draining of the buffer.
        let mut released = core::mem::take(&mut self.released);
        match stage {
            Stage::Bucket => released.extend(self.bucket.as_mut().and_then(|bucket| bucket.release(now))),
            Stage::Bottleneck => {
                if let Some(bottleneck) = &mut self.bottleneck {
                    bottleneck.release(now, self.cross.as_deref_mut(), &mut released, outputs);
                }
            }
            Stage::Slots => {
                if let Some(slots) = &mut self.slots {
                    slots.release(now, self.direct.draws, &mut released);
                }
            }
            Stage::Propagation => {
                // Propagation has two sources of events. At equal instants, a packet after its propagation goes before a packet held back.
                if let Some(packet) = self.line.take_due(now) {
                    released.push_back(packet);
                } else {
                    let mut held = VecDeque::new();
                    self.reorder.release(now, &mut held);
                    for packet in held {
                        self.propagate(now, packet, Travel::InOrder, outputs);
                    }
                }
            }
            Stage::Mtu | Stage::Outage | Stage::Loss | Stage::Duplication | Stage::Corruption | Stage::Limit => {}
        }
        while let Some(packet) = released.pop_front() {
            self.walk_on(stage, now, packet, outputs);
        }
        self.released = released;
    }

    fn walk_on(&mut self, after: Stage, now: Instant, packet: Carried<T>, outputs: &mut Outputs<T>) {
        // All stages with waiting packets come after the limit, so no stage ahead reads `inside`.
        self.walk(usize::from(self.route.behind[after as usize]), now, packet, 0, outputs);
    }

    /// Leads a packet through the stages from index `from` of the route on. `inside` is the number of further packets in the line, for the limit.
    fn walk(&mut self, from: usize, now: Instant, mut packet: Carried<T>, inside: u64, outputs: &mut Outputs<T>) {
        let draws = self.direct.draws.copy(packet.number, packet.copy);
        for place in from..usize::from(self.route.count) {
            match self.route.stages[place] {
                Stage::Mtu => {
                    if self.mtu.is_some_and(|mtu| packet.info.size > mtu) {
                        return drop(outputs, now, DropCause::Mtu, packet);
                    }
                }
                Stage::Outage => {
                    if self.direct.is_down(now) {
                        return drop(outputs, now, DropCause::Outage, packet);
                    }
                }
                Stage::Loss => {
                    if self.loses(now, &packet) {
                        // An ECN-capable packet is marked in place of the loss, and goes on.
                        if !(self.marks_instead_of_loss && packet.info.ecn.is_capable()) {
                            return drop(outputs, now, DropCause::Loss, packet);
                        }
                        packet.marks.congestion = true;
                    }
                }
                Stage::Duplication => {
                    if let Some(chance) = &mut self.duplication
                        && chance.happens(draws.first(Purpose::Duplication))
                    {
                        // The copy is made before the packet's walk, because the walk consumes the packet.
                        let copy = packet.clone().as_copy(1);
                        outputs.push(Output { packet: copy.clone(), exit: Exit::Copied(now) });
                        let before = outputs.len();
                        self.walk(place + 1, now, packet, inside, outputs);
                        // The walk may have dropped the packet, or packets at the head of a queue in its place.
                        let dropped = outputs[before..].iter().filter(|output| matches!(output.exit, Exit::Dropped(..))).count() as u64;
                        return self.walk(place + 1, now, copy, (inside + 1).saturating_sub(dropped), outputs);
                    }
                }
                Stage::Corruption => {
                    // The damage is drawn by the packet and copy number, so packet and copy are damaged independently.
                    if let Some(corruption) = &mut self.corruption
                        && let Some(damage) = corruption.damage(packet.info, draws)
                    {
                        packet.marks.damage(Some(damage), corruption.checksum() == Checksum::Discards);
                    }
                }
                Stage::Limit => {
                    if self.limit.is_some_and(|limit| inside >= limit) {
                        return drop(outputs, now, DropCause::Limit, packet);
                    }
                }
                Stage::Bucket => {
                    if let Some(bucket) = &mut self.bucket {
                        match bucket.offer(now, packet, outputs) {
                            Some(passed) => packet = passed,
                            None => return,
                        }
                    }
                }
                Stage::Bottleneck => {
                    if let Some(bottleneck) = &mut self.bottleneck {
                        if let Some(cross) = &mut self.cross {
                            bottleneck.catch_up(now, cross, outputs);
                        }
                        // A bottleneck keeps even a packet that finds the transmitter idle, for its time of transmission.
                        return bottleneck.offer(now, packet, || draws.first(Purpose::Queue), self.cross.as_deref_mut(), outputs);
                    }
                }
                Stage::Slots => {
                    if let Some(slots) = &mut self.slots {
                        return slots.offer(now, packet, self.direct.draws);
                    }
                }
                Stage::Propagation => return self.place(now, packet, outputs),
            }
        }
        outputs.push(Output { packet, exit: Exit::Arrives(now) });
    }

    fn loses(&mut self, now: Instant, packet: &Carried<T>) -> bool {
        let draws = self.direct.draws.copy(packet.number, packet.copy);
        let traced = self.trace.as_ref().map(|trace| trace.at(now).1);
        let by_trace = traced.is_some_and(|loss| loss.happens(draws.first(Purpose::TraceLoss)));
        let by_model = self.direct.loss.as_mut().is_some_and(|loss| loss.loses(now, packet.number, draws.first(Purpose::Loss), || draws));
        let by_listed = self.listed.as_mut().is_some_and(|listed| listed.loses(now, packet.info));
        // All three models have advanced above: a short circuit would leave one of them behind.
        by_model || by_trace || by_listed
    }

    /// Places a packet among the packets under way according to the reorder stage, and lets the packet propagate.
    fn place(&mut self, now: Instant, packet: Carried<T>, outputs: &mut Outputs<T>) {
        if self.reorder.is_idle() {
            return self.propagate(now, packet, Travel::InOrder, outputs);
        }
        let draws = self.direct.draws.copy(packet.number, packet.copy);
        let mut behind = Vec::new();
        match self.reorder.place(now, packet, || draws.first(Purpose::Reordering), &mut behind) {
            Placed::InOrder(packet) => self.propagate(now, packet, Travel::InOrder, outputs),
            Placed::Jumps(packet) => self.propagate(now, packet, Travel::AtOnce, outputs),
            Placed::Late(packet, by) => self.propagate(now, packet, Travel::Late(by), outputs),
            Placed::Held => {}
        }
        for packet in behind {
            // One nanosecond of additional delay keeps these packets after the packet placed above over a constant delay too.
            self.propagate(now, packet, Travel::Late(Duration::from_nanos(1)), outputs);
        }
    }

    fn propagate(&mut self, now: Instant, packet: Carried<T>, travel: Travel, outputs: &mut Outputs<T>) {
        let draws = self.direct.draws.copy(packet.number, packet.copy);
        let mut delay = || {
            let traced = self.trace.as_ref().map_or(0, |trace| trace.at(now).0);
            // Words have addresses, so an unread word can be skipped without an effect on further words.
            let word = if self.direct.delay.is_random() { draws.first(Purpose::Jitter) } else { 0 };
            let listed = self.listed.as_mut().map_or(0, |listed| listed.delay_nanos(now, packet.info));
            self.direct.delay.draw_nanos(now, word, || draws).saturating_add(traced).saturating_add(listed)
        };
        let wanted = match travel {
            Travel::InOrder => now.saturating_add_nanos(delay()),
            // A jump draws no delay, as in netem.
            Travel::AtOnce => now,
            Travel::Late(by) => now.saturating_add_nanos(delay()).saturating_add(by),
        };
        let until = self.direct.order.arrival(wanted);
        let last = self.layout[self.layout.len() - 1] == Stage::Propagation;
        // Without a later stage, the owner of the line keeps the packet until its arrival.
        if last || (self.bucket.is_none() && self.bottleneck.is_none() && self.slots.is_none()) {
            outputs.push(Output { packet, exit: Exit::Arrives(until) });
        } else {
            self.line.push(until, packet);
        }
    }
}

/// Delay of a packet on the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Travel {
    /// By the delay of the line.
    InOrder,
    /// Not at all: the packet jumps ahead.
    AtOnce,
    /// By the delay of the line and this time more.
    Late(Duration),
}

fn drop<T>(outputs: &mut Outputs<T>, now: Instant, cause: DropCause, packet: Carried<T>) {
    outputs.push(Output { packet, exit: Exit::Dropped(now, cause) });
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use cohaptic_units::Rate;

    use super::*;
    use crate::line::name::LinkName;
    use crate::stages::queue::{Bottleneck, CrossTraffic, Poisson};

    /// With calls during a silence, the next packet has to wait only for the cross packets since the last call. Without calls, the next packet has to wait for
    /// the cross packets of the whole silence.
    #[test]
    fn cross_packets_of_a_silence_are_computed_on_the_way() {
        let rate = |bits| Rate::bits_per_sec(bits).unwrap();
        let cross_traffic = Some(CrossTraffic::poisson(Poisson { rate: rate(6_000_000), size: Bytes::new(1500) }).unwrap());
        let config = LinkConfig { bottleneck: Some(Bottleneck::at_rate(rate(12_000_000))), cross_traffic, ..LinkConfig::default() };
        let direct = || Direct::new(1, &LinkName::between("a", "b"), &LinkConfig::default());
        let mut staged = Staged::<()>::new(Instant::ZERO, direct(), config, None);
        let next = |staged: &Staged<()>| staged.cross.as_ref().and_then(|cross| cross.next_at()).unwrap();
        let mut outputs = Vec::new();
        for second in 1..=20 {
            let now = Instant::from_nanos(second * 1_000_000_000);
            staged.pass(now, &mut outputs);
            assert!(next(&staged) < now, "nobody has computed the last second");
            staged.catch_up(now, &mut outputs);
            assert!(next(&staged) > now && staged.next_at().is_none());
        }
        // No packet comes out, and a cross packet is reported only once a packet of the line has met the queue.
        assert!(outputs.is_empty() && staged.crossed().offered == 0);
    }
}
