//! Runs of scenes without need for events: all numbers of all peers in arrays, for one scene or for several scenes of one shape side by side.
//!
//! If all peers tick together and the observer wants no more than ticks, a run is a loop over ticks: samples are sent, samples arrive, forces are computed,
//! bodies move. This loop works on arrays, eight numbers at a time: eight peers of one run, or one peer of eight runs. [`crate::world::World`] computes the
//! same with events. Both do the same operations in the same order on each number, draw the same random numbers at the same addresses and keep the same
//! counters, so both return the same [`Summary`] to the bit.

mod blocks;
mod bodies;
mod changes;
mod lanes;
mod place;
mod processor;
mod run_watch;
mod samples;
mod shape;
mod threads;
mod ticks;

use std::ops::{ControlFlow, Range};
use std::sync::Arc;
use std::time::Duration;

use cohaptic_peer::Lead;
use cohaptic_peer::coordination::{BuiltIn, Law};
use cohaptic_scene::{Axes, Scene};
use cohaptic_units::Instant;
use cohaptic_wan::LinkStats;
use pulp::NullaryFnOnce;

use crate::plan::{DeviceChoice, Plan};
use crate::summary::{Ending, LinkSummaries, PeerSummary, Summary};
use blocks::{Moved, law_of_lanes};
use bodies::Bodies;
use changes::Changes;
use lanes::Lanes;
pub(crate) use lanes::{WIDTH, larger, smaller};
use place::Places;
use processor::on_widest;
pub(crate) use run_watch::Onlooker;
use run_watch::{RunWatch, Unwatched, WatchedTicks};
use samples::{Broadcast, PerPacket, Sample};
pub(crate) use shape::Shape;
pub use ticks::Ticks;

/// Runs a scene of the given shape and law to its end. `keep_going` is called as [`crate::Observer::keep_going`] is.
pub(crate) fn run(scene: &Scene, shape: Shape, law: BuiltIn, keep_going: &mut dyn FnMut(Instant) -> bool) -> Summary {
    let [summary] = run_lanes([scene], shape, [law], keep_going);
    summary
}

/// Runs L scenes of the given shape to their ends, each with its law.
pub(crate) fn run_lanes<const L: usize>(
    scenes: [&Scene; L],
    shape: Shape,
    laws: [BuiltIn; L],
    keep_going: &mut dyn FnMut(Instant) -> bool,
) -> [Summary; L] {
    let watch = Unwatched(keep_going);
    match scenes[0].axes {
        Axes::One => Arrays::<1, L>::new(scenes, shape, laws, None).run(watch),
        Axes::Two | Axes::Three => Arrays::<3, L>::new(scenes, shape, laws, None).run(watch),
    }
}

/// Runs a scene to its end, or until `onlooker` fails. The summary has no meaning after a failure.
pub(crate) fn run_watched(scene: &Scene, (shape, law): (Shape, BuiltIn), plan: &Plan, onlooker: &mut dyn Onlooker) -> Summary {
    let (watch, scenes, laws, devices) = (WatchedTicks::new(scene, onlooker), [scene], [law], Some(plan.devices.as_slice()));
    let [summary] = match scene.axes {
        Axes::One => Arrays::<1, 1>::new(scenes, shape, laws, devices).run(watch),
        Axes::Two | Axes::Three => Arrays::<3, 1>::new(scenes, shape, laws, devices).run(watch),
    };
    summary
}

/// Runs a scene on the given number of threads to its end. Returns `None` if the run diverged: only a run without threads knows the instant.
pub(crate) fn run_on_threads(
    scene: &Scene,
    shape: &Shape,
    law: BuiltIn,
    threads: usize,
    keep_going: &mut dyn FnMut(Instant) -> bool,
) -> Option<Summary> {
    match scene.axes {
        Axes::One => threads::run::<1>(scene, shape, law, threads, keep_going),
        Axes::Two | Axes::Three => threads::run::<3>(scene, shape, law, threads, keep_going),
    }
}

/// Some or all peers of L runs of scenes of one shape, with A axes.
#[derive(Debug)]
struct Arrays<'a, const A: usize, const L: usize> {
    scenes: [&'a Scene; L],
    shape: Shape,
    law: BuiltIn<Lanes>,
    /// Peers of the scene in these arrays. Unless a comment says otherwise, a peer is counted from the first of these members.
    members: Range<usize>,
    bodies: Bodies<A>,
    samples: Samples<A, L>,
    changes: Changes<'a, L>,
    /// Horizons of the extrapolation \[s\], indexed by run, and leads of the held samples, indexed by peer, then run. `None` for a law without extrapolation.
    leads: Option<([f64; L], Vec<[Lead<A>; L]>)>,
    /// Tick of the next sending, indexed by peer of the scene.
    next_send: Vec<u64>,
    /// Least entry of `next_send`: at earlier ticks nothing is sent.
    earliest_send: u64,
    /// Sending peers of the present tick, by index in the scene. Used only with [`Samples::PerPacket`].
    senders: Vec<usize>,
    /// Latest sample of each peer of the scene. Empty with [`Samples::Broadcast`].
    sent: Vec<Sample<A, L>>,
    /// Largest distance between two copies along an axis so far \[m\], indexed by run.
    max_discrepancy: [f64; L],
    /// `true` if all numbers were finite after the latest tick, indexed by run.
    finite: [bool; L],
    /// Results of the ended runs, indexed by run.
    summaries: [Option<Summary>; L],
    processor: pulp::Arch,
}

/// Samples in flight and samples held, in the form allowed by the links.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one a run, and a box would be another look-up a packet")]
enum Samples<const A: usize, const L: usize> {
    Broadcast(Broadcast<A, L>),
    PerPacket(PerPacket<A, L>),
}

impl<'a, const A: usize, const L: usize> Arrays<'a, A, L> {
    /// Returns all peers of the scenes before the first tick. `devices` as for [`Bodies::new`].
    fn new(scenes: [&'a Scene; L], shape: Shape, laws: [BuiltIn; L], devices: Option<&[DeviceChoice]>) -> Self {
        let members = 0..shape.peers;
        let bodies = bodies_of::<A, L>(&scenes, &members, &laws, devices);
        let initial: Vec<Sample<A, L>> = members.clone().map(|peer| bodies.sample(peer)).collect();
        Self::of_members(scenes, shape, laws, members, bodies, &initial)
    }

    /// Returns the given peers with their bodies before the first tick. `initial` holds the initial states of all peers of the scene.
    fn of_members(
        scenes: [&'a Scene; L],
        shape: Shape,
        laws: [BuiltIn; L],
        members: Range<usize>,
        bodies: Bodies<A>,
        initial: &[Sample<A, L>],
    ) -> Self {
        let samples = match shape.delay {
            // A sample counts from the first tick at or after its arrival, hence the division rounded up.
            Some(delay) => Samples::Broadcast(Broadcast::new(initial, nanos(delay).div_ceil(nanos(shape.tick)))),
            None => Samples::PerPacket(PerPacket::new(&scenes, initial, &shape, members.clone())),
        };
        Self {
            law: law_of_lanes(&laws),
            changes: Changes::new(&scenes),
            bodies,
            leads: Law::<f64>::horizon(&laws[0])
                .is_some()
                .then(|| (laws.map(|law| Law::<f64>::horizon(&law).unwrap_or(0.0)), vec![[Lead::STALE; L]; members.len()])),
            scenes,
            earliest_send: shape.phases.iter().copied().min().unwrap_or(u64::MAX),
            next_send: shape.phases.clone(),
            senders: Vec::new(),
            sent: if matches!(samples, Samples::PerPacket(_)) { initial.to_vec() } else { Vec::new() },
            samples,
            members,
            shape,
            max_discrepancy: [0.0; L],
            finite: [true; L],
            summaries: [const { None }; L],
            processor: pulp::Arch::new(),
        }
    }

    /// Runs all L runs to their ends.
    fn run(mut self, mut watch: impl RunWatch<A>) -> [Summary; L] {
        let (mut tick, last) = (0, self.shape.tick_at(self.shape.end));
        loop {
            // Stretches between changes: within a stretch the law and the links stay as they are.
            let until = self.next_change().min(last);
            if self.run_over(tick..until, &mut watch).is_break() {
                break;
            }
            tick = until;
            // Changes at the end of the scene are applied in `finish`, at the instant of the end.
            if tick == last {
                self.finish(tick, &mut watch);
                break;
            }
            let now = self.shape.instant(tick);
            // The tick before a change may have diverged, and a change must not be applied to an ended run.
            if self.end_diverged(tick, now) {
                break;
            }
            self.change(tick, now, &mut |scene| watch.change_damping(scene));
        }
        self.summaries.map(|summary| summary.expect("every run has ended"))
    }

    /// Computes the given ticks of all runs. Breaks early if all runs have ended.
    fn run_over(&mut self, ticks: Range<u64>, watch: &mut impl RunWatch<A>) -> ControlFlow<()> {
        let tick_nanos = nanos(self.shape.tick);
        for tick in ticks {
            let now = Instant::from_nanos(tick * tick_nanos);
            if self.finite.contains(&false) && self.end_diverged(tick, now) {
                return ControlFlow::Break(());
            }
            let discrepancy = self.step(tick, now, watch);
            // Counted after the step: the number of ticks computed so far.
            let ticks = tick + 1;
            if !watch.after_motion(now, discrepancy[0]) || self.shape.is_asked_before(ticks) && !watch.keep_going(now) {
                self.end_all(ticks, |_| Ending::Interrupted(now));
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    }

    /// Ends all runs at the end of the scene, after the given number of ticks.
    fn finish(&mut self, ticks: u64, watch: &mut impl RunWatch<A>) {
        let end = self.shape.end;
        self.change(ticks, end, &mut |scene| watch.change_damping(scene));
        if let Samples::PerPacket(samples) = &mut self.samples {
            samples.finish(self.shape.before(ticks));
        }
        self.end_all(ticks, |finite| if finite { Ending::Complete } else { Ending::Diverged(end) });
    }

    /// Computes a tick. Returns the distance between copies \[m\], indexed by run.
    #[inline(always)]
    fn step(&mut self, tick: u64, now: Instant, watch: &mut impl RunWatch<A>) -> [f64; L] {
        if self.begin(tick) {
            self.send(tick, now);
        }
        self.go_on(now, tick, watch)
    }

    /// Begins a tick: takes the samples of the sending peers. Returns whether any peer sends; then `senders` lists the sending peers of the scene, and
    /// `sent` holds the samples of the members among them.
    #[inline(always)]
    fn begin(&mut self, tick: u64) -> bool {
        let sends = tick == self.earliest_send;
        if sends {
            self.gather(tick);
        }
        sends
    }

    /// Finishes a tick after all samples were sent. Returns the distance between copies \[m\], indexed by run.
    #[inline(always)]
    fn go_on(&mut self, now: Instant, tick: u64, watch: &mut impl RunWatch<A>) -> [f64; L] {
        // Samples that arrive at a tick count in the forces of the same tick, as in the world of events.
        match &mut self.samples {
            Samples::Broadcast(samples) => samples.deliver(tick),
            Samples::PerPacket(samples) => samples.deliver(tick),
        }
        self.bodies.move_hands(now);
        if self.leads.is_some() {
            self.extrapolate(now);
        }
        let Moved { discrepancy, finite } = self.motion(now, watch);
        for (largest, discrepancy) in self.max_discrepancy.iter_mut().zip(discrepancy) {
            *largest = largest.max(discrepancy);
        }
        self.finite = finite;
        discrepancy
    }

    /// Computes the means of the held samples and moves all bodies.
    #[inline(always)]
    fn motion(&mut self, now: Instant, watch: &mut impl RunWatch<A>) -> Moved<L> {
        // In a broadcast, means stay as they are until a sample arrives.
        if !matches!(&self.samples, Samples::Broadcast(samples) if samples.is_settled()) {
            on_widest(self.processor, Means::<A, L> { samples: &mut self.samples, bodies: &mut self.bodies });
        }
        watch.before_motion(now, &self.bodies, &self.law);
        self.bodies.advance::<L>(self.processor, &self.law)
    }

    /// Computes the leads of all held samples, to the bit as [`cohaptic_peer::Held::move_on`] does.
    #[inline(never)]
    // A lead stays valid until a new sample arrives or its horizon passes. Only then are all held samples looked at.
    fn extrapolate(&mut self, now: Instant) {
        let Shape { tick, send_every, phases, .. } = &self.shape;
        // A link is offered every sample of its sender, so the sequence number of a sample gives its instant.
        let sent = |sender: usize, sequence: u64| Instant::from_nanos((phases[sender] + sequence * send_every) * nanos(*tick));
        let Some((horizons, leads)) = &mut self.leads else { return };
        for (peer, leads) in leads.iter_mut().enumerate() {
            let values: [[f64; A]; L] = std::array::from_fn(|run| {
                let lead = &mut leads[run];
                match &self.samples {
                    Samples::Broadcast(samples) if samples.has_changed(peer) || !lead.holds_at(now) => {
                        *lead = Lead::of(samples.moving((peer, run), sent), now, horizons[run]);
                    }
                    Samples::PerPacket(samples) if samples.has_changed(peer, run) || !lead.holds_at(now) => {
                        *lead = Lead::of(samples.moving((peer, run), sent), now, horizons[run]);
                    }
                    Samples::Broadcast(_) | Samples::PerPacket(_) => {}
                }
                lead.at(now)
            });
            for axis in 0..A {
                self.bodies.blocks_mut().set_lead::<L>(axis, peer, values.map(|value| value[axis]));
            }
        }
    }

    /// Takes the samples of the sending peers of this tick, and sets the next tick of sending for each of these peers.
    fn gather(&mut self, tick: u64) {
        self.senders.clear();
        for (peer, next) in self.next_send.iter_mut().enumerate() {
            if *next != tick {
                continue;
            }
            *next += self.shape.send_every;
            match &mut self.samples {
                Samples::Broadcast(samples) => samples.send(tick, peer, &self.bodies),
                Samples::PerPacket(_) => {
                    self.senders.push(peer);
                    // Peers of other groups send too: their samples come by the exchange, but their links to members are here.
                    if self.members.contains(&peer) {
                        self.sent[peer] = self.bodies.sample(peer - self.members.start);
                    }
                }
            }
        }
        self.earliest_send = self.next_send.iter().copied().min().unwrap_or(u64::MAX);
    }

    /// Sends the gathered samples over the links to receivers in `members`. A broadcast was sent by [`Arrays::gather`].
    fn send(&mut self, tick: u64, now: Instant) {
        if let Samples::PerPacket(samples) = &mut self.samples {
            // Links may look ahead only to the next sample or the next change of the timeline, whichever is earlier.
            let change = self.changes.next_at();
            let next = |sender: usize| next_offer(&self.shape, self.next_send[sender]).min(change);
            samples.send(self.processor, (tick, now), &self.senders, &self.sent, next);
        }
    }

    /// Advances the queues of all links up to `tick`, without the events at `tick` or later.
    #[cold]
    fn pass(&mut self, tick: u64) {
        if let Samples::PerPacket(samples) = &mut self.samples {
            let change = self.changes.next_at();
            samples.pass(self.shape.before(tick), &|sender| next_offer(&self.shape, self.next_send[sender]).min(change));
        }
    }

    /// Ends the runs diverged before `tick`. Returns whether all runs have ended.
    #[cold]
    fn end_diverged(&mut self, tick: u64, now: Instant) -> bool {
        for run in 0..L {
            if !self.finite[run] && self.summaries[run].is_none() {
                self.end(run, tick, Ending::Diverged(now));
            }
        }
        self.summaries.iter().all(Option::is_some)
    }

    fn end_all(&mut self, ticks: u64, ending: impl Fn(bool) -> Ending) {
        for run in 0..L {
            if self.summaries[run].is_none() {
                self.end(run, ticks, ending(self.finite[run]));
            }
        }
    }

    /// Ends a run after the given number of ticks and stores its summary.
    fn end(&mut self, run: usize, ticks: u64, ending: Ending) {
        let until = self.stop(run, ticks, ending);
        self.summaries[run] = Some(summary(std::slice::from_ref(self), run, ticks, ending, until, self.max_discrepancy[run]));
        // An ended run goes on in its lanes, and its numbers may overflow. They no longer count for the other runs.
        self.bodies.blocks_mut().end(run);
    }

    /// Stops a run after the given number of ticks and discards its packets in flight. Returns the instant of the last possible delivery.
    fn stop(&mut self, run: usize, ticks: u64, ending: Ending) -> Instant {
        // Packets are delivered up to the latest tick, and to the end of the scene if the run reached the end.
        let delivered_until = match ending {
            Ending::Complete => self.shape.end,
            Ending::Diverged(at) if at == self.shape.end => at,
            Ending::Diverged(_) | Ending::Interrupted(_) => Instant::from_nanos((ticks - 1) * nanos(self.shape.tick)),
        };
        if delivered_until < self.shape.end
            && let Samples::PerPacket(samples) = &mut self.samples
        {
            let Shape { tick, send_every, phases, .. } = &self.shape;
            samples.end_early(run, delivered_until, |sender, sequence| Instant::from_nanos((phases[sender] + sequence * send_every) * nanos(*tick)));
        }
        delivered_until
    }

    /// Returns the results of a peer.
    fn peer_summary(&self, peer: usize, run: usize) -> PeerSummary {
        let (position, velocity) = (0..self.scenes[run].axes.count()).map(|axis| self.bodies.blocks().object(axis, peer, run)).unzip();
        let stale_samples = match &self.samples {
            Samples::Broadcast(_) => 0,
            Samples::PerPacket(samples) => samples.stale_samples(peer, run),
        };
        let name = self.scenes[run].peers[self.members.start + peer].name.clone();
        PeerSummary { name, position, velocity, attitude: None, stale_samples, refused_samples: 0 }
    }

    /// Returns the counters of each link from `from` after the given number of ticks, if all links have the constant delay `delay` and packets arriving up
    /// to `until` are delivered.
    fn broadcast_stats(&self, from: usize, delay: Duration, ticks: u64, until: Instant) -> LinkStats {
        let delay = nanos(delay);
        // Such a link keeps no counters: its packets are sent at ticks phase, phase + M, phase + 2M, … with M = `send_every`.
        let sent_before = |ticks: u64| ticks.saturating_sub(self.shape.phases[from]).div_ceil(self.shape.send_every);
        let last = until.as_nanos().checked_sub(delay).map(|nanos| nanos / crate::arrays::nanos(self.shape.tick));
        let offered = sent_before(ticks);
        // Packets of the instant `last` count if the tick was computed, hence the smaller of both numbers of ticks.
        let delivered = last.map_or(0, |last| sent_before(last.saturating_add(1).min(ticks)));
        LinkStats::counted(offered, delivered, u128::from(delivered) * u128::from(delay), [])
    }
}

/// Returns the counters of the links of a run ended after the given number of ticks. `parts` together hold all peers.
fn links<const A: usize, const L: usize>(parts: &[Arrays<'_, A, L>], run: usize, ticks: u64, until: Instant) -> LinkSummaries {
    let peers = parts[0].shape.peers;
    if let Some(delay) = parts[0].shape.delay {
        return LinkSummaries::by_sender((0..peers).map(|from| parts[0].broadcast_stats(from, delay, ticks, until)).collect());
    }
    // Capacity for all links, so the vector of a large mesh does not grow several times.
    let mut stats = Vec::with_capacity(parts[0].shape.topology.as_ref().map_or(peers * (peers - 1), |topology| topology.links()));
    for (from, part) in (0..peers).flat_map(|from| parts.iter().map(move |part| (from, part))) {
        let Samples::PerPacket(samples) = &part.samples else { continue };
        match &part.shape.topology {
            None => stats.extend((0..part.members.len()).filter_map(|receiver| samples.stats(from, receiver, run))),
            Some(topology) => {
                let near = topology.neighbours(from).iter().map(|to| *to as usize).filter(|to| part.members.contains(to));
                stats.extend(near.filter_map(|to| samples.stats(from, to - part.members.start, run)));
            }
        }
    }
    match &parts[0].shape.topology {
        Some(topology) => LinkSummaries::on(Arc::clone(topology), stats),
        None => LinkSummaries::each(peers, stats),
    }
}

/// Returns the summary of a run after the given number of ticks, with the packets arrived up to `until`. `parts` together hold all peers.
fn summary<const A: usize, const L: usize>(
    parts: &[Arrays<'_, A, L>],
    run: usize,
    ticks: u64,
    ending: Ending,
    until: Instant,
    max_discrepancy: f64,
) -> Summary {
    let stop = match ending {
        Ending::Complete => parts[0].shape.end,
        Ending::Diverged(at) | Ending::Interrupted(at) => at,
    };
    let members = || parts.iter().flat_map(|part| (0..part.members.len()).map(move |peer| (part, peer)));
    Summary {
        ending,
        duration: stop - Instant::ZERO,
        ticks,
        peers: members().map(|(part, peer)| part.peer_summary(peer, run)).collect(),
        links: links(parts, run, ticks, until),
        // `Shape::of` refuses scenes with access lines.
        access_lines: Vec::new(),
        max_discrepancy,
        // `Shape::of` refuses scenes with a turning object.
        max_rotation_discrepancy: None,
    }
}

/// Returns the bodies of some peers.
fn bodies_of<const A: usize, const L: usize>(
    scenes: &[&Scene; L],
    members: &Range<usize>,
    laws: &[BuiltIn; L],
    devices: Option<&[DeviceChoice]>,
) -> Bodies<A> {
    Bodies::new(Places { first: members.start, peers: members.len(), runs: L }, scenes, &laws[0], devices)
}

/// Task of computing the means of the held samples, compiled for the widest registers.
struct Means<'a, const A: usize, const L: usize> {
    samples: &'a mut Samples<A, L>,
    bodies: &'a mut Bodies<A>,
}

impl<const A: usize, const L: usize> NullaryFnOnce for Means<'_, A, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        match self.samples {
            Samples::Broadcast(samples) => samples.refresh(self.bodies.blocks_mut()),
            Samples::PerPacket(samples) => samples.refresh(self.bodies.blocks_mut()),
        }
    }
}

/// Returns the instant of the tick `next_send`. Until then the sender offers its links no further packet.
fn next_offer(shape: &Shape, next_send: u64) -> Instant {
    Instant::from_nanos(next_send.saturating_mul(nanos(shape.tick)))
}

/// Returns a span in nanoseconds. Spans here are at most a year, so the conversion never saturates.
fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}
