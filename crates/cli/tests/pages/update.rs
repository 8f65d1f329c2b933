//! Replacement of the outputs on a page by the present outputs of its commands.

use std::ops::Range;

use crate::pages::compare::{LEFT_OUT, same_line, words};
use crate::pages::notes::Vary;

/// Returns the lines that the page shows from now on: the same excerpt of the output, if its places can be found, or else the whole output. Lines that differ
/// only in parts that are not compared stay as they are.
pub(crate) fn shown_anew(shown: &[&str], printed: &[&str], vary: &Vary) -> Vec<String> {
    let trimmed: Vec<&str> = printed.iter().map(|line| line.trim_end()).collect();
    let mut anew = shortened(shown, &trimmed).unwrap_or_else(|| owned(&trimmed));
    for line in &mut anew {
        let as_it_was = shown.iter().find(|shown| shown.trim() != LEFT_OUT && same_line(shown, line, vary));
        if let Some(as_it_was) = as_it_was {
            (*as_it_was).clone_into(line);
        }
    }
    anew
}

/// `None` if a part between lines left out is not found by the words of its first line.
fn shortened(shown: &[&str], printed: &[&str]) -> Option<Vec<String>> {
    let marks: Vec<&str> = shown.iter().copied().filter(|line| line.trim() == LEFT_OUT).collect();
    let parts: Vec<&[&str]> = shown.split(|line| line.trim() == LEFT_OUT).collect();
    let (first, others) = parts.split_first().filter(|_| !marks.is_empty())?;
    let mut anew: Vec<&str> = printed.get(..first.len())?.to_vec();
    let mut at = first.len();
    for (part, mark) in others.iter().zip(&marks) {
        anew.push(mark);
        // Nothing behind the last mark: all is left out up to the end.
        let Some(head) = part.first() else { return Some(owned(&anew)) };
        let head = words(head);
        let from = (at..printed.len()).find(|&line| words(printed[line]) == head)?;
        at = from + part.len();
        anew.extend(printed.get(from..at)?);
    }
    if at < printed.len() {
        anew.push(marks.last()?);
    }
    Some(owned(&anew))
}

fn owned(lines: &[&str]) -> Vec<String> {
    lines.iter().map(|&line| line.to_owned()).collect()
}

/// Returns the page with new lines at the given places, which must be in the order of the page.
pub(crate) fn replaced(text: &str, changes: &[(Range<usize>, Vec<String>)]) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (place, anew) in changes.iter().rev() {
        lines.splice(place.clone(), anew.iter().cloned());
    }
    lines.join("\n") + "\n"
}

#[test]
fn what_was_left_out_stays_left_out() {
    let printed = ["title", "", "rate 7", "b", "c", "d"];
    assert_eq!(shown_anew(&["…", "rate 3", "…"], &printed, &Vary::default()), ["…", "rate 7", "…"]);
    assert_eq!(shown_anew(&["heading", "  …", "b", "x"], &printed, &Vary::default()), ["title", "  …", "b", "c", "  …"]);
    assert_eq!(shown_anew(&["…", "c", "x"], &printed, &Vary::default()), ["…", "c", "d"]);
    assert_eq!(shown_anew(&["…", "gone", "…"], &printed, &Vary::default()), printed);
    assert_eq!(shown_anew(&["x", "rate 3"], &["y", "rate 7"], &Vary { figures: vec![String::new()], ..Vary::default() }), ["y", "rate 3"]);
    assert_eq!(shown_anew(&["title"], &printed, &Vary::default()), printed);
}

#[test]
fn places_are_those_of_the_page_before() {
    let changes = [(1..2, vec!["B".to_owned(), "b".to_owned()]), (3..3, vec!["new".to_owned()])];
    assert_eq!(replaced("a\nx\nc\nd\n", &changes), "a\nB\nb\nc\nnew\nd\n");
}
