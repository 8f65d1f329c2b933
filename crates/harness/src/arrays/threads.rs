//! One run on several threads, to the same bits as on one.
//!
//! Each thread has some of the peers: it moves them, and has the links to them with the samples in flight. Peers act on each other by their
//! samples alone, so threads meet only at ticks at which some peer sends, and exchange the samples. Fates of packets have addresses, so any thread may
//! draw them.

mod barrier;

use std::ops::{ControlFlow, Range};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use self::barrier::Barrier;
use super::bodies::Bodies;
use super::lanes::{larger, smaller};
use super::run_watch::Unwatched;
use super::samples::Sample;
use super::shape::Shape;
use super::{Arrays, Others, Samples, bodies_of, is_asked_before, nanos, summary};
use crate::summary::{Ending, Summary};

/// Peers a thread at least: for fewer the threads wait for each other longer than they work.
const PEERS_A_THREAD: usize = 8;

/// How many threads pay for a scene of that shape at most, and why no more.
pub(super) fn that_pay(shape: &Shape) -> (usize, &'static str) {
    if shape.delay.is_some() {
        (1, "all samples travel together: a tick takes less time than threads take to meet")
    } else if shape.has_windows() {
        (1, "peers tick at instants of their own: threads would meet in each window")
    } else if shape.is_carried() {
        (1, "packets of several peers pass one access line, or links know their fates only as time goes")
    } else if shape.turns.is_some() {
        (1, "the object turns: how far copies are turned apart is a matter of all of them")
    } else {
        ((shape.peers / PEERS_A_THREAD).max(1), "eight peers a thread; threads meet where samples are sent, and the number of threads changes no bit")
    }
}

/// The words that threads exchange.
struct Exchange<const P: usize> {
    /// The words of each thread, in turns: an early thread tells the next while others still read the last.
    told: [Vec<Mutex<Told<P>>>; 2],
    barrier: Barrier,
    goes_on: AtomicBool,
}

/// The words of a thread at a tick.
struct Told<const P: usize> {
    samples: Vec<(usize, Sample<P, 1>)>,
    /// The least and the greatest position of its copies along each axis, at each tick since it last told.
    extremes: Vec<(f64, f64)>,
    is_finite: bool,
}

/// A thread's side of the exchange.
struct Thread<'e, const P: usize> {
    exchange: &'e Exchange<P>,
    place: usize,
    members: Range<usize>,
    turn: usize,
    extremes: Vec<(f64, f64)>,
    /// Those of all threads at a meeting.
    extremes_of_all: Vec<(f64, f64)>,
    is_finite: bool,
    /// As far as all have told.
    all_are_finite: bool,
    max_discrepancy: f64,
}

impl<const P: usize> Exchange<P> {
    fn new(threads: usize) -> Self {
        let told = || (0..threads).map(|_| Mutex::new(Told { samples: Vec::new(), extremes: Vec::new(), is_finite: true })).collect();
        Self { told: [told(), told()], barrier: Barrier::new(threads), goes_on: AtomicBool::new(true) }
    }
}

impl<const P: usize> Others<P, 1> for Thread<'_, P> {
    fn exchange(&mut self, senders: &[usize], sent: &mut [Sample<P, 1>]) {
        let told = &self.exchange.told[self.turn];
        self.turn = 1 - self.turn;
        {
            let mut own = told[self.place].lock().unwrap_or_else(PoisonError::into_inner);
            own.samples.clear();
            own.samples.extend(senders.iter().filter(|sender| self.members.contains(sender)).map(|sender| (*sender, sent[*sender])));
            // They change places, so that neither is allocated again.
            own.extremes.clear();
            std::mem::swap(&mut own.extremes, &mut self.extremes);
            own.is_finite = self.is_finite;
        }
        self.exchange.barrier.wait();
        self.extremes_of_all.clear();
        for told in told {
            let told = told.lock().unwrap_or_else(PoisonError::into_inner);
            for (sender, sample) in &told.samples {
                sent[*sender] = *sample;
            }
            self.extremes_of_all.resize(told.extremes.len(), (f64::INFINITY, f64::NEG_INFINITY));
            for ((low, high), told) in self.extremes_of_all.iter_mut().zip(&told.extremes) {
                (*low, *high) = (smaller(told.0, *low), larger(told.1, *high));
            }
            self.all_are_finite &= told.is_finite;
        }
        self.max_discrepancy = self.extremes_of_all.iter().fold(self.max_discrepancy, |largest, (low, high)| largest.max(high - low));
    }
}

/// A run of a scene on that number of threads, to its end; `None` if it diverged, which is known later than it happens.
pub(super) fn run<B: Bodies<A, P> + Send, const A: usize, const P: usize>(
    scene: &Scene,
    shape: &Shape,
    law: BuiltIn,
    threads: usize,
    keep_going: &mut dyn FnMut(Instant) -> bool,
) -> Option<Summary> {
    let members: Vec<Range<usize>> = (0..threads).map(|place| place * shape.peers / threads..(place + 1) * shape.peers / threads).collect();
    let bodies: Vec<B> = members.iter().map(|members| bodies_of::<B, A, P, 1>(&[scene], members, &[law], None)).collect();
    let initial: Vec<Sample<P, 1>> =
        bodies.iter().zip(&members).flat_map(|(bodies, members)| (0..members.len()).map(|peer| bodies.sample(peer))).collect();
    let exchange = Exchange::new(threads);
    let part = |place: usize, bodies: B, keep_going: Option<&mut dyn FnMut(Instant) -> bool>| {
        let _broken_if_panicking = exchange.barrier.guard();
        let members = members[place].clone();
        let thread = Thread {
            exchange: &exchange,
            place,
            members: members.clone(),
            turn: 0,
            extremes: Vec::new(),
            extremes_of_all: Vec::new(),
            is_finite: true,
            all_are_finite: true,
            max_discrepancy: 0.0,
        };
        let arrays = Arrays::of_members([scene], shape.clone(), [law], members, bodies, &initial);
        Part { arrays, thread, keep_going }.run()
    };
    let ended: Vec<Option<Ended<'_, B, A, P>>> = std::thread::scope(|scope| {
        let mut bodies = bodies.into_iter();
        let first = bodies.next()?;
        let part = &part;
        let others: Vec<_> = bodies.enumerate().map(|(place, bodies)| scope.spawn(move || part(place + 1, bodies, None))).collect();
        let first = part(0, first, Some(keep_going));
        let others = others.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        Some(std::iter::once(first).chain(others).collect())
    })?;
    let ended: Vec<Ended<'_, B, A, P>> = ended.into_iter().collect::<Option<_>>()?;
    let Ended { ending, ticks, until, max_discrepancy, .. } = ended[0];
    let parts: Vec<_> = ended.into_iter().map(|ended| ended.part).collect();
    Some(summary(&parts, 0, ticks, ending, until, max_discrepancy))
}

/// The peers of a thread at the end of the run.
struct Ended<'a, B, const A: usize, const P: usize> {
    part: Arrays<'a, B, A, P, 1>,
    ending: Ending,
    ticks: u64,
    /// Until when packets were delivered.
    until: Instant,
    max_discrepancy: f64,
}

/// The run of a thread.
struct Part<'a, 'e, 'k, B, const A: usize, const P: usize> {
    arrays: Arrays<'a, B, A, P, 1>,
    thread: Thread<'e, P>,
    keep_going: Option<&'k mut dyn FnMut(Instant) -> bool>,
}

/// Why the run of a thread ends early.
enum Early {
    Diverged,
    /// After that number of ticks.
    Interrupted(u64),
}

impl<'a, B: Bodies<A, P>, const A: usize, const P: usize> Part<'a, '_, '_, B, A, P> {
    fn run(mut self) -> Option<Ended<'a, B, A, P>> {
        let (mut tick, last) = (0, self.arrays.shape.tick_at(self.arrays.shape.end));
        let nobody = &mut Unwatched(&mut |_| true);
        let (ending, ticks) = loop {
            let until = self.arrays.next_change().min(last);
            match self.run_over(tick..until) {
                ControlFlow::Break(Early::Diverged) => return None,
                ControlFlow::Break(Early::Interrupted(ticks)) => break (Ending::Interrupted(self.arrays.shape.before(ticks).1), ticks),
                ControlFlow::Continue(()) => tick = until,
            }
            let now = self.arrays.shape.instant(tick).min(self.arrays.shape.end);
            self.arrays.change(tick, now, nobody);
            if tick == last {
                break (Ending::Complete, tick);
            }
        };
        let Self { mut arrays, mut thread, .. } = self;
        if ending == Ending::Complete
            && let Samples::PerPacket(samples) = &mut arrays.samples
        {
            samples.finish(arrays.shape.before(ticks));
        }
        thread.exchange(&[], &mut arrays.sent);
        if !thread.all_are_finite {
            return None;
        }
        let until = arrays.stop(0, ticks, ending);
        Some(Ended { part: arrays, ending, ticks, until, max_discrepancy: thread.max_discrepancy })
    }

    fn run_over(&mut self, ticks: Range<u64>) -> ControlFlow<Early> {
        let tick_nanos = nanos(self.arrays.shape.tick);
        for tick in ticks {
            if !self.thread.all_are_finite {
                return ControlFlow::Break(Early::Diverged);
            }
            let now = Instant::from_nanos(tick * tick_nanos);
            self.thread.extremes.extend(self.arrays.bodies.blocks().extremes());
            self.arrays.step(tick, now, (&mut self.thread, &mut Unwatched(&mut |_| true)));
            self.thread.is_finite &= self.arrays.finite[0];
            if is_asked_before(tick + 1) && !self.goes_on(now) {
                return ControlFlow::Break(Early::Interrupted(tick + 1));
            }
        }
        ControlFlow::Continue(())
    }

    /// Whether the run goes on after that instant: the first thread asks the observer.
    fn goes_on(&mut self, before: Instant) -> bool {
        let Exchange { barrier, goes_on, .. } = self.thread.exchange;
        if let Some(keep_going) = &mut self.keep_going {
            goes_on.store(keep_going(before), Ordering::Relaxed);
        }
        barrier.wait();
        let wanted = goes_on.load(Ordering::Relaxed);
        // The next answer may be given once all have this one.
        barrier.wait();
        wanted
    }
}
