//! A link in real time, and the ways to wait for its packets.

use std::io;
use std::time::Duration;

use cohaptic_realtime::{Clock as _, Lateness, MonotonicClock, Pacer, Pacing, Wishes, prepare_thread};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Delay, Distribution, Jitter, Link, LinkConfig, LinkName};

use crate::cost::processor_time;

/// A way to wait for the instant of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Way {
    /// Sleep until the next whole millisecond, as a timer wheel does.
    Wheel,
    /// `std::thread::sleep` for the remaining span.
    Sleep,
    /// `clock_nanosleep` until the instant.
    Until,
    /// The pacer of the relay and of live sessions.
    Paced(Pacing),
    /// A loop that reads the clock.
    Busy,
}

/// Returns the pacer that spins for the last `micros` microseconds.
const fn spin(micros: u64) -> Way {
    Way::Paced(Pacing::Spin { margin: Duration::from_micros(micros) })
}

impl Way {
    pub(super) const ALL: [Self; 9] =
        [Self::Wheel, Self::Sleep, Self::Until, Self::Paced(Pacing::Sleep), spin(30), spin(60), spin(120), spin(250), Self::Busy];

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Wheel => "timer wheel",
            Self::Sleep => "thread::sleep",
            Self::Until => "clock_nanosleep",
            Self::Paced(Pacing::Sleep) => "pacer, sleeping",
            Self::Paced(Pacing::Spin { .. }) => "pacer, spinning",
            Self::Busy => "busy",
        }
    }

    pub(super) fn setting(self) -> String {
        match self {
            Self::Wheel => "1 ms".to_owned(),
            Self::Paced(Pacing::Spin { margin }) => format!("{} µs", margin.as_micros()),
            Self::Sleep | Self::Until | Self::Paced(Pacing::Sleep) | Self::Busy => String::new(),
        }
    }

    pub(super) const fn words(self) -> &'static str {
        match self {
            Self::Wheel => "wakes at whole milliseconds, as tokio's timers and many event loops do",
            Self::Sleep => "sleeps for the rest, which it computes before",
            Self::Until => "sleeps until an instant, so that computing it costs nothing",
            Self::Paced(Pacing::Sleep) => "asks to be woken as much earlier as it is usually late",
            Self::Paced(Pacing::Spin { .. }) => "is woken that much earlier and looks at the clock for the rest",
            Self::Busy => "keeps a core for itself",
        }
    }
}

/// Results of one way.
#[derive(Debug)]
pub(super) struct Releases {
    pub(super) way: Way,
    /// Lateness of the released packets.
    pub(super) lateness: Lateness,
    /// Processor time of the releasing threads.
    pub(super) processor: Duration,
    /// Pacer, which learns from turn to turn.
    pacer: Pacer,
}

/// Number of packets on the link. Each released packet is offered again, so about one packet leaves per millisecond.
const UNDER_WAY: u32 = 24;

impl Releases {
    pub(super) fn new(way: Way) -> Self {
        // Ways without a pacer get an unused pacer.
        let pacing = match way {
            Way::Paced(pacing) => pacing,
            Way::Wheel | Way::Sleep | Way::Until | Way::Busy => Pacing::Sleep,
        };
        Self { way, lateness: Lateness::new(), processor: Duration::ZERO, pacer: Pacer::new(pacing) }
    }

    /// Releases packets for `span` in a thread of its own, so that the changed timer slack ends with the thread.
    pub(super) fn turn(&mut self, seed: u64, span: Duration) -> io::Result<()> {
        let done = std::thread::scope(|scope| scope.spawn(|| self.release(seed, span)).join());
        done.unwrap_or_else(|_| Err(io::Error::other("the thread that released packets panicked")))
    }

    /// Releases packets for `span` in this thread.
    fn release(&mut self, seed: u64, span: Duration) -> io::Result<()> {
        // The thread asks for no timer slack, which the system always grants. A refusal would show in the numbers.
        let _ = prepare_thread(&Wishes::NONE);
        let mut link = link(seed);
        let started = processor_time();
        let clock = MonotonicClock::start();
        for packet in 0..UNDER_WAY {
            offer(&mut link, Instant::ZERO, packet);
        }
        while let Some(at) = link.poll_timeout().filter(|at| *at <= Instant::ZERO + span) {
            self.wait(&clock, at)?;
            // The link gets the due instant and not the instant of the wake-up, so that all ways release the same packets.
            link.handle_timeout(at).expect("time goes on");
            while let Some(event) = link.poll_event() {
                self.lateness.record(clock.now().saturating_duration_since(event.at));
                offer(&mut link, at, event.payload);
            }
        }
        self.processor += processor_time() - started;
        Ok(())
    }

    /// Waits until `at` by this way.
    fn wait(&mut self, clock: &MonotonicClock, at: Instant) -> io::Result<()> {
        const WHEEL: u64 = 1_000_000;
        match self.way {
            Way::Wheel => sleep_until(clock, Instant::from_nanos(at.as_nanos().div_ceil(WHEEL) * WHEEL)),
            Way::Sleep => {
                std::thread::sleep(at.saturating_duration_since(clock.now()));
                Ok(())
            }
            Way::Until => sleep_until(clock, at),
            Way::Paced(_) => {
                while clock.now() < at {
                    self.pacer.wait(clock, Some(at), &[])?;
                }
                Ok(())
            }
            Way::Busy => {
                while clock.now() < at {
                    std::hint::spin_loop();
                }
                Ok(())
            }
        }
    }
}

/// Sleeps until `at`, and sleeps again after an early wake-up by a signal.
fn sleep_until(clock: &MonotonicClock, at: Instant) -> io::Result<()> {
    while clock.now() < at {
        clock.block(Some(at), &[])?;
    }
    Ok(())
}

/// Returns a link with jitter.
fn link(seed: u64) -> Link<u32> {
    // Delays from 7 to 41 ms spread the packets over time, whatever their first instants were.
    let jitter = Jitter::new(Duration::from_millis(10), Distribution::Uniform);
    let delay = Delay::with_jitter(Duration::from_millis(24), jitter).expect("a law above zero");
    Link::new(seed, &LinkName::between("left", "right"), LinkConfig { delay, ..LinkConfig::default() })
}

fn offer(link: &mut Link<u32>, at: Instant, packet: u32) {
    link.handle_packet(at, Bytes::new(64), packet).expect("time goes on");
}
