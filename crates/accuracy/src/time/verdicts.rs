//! Stability of a scene, as written and in steps.

use std::path::Path;
use std::time::Duration;

use cohaptic_scene::Scene;
use cohaptic_stability::{Method, Verdict, analyse};

use super::steps::Rounding;
use crate::AccuracyError;

/// Times of two equal peers, whose clocks may differ by an offset.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Times {
    /// Period of the ticks of both peers. A sample is sent every eighth tick.
    pub(crate) tick: Duration,
    /// Offset of the second clock.
    pub(crate) offset: Duration,
    /// Delay of both links.
    pub(crate) delay: Duration,
}

impl Times {
    /// Returns the times of a simulator in which every time is a number of steps. A tick has at least one step.
    pub(crate) fn in_steps(self, step: Duration, rounding: Rounding) -> Self {
        let Self { tick, offset, delay } = self;
        let tick = rounding.span(tick, step).max(step);
        Self { tick, offset: rounding.span(offset, step), delay: rounding.span(delay, step) }
    }

    /// Returns the scene with the coordination stiffness `stiffness` \[N/m\].
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

    /// Returns whether the scene is stable with this stiffness; `None` if stable and unstable cannot be told apart.
    pub(crate) fn verdict(self, stiffness: f64, method: Method) -> Result<Option<bool>, AccuracyError> {
        Ok(match analyse(&self.scene(stiffness)?, method)?.verdict() {
            Verdict::Stable => Some(true),
            Verdict::Unstable => Some(false),
            Verdict::Marginal | Verdict::Overflow => None,
        })
    }
}

/// Returns all pairs of `side` delays and `side` stiffnesses.
pub(crate) fn grid(side: u32) -> impl Iterator<Item = (Duration, f64)> {
    (0..side).flat_map(move |row| (0..side).map(move |column| (delay(row, side), stiffness(column, side))))
}

/// Returns a delay from 2 to 12 ms, in the middle of one of `side` equal parts.
fn delay(row: u32, side: u32) -> Duration {
    Duration::from_nanos(2_000_000 + 10_000_000 * u64::from(2 * row + 1) / u64::from(2 * side))
}

/// Returns a stiffness from 300 to 4800 N/m, with a constant ratio between neighbours.
fn stiffness(column: u32, side: u32) -> f64 {
    300.0 * libm::pow(16.0, f64::from(2 * column + 1) / f64::from(2 * side))
}
