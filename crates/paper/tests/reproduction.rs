//! The reproduction at coarse resolution: every verdict, and well-formed page and drawings.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

use std::sync::OnceLock;

use cohaptic_paper::{Claim, Options, Reproduction, Unwatched, Verdict, Watch, page, reproduce};
use cohaptic_picture::Size;

fn again() -> Reproduction {
    reproduce(Options { quick: true, ..Options::default() }, &Unwatched).unwrap()
}

fn quick() -> &'static Reproduction {
    static QUICK: OnceLock<Reproduction> = OnceLock::new();
    QUICK.get_or_init(again)
}

fn claim(id: &str) -> &'static Claim {
    quick().claims.iter().find(|claim| claim.id == id).unwrap_or_else(|| panic!("no claim {id}"))
}

/// Values from docs/results.md and crates/stability/tests/reference/radii.json, to the digits printed there.
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
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_second_time_every_byte_is_the_same() {
    let second = again();
    assert_eq!(&second, quick());
    assert_eq!(page::html(&second), page::html(quick()));
}

/// A column is 85 mm wide. A drawing is a little wider if two plots with their labels need more.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn drawings_have_the_size_that_was_asked_for_and_numbers_do_not_depend_on_it() {
    let narrow = reproduce(Options { quick: true, size: Size::ONE_COLUMN }, &Unwatched).unwrap();
    assert_eq!(narrow.claims, quick().claims);
    for (one, other) in narrow.figures.iter().zip(&quick().figures) {
        assert_eq!((&one.csv, &one.table, &one.caption), (&other.csv, &other.table, &other.caption));
        let width: f64 = one.svg.split(" width=\"").nth(1).and_then(|rest| rest.split_once("mm\"")?.0.parse().ok()).unwrap();
        assert!((85.0..95.0).contains(&width) && other.svg.contains(" width=\"800\""), "{}: {width}", one.id);
        assert_eq!(cohaptic_picture::testing::faults(&one.svg), [""; 0], "{}", one.id);
    }
}

#[test]
fn the_page_needs_nothing_from_elsewhere() {
    let page = page::html(quick());
    assert_eq!(cohaptic_picture::testing::page_faults(&page), [""; 0]);
    assert_eq!(page.matches("<svg ").count(), quick().figures.len());
    for figure in &quick().figures {
        assert_eq!(cohaptic_picture::testing::faults(&figure.svg), [""; 0], "{}", figure.id);
        assert!(figure.table.rows.iter().all(|row| row.len() == figure.table.head.len()), "{}", figure.id);
        let columns = figure.csv.lines().next().unwrap().split(',').count();
        assert!(figure.csv.lines().all(|line| line.split(',').count() == columns), "{}", figure.id);
    }
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
    let given_up = reproduce(Options { quick: true, ..Options::default() }, &Impatient).unwrap_err();
    assert_eq!(given_up.to_string(), "given up before the end");
}
