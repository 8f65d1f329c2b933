//! Runs of peers that tick at instants of their own: with offsets, or by clocks that drift.
//!
//! In a window each peer ticks at most once. So what it sends in it says where it was before the window, and what it hears there acts on where it is after it:
//! first all that send do so, in the order of their ticks; then each takes in what has arrived by its own tick; then all move at once. No delay is too
//! short for that. Peers that do not tick in the window move with the others and are put back.

mod latest;
mod timetable;

use std::ops::ControlFlow;

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_peer::{Clock, Lead};
use cohaptic_scene::{Axes, Scene};
use cohaptic_units::Instant;
use pulp::NullaryFnOnce;

use self::latest::Latest;
use self::timetable::Timetable;
use super::blocks::{Moved, Rests};
use super::bodies::{Bodies, SeenPlace};
use super::lanes::{Mask, WIDTH};
use super::processor::on_widest;
use super::run_watch::{Onlooker, Unwatched, WatchedTicks, WindowWatch};
use super::samples::{Broadcast, NextTick, Sample, TOGETHER};
use super::shape::Shape;
use super::translations::Translations;
use super::{Arrays, Means, Samples, bodies_of, nanos, summary};
use crate::observer::{MOST_INSTANTS_BETWEEN_QUESTIONS, MOST_WORK_BETWEEN_QUESTIONS};
use crate::plan::{DeviceChoice, Plan};
use crate::summary::{Ending, Summary};

/// A run of a scene of that shape with that law, to its end; `None` if it diverged: another with events says when. `keep_going` is asked as
/// [`crate::Observer::keep_going`] is.
pub(crate) fn run_in_windows(scene: &Scene, law: (Shape, BuiltIn), keep_going: &mut dyn FnMut(Instant) -> bool) -> Option<Summary> {
    run(scene, law, None, WindowWatch::Unwatched(Unwatched(keep_going)))
}

/// [`run_in_windows`], or until the onlooker fails: then the summary means nothing.
pub(crate) fn run_in_watched_windows(scene: &Scene, law: (Shape, BuiltIn), plan: &Plan, onlooker: &mut dyn Onlooker) -> Option<Summary> {
    run(scene, law, Some(&plan.devices), WindowWatch::Watched(WatchedTicks::new(scene, onlooker)))
}

fn run(scene: &Scene, law: (Shape, BuiltIn), devices: Option<&[DeviceChoice]>, watch: WindowWatch<'_>) -> Option<Summary> {
    match scene.axes {
        Axes::One => Windows::<1>::new(scene, law, devices).run(watch),
        Axes::Two | Axes::Three => Windows::<3>::new(scene, law, devices).run(watch),
    }
}

/// A run along A axes, window by window.
struct Windows<'a, const A: usize> {
    arrays: Arrays<'a, Translations<A>, A, A, 1>,
    timetable: Timetable,
    latest: Latest<A>,
    rests: Rests,
    /// The peers that tick, by block of peers.
    ticking: Vec<Mask>,
    /// How many windows there were, and this one.
    window: u64,
    /// By peer a nanosecond after its tick; 0 if it does not tick in the window.
    until: Vec<u64>,
    /// Peers that take their means of the same samples.
    together: Vec<usize>,
    /// States and forces before peers move, eight peers after another, if ticks are looked at.
    seen: Vec<SeenPlace<A>>,
    /// The instants of the window with their discrepancies, if they are looked at.
    distances: Vec<(Instant, f64)>,
}

/// What has come of a window.
enum Passed {
    Finite,
    /// It is shown up to the instant at which something was no finite number any more.
    Diverged,
    /// The observer has failed.
    Failed,
}

impl<'a, const A: usize> Windows<'a, A> {
    /// The scene at its beginning.
    fn new(scene: &'a Scene, (shape, law): (Shape, BuiltIn), devices: Option<&[DeviceChoice]>) -> Self {
        let members = 0..shape.peers;
        let bodies: Translations<A> = bodies_of(&[scene], &members, &[law], devices);
        let initial: Vec<Sample<A, 1>> = members.clone().map(|peer| bodies.sample(peer)).collect();
        let timetable = Timetable::new(shape.clocks.as_deref().unwrap_or_default());
        let delay = shape.delay;
        let mut arrays = Arrays::of_members([scene], shape, [law], members, bodies, &initial);
        if let Some(delay) = delay {
            arrays.samples = Samples::Broadcast(Broadcast::one_after_the_other(&initial, nanos(delay)));
        }
        Self {
            timetable,
            latest: Latest::new(initial.iter().map(|sample| sample.position.map(|[x]| x)).collect()),
            rests: Rests::default(),
            ticking: Vec::new(),
            window: 0,
            until: Vec::new(),
            together: Vec::new(),
            seen: Vec::new(),
            distances: Vec::new(),
            arrays,
        }
    }

    /// Runs it to its end; `None` if it diverged.
    fn run(mut self, mut watch: WindowWatch<'_>) -> Option<Summary> {
        let end = self.arrays.shape.end;
        let mut until_asked = MOST_INSTANTS_BETWEEN_QUESTIONS;
        // A tick hears of all others, unless a sample reaches all together.
        let work_of_a_tick = if self.arrays.shape.is_broadcast() { 1 } else { self.arrays.shape.peers };
        let mut work = 0;
        loop {
            let now = self.timetable.next_instant();
            if now >= end {
                self.arrays.change(0, end, &mut |scene| watch.change_damping(scene));
                return Some(self.end(Ending::Complete, end));
            }
            if self.arrays.changes.next_at() <= now {
                self.arrays.change(0, now, &mut |scene| watch.change_damping(scene));
            }
            self.window += u64::from(!self.timetable.is_cut());
            until_asked -= self.timetable.begin(self.arrays.changes.next_at().min(end), until_asked);
            let (latest, ticked) = (self.timetable.latest(), self.timetable.ticks().len());
            let passed = self.pass(&mut watch);
            self.timetable.end();
            match passed {
                Passed::Finite => {}
                Passed::Diverged => return None,
                Passed::Failed => return Some(self.end(Ending::Interrupted(latest), latest)),
            }
            work += ticked * work_of_a_tick;
            let is_due = until_asked == 0;
            if is_due || work >= MOST_WORK_BETWEEN_QUESTIONS {
                work = 0;
                if is_due {
                    // Windows are cut there, and only there: a run that is asked more often has the same windows.
                    until_asked = MOST_INSTANTS_BETWEEN_QUESTIONS;
                }
                if !watch.goes_on(latest) {
                    return Some(self.end(Ending::Interrupted(latest), latest));
                }
            }
        }
    }

    /// Everything that happens in a window, or in a part of it.
    fn pass(&mut self, watch: &mut WindowWatch<'_>) -> Passed {
        self.until.clear();
        self.until.resize(self.arrays.shape.peers, 0);
        self.timetable.ticks().for_each(|(peer, at, _)| self.until[peer] = at.as_nanos() + 1);
        self.send();
        self.hear();
        let Self { arrays, timetable, .. } = self;
        arrays.bodies.move_hands_each(|peer| timetable.instant(peer));
        self.seen.clear();
        if watch.wants_ticks() {
            self.seen.extend((0..arrays.shape.peers.div_ceil(WIDTH)).map(|place| arrays.bodies.seen(place, &arrays.law)));
        }
        self.measure(watch.wants_instants());
        let passed = self.advance();
        if watch.wants_instants() && self.show(watch).is_break() { Passed::Failed } else { passed }
    }

    /// Shows what happened at each instant of the window, up to the first one at which something was no finite number any more.
    fn show(&self, watch: &mut WindowWatch<'_>) -> ControlFlow<()> {
        let blocks = self.arrays.bodies.blocks();
        let mut ticks = self.timetable.ticks().peekable();
        for (instant, discrepancy) in &self.distances {
            let mut all_finite = true;
            while let Some((peer, at, _)) = ticks.next_if(|(_, at, _)| at == instant) {
                if let Some(seen) = self.seen.get(peer / WIDTH)
                    && !watch.on_tick((at, peer), seen)
                {
                    return ControlFlow::Break(());
                }
                all_finite &= blocks.is_finite(peer);
            }
            if !watch.on_instant(*instant, *discrepancy) {
                return ControlFlow::Break(());
            }
            if !all_finite {
                break;
            }
        }
        ControlFlow::Continue(())
    }

    /// Those whose time it is send, each at its own tick.
    fn send(&mut self) {
        let Self { arrays, timetable, window, .. } = self;
        let Arrays { samples, bodies, next_send, shape, senders, sent, processor, .. } = arrays;
        senders.clear();
        for (peer, at, tick) in timetable.ticks() {
            if next_send[peer] != tick {
                continue;
            }
            next_send[peer] += shape.send_every;
            match samples {
                Samples::Broadcast(samples) => samples.send(at.as_nanos(), peer, bodies),
                Samples::PerPacket(_) => {
                    senders.push(peer);
                    sent[peer] = bodies.sample(peer);
                }
            }
        }
        if let Samples::PerPacket(samples) = samples {
            let (window, first) = (*window, timetable.next_instant());
            let soon = first.saturating_add_nanos(2 * nanos(shape.tick));
            // Windows are counted from a tick of the receiver, which has one a window at most; or from this one, which may be long before it ticks at all: the
            // first of the window ticks in each window at least once in the longest span, which is shorter than two ticks.
            let next_tick = |peer: usize| match timetable.instant(peer) {
                at if timetable.ticks_now(peer) => NextTick { at, since: (window, at) },
                at if at < soon => NextTick { at, since: (window + 1, at) },
                at => NextTick { at, since: (window - 1, first) },
            };
            samples.send_in_turn((*processor, window), senders, |peer| timetable.instant(peer), sent, next_tick);
        }
    }

    /// Each takes in what has arrived by its tick.
    fn hear(&mut self) {
        let Self { arrays, timetable, window, until, together, .. } = self;
        let Arrays { samples, bodies, leads, shape, processor, .. } = &mut *arrays;
        let tick_nanos = nanos(shape.tick);
        let own_time = |tick: u64| Instant::from_nanos(tick * tick_nanos);
        let sent = |sender: usize, sequence: u64| own_time(shape.phases[sender] + sequence * shape.send_every);
        let mut lead = |peer: usize, tick: u64, has_heard: bool, all: &dyn Fn(Instant, f64) -> Lead<A>, bodies: &mut Translations<A>| {
            let Some((horizons, leads)) = leads else { return };
            let ([lead], now) = (&mut leads[peer], own_time(tick));
            if has_heard || !lead.holds_at(now) {
                *lead = all(now, horizons[0]);
            }
            for (axis, value) in lead.at(now).into_iter().enumerate() {
                bodies.blocks_mut().set_lead::<1>(axis, peer, [value]);
            }
        };
        match samples {
            Samples::Broadcast(samples) => {
                together.clear();
                for (peer, at, tick) in timetable.ticks() {
                    let is_due = samples.is_due(at.as_nanos());
                    if !together.is_empty() && (is_due || together.len() == TOGETHER) {
                        on_widest(*processor, MeansOf { peers: together, samples, bodies });
                        together.clear();
                    }
                    if is_due {
                        samples.deliver_in_turn(at.as_nanos());
                    }
                    let has_heard = samples.has_heard(peer);
                    lead(peer, tick, has_heard, &|now, horizon| Lead::of(samples.moving((peer, 0), sent), now, horizon), bodies);
                    if has_heard {
                        together.push(peer);
                    }
                }
                if !together.is_empty() {
                    on_widest(*processor, MeansOf { peers: together, samples, bodies });
                }
            }
            Samples::PerPacket(samples) => {
                let next = *window + u64::from(!timetable.is_cut());
                samples.deliver_in_turn((*window, next), |peer| until[peer]);
                for (peer, _, tick) in timetable.ticks() {
                    let has_heard = samples.has_changed(peer, 0);
                    lead(peer, tick, has_heard, &|now, horizon| Lead::of(samples.moving((peer, 0), sent), now, horizon), bodies);
                }
            }
        }
        if matches!(arrays.samples, Samples::PerPacket(_)) {
            on_widest(arrays.processor, Means::<_, A, A, 1> { samples: &mut arrays.samples, bodies: &mut arrays.bodies });
        }
    }

    /// How far copies are apart at the instants of the window.
    fn measure(&mut self, all: bool) {
        let Self { arrays, timetable, latest, distances, .. } = self;
        let blocks = arrays.bodies.blocks();
        let ticks = timetable.ticks().map(|(peer, at, _)| (peer, at, std::array::from_fn(|axis| blocks.object(axis, peer, 0).0)));
        let largest = &mut arrays.max_discrepancy[0];
        let least = (!all).then_some(*largest);
        distances.clear();
        latest.tick(ticks, timetable.resting(), least, |at, discrepancy| {
            *largest = largest.max(discrepancy);
            if all {
                distances.push((at, discrepancy));
            }
        });
    }

    /// Those that tick move to their next ticks.
    fn advance(&mut self) -> Passed {
        let Self { arrays, timetable, rests, ticking, .. } = self;
        arrays.bodies.blocks_mut().set_spans(timetable.are_long());
        let all_tick = timetable.resting().is_empty();
        if !all_tick {
            rests.keep(arrays.bodies.blocks());
        }
        let Moved { finite, .. } = arrays.bodies.advance::<1>(arrays.processor, &arrays.law);
        if !all_tick {
            timetable.write_masks(ticking);
            rests.put_back(arrays.bodies.blocks_mut(), ticking);
        }
        // Those that are put back may have moved beyond all numbers.
        if finite[0] || arrays.bodies.blocks().are_finite() { Passed::Finite } else { Passed::Diverged }
    }

    /// What came out, with all that arrived by an instant.
    fn end(mut self, ending: Ending, until: Instant) -> Summary {
        let Shape { tick, send_every, phases, clocks, .. } = &self.arrays.shape;
        let sent = |sender: usize, sequence: u64| {
            let clock = clocks.as_ref().map_or_else(|| Clock::regular(*tick), |clocks| clocks[sender]);
            clock.instant(phases[sender] + sequence * send_every).unwrap_or(Instant::MAX)
        };
        match &mut self.arrays.samples {
            Samples::Broadcast(samples) => samples.deliver_in_turn(until.as_nanos()),
            Samples::PerPacket(samples) => samples.end_in_turn(until, sent),
        }
        let (ticks, discrepancy) = (self.timetable.most_ticks(), self.arrays.max_discrepancy[0]);
        summary(&[self.arrays], 0, ticks, ending, until, discrepancy)
    }
}

/// The means of what some peers hold now.
struct MeansOf<'a, const A: usize> {
    peers: &'a [usize],
    samples: &'a mut Broadcast<A, 1>,
    bodies: &'a mut Translations<A>,
}

impl<const A: usize> NullaryFnOnce for MeansOf<'_, A> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.samples.take_means(self.peers, self.bodies);
    }
}
