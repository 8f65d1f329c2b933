//! `compare.csv`: a row for each combination and measure.

use cohaptic_campaign::{Estimate, Judgement};
use cohaptic_units::print::csv_field;

use super::Finished;

/// The columns behind those of the keys.
const COLUMNS: &str = "refused,runs,diverged,verdict,judged,measure,count,mean,low,high,pairs,difference,difference_low,difference_high";

/// The table. Numbers have the fewest digits that read back the same, and a cell is empty where there is no number. A combination that is refused has one row.
#[must_use]
pub fn csv(finished: &Finished) -> String {
    let comparison = &finished.comparison;
    let keys = finished.keys().iter().map(|key| csv_field(&key.column()) + ",");
    let mut text = format!("combination,strategy,{}{COLUMNS}\n", keys.collect::<String>());
    for (combination, cell) in comparison.cells.iter().enumerate() {
        let (strategy, other) = (combination / comparison.others(), combination % comparison.others());
        let values = finished.keys().iter().zip(finished.places(other)).map(|(key, place)| csv_field(&key.cell(place)) + ",");
        let head = format!("{combination},{},{}", csv_field(&comparison.strategies[strategy]), values.collect::<String>());
        if let Some(reason) = &cell.refused {
            text.push_str(&format!("{head}{}{}\n", csv_field(reason), ",".repeat(COLUMNS.matches(',').count())));
            continue;
        }
        let (runs, diverged) = cell.diverged.map_or((0, 0), |share| (share.of, share.count));
        let (verdict, judged) =
            finished.judgement(strategy, other).and_then(Judgement::verdict).map_or(("", ""), |known| (&*known.word, &*known.judged));
        for (measure, figures) in comparison.measures.iter().zip(&cell.figures) {
            let [mean, difference] = [figures.mean, figures.difference].map(|estimate| estimate_cells(estimate.as_ref()));
            text.push_str(&format!("{head},{runs},{diverged},{verdict},{judged},{},{mean},{difference}\n", csv_field(&measure.name)));
        }
    }
    text
}

/// How many values, their mean, and both ends of its interval.
fn estimate_cells(estimate: Option<&Estimate>) -> String {
    let Some(estimate) = estimate else { return "0,,,".to_owned() };
    let ends = if estimate.half_width.is_some() { format!("{:?},{:?}", estimate.low(), estimate.high()) } else { ",".to_owned() };
    format!("{},{:?},{ends}", estimate.count, estimate.mean)
}
