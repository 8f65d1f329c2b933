//! Stiffness at which a scene becomes unstable, found by bisection with the verdicts of each method.

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_harness::check::{Stability, stability};
use cohaptic_scene::Scene;
use cohaptic_stability::{Boundary, BoundaryOptions, Family, FamilyScratch, KeyRange, Method, analyse};

use rustix::time::{ClockId, clock_gettime};

use super::growth::growth_over;
use super::references::on_the_edge;
use super::{Effort, row};
use crate::cost::processor_time;
use crate::watch::RowSink;
use crate::{AccuracyError, Row};

/// Name of the work.
const CASE: &str = "boundary of KT, three peers at 24 ms";

/// Interval of the bisection \[N/m\]: stable at the lower end, unstable at the upper end.
const RANGE: [f64; 2] = [1000.0, 2600.0];

/// Halvings of an interval of 1600 N/m down to the rounding of the result.
const ALL: u32 = 52;
/// Halvings down to half a µN/m, finer than the longest simulation of this module can resolve.
const SIMULATED: u32 = 31;

/// Measures the rows of the boundary.
pub(super) fn measure(effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    let (edge, text) = on_the_edge();
    // The reference file gives the stiffness at which the radius is 1 with 50 digits.
    let exact = edge.scene.coordination.gains.stiffness;
    let key = KeyRange::parse("coordination.stiffness=1000..2600").expect("a range");
    let family = Family::new(&text, "on-the-edge.toml".as_ref(), &[], vec![key.clone()])?;
    let with = |stiffness: f64| {
        let mut scene = edge.scene.clone();
        scene.coordination.gains.stiffness = stiffness;
        scene
    };
    let mut push = |method: &str, setting: String, found: Found, note: &str| {
        let row = row(CASE, method, setting, (found.millis, "ms a boundary"), "KT of radius 1 with 50 digits");
        let error = (found.value - exact).abs();
        done.push(Row { error: Some(error), error_unit: "stiffness [N/m]", note: format!("{} verdicts; {note}", found.verdicts), ..row })
    };
    for method in [Method::Full, Method::Reduced] {
        let found = halve(ALL, |stiffness| Ok(analyse(&with(stiffness), method)?.radius.value > 1.0))?;
        push(method.word(), String::new(), found, "each from the scene on")?;
    }
    // One scratch for all verdicts: the preparation is the advantage of a family.
    let mut scratch = FamilyScratch::default();
    let found = halve(ALL, |stiffness| Ok(family.radius(&[stiffness], &mut scratch)?.radius > 1.0))?;
    push("family", String::new(), found, "reduced, with what the scenes share prepared once, radii without bounds")?;
    let found = searched(&family, &key)?;
    push("search", String::new(), found, "`Boundary::find`, which looks for every crossing in the range and not for one, to 1e-9 of the range")?;
    for frames in effort.growth_frames {
        let found = halve(SIMULATED, |stiffness| Ok(growth_over(&with(stiffness), *frames).is_none_or(|growth| growth > 1.0)))?;
        push("growth", format!("{frames} frames"), found, "a disturbance grows or does not")?;
    }
    for seconds in effort.boundary_seconds {
        let found = halve(SIMULATED, |stiffness| Ok(grows(with(stiffness), *seconds)))?;
        push(
            "two runs",
            format!("{seconds} s"),
            found,
            "as `cohaptic check` judges without analysis: two runs side by side, undecided ones by their ratio",
        )?;
    }
    Ok(())
}

/// A boundary and its cost.
struct Found {
    /// Stiffness at the boundary \[N/m\].
    value: f64,
    /// Processor time of the search \[ms\].
    millis: f64,
    /// Number of verdicts in the search.
    verdicts: usize,
}

/// Halves the interval `times` times.
fn halve(times: u32, mut is_unstable: impl FnMut(f64) -> Result<bool, AccuracyError>) -> Result<Found, AccuracyError> {
    let start = processor_time();
    let [mut low, mut high] = RANGE;
    let mut verdicts = 0;
    for _ in 0..times {
        let middle = 0.5 * (low + high);
        verdicts += 1;
        // The boundary stays in the interval: unstable at `high`, stable at `low`.
        if is_unstable(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(Found { value: 0.5 * (low + high), millis: millis(start), verdicts })
}

/// Finds the boundary by the library's own search. The search uses all threads of the machine, so its cost is the processor time of the whole process, which
/// has no other work meanwhile.
fn searched(family: &Family, key: &KeyRange) -> Result<Found, AccuracyError> {
    let start = process_time();
    let boundary = Boundary::find(family, BoundaryOptions::of(key), &[], |_| (), || false)?;
    let millis = (process_time() - start).as_secs_f64() * 1e3;
    // Without a crossing the error of the row becomes NaN, which cannot pass for a result.
    let value = boundary.crossings.first().map_or(f64::NAN, |crossing| crossing.value);
    Ok(Found { value, millis, verdicts: boundary.samples })
}

/// Returns the processor time used by all threads of this process so far.
fn process_time() -> Duration {
    clock_gettime(ClockId::ProcessCPUTime).try_into().expect("processor time is not negative")
}

/// Returns whether the simulated scene grows, as `cohaptic check` judges without analysis.
fn grows(mut scene: Scene, seconds: u64) -> bool {
    // A longer run distinguishes slower growth from slower decay.
    scene.duration = Duration::from_secs(seconds);
    match stability(&scene, Model::Least, || true) {
        Stability::Stable => false,
        Stability::Undecided { ratio } => ratio > 1.0,
        // No call interrupts the check, and any other outcome is no sign of stability.
        Stability::Unstable | Stability::Interrupted => true,
    }
}

fn millis(start: Duration) -> f64 {
    (processor_time() - start).as_secs_f64() * 1e3
}
