//! A link by the wall clock, and the ways to wait for its packets.

use std::io;
use std::time::Duration;

use cohaptic_realtime::{Clock as _, Lateness, MonotonicClock, Pacer, Pacing, Wishes, prepare_thread};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Delay, Distribution, Jitter, Link, LinkConfig, LinkName};

use crate::cost::processor_time;

/// How to wait for a packet's time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Way {
    /// Look every millisecond, as a timer wheel does.
    Wheel,
    /// `std::thread::sleep` for the rest.
    Sleep,
    /// `clock_nanosleep` until then.
    Until,
    /// What the relay and live sessions do.
    Paced(Pacing),
    /// Look at the clock, and do nothing else.
    Busy,
}

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

/// What became of the packets that were waited for in one way.
#[derive(Debug)]
pub(super) struct Releases {
    pub(super) way: Way,
    /// Of each packet that left.
    pub(super) lateness: Lateness,
    /// What the thread that released them used.
    pub(super) processor: Duration,
    /// Learns from turn to turn.
    pacer: Pacer,
}

/// Packets under way. Each that leaves comes back, so that about one leaves in a millisecond.
const UNDER_WAY: u32 = 24;

impl Releases {
    pub(super) fn new(way: Way) -> Self {
        let pacing = match way {
            Way::Paced(pacing) => pacing,
            Way::Wheel | Way::Sleep | Way::Until | Way::Busy => Pacing::Sleep,
        };
        Self { way, lateness: Lateness::new(), processor: Duration::ZERO, pacer: Pacer::new(pacing) }
    }

    /// Releases packets for that long, on a thread of its own, whose timer slack goes with it.
    pub(super) fn turn(&mut self, seed: u64, span: Duration) -> io::Result<()> {
        let done = std::thread::scope(|scope| scope.spawn(|| self.release(seed, span)).join());
        done.unwrap_or_else(|_| Err(io::Error::other("the thread that released packets panicked")))
    }

    fn release(&mut self, seed: u64, span: Duration) -> io::Result<()> {
        // No timer slack, which the system always grants; a refusal would be seen in the numbers.
        let _ = prepare_thread(&Wishes::NONE);
        let mut link = link(seed);
        let started = processor_time();
        let clock = MonotonicClock::start();
        for packet in 0..UNDER_WAY {
            offer(&mut link, Instant::ZERO, packet);
        }
        while let Some(at) = link.poll_timeout().filter(|at| *at <= Instant::ZERO + span) {
            self.wait(&clock, at)?;
            // The link is told the instant that was due, and not the one at which somebody woke up.
            link.handle_timeout(at).expect("time goes on");
            while let Some(event) = link.poll_event() {
                self.lateness.record(clock.now().saturating_duration_since(event.at));
                offer(&mut link, at, event.payload);
            }
        }
        self.processor += processor_time() - started;
        Ok(())
    }

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

/// Sleeps until then. A signal may wake it earlier: then it sleeps again.
fn sleep_until(clock: &MonotonicClock, at: Instant) -> io::Result<()> {
    while clock.now() < at {
        clock.block(Some(at), &[])?;
    }
    Ok(())
}

fn link(seed: u64) -> Link<u32> {
    // From 7 to 41 ms, so that packets spread over time whatever they began with.
    let jitter = Jitter::new(Duration::from_millis(10), Distribution::Uniform);
    let delay = Delay::with_jitter(Duration::from_millis(24), jitter).expect("a law above zero");
    Link::new(seed, &LinkName::between("left", "right"), LinkConfig { delay, ..LinkConfig::default() })
}

fn offer(link: &mut Link<u32>, at: Instant, packet: u32) {
    link.handle_packet(at, Bytes::new(64), packet).expect("time goes on");
}
