//! Comparison of the output of a command with the output on a page.

use crate::pages::notes::Vary;

/// Mark on a page in place of lines that are left out.
pub(crate) const LEFT_OUT: &str = "…";

/// Returns whether the lines are what the page shows. Spaces at the end of a line do not count.
pub(crate) fn same(shown: &[&str], printed: &[&str], vary: &Vary) -> bool {
    let parts: Vec<&[&str]> = shown.split(|line| line.trim() == LEFT_OUT).collect();
    let [first, rest @ ..] = &parts[..] else { return printed.is_empty() };
    let Some((last, middle)) = rest.split_last() else { return all_same(first, printed, vary) };
    if first.len() + last.len() > printed.len() || !all_same(first, &printed[..first.len()], vary) {
        return false;
    }
    let end = printed.len() - last.len();
    let mut at = first.len();
    for part in middle {
        match (at..=end.saturating_sub(part.len())).find(|&from| from + part.len() <= end && all_same(part, &printed[from..from + part.len()], vary))
        {
            Some(from) => at = from + part.len(),
            None => return false,
        }
    }
    at <= end && all_same(last, &printed[end..], vary)
}

fn all_same(shown: &[&str], printed: &[&str], vary: &Vary) -> bool {
    shown.len() == printed.len() && shown.iter().zip(printed).all(|(shown, printed)| same_line(shown, printed, vary))
}

/// Of one line.
pub(crate) fn same_line(shown: &str, printed: &str, vary: &Vary) -> bool {
    let (shown, printed) = (shown.trim_end(), printed.trim_end());
    shown == printed
        || vary.leaves_alone(shown, printed)
        || within_errors(shown, printed)
        || has_parts(shown, printed)
        || (vary.figures_of(shown) && words(shown) == words(printed))
}

/// Returns whether the printed line has all parts of the shown line, in order. The shown line leaves out text between its parts.
fn has_parts(shown: &str, printed: &str) -> bool {
    let parts: Vec<&str> = shown.split(LEFT_OUT).collect();
    let [first, middle @ .., last] = &parts[..] else { return false };
    let Some(mut rest) = printed.strip_prefix(first).and_then(|rest| rest.strip_suffix(last)) else { return false };
    for part in middle {
        let Some((_, behind)) = rest.split_once(part) else { return false };
        rest = behind;
    }
    true
}

/// Returns whether the lines differ in nothing but figures with their errors, `X +- 1.2e-13`, and these by no more than the larger error says. Such an error is
/// a bound of what rounding did, which depends on the processor: it may be ten times the other one.
fn within_errors(shown: &str, printed: &str) -> bool {
    let (shown, printed): (Vec<&str>, Vec<&str>) = (shown.split(' ').collect(), printed.split(' ').collect());
    let number = |word: Option<&&str>| word.and_then(|word| word.parse::<f64>().ok());
    let error = |words: &[&str], at: usize| number(words.get(at)).filter(|_| words[at].contains("e-") && at > 0 && words[at - 1] == "+-");
    let same_place = |at: usize| {
        if let (Some(one), Some(other)) = (error(&shown, at), error(&printed, at)) {
            return one <= 10.0 * other && other <= 10.0 * one;
        }
        let both = error(&shown, at + 2).zip(error(&printed, at + 2)).zip(number(shown.get(at)).zip(number(printed.get(at))));
        both.is_some_and(|((one, other), (shown, printed))| (shown - printed).abs() <= one.max(other))
    };
    shown.len() == printed.len() && (0..shown.len()).all(|at| shown[at] == printed[at] || same_place(at))
}

/// The line without its figures: `0.7 s:` and `700 ms:` are both `#:`. Spaces between words count as one.
pub(crate) fn words(line: &str) -> Vec<String> {
    const TIMES: [&str; 6] = ["ns", "µs", "us", "ms", "s", "min"];
    let mut words: Vec<String> = Vec::new();
    for word in line.split_whitespace() {
        let (core, end) = word.split_at(word.trim_end_matches([',', ';', ':', ')', '.']).len());
        if word.contains("://") {
            words.push(address(word));
            continue;
        }
        let begin = core.len() - core.trim_start_matches(['(', '+', '-', '−', '±']).len();
        let number = core[begin..].starts_with(|letter: char| letter.is_ascii_digit());
        let after_number = words.last().is_some_and(|last| last.ends_with('#'));
        if number {
            words.push(format!("{}#{end}", &core[..begin].replace(['+', '-', '−'], "")));
        } else if after_number && TIMES.contains(&core) {
            words.last_mut().unwrap().push_str(end);
        } else {
            words.push(word.to_owned());
        }
    }
    words
}

/// Returns a web address with each part that has digits replaced by `#`, because ports and tokens differ in every run.
fn address(word: &str) -> String {
    let parts = word.split_inclusive(|letter: char| !letter.is_ascii_alphanumeric());
    let figure = |part: &str| match part.find(|letter: char| !letter.is_ascii_alphanumeric()) {
        Some(end) if part.contains(|letter: char| letter.is_ascii_digit()) => format!("#{}", &part[end..]),
        None if part.contains(|letter: char| letter.is_ascii_digit()) => "#".to_owned(),
        _ => part.to_owned(),
    };
    parts.map(figure).collect()
}

#[test]
fn lines_left_out_are_any_lines_and_the_others_are_those() {
    let printed = ["title", "", "a 1", "b 2", "c 3"];
    let same = |shown: &[&str]| same(shown, &printed, &Vary::default());
    assert!(same(&printed) && same(&["…"]) && same(&["title", "…", "c 3"]) && same(&["  …", "b 2", "…"]) && same(&["…", "a 1", "…", "c 3", "…"]));
    for other in
        [&["title"][..], &[], &["…", "a 1"], &["…", "b 2", "…", "a 1", "…"], &["title", "", "a 1", "b 2", "c 4"], &["…", "b 2", "…", "b 2", "c 3"]]
    {
        assert!(!same(other), "{other:?}");
    }
}

#[test]
fn a_part_of_a_line_may_be_left_out() {
    let same = |shown: &str| same(&[shown], &["expected one of delay, jitter, loss; see --help"], &Vary::default());
    assert!(same("expected one of delay, …; see --help") && same("expected … loss; … --help") && same("expected…"));
    assert!(!same("expected one of loss, …; see --help") && !same("expected … loss; … jitter …") && !same("one of …"));
}

#[test]
fn figures_with_an_error_of_rounding_are_the_same_within_it() {
    let line = "  stable  0.992453875813 +- 8.6e-13";
    let same = |printed: &str| same(&[line], &[printed], &Vary::default());
    assert!(same("  stable  0.992453875813 +- 3.7e-13") && same("  stable  0.992453875814 +- 1.2e-12"));
    // Off by more than is said, an error of another order, and other words.
    for other in [
        "  stable  0.992453875833 +- 8.6e-13",
        "  stable  0.992453875813 +- 1.2e-11",
        "  unstable  0.992453875813 +- 8.6e-13",
        "  stable   0.992453875813 +- 8.6e-13",
    ] {
        assert!(!same(other), "{other}");
    }
    assert!(!super::compare::same(&["mean 39.9 ms +- 0.1 ms"], &["mean 39.8 ms +- 0.1 ms"], &Vary::default()));
}

#[test]
fn only_what_is_said_to_vary_is_passed_over() {
    let vary = Vary { figures: vec!["a second".to_owned()], lines: vec!["the run is".to_owned()], ..Vary::default() };
    assert!(same(&["radius 1", "in 0.7 s: 90 a second"], &["radius 1", "in 12 ms:  7 a second"], &vary));
    assert!(same(&["the run is valid"], &["the run is not valid: 2 of 3"], &vary));
    assert!(!same(&["radius 1"], &["radius 2"], &vary) && !same(&["in 0.7 s: 90 a second"], &["within 0.7 s: 90 a second"], &vary));
    assert_eq!(words("p50 35.5 µs, worst (-1.2e-3 ms)"), ["p50", "#,", "worst", "(#)"]);
    assert_eq!(words("at http://127.0.0.1:80/?token=09b1d4"), ["at", "http://#.#.#.#:#/?token=#"]);
}
