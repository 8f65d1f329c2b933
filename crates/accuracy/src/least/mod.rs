//! The least model against the general one: what each thing that a scene can need costs, and that the answer is the same to the bit.
//!
//! The base scene has three peers, a constant delay, and nothing else; each other scene has exactly one thing more. Base and variant take turns,
//! so that noise hits both. The error is the largest difference between an object's positions under [`Model::Least`] and under [`Model::General`], which
//! simulates all that the program has whether the scene needs it or not: it must be zero.

mod csv;
mod positions;
mod scenes;

use std::convert::Infallible;
use std::hint::black_box;
use std::time::Duration;

use cohaptic_harness::{Model, NoObserver, Observer, PacketRow, Simulation};
use cohaptic_scene::Scene;

use self::csv::CsvSink;
use self::scenes::{Recorded, Variant};
use crate::cost::{Rounds, Work, nanos};
use crate::row::RowSink;
use crate::{AccuracyError, Row, Subject, Watch};

/// How much work there is in the rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Effort {
    /// Simulated time of a run \[ms\].
    pub simulated_millis: u64,
    /// In how many rounds costs are measured.
    pub rounds: usize,
    /// A round of one scene takes about so long \[ms\].
    pub round_millis: u64,
}

impl Effort {
    /// Seconds.
    pub const QUICK: Self = Self { simulated_millis: 1000, rounds: 15, round_millis: 4 };

    /// Half a minute.
    pub const FULL: Self = Self { simulated_millis: 5000, rounds: 41, round_millis: 10 };
}

/// The rows of this subject.
///
/// # Errors
///
/// As [`crate::measure`].
pub fn rows(effort: Effort, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut sink = RowSink { rows: Vec::new(), watch };
    let base = scenes::base(effort.simulated_millis)?;
    for variant in scenes::VARIANTS {
        sink.check()?;
        sink.push(variant_row(variant, &base, effort)?)?;
    }
    Ok(sink.rows)
}

fn variant_row(variant: Variant, base: &Scene, effort: Effort) -> Result<Row, AccuracyError> {
    let scene = scenes::with(&variant, effort.simulated_millis)?;
    let rounds = Rounds { count: effort.rounds, span: Duration::from_millis(effort.round_millis) };
    let mut works: [Work<'_>; 2] =
        [Box::new(|| run(base, Model::Least, Recorded::Nothing)), Box::new(|| run(&scene, variant.model, variant.recorded))];
    let times = rounds.medians(&mut works);
    let [alone, more] = [a_tick(&times[0], base), a_tick(&times[1], &scene)];
    let simulated = scene.duration.as_secs_f64() / times[1].as_secs_f64();
    // Half up, and never "-0.0".
    let tenths = ((more - alone) * 10.0 + 0.5).floor() / 10.0;
    let note = format!("{:.2} times the base, {tenths:+.1} ns; {simulated:.0} s simulated in a second{}", more / alone, variant.words());
    let row = Row::of(Subject::LeastModel, "three peers, constant delay, and", variant.name, String::new(), (more, "ns a peer's tick"));
    Ok(Row {
        error: Some(positions::largest_difference(&scene)),
        error_unit: "largest difference of positions [m]",
        reference: "the same scene in the general model",
        note,
        ..row
    })
}

/// Nanoseconds that a tick of a peer took.
fn a_tick(time: &Duration, scene: &Scene) -> f64 {
    let ticks: f64 = scene.peers.iter().map(|peer| scene.duration.as_secs_f64() / peer.clock.tick.as_secs_f64()).sum();
    nanos(*time) / ticks
}

fn run(scene: &Scene, model: Model, recorded: Recorded) {
    match recorded {
        Recorded::Nothing => drop(black_box(finished(scene, model, &mut NoObserver))),
        Recorded::Trajectory => drop(black_box(finished(scene, model, &mut CsvSink::trajectory(scene)))),
        Recorded::Packets => drop(black_box(finished(scene, model, &mut CsvSink::packets(scene)))),
        Recorded::CountedPackets => drop(black_box(finished(scene, model, &mut Counted::default()))),
    }
}

fn finished<O: Observer<Error = Infallible>>(scene: &Scene, model: Model, observer: &mut O) -> cohaptic_harness::Summary {
    let Ok(summary) = Simulation::new(scene, model).run(observer);
    summary
}

/// Looks at packets and keeps nothing of them.
#[derive(Default)]
struct Counted(u64);

impl Observer for Counted {
    type Error = Infallible;

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        self.0 += black_box(row).sequence;
        Ok(())
    }
}
