//! Whether a scene is stable, as written and as steps have it.

use std::path::Path;
use std::time::Duration;

use cohaptic_scene::Scene;
use cohaptic_stability::{Method, Verdict, analyse};

use super::steps::Rounding;
use crate::AccuracyError;

/// Two equal peers whose clocks may be apart.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Times {
    /// The tick of both; a sample goes out every eighth.
    pub(crate) tick: Duration,
    /// By how much the second clock is late.
    pub(crate) offset: Duration,
    /// One way.
    pub(crate) delay: Duration,
}

impl Times {
    /// As a simulator has them in which every time is a number of steps. A tick takes a step at least.
    pub(crate) fn in_steps(self, step: Duration, rounding: Rounding) -> Self {
        let Self { tick, offset, delay } = self;
        let tick = rounding.span(tick, step).max(step);
        Self { tick, offset: rounding.span(offset, step), delay: rounding.span(delay, step) }
    }

    /// The scene with that coordination.
    pub(crate) fn scene(self, stiffness: f64) -> Result<Scene, AccuracyError> {
        let Self { tick, offset, delay } = self;
        let [tick, update, offset, delay] = [tick, tick * 8, offset, delay].map(|span| span.as_nanos());
        let text = format!(
            "[scene]\nduration = \"20s\"\n[object]\nmass = 0.3\n[coordination]\nstrategy = \"average-position\"\nstiffness = {stiffness:?}\ndamping = 5.0\n\
             update = \"{update}ns\"\n[peer]\ntick = \"{tick}ns\"\ndevice = {{ mass = 0.1, damping = 5.0 }}\ncoupling = {{ stiffness = 2000.0, damping = 5.0 }}\n\
             [[peers]]\nname = \"left\"\n[[peers]]\nname = \"right\"\nclock = {{ offset = \"{offset}ns\" }}\n[link]\ndelay = \"{delay}ns\"\n"
        );
        Ok(Scene::parse(&text, Path::new("time.toml"), &[])?)
    }

    /// Whether it is stable with that coordination; `None` if that cannot be told from not.
    pub(crate) fn verdict(self, stiffness: f64, method: Method) -> Result<Option<bool>, AccuracyError> {
        Ok(match analyse(&self.scene(stiffness)?, method)?.verdict() {
            Verdict::Stable => Some(true),
            Verdict::Unstable => Some(false),
            Verdict::Marginal | Verdict::Overflow => None,
        })
    }
}

/// Delays and stiffnesses that go together: `side` of each.
pub(crate) fn grid(side: u32) -> impl Iterator<Item = (Duration, f64)> {
    (0..side).flat_map(move |row| (0..side).map(move |column| (delay(row, side), stiffness(column, side))))
}

/// From 2 to 12 ms, in the middle of equal parts.
fn delay(row: u32, side: u32) -> Duration {
    Duration::from_nanos(2_000_000 + 10_000_000 * u64::from(2 * row + 1) / u64::from(2 * side))
}

/// From 300 to 4800 N/m, each the same factor above the one before.
fn stiffness(column: u32, side: u32) -> f64 {
    300.0 * libm::pow(16.0, f64::from(2 * column + 1) / f64::from(2 * side))
}
