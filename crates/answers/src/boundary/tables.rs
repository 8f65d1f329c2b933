//! The tables of a boundary. Numbers have the fewest digits that read back as the same `f64`.

use cohaptic_stability::{Cell, Criterion};
use cohaptic_units::print::csv_field;

use super::Searched;

/// Returns `boundary.csv`: a row per crossing.
#[must_use]
pub fn crossings_csv(Searched { range, found, .. }: &Searched<'_>) -> String {
    let mut text = format!("{},from,to\n", csv_field(&range.key));
    for crossing in &found.crossings {
        text.push_str(&format!("{:?},{},{}\n", crossing.value, crossing.from.word(), crossing.to.word()));
    }
    text
}

/// Returns `samples.csv`: a row per sampled value.
#[must_use]
pub fn samples_csv(Searched { range, family, found, .. }: &Searched<'_>) -> String {
    let is_mean_square = family.criterion() == Criterion::MeanSquare;
    let columns = if is_mean_square { "mean_square_radius,error_bound,verdict,judged" } else { "spectral_radius,error_bound,verdict" };
    let mut text = format!("{},{columns}\n", csv_field(&range.key));
    for (value, Cell { radius, is_nominal }) in &found.known {
        text.push_str(&format!("{value:?},{:?},{:?},{}", radius.value, radius.error, radius.verdict().word()));
        if is_mean_square {
            text.push_str(&format!(",{}", Criterion::MeanSquare.kind(*is_nominal).word()));
        }
        text.push('\n');
    }
    text
}
