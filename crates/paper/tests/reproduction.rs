//! The paper at coarse resolution: what every verdict is, and that the page and the drawings are well formed.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

use std::sync::OnceLock;

use cohaptic_paper::{Claim, Options, Reproduction, Unwatched, Verdict, Watch, page, reproduce};

fn again() -> Reproduction {
    reproduce(Options { quick: true }, &Unwatched).unwrap()
}

fn quick() -> &'static Reproduction {
    static QUICK: OnceLock<Reproduction> = OnceLock::new();
    QUICK.get_or_init(again)
}

fn claim(id: &str) -> &'static Claim {
    quick().claims.iter().find(|claim| claim.id == id).unwrap_or_else(|| panic!("no claim {id}"))
}

/// Parts from docs/results.md and crates/stability/tests/reference/radii.json, to the digits printed there.
#[test]
fn numbers_are_those_that_were_computed_apart_from_the_program() {
    for (id, parts) in [
        ("bounded-stiffness", &["AP 2.000 (N = 2), 1.500 (N = 3), 1.333 (N = 4)", "PD 2.000 (N = 2), 3.000 (N = 3), 4.000 (N = 4)"][..]),
        ("region-contains", &["AP ρ = 1.0027, PD ρ = 0.9780"]),
        (
            "stability-tests",
            &["AP 2100 N/m 0.9925", "PD 2100 N/m 1.0534", "AP 1000 N/m 0.9862", "PD 1000 N/m 0.9922", "AP 2100 N/m 1.0144", "PD 2100 N/m 1.0117"],
        ),
        ("travel-order", &["AP 1.136 s, PD 2.256 s"]),
        ("both-stable", &["AP 24 ms 1.0381", "copies against each other 1.0381", "PD 24 ms 0.9996"]),
        ("nearer-to-mass", &["AP N = 3 -32.0", "PD N = 3 -37.6", "ideal 30.97 dB"]),
    ] {
        for part in parts {
            assert!(claim(id).ours.contains(part), "no {part:?} in {}", claim(id).ours);
        }
    }
}

#[test]
fn claims_that_hold_hold_and_the_others_come_with_a_scene() {
    for id in ["bounded-stiffness", "less-viscous", "frequency-needs-scaling", "viscosity-law", "damping-grows", "travel-order", "any-number"] {
        assert_eq!(claim(id).verdict, Verdict::Holds, "{id}: {}", claim(id).ours);
    }
    for id in ["region-contains", "both-stable", "ap-unaffected"] {
        assert!(matches!(claim(id).verdict, Verdict::FailsAt(_)), "{id}: {}", claim(id).verdict);
        assert!(claim(id).scene.is_some(), "{id}");
    }
    for id in ["stability-tests", "travel-times", "nearer-to-mass", "pd-decreases", "region-larger"] {
        assert!(matches!(claim(id).verdict, Verdict::HoldsWhere(_)), "{id}: {}", claim(id).verdict);
    }
}

#[test]
fn a_second_time_every_byte_is_the_same() {
    let second = again();
    assert_eq!(&second, quick());
    assert_eq!(page::html(&second), page::html(quick()));
}

#[test]
fn the_page_needs_nothing_from_elsewhere() {
    let page = page::html(quick());
    for word in ["src=", "<script", "<link", "@import", "url(", "href=\"http"] {
        // A place within the page is not elsewhere.
        assert!(!page.replace("url(#", "").contains(word), "{word} in the page");
    }
    assert!(page.matches("<title>").count() > quick().figures.len(), "every drawing has a title");
    assert_balanced(&page);
    for figure in &quick().figures {
        assert_balanced(&figure.svg);
        assert_eq!(cohaptic_picture::testing::faults(&figure.svg), [""; 0], "{}", figure.id);
        assert!(figure.table.rows.iter().all(|row| row.len() == figure.table.head.len()), "{}", figure.id);
        let columns = figure.csv.lines().next().unwrap().split(',').count();
        assert!(figure.csv.lines().all(|line| line.split(',').count() == columns), "{}", figure.id);
    }
}

/// Every tag that opens closes, in order. Void elements are those of HTML that the page uses.
fn assert_balanced(text: &str) {
    let mut open = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        let end = start + rest[start..].find('>').expect("a tag ends");
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "</{name}> closes another tag");
        } else if !tag.ends_with('/') && !tag.starts_with(['!', '?']) && name != "meta" {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?} are not closed");
}

struct Impatient;

impl Watch for Impatient {
    fn one_more(&self) {}

    fn stops(&self) -> bool {
        true
    }
}

#[test]
fn it_can_be_given_up() {
    let given_up = reproduce(Options { quick: true }, &Impatient).unwrap_err();
    assert_eq!(given_up.to_string(), "given up before the end");
}
