//! Measures: numbers that summarise a run, computed during the run, in one pass and, but for smoothness and lag of motions, constant memory. Sums are added in
//! the order of ticks, so a measure has the same bits with every [`Model`].
//!
//! [`Measures`] is an [`Observer`]. A scene without measures and task has no such observer, and its runs are unwatched. [`cohaptic_scene::Measure`] has names,
//! units and descriptions. Each file of this module accumulates one quantity and gives the measures of this quantity. A new quantity is a new file, a line in
//! the list below, and lines in [`cohaptic_scene::Measure`].
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
//! let run = Measures::run(&scene, Model::Least);
//! // 24 ms on the way and 0 to 7 ms held.
//! assert!((run.values[0].value.unwrap() - 0.0275).abs() < 1e-4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod ages;
mod discrepancy;
mod energy;
mod forces;
mod impedance;
mod quantiles;
mod task;
mod traffic;
pub(crate) mod travel;

use std::convert::Infallible;
use std::time::Duration;

use cohaptic_scene::{Measure, MeasureName, MeasureSettings, Scene};
use cohaptic_units::Instant;

use crate::task::{TaskResult, TaskView, has_diverged};
use crate::{HoldRow, InstantRow, Model, NoObserver, Observer, SendRow, Simulation, StepRow, Summary, TickRow};

/// Accumulated quantity of a run, and the measures computed from this quantity.
trait Accumulator: Sized {
    /// Type that selects one of the measures.
    type Figure: Copy + 'static;

    /// Measures of this accumulator, each with its figure.
    const GIVES: &'static [(Measure, Self::Figure)];
    /// Kinds of rows that the accumulator takes.
    const ROWS: Rows;

    /// Returns whether a run has the accumulator even if none of its measures is asked for.
    fn is_needed(_scene: &Scene) -> bool {
        false
    }

    /// Returns the accumulator before the run.
    fn new(asked: &Asked<'_>) -> Self;

    fn on_tick(&mut self, _row: &TickRow<'_>) {}

    fn on_step(&mut self, _row: &StepRow<'_>) {}

    fn on_instant(&mut self, _row: &InstantRow) {}

    fn on_send(&mut self, _row: &SendRow) {}

    fn on_hold(&mut self, _row: &HoldRow) {}

    /// Returns a figure after `elapsed` of the scene, of the peer `peer` if the figure is per peer; `None` if the figure has no value.
    fn value(&self, figure: Self::Figure, peer: Option<usize>, elapsed: Duration) -> Option<f64>;
}

/// Wanted measures of a scene.
#[derive(Clone, Copy, Debug)]
struct Asked<'a> {
    scene: &'a Scene,
    /// Names of the measures.
    names: &'a [MeasureName],
    settings: &'a MeasureSettings,
}

impl Asked<'_> {
    fn has(&self, measure: Measure) -> bool {
        self.names.iter().any(|name| name.measure == measure)
    }
}

/// Kinds of rows wanted by an observer: `true` for each wanted kind.
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
    /// Name of the measure.
    pub name: MeasureName,
    /// Value in the unit of the measure. `None` if there is no value, or if the value is not finite because the run diverged.
    pub value: Option<f64>,
}

/// Results of a run with its measures.
#[derive(Clone, PartialEq, Debug)]
pub struct MeasuredRun {
    /// Results of the run.
    pub summary: Summary,
    /// Values of the measures, in the order of their names; empty if the scene measures nothing.
    pub values: Vec<MeasuredValue>,
    /// Result of the task; `None` for a scene without a task.
    pub task: Option<TaskResult>,
}

macro_rules! accumulators {
    ($($field:ident: $kind:ty;)+) => {
        /// Measures of one run.
        #[derive(Clone, Debug)]
        pub struct Measures {
            names: Vec<MeasureName>,
            rows: Rows,
            $($field: Option<$kind>,)+
        }

        impl Measures {
            /// Returns measures of a run of the scene, before the run.
            #[must_use]
            pub(crate) fn new(scene: &Scene, names: &[MeasureName], settings: &MeasureSettings) -> Self {
                let asked = Asked { scene, names, settings };
                let mut rows = Rows::NONE;
                $(
                    // Only accumulators of an asked measure exist, and the judge of a task, so a run computes nothing else.
                    let needed = <$kind>::is_needed(scene) || <$kind>::GIVES.iter().any(|(measure, _)| asked.has(*measure));
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

        /// Returns the measures of all accumulators.
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
                // The constant removes the call at compile time for accumulators without this kind of row.
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
    settling: discrepancy::Settling;
    coordination_force: forces::CoordinationForce;
    felt_force: forces::FeltForce;
    energy: energy::Energy;
    impedance: impedance::Impedance;
    traffic: traffic::Traffic;
    ages: ages::Ages;
    task: task::TaskMeasures;
}

impl Measures {
    /// Returns the measures in `[measure]` of the scene, with a judge if the scene has a `[task]`; `None` if the scene has neither.
    #[must_use]
    pub fn of(scene: &Scene) -> Option<Self> {
        let names = scene.measure.as_ref().map_or(&[][..], |measure| &measure.names);
        (scene.measure.is_some() || scene.task.is_some()).then(|| Self::new(scene, names, &scene.measure_settings()))
    }

    /// Runs a scene with its measures and with a judge of its task.
    ///
    /// # Panics
    ///
    /// If the scene needs events and has more than 23,170 peers; see [`crate::too_large`].
    #[must_use]
    pub fn run(scene: &Scene, model: Model) -> MeasuredRun {
        let simulation = Simulation::new(scene, model);
        let Some(mut measures) = Self::of(scene) else {
            let Ok(summary) = simulation.run(&mut NoObserver);
            return MeasuredRun { summary, values: Vec::new(), task: None };
        };
        // Rows are many and cheap for measures, so a dynamic call for each row would be a good part of the run.
        let Ok(summary) = simulation.run_compiled(&mut measures);
        let (values, task) = (measures.values(summary.duration), measures.task(&summary));
        MeasuredRun { summary, values, task }
    }

    /// Returns the value of each measure after `elapsed` of the scene, in the order of the names. At the end of a run `elapsed` is [`Summary::duration`].
    #[must_use]
    pub fn values(&self, elapsed: Duration) -> Vec<MeasuredValue> {
        // Overflowed values have no meaning and are left out.
        let value = |name: MeasureName| self.value(name, elapsed).filter(|value| value.is_finite());
        self.names.iter().map(|name| MeasuredValue { name: *name, value: value(*name) }).collect()
    }

    /// Returns the result of the task after the run with this summary; `None` for a scene without a task.
    #[must_use]
    pub fn task(&self, summary: &Summary) -> Option<TaskResult> {
        self.task.as_ref()?.result(has_diverged(summary), summary.duration)
    }

    /// Returns what there is to see of the task at an instant of a run that goes on; `None` for a scene without a task.
    #[must_use]
    pub fn task_view(&self, at: Instant) -> Option<TaskView> {
        self.task.as_ref()?.view(at)
    }
}

/// Returns the mean `sum / count`; `None` if `count` is 0.
#[expect(clippy::cast_precision_loss, reason = "sums of nanoseconds and counts, rounded once each")]
fn ratio(sum: u128, count: u64) -> Option<f64> {
    (count > 0).then(|| sum as f64 / count as f64)
}

/// Returns the root of the mean square; `None` if `count` is 0.
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
