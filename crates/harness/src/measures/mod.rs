//! Measures: numbers that sum a run up, computed while it runs, in one pass and constant memory. Sums are taken in the order of ticks, so a measure has the same bits
//! whatever the [`Model`].
//!
//! [`Measures`] is an [`Observer`]; a scene without measures has none, and its runs are not watched. Names, units and words stand in [`cohaptic_scene::Measure`]. Each file here is one idea that gives some
//! of them; a new one is such a file, its line in the list below, and its lines in that registry.
//!
//! ```
//! use cohaptic_harness::measures::Measures;
//! use cohaptic_harness::Model;
//! use cohaptic_scene::Scene;
//!
//! let text = r#"
//!     scene = { duration = "1s", count = 2 }
//!     object = { mass = 0.45 }
//!     coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
//!     peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
//!     link = { delay = "24ms" }
//!     measure = { names = ["age_mean_s"] }
//! "#;
//! let scene = Scene::parse(text, "two.toml".as_ref(), &[])?;
//! let (_, values) = Measures::run(&scene, Model::Least);
//! // 24 ms on the way and 0 to 7 ms held.
//! assert!((values[0].value.unwrap() - 0.0275).abs() < 1e-4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod ages;
mod discrepancy;
mod energy;
mod forces;
mod impedance;
mod quantiles;
mod settling;
mod traffic;
pub(crate) mod travel;

use std::convert::Infallible;
use std::time::Duration;

use cohaptic_scene::{Measure, MeasureName, MeasureSettings, Scene};

use crate::{HoldRow, InstantRow, Model, NoObserver, Observer, SendRow, Simulation, StepRow, Summary, TickRow};

pub use quantiles::QuantileSketch;

/// Something that is accumulated over a run, and the measures that come of it.
trait Accumulator: Sized {
    /// What it can be asked for.
    type Figure: Copy + 'static;

    /// The measures that it gives.
    const GIVES: &'static [(Measure, Self::Figure)];
    /// The rows that it takes in.
    const ROWS: Rows;

    /// Before the run.
    fn new(asked: &Asked<'_>) -> Self;

    fn on_tick(&mut self, _row: &TickRow<'_>) {}

    fn on_step(&mut self, _row: &StepRow<'_>) {}

    fn on_instant(&mut self, _row: &InstantRow) {}

    fn on_send(&mut self, _row: &SendRow) {}

    fn on_hold(&mut self, _row: &HoldRow) {}

    /// A figure, of one peer if it is one of each peer, after that much of the scene; `None` where it has no value.
    fn value(&self, figure: Self::Figure, peer: Option<usize>, elapsed: Duration) -> Option<f64>;
}

/// The measures of a scene that are asked for.
#[derive(Clone, Copy, Debug)]
struct Asked<'a> {
    scene: &'a Scene,
    names: &'a [MeasureName],
    settings: &'a MeasureSettings,
}

impl Asked<'_> {
    fn has(&self, measure: Measure) -> bool {
        self.names.iter().any(|name| name.measure == measure)
    }
}

/// Rows of an observer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Rows {
    ticks: bool,
    steps: bool,
    instants: bool,
    sends: bool,
    holds: bool,
}

impl Rows {
    const NONE: Self = Self { ticks: false, steps: false, instants: false, sends: false, holds: false };

    const fn and(self, other: Self) -> Self {
        Self {
            ticks: self.ticks || other.ticks,
            steps: self.steps || other.steps,
            instants: self.instants || other.instants,
            sends: self.sends || other.sends,
            holds: self.holds || other.holds,
        }
    }
}

/// A measure and its value.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MeasuredValue {
    /// Which measure.
    pub name: MeasureName,
    /// In the unit of the measure; `None` where it has no value, among them that of a run that diverged beyond all numbers.
    pub value: Option<f64>,
}

macro_rules! accumulators {
    ($($field:ident: $kind:ty;)+) => {
        /// The measures of one run.
        #[derive(Clone, Debug)]
        pub struct Measures {
            names: Vec<MeasureName>,
            rows: Rows,
            $($field: Option<$kind>,)+
        }

        impl Measures {
            /// Those measures of a run of the scene, before it begins.
            #[must_use]
            pub fn new(scene: &Scene, names: &[MeasureName], settings: &MeasureSettings) -> Self {
                let asked = Asked { scene, names, settings };
                let mut rows = Rows::NONE;
                $(
                    let needed = <$kind>::GIVES.iter().any(|(measure, _)| asked.has(*measure));
                    let $field = needed.then(|| {
                        rows = rows.and(<$kind>::ROWS);
                        <$kind>::new(&asked)
                    });
                )+
                Self { names: names.to_vec(), rows, $($field,)+ }
            }

            fn value(&self, name: MeasureName, elapsed: Duration) -> Option<f64> {
                $(
                    let figure = <$kind>::GIVES.iter().find(|(measure, _)| *measure == name.measure).map(|(_, figure)| *figure);
                    if let (Some(accumulator), Some(figure)) = (&self.$field, figure) {
                        return accumulator.value(figure, name.peer, elapsed);
                    }
                )+
                None
            }
        }

        impl Observer for Measures {
            type Error = Infallible;

            fn wants_ticks(&self) -> bool {
                self.rows.ticks
            }

            fn wants_steps(&self) -> bool {
                self.rows.steps
            }

            fn wants_instants(&self) -> bool {
                self.rows.instants
            }

            fn wants_sends(&self) -> bool {
                self.rows.sends
            }

            fn wants_holds(&self) -> bool {
                self.rows.holds
            }

            accumulators! { forwarded $($field: $kind;)+ => on_tick TickRow<'_>, ticks }
            accumulators! { forwarded $($field: $kind;)+ => on_step StepRow<'_>, steps }
            accumulators! { forwarded $($field: $kind;)+ => on_instant InstantRow, instants }
            accumulators! { forwarded $($field: $kind;)+ => on_send SendRow, sends }
            accumulators! { forwarded $($field: $kind;)+ => on_hold HoldRow, holds }
        }

        /// The measures that accumulators give.
        #[cfg(test)]
        fn given() -> Vec<Measure> {
            let mut given = Vec::new();
            $(given.extend(<$kind>::GIVES.iter().map(|(measure, _)| *measure));)+
            given
        }
    };
    (forwarded $($field:ident: $kind:ty;)+ => $on:ident $row:ty, $rows:ident) => {
        #[inline(always)]
        fn $on(&mut self, row: &$row) -> Result<(), Infallible> {
            $(
                if <$kind>::ROWS.$rows && let Some(accumulator) = &mut self.$field {
                    accumulator.$on(row);
                }
            )+
            Ok(())
        }
    };
}

accumulators! {
    discrepancy: discrepancy::Discrepancy;
    travel: travel::Travel;
    settling: settling::Settling;
    coordination_force: forces::CoordinationForce;
    felt_force: forces::FeltForce;
    energy: energy::Energy;
    impedance: impedance::Impedance;
    traffic: traffic::Traffic;
    ages: ages::Ages;
}

impl Measures {
    /// The measures that `[measure]` of the scene asks for; `None` if it asks for none.
    #[must_use]
    pub fn of(scene: &Scene) -> Option<Self> {
        scene.measure.as_ref().map(|measure| Self::new(scene, &measure.names, &measure.settings))
    }

    /// Runs a scene with the measures that it asks for, and gives their values; none if it asks for none.
    ///
    /// # Panics
    ///
    /// If the scene needs events and has more than 23,170 peers; see [`crate::too_large`].
    #[must_use]
    pub fn run(scene: &Scene, model: Model) -> (Summary, Vec<MeasuredValue>) {
        let simulation = Simulation::new(scene, model);
        let Some(mut measures) = Self::of(scene) else {
            let Ok(summary) = simulation.run(&mut NoObserver);
            return (summary, Vec::new());
        };
        let summary = simulation.run_measured(&mut measures);
        let values = measures.values(summary.duration);
        (summary, values)
    }

    /// The value of each measure after that much of the scene, in order; at the end of a run that is [`Summary::duration`].
    #[must_use]
    pub fn values(&self, elapsed: Duration) -> Vec<MeasuredValue> {
        let value = |name: MeasureName| self.value(name, elapsed).filter(|value| value.is_finite());
        self.names.iter().map(|name| MeasuredValue { name: *name, value: value(*name) }).collect()
    }
}

/// `None` for a mean of nothing.
#[expect(clippy::cast_precision_loss, reason = "sums of nanoseconds and counts, rounded once each")]
fn ratio(sum: u128, count: u64) -> Option<f64> {
    (count > 0).then(|| sum as f64 / count as f64)
}

/// `None` for a mean of nothing.
#[expect(clippy::cast_precision_loss, reason = "fewer rows than 2^53")]
fn mean_square_root(squares: f64, count: u64) -> Option<f64> {
    (count > 0).then(|| libm::sqrt(squares / count as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_measure_is_given_once() {
        let mut given = given();
        given.sort_unstable();
        assert_eq!(given, Measure::ALL);
    }
}
