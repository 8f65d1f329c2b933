//! Which frequencies are looked at.

use cohaptic_units::print::{Counted, Number};

use crate::arguments::AdmittanceArguments;
use crate::failure::Failure;

const LOWEST: f64 = 0.01;
const HIGHEST: f64 = 100.0;
const POINTS: usize = 60;
/// More points than this are refused: a table of them fills a small machine.
const MOST: usize = 1_000_000;

/// The frequencies that were asked for \[Hz\], none above `highest`.
pub(super) fn of(arguments: &AdmittanceArguments, highest: f64) -> Result<Vec<f64>, Failure> {
    if !arguments.at.is_empty() {
        return arguments.at.iter().map(|hz| checked("--at", *hz, highest)).collect();
    }
    let from = checked("--from", arguments.from.unwrap_or(LOWEST), highest)?;
    let to = checked("--to", arguments.to.unwrap_or_else(|| HIGHEST.min(highest)), highest)?;
    let points = arguments.points.map_or(POINTS, std::num::NonZeroUsize::get);
    if points == 1 || from >= to {
        return Err(Failure::Input(format!(
            "{} from {} Hz to {} Hz: expected at least 2, the first below the last; --at takes one alone",
            Counted(points, "frequency"),
            Number(from),
            Number(to)
        )));
    }
    if points > MOST {
        return Err(Failure::Input(format!("--points {points}: expected at most {MOST}")));
    }
    #[expect(clippy::cast_precision_loss, reason = "at most a million points")]
    let share = |place: usize| place as f64 / (points - 1) as f64;
    let between = |place: usize| if place + 1 == points { to } else { from * (to / from).powf(share(place)) };
    Ok((0..points).map(between).collect())
}

fn checked(option: &str, hz: f64, highest: f64) -> Result<f64, Failure> {
    if hz > 0.0 && hz <= highest {
        return Ok(hz);
    }
    Err(Failure::Input(format!(
        "{option} {}: expected a frequency above 0 and at most {} Hz, half the rate of the peer's ticks",
        Number(hz),
        Number(highest)
    )))
}
