//! Check of the figures in a sentence or a table: commands must have printed them.

/// Returns the numbers with a decimal point in `text` that equal no number of `printed` rounded to as many decimal places. Signs are ignored.
pub(crate) fn missing(text: &str, printed: &str) -> Vec<String> {
    let known: Vec<f64> = numbers(printed).iter().filter_map(|number| number.parse().ok()).collect();
    let is_known = |number: &str| {
        let places = number.split_once('.').map_or(0, |(_, fraction)| fraction.len());
        known.iter().any(|known| format!("{known:.places$}") == number)
    };
    numbers(text).into_iter().filter(|number| number.contains('.') && !is_known(number)).collect()
}

/// All runs of digits, with a decimal point within or none; of a number with an exponent the digits before it.
fn numbers(text: &str) -> Vec<String> {
    let runs = text.split(|letter: char| !letter.is_ascii_digit() && letter != '.');
    let runs = runs.map(|run| run.trim_matches('.')).filter(|run| !run.is_empty() && run.matches('.').count() < 2);
    runs.map(str::to_owned).collect()
}

#[test]
fn a_figure_is_one_that_was_printed_and_rounded() {
    let printed = "radius 0.896488138569 +- 2.5e-13; 29.018, -32.0 dB; 10.1.0.1";
    assert!(missing("a radius of 0.896488, −29.02 dB, 2.5·10⁻¹³ and 3 peers, as in 4.", printed).is_empty());
    assert_eq!(missing("0.896489 and 10.1 and 29.0180", printed), ["0.896489", "10.1"]);
}
