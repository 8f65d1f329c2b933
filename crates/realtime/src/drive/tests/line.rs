//! Line with an artificial clock, which logs the calls of the loop.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::fs::File;
use std::os::fd::AsFd as _;
use std::rc::Rc;

use super::super::*;
use super::MILLI;

/// Artificial clock and arrivals. The clock moves by a step at each reading, and by waiting.
pub(super) struct World {
    pub(super) now: Cell<u64>,
    pub(super) step: u64,
    /// Lateness of each wake-up \[ns\].
    pub(super) late: u64,
    /// Instants of the arrivals still to come \[ns\].
    pub(super) coming: RefCell<VecDeque<u64>>,
    /// End of each wait \[ns\], and whether an arrival could end the wait.
    pub(super) slept: RefCell<Vec<(u64, bool)>>,
}

impl Clock for Rc<World> {
    fn now(&self) -> Instant {
        self.now.set(self.now.get() + self.step);
        Instant::from_nanos(self.now.get())
    }

    fn block(&self, until: Option<Instant>, readable: &[BorrowedFd<'_>]) -> io::Result<bool> {
        let until = until.map_or(u64::MAX, Instant::as_nanos);
        self.slept.borrow_mut().push((until, !readable.is_empty()));
        let first = self.coming.borrow().front().copied().filter(|first| *first <= until && !readable.is_empty());
        self.now.set(self.now.get().max(first.unwrap_or(until)) + self.late);
        Ok(first.is_some())
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Did {
    Read(usize),
    Told(u64),
    Sent(u64),
}

/// Line with a delay of 5 ms. `AHEAD` is in nanoseconds; 0 stands for `None`.
pub(super) struct Line<const AHEAD: u64, const RESTS: bool> {
    pub(super) world: Rc<World>,
    pub(super) socket: File,
    /// Packets in one reading, at most.
    pub(super) batch: usize,
    /// Packets made ready by one call, at most.
    pub(super) ready_at_once: usize,
    pub(super) under_way: VecDeque<u64>,
    pub(super) ready: u64,
    pub(super) over_after: u64,
    pub(super) sent: u64,
    /// Calls of the loop with their instants \[ns\].
    pub(super) log: Vec<(u64, Did)>,
}

impl<const AHEAD: u64, const RESTS: bool> Line<AHEAD, RESTS> {
    pub(super) fn new(step: u64, late: u64, coming: impl IntoIterator<Item = u64>) -> Self {
        let (now, coming, slept) = (Cell::new(0), RefCell::new(coming.into_iter().collect()), RefCell::default());
        let (socket, under_way, log) = (File::open("/dev/null").unwrap(), VecDeque::new(), Vec::new());
        let world = Rc::new(World { now, step, late, coming, slept });
        Self { world, socket, batch: 64, ready_at_once: 64, under_way, ready: 0, over_after: u64::MAX, sent: 0, log }
    }

    pub(super) fn run(&mut self, pacing: Pacing, end: u64) {
        let schedule = Schedule { pacing, end: Some(Instant::from_nanos(end)), look_every: Duration::from_secs(1) };
        drive(self, &schedule, |_, _| ControlFlow::Continue(())).unwrap();
    }

    pub(super) fn when(&self, which: impl Fn(Did) -> bool) -> Vec<u64> {
        self.log.iter().filter(|(_, did)| which(*did)).map(|(at, _)| *at).collect()
    }

    pub(super) fn departures(&self) -> Vec<u64> {
        self.when(|did| matches!(did, Did::Sent(_)))
    }

    fn note(&mut self, did: Did) {
        self.log.push((self.world.now.get(), did));
    }
}

impl<const AHEAD: u64, const RESTS: bool> Driven for Line<AHEAD, RESTS> {
    type Clock = Rc<World>;
    type Error = io::Error;
    const AHEAD: Option<Duration> = if AHEAD > 0 { Some(Duration::from_nanos(AHEAD)) } else { None };
    const RESTS: bool = RESTS;

    fn clock(&self) -> &Rc<World> {
        &self.world
    }

    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>> {
        [self.socket.as_fd()]
    }

    fn receive(&mut self, now: Instant) -> io::Result<Received> {
        let mut coming = self.world.coming.borrow_mut();
        let (mut count, mut last) = (0, now.as_nanos());
        while count < self.batch && coming.front().is_some_and(|at| *at <= now.as_nanos()) {
            last = coming.pop_front().unwrap();
            self.under_way.push_back(last + 5 * MILLI);
            count += 1;
        }
        drop(coming);
        self.note(Did::Read(count));
        // A full reading may have left later packets unread.
        Ok(Received { count, until: if count == self.batch { Instant::from_nanos(last) } else { now } })
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.under_way.front().copied().map(Instant::from_nanos)
    }

    fn handle_timeout(&mut self, now: Instant) -> bool {
        self.note(Did::Told(now.as_nanos()));
        let due = self.under_way.iter().take_while(|due| **due <= now.as_nanos()).count();
        self.ready += self.under_way.drain(..due.min(self.ready_at_once)).count() as u64;
        due > self.ready_at_once
    }

    fn send(&mut self) -> u64 {
        let count = std::mem::take(&mut self.ready);
        if count > 0 {
            self.note(Did::Sent(count));
        }
        self.sent += count;
        count
    }

    fn is_over(&self) -> bool {
        self.sent >= self.over_after
    }
}
