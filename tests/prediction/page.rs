//! Tables of `docs/prediction.md`.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use super::statistics::{deviation, mean, rank_correlation};
use super::{Condition, MOVE, NORMAL, Times, bursts, file, fitted, metres, scene, second_study, speed, study, times};

/// The variable of the environment with which this test writes its tables into the page.
const UPDATE: &str = "COHAPTIC_UPDATE_PAGES";
/// Visual delay of the surgeon \[s\]: the default of a scene.
const VISUAL_DELAY: f64 = 0.2;
/// First of the conditions with outages.
const OUTAGES: usize = 7;

/// A condition with the times of its runs.
type Row = (Condition, Times);

fn rows(conditions: Vec<Condition>, step: u64) -> Vec<Row> {
    let run = |condition: Condition| {
        let times = times(&scene(&condition.link, step));
        assert_eq!(times.done.len(), super::RUNS, "{}: transfers that were not done have no time", condition.name);
        (condition, times)
    };
    conditions.into_iter().map(run).collect()
}

/// Returns the error of a row as a fraction of the people's time.
fn error((condition, times): &Row) -> f64 {
    let people = condition.people.expect("a row of the study");
    times.mean() / people - 1.0
}

/// Returns per cent with a sign, in the typography of the book.
fn signed(percent: f64) -> String {
    format!("{percent:+.1} %").replace('-', "−")
}

fn table_of_study(milliseconds: &[Row], packets: &[Row]) -> String {
    let mut text = "| condition | people \\[s\\] | predicted \\[s\\] | deviation \\[s\\] | error |\n| --- | ---: | ---: | ---: | ---: |\n".to_owned();
    let mut row = |row: &Row, note: &str| {
        let (condition, times) = row;
        let people = condition.people.expect("a row of the study");
        let error = if condition.link.is_empty() { "fitted".to_owned() } else { signed(100.0 * error(row)) };
        let _ = writeln!(text, "| {}{note} | {people:.1} | {:.1} | {:.1} | {error} |", condition.name, times.mean(), deviation(&times.done));
    };
    milliseconds[..OUTAGES].iter().for_each(|common| row(common, ""));
    milliseconds[OUTAGES..].iter().for_each(|outages| row(outages, ", in milliseconds"));
    packets.iter().for_each(|outages| row(outages, ", in packets"));
    text
}

/// Returns the agreement over the rows that were not fitted, with outages by either reading, and that of a prediction of the fitted time for every row.
fn table_of_agreement(milliseconds: &[Row], packets: &[Row]) -> String {
    let mut text = "| outages count | rank correlation | mean error | bias |\n| --- | ---: | ---: | ---: |\n".to_owned();
    let common = &milliseconds[1..OUTAGES];
    for (name, outages) in [("milliseconds", &milliseconds[OUTAGES..]), ("packets", packets)] {
        let rows: Vec<&Row> = common.iter().chain(outages).collect();
        let errors: Vec<f64> = rows.iter().map(|row| error(row)).collect();
        let predicted: Vec<f64> = rows.iter().map(|(_, times)| times.mean()).collect();
        let people: Vec<f64> = rows.iter().filter_map(|(condition, _)| condition.people).collect();
        let sizes: Vec<f64> = errors.iter().map(|error| error.abs()).collect();
        let (rank, size, bias) = (rank_correlation(&predicted, &people), 100.0 * mean(&sizes), 100.0 * mean(&errors));
        let _ = writeln!(text, "| {name} | {rank:.2} | {size:.1} % | {} |", signed(bias));
    }
    let ignorant: Vec<f64> =
        milliseconds[1..].iter().filter_map(|(condition, _)| condition.people).map(|people| 100.0 * (1.0 - NORMAL / people)).collect();
    let _ = writeln!(text, "| nothing is predicted: {NORMAL} s for every row | | {:.1} % | {} |", mean(&ignorant), signed(-mean(&ignorant)));
    text
}

/// Returns the predicted times over mean delays, each over the time without a delay and over that of the shortest delay, with the ratios of the formula.
fn table_of_second_study(normal: &Row, rows: &[Row]) -> String {
    let heads = "| mean delay | time over that without delay | by the formula | time over that of 77 ms | by the formula |";
    let mut text = format!("{heads}\n| --- | ---: | ---: | ---: | ---: |\n");
    let (normal, shortest) = (normal.1.mean(), rows[0].1.mean());
    let by_formula = |delay: f64| (MOVE + VISUAL_DELAY + delay) / (MOVE + VISUAL_DELAY);
    let delay = |condition: &Condition| condition.name.trim_end_matches(" ms").parse::<f64>().unwrap() / 1e3;
    let first = by_formula(delay(&rows[0].0));
    for (condition, times) in rows {
        let (time, formula) = (times.mean(), by_formula(delay(condition)));
        let _ = writeln!(text, "| {} | {:.2} | {formula:.2} | {:.2} | {:.2} |", condition.name, time / normal, time / shortest, formula / first);
    }
    text
}

/// Compares a table with that below its comment on the page, or writes it there.
fn assert_table(page: &mut String, name: &str, table: &str) {
    // An empty line on either side: Markdown would take the table for a part of the comments.
    let table = format!("\n{}\n", table.trim_end());
    let (begin, end) = (format!("<!-- table of the test: {name} -->\n"), "\n<!-- end of the table -->");
    let from = page.find(&begin).unwrap_or_else(|| panic!("the page has no table {name}")) + begin.len();
    let to = from + page[from..].find(end).expect("a table ends");
    if std::env::var_os(UPDATE).is_some() {
        page.replace_range(from..to, &table);
    } else {
        assert_eq!(&page[from..to], table, "table {name}: {UPDATE}=1 writes it anew");
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_page_has_what_comes_out() {
    let step = fitted();
    let milliseconds = rows(study(1), step);
    let packets = rows(study(2).split_off(OUTAGES), step);
    let second = rows(second_study(), step);
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/prediction.md");
    let mut page = fs::read_to_string(&path).unwrap();
    assert_table(&mut page, "study", &table_of_study(&milliseconds, &packets));
    assert_table(&mut page, "agreement", &table_of_agreement(&milliseconds, &packets));
    assert_table(&mut page, "second study", &table_of_second_study(&milliseconds[0], &second));
    if std::env::var_os(UPDATE).is_some() {
        fs::write(&path, &page).unwrap();
    }
    assert!(page.contains(&format!("{:.2} mm", 1e3 * metres(step))), "the page has the fitted step");
}

/// The file has the fitted number.
#[test]
fn the_scene_has_the_fitted_step() {
    let text = fs::read_to_string(file()).unwrap();
    let of = |key: &str| -> f64 {
        let (_, rest) = text.split_once(&format!("{key} = ")).unwrap();
        rest.split([',', ' ', '}']).next().unwrap().parse().unwrap()
    };
    let step = (of("step") * 1e5).round() as u64;
    assert_eq!((of("step"), of("speed")), (metres(step), speed(metres(step))));
    let away = |step| (times(&scene("", step)).mean() - NORMAL).abs();
    let found = away(step);
    assert!(found < away(step - 1) && found < away(step + 1), "{found}");
}

/// A chain that enters the bad state with p and leaves it with r loses p/(p + r) of all samples in runs of 1/r.
#[test]
fn losses_are_those_of_the_study() {
    for (link, loss, run) in [(bursts(0.099, 1.40), 0.099, 1.40), (bursts(0.502, 2.43), 0.502, 2.43)] {
        let number = |key: &str| -> f64 { link.split_once(key).unwrap().1.split([',', ' ']).next().unwrap().parse().unwrap() };
        let (p, r) = (number("p = "), number("r = "));
        assert!((p / (p + r) - loss).abs() < 1e-6 && (1.0 / r - run).abs() < 1e-5, "{link}");
    }
}
