//! The table `compare.csv`: a row per combination and measure.

use cohaptic_campaign::{Estimate, Judgement};
use cohaptic_units::print::csv_field;

use super::Finished;

/// Columns after the columns of the keys.
const COLUMNS: &str = "refused,runs,diverged,done,verdict,judged,measure,count,mean,low,high,pairs,difference,difference_low,difference_high";

/// Returns the table. Numbers have the fewest digits that read back as the same `f64`; a cell without a number is empty. A refused combination has a single
/// row.
#[must_use]
pub fn csv(finished: &Finished) -> String {
    let comparison = &finished.comparison;
    let keys = finished.keys().iter().map(|key| csv_field(&key.column()) + ",");
    let mut text = format!("combination,strategy,{}{COLUMNS}\n", keys.collect::<String>());
    for (combination, cell) in comparison.cells.iter().enumerate() {
        let (strategy, other) = (combination / comparison.others(), combination % comparison.others());
        let values = finished.keys().iter().zip(finished.places(other)).map(|(key, place)| csv_field(&key.cell(place)) + ",");
        let head = format!("{combination},{},{}", csv_field(&comparison.strategies[strategy]), values.collect::<String>());
        // The row of a refusal has the reason in the first cell after the keys, and all further cells empty.
        if let Some(reason) = &cell.refused {
            text.push_str(&format!("{head}{}{}\n", csv_field(reason), ",".repeat(COLUMNS.matches(',').count())));
            continue;
        }
        let (runs, diverged) = cell.diverged.map_or((0, 0), |share| (share.of, share.count));
        // Empty for a scene without a task.
        let done = cell.done.map_or_else(String::new, |share| share.count.to_string());
        let (verdict, judged) =
            finished.judgement(strategy, other).and_then(Judgement::verdict).map_or(("", ""), |known| (&*known.word, &*known.judged));
        for (measure, figures) in comparison.measures.iter().zip(&cell.figures) {
            let [mean, difference] = [figures.mean, figures.difference].map(|estimate| estimate_cells(estimate.as_ref()));
            text.push_str(&format!("{head},{runs},{diverged},{done},{verdict},{judged},{},{mean},{difference}\n", csv_field(&measure.name)));
        }
    }
    text
}

/// Returns the cells of an estimate: number of values, mean, and both ends of the interval.
fn estimate_cells(estimate: Option<&Estimate>) -> String {
    let Some(estimate) = estimate else { return "0,,,".to_owned() };
    let ends = if estimate.half_width.is_some() { format!("{:?},{:?}", estimate.low(), estimate.high()) } else { ",".to_owned() };
    format!("{},{:?},{ends}", estimate.count, estimate.mean)
}
