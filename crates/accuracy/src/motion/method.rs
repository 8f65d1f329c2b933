//! Methods of motion that are compared.

use std::time::Duration;

use cohaptic_peer::{Integrator, Motion, StepMap};

use super::advance::{Euler, Program, RungeKutta, Stepped};
use super::scenes::TICK;
use super::world::{Pair, World, run};
use crate::Options;

/// A method of motion from tick to tick.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Method {
    /// The program's matrix exponential, as one map per tick.
    Exact,
    /// Semi-implicit Euler, with this number of steps per tick.
    Euler(u32),
    /// The Runge–Kutta method, with this number of steps per tick.
    RungeKutta(u32),
    /// The steps of semi-implicit Euler, multiplied into one map in advance: the program's `integrator = "semi-implicit-euler"`.
    EulerMap(u32),
    /// The steps of Runge–Kutta, multiplied into one map in advance: the program's `integrator = "rk4"`.
    RungeKuttaMap(u32),
}

impl Method {
    /// Returns all compared methods.
    pub(crate) fn all(options: Options) -> Vec<Self> {
        let steps: &[u32] = if options.quick { &[1, 4, 16, 64] } else { &[1, 2, 4, 8, 16, 32, 64] };
        let ways: [fn(u32) -> Self; 4] = [Self::Euler, Self::RungeKutta, Self::EulerMap, Self::RungeKuttaMap];
        std::iter::once(Self::Exact).chain(ways.into_iter().flat_map(|way| steps.iter().map(move |steps| way(*steps)))).collect()
    }

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact propagator",
            Self::Euler(_) => "semi-implicit Euler, stepped",
            Self::RungeKutta(_) => "RK4, stepped",
            Self::EulerMap(_) => "semi-implicit Euler, one map",
            Self::RungeKuttaMap(_) => "RK4, one map",
        }
    }

    /// Returns the number of steps per tick in words.
    pub(crate) fn setting(self) -> String {
        match self {
            Self::Exact => String::new(),
            Self::Euler(steps) | Self::RungeKutta(steps) | Self::EulerMap(steps) | Self::RungeKuttaMap(steps) => {
                let plural = if steps == 1 { "" } else { "s" };
                format!("{steps} step{plural} a tick")
            }
        }
    }

    /// Returns the integrator of the program whose map does the same in one multiplication, except for rounding.
    pub(crate) const fn integrator(self) -> Integrator {
        match self {
            Self::Exact => Integrator::Exact,
            Self::Euler(steps) | Self::EulerMap(steps) => Integrator::SemiImplicitEuler { steps },
            Self::RungeKutta(steps) | Self::RungeKuttaMap(steps) => Integrator::RungeKutta4 { steps },
        }
    }

    /// Returns the program's maps of a tick.
    pub(crate) fn maps(self, pair: &Pair) -> [StepMap; 4] {
        pair.plants.map(|plant| plant.step(Duration::from_millis(1), self.integrator()))
    }

    /// Runs the loop with this method.
    pub(crate) fn run(self, pair: &Pair, show: impl FnMut(usize, &[Motion; 4])) -> World<f64> {
        let stepped = |steps| pair.plants.map(|plant| Stepped::new(&plant, TICK, steps));
        match self {
            // Maps of all integrators cost the same per tick; only loops over sub-steps cost more with more steps.
            Self::Exact | Self::EulerMap(_) | Self::RungeKuttaMap(_) => run(pair, &self.maps(pair).map(Program::new), show),
            Self::Euler(steps) => run(pair, &stepped(steps).map(Euler), show),
            Self::RungeKutta(steps) => run(pair, &stepped(steps).map(RungeKutta), show),
        }
    }
}
