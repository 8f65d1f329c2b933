//! Damaged scene files: the result is a scene or an error that can be shown.

use std::path::{Path, PathBuf};

use cohaptic_scene::{Scene, scene_files};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::every_key::path;

/// Edit of a text. Numbers choose the place, modulo the length of the text.
#[derive(Clone, Debug)]
enum Edit {
    FlipBit(usize, u8),
    Delete(usize, usize),
    Duplicate(usize, usize, usize),
    SwapLines(usize, usize),
    DeleteLine(usize),
    RepeatLine(usize),
    Insert(usize, &'static str),
    ReplaceNumber(usize, &'static str),
    ReplaceText(usize, &'static str),
    Nest(usize, usize),
}

const NUMBERS: [&str; 18] = [
    "nan",
    "-nan",
    "inf",
    "-inf",
    "1e999",
    "-1e999",
    "-0.0",
    "0",
    "-1",
    "1e-320",
    "1e308",
    "9223372036854775807",
    "9223372036854775808",
    "99999999999999999999999999999999999999999999",
    "0xffffffffffffffff",
    "1979-05-27",
    "true",
    "[]",
];

const TEXTS: [&str; 16] = [
    "\"\"",
    "\"8 parsecs\"",
    "\"-1ms\"",
    "\"18446744073709551615ns\"",
    "\"999999999999h\"",
    "\"\\u001b[2J\"",
    "\"all\"",
    "\"none\"",
    "\"101%\"",
    "\"left\"",
    "\"sixth\"",
    "\"+z\"",
    "\"0bit\"",
    "{}",
    "[[]]",
    "\"é𝄞\u{202e}\"",
];

const SPLICES: [&str; 14] = [
    "\n[peers]\n",
    "\n[[scene]]\n",
    "\ncount = 6\n",
    "\n[scene.count]\n",
    "=",
    "\"",
    "'''",
    "\0",
    "\u{feff}",
    ".",
    "\n[[peers.hand]]\n",
    "\nx = {\n",
    "\r",
    "]]",
];

fn edit() -> impl Strategy<Value = Edit> {
    let place = any::<usize>;
    prop_oneof![
        (place(), 0..8_u8).prop_map(|(at, bit)| Edit::FlipBit(at, bit)),
        (place(), 1..40_usize).prop_map(|(at, length)| Edit::Delete(at, length)),
        (place(), 1..80_usize, place()).prop_map(|(at, length, to)| Edit::Duplicate(at, length, to)),
        (place(), place()).prop_map(|(a, b)| Edit::SwapLines(a, b)),
        place().prop_map(Edit::DeleteLine),
        place().prop_map(Edit::RepeatLine),
        (place(), prop::sample::select(&SPLICES[..])).prop_map(|(at, text)| Edit::Insert(at, text)),
        (place(), prop::sample::select(&NUMBERS[..])).prop_map(|(at, number)| Edit::ReplaceNumber(at, number)),
        (place(), prop::sample::select(&TEXTS[..])).prop_map(|(at, text)| Edit::ReplaceText(at, text)),
        (place(), 1..200_usize).prop_map(|(at, depth)| Edit::Nest(at, depth)),
    ]
}

fn apply(text: &str, edit: &Edit) -> String {
    let place = |at: usize, length: usize| at.checked_rem(length).unwrap_or(0);
    let spliced = |at: usize, end: usize, new: &[u8]| {
        let bytes = text.as_bytes();
        let at = place(at, bytes.len() + 1);
        let end = end.clamp(at, bytes.len());
        String::from_utf8_lossy(&[&bytes[..at], new, &bytes[end..]].concat()).into_owned()
    };
    let lines = |change: &dyn Fn(&mut Vec<&str>)| {
        let mut lines: Vec<&str> = text.lines().collect();
        if !lines.is_empty() {
            change(&mut lines);
        }
        lines.join("\n")
    };
    match *edit {
        Edit::FlipBit(at, bit) => {
            let at = place(at, text.len());
            text.as_bytes().get(at).map_or_else(String::new, |byte| spliced(at, at + 1, &[byte ^ (1 << bit)]))
        }
        Edit::Delete(at, length) => spliced(at, place(at, text.len() + 1) + length, b""),
        Edit::Duplicate(at, length, to) => {
            let at = place(at, text.len() + 1);
            spliced(to, 0, &text.as_bytes()[at..(at + length).min(text.len())])
        }
        Edit::SwapLines(a, b) => lines(&|lines| {
            let count = lines.len();
            lines.swap(a % count, b % count);
        }),
        Edit::DeleteLine(at) => lines(&|lines| {
            lines.remove(at % lines.len());
        }),
        Edit::RepeatLine(at) => lines(&|lines| lines.insert(at % lines.len(), lines[at % lines.len()])),
        Edit::Insert(at, new) => spliced(at, 0, new.as_bytes()),
        Edit::ReplaceNumber(at, new) => replaced(text, at, new, |byte| byte.is_ascii_digit() || byte == b'.'),
        Edit::ReplaceText(at, new) => {
            let quotes: Vec<usize> = text.match_indices('"').map(|(at, _)| at).collect();
            let pair = place(at, quotes.len() / 2) * 2;
            match (quotes.get(pair), quotes.get(pair + 1)) {
                (Some(&start), Some(&end)) => spliced(start, end + 1, new.as_bytes()),
                _ => text.to_owned(),
            }
        }
        Edit::Nest(at, depth) => replaced(text, at, &format!("{}1{}", "[".repeat(depth), "]".repeat(depth)), |byte| byte.is_ascii_digit()),
    }
}

/// Replaces a run of bytes for which `belongs` is true by `new`. `at` chooses the run, modulo the number of runs.
fn replaced(text: &str, at: usize, new: &str, belongs: impl Fn(u8) -> bool) -> String {
    let bytes = text.as_bytes();
    let starts: Vec<usize> = (0..bytes.len()).filter(|&at| belongs(bytes[at]) && (at == 0 || !belongs(bytes[at - 1]))).collect();
    let Some(&start) = at.checked_rem(starts.len()).and_then(|at| starts.get(at)) else { return text.to_owned() };
    let length = bytes[start..].iter().take_while(|byte| belongs(**byte)).count();
    String::from_utf8_lossy(&[&bytes[..start], new.as_bytes(), &bytes[start + length..]].concat()).into_owned()
}

/// Returns the paths of the scenes of the repository.
fn shipped() -> Vec<PathBuf> {
    scene_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios")).unwrap()
}

/// Checks that an error can be shown, shows the line of the fault, and holds no control characters but line breaks.
fn check(text: &str, overrides: &[String]) -> Result<(), TestCaseError> {
    let Err(error) = Scene::parse(text, &path(), overrides) else { return Ok(()) };
    let shown = error.to_string();
    prop_assert!(shown.chars().all(|c| c == '\n' || !c.is_control()), "{shown:?}");
    prop_assert!(shown.lines().count() >= 4, "{shown}");
    prop_assert!(shown.contains("expected"), "{shown}");
    // The message for a reader that answers nothing without saying why.
    prop_assert!(!shown.contains("the scene is refused"), "{shown}");
    let place = error.diagnostic().expect("a fault in a text has a place");
    prop_assert!(place.line() >= 1 && place.column() >= 1);
    prop_assert!(place.shown_line().chars().count() <= 202);
    Ok(())
}

properties! {
    #![proptest_config(ProptestConfig { cases: 4_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    #[ignore = ".ci/nightly runs it: it takes long"]
    fn a_scene_that_something_happened_to_is_read_or_refused(edits in prop::collection::vec(edit(), 1..6)) {
        let original = std::fs::read_to_string(path()).unwrap();
        let text = edits.iter().fold(original, |text, edit| apply(&text, edit));
        check(&text, &[])?;
    }

    #[test]
    #[ignore = ".ci/nightly runs it: it takes long"]
    fn a_shipped_scene_that_something_happened_to_is_read_or_refused(
        scene in any::<prop::sample::Index>(),
        edits in prop::collection::vec(edit(), 1..6),
    ) {
        let shipped = shipped();
        let original = std::fs::read_to_string(&shipped[scene.index(shipped.len())]).unwrap();
        let text = edits.iter().fold(original, |text, edit| apply(&text, edit));
        check(&text, &[])?;
    }

    #[test]
    #[ignore = ".ci/nightly runs it: it takes long"]
    fn any_override_is_taken_or_refused(
        key in "(scene|peer|peers|modulators|link|links|timeline|expect|coordination)(\\.(left|right|0|9|hand|delay|jitter|loss|queue|netem|trace|modulated|device|mass|at|set|count|x|\"|)){0,5}",
        value in prop_oneof!["\\PC{0,12}", prop::sample::select(&NUMBERS[..]).prop_map(str::to_owned), prop::sample::select(&TEXTS[..]).prop_map(str::to_owned)],
    ) {
        let original = std::fs::read_to_string(path()).unwrap();
        check(&original, &[format!("{key}={value}")])?;
    }

    #[test]
    fn any_text_is_refused_in_a_way_that_can_be_shown(text in "\\PC{0,200}") {
        check(&text, std::slice::from_ref(&text))?;
    }
}

#[test]
fn the_deepest_nesting_is_refused() {
    let dotted = "a.".repeat(5_000) + "b = 1";
    let tables = format!("[{}b]\nc = 1", "a.".repeat(70));
    let inline = format!("x = {}1{}", "{ a.a.a.a.a.a.a.a = ".repeat(79), " }".repeat(79));
    let arrays = format!("x = {}{}", "[".repeat(100_000), "]".repeat(100_000));
    for text in [dotted, tables, inline, arrays] {
        check(&text, &[]).unwrap();
        check("", &[format!("scene={text}"), text]).unwrap();
    }
}
