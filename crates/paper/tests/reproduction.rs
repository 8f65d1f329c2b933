//! The reproduction at coarse resolution: every verdict, and well-formed page and drawings.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

use std::collections::BTreeSet;
use std::sync::OnceLock;

use cohaptic_paper::{Claim, FAILS, Options, Reproduction, Unwatched, Verdict, Watch, page, reproduce};
use cohaptic_picture::{Size, escape};

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
    for (id, row) in [
        ("bounded-stiffness", "2 | 2.000 | 2.000 | 2.000 | 2.000"),
        ("bounded-stiffness", "3 | 1.500 | 1.500 | 3.000 | 3.000"),
        ("bounded-stiffness", "4 | 1.333 | 1.333 | 4.000 | 4.000"),
        ("stability-tests", "AP, 2100 N/m | stable | 0.9925 |"),
        ("stability-tests", "| 1.0144 ✗ |"),
        ("stability-tests", "PD, 2100 N/m | unstable | 1.0534 |"),
        ("stability-tests", "| 1.0117 |"),
        ("stability-tests", "AP, 1000 N/m | stable | 0.9862 |"),
        ("stability-tests", "| 1.0027 ✗ |"),
        ("stability-tests", "PD, 1000 N/m | stable | 0.9922 |"),
        ("stability-tests", "| 0.9780 |"),
        ("travel-order", "AP | 1.22 s | 1.136 s |"),
        ("travel-order", "PD | 1.514 s | 2.256 s |"),
        ("travel-times", "PD | 1.514 s | 2.256 s ✗ |"),
        ("both-stable", "AP | 1.0381 ✗ |"),
        ("both-stable", "PD | 0.9996 |"),
        ("nearer-to-mass", "3 | -32.0"),
        ("nearer-to-mass", "| -37.6"),
        ("nearer-to-mass", "| 30.97"),
    ] {
        let rows: Vec<String> = claim(id).tables.iter().flat_map(|table| &table.rows).map(|row| row.join(" | ")).collect();
        assert!(rows.iter().any(|found| found.contains(row)), "no {row:?} in {rows:#?}");
    }
    assert!(claim("region-contains").ours.contains("AP has ρ = 1.0027 and PD ρ = 0.9780"), "{}", claim("region-contains").ours);
    assert!(claim("both-stable").tables[0].rows[0][3].starts_with("1.0381"), "the untouched copies swing apart: {:?}", claim("both-stable").tables);
}

/// A claim that is marked nowhere holds, and one that does not hold shows where: in a cell of its tables, in words of its verdict, or in both.
#[test]
fn every_claim_has_its_numbers_its_reason_and_its_scene() {
    let figures: Vec<&str> = quick().figures.iter().map(|figure| figure.id.as_str()).collect();
    for claim in &quick().claims {
        let Claim { id, tables, scene, commands, how, says, short, .. } = claim;
        assert!([says, short, how.as_str()].iter().all(|text| !text.is_empty()), "{id}");
        assert!(!tables.is_empty(), "{id}");
        for table in tables {
            assert!(
                !table.title.is_empty() && !table.rows.is_empty() && table.rows.iter().all(|row| row.len() == table.head.len()),
                "{id}: {table:#?}"
            );
            let grouped: usize = table.groups.iter().map(|(_, columns)| columns).sum();
            assert!(table.groups.is_empty() || grouped == table.head.len(), "{id}: {table:#?}");
        }
        let marked = tables.iter().flat_map(|table| table.rows.iter().flatten()).any(|cell| cell.ends_with(FAILS));
        assert_eq!(marked, claim.verdict != Verdict::Holds, "{id}: {tables:#?}");
        assert_eq!(claim.why.is_empty(), claim.verdict == Verdict::Holds, "{id}: {}", claim.why);
        assert!(
            scene.contains("[scene]") && commands.lines().all(|line| line.starts_with("cohaptic ") && line.contains(&format!("{id}.toml"))),
            "{commands}"
        );
        assert!(claim.figures.iter().all(|figure| figures.contains(figure)), "{id}: {:?}", claim.figures);
    }
}

/// The answer counts the claims of the paper, names each in the sentence of its verdict, and stands before everything else.
#[test]
fn the_page_begins_with_the_answer() {
    let page = page::html(quick());
    let count = |of: fn(&Verdict) -> bool| quick().claims.iter().filter(|claim| !claim.is_own && of(&claim.verdict)).count();
    let holds = count(|verdict| matches!(verdict, Verdict::Holds));
    let partly = count(|verdict| matches!(verdict, Verdict::HoldsWhere(_)));
    let fails = count(|verdict| matches!(verdict, Verdict::FailsAt(_)));
    let answer = format!(
        "<p><strong>In part.</strong> Of {} claims of the paper, {holds} hold in everything that was computed, {partly} hold under",
        holds + partly + fails
    );
    let (at, sections) = (page.find(&answer).unwrap_or_else(|| panic!("no {answer:?}")), page.find("<section ").unwrap());
    assert!(at < page.find("<table>").unwrap() && at < sections);
    // The object is less viscous with AP, and PD is stable where AP is not.
    let advice = "<p>So for the same gains AP gives the less viscous object, but it need not be stable where PD is.";
    assert!(page[at..sections].contains(advice), "{page}");
    let (_, symbols) = page[..sections].split_once("<h2>How to read this page</h2>").unwrap();
    assert!(["AP", "PD", "KT", "ρ"].iter().all(|symbol| symbols.contains(symbol)) && symbols.matches("<dt>").count() > 5, "{symbols}");
    for claim in &quick().claims {
        let begin = page.find(&format!("<section id=\"{}\">", claim.id)).unwrap();
        assert_eq!(page[..sections].contains(claim.short), !claim.is_own, "{}", claim.id);
        // The tables and figures of a claim stand in its section, or a figure that an earlier claim shows is linked.
        let section = &page[begin..begin + page[begin..].find("</section>").unwrap()];
        assert!(claim.tables.iter().all(|table| section.contains(&table.title)), "{}", claim.id);
        let is_shown = |figure: &&str| section.contains(&format!("<figure id=\"{figure}\">")) || section.contains(&format!("href=\"#{figure}\""));
        assert!(claim.figures.iter().all(is_shown), "{}", claim.id);
        assert_words(claim, section);
    }
}

/// Checks that a claim's section has the words of the paper, the answer, the scene and its commands, and of a claim that fails anywhere where and why.
fn assert_words(claim: &Claim, section: &str) {
    // A long command is broken before its options, as a shell takes it.
    let commands = section.replace(" \\\n    --", " --");
    assert!(commands.contains(&format!("<pre>{}</pre>", escape(&claim.commands))), "{}: {section}", claim.id);
    assert!(section.lines().all(|line| !line.starts_with("<pre>cohaptic") || line.chars().count() < 120), "{}: {section}", claim.id);
    for text in [claim.says, &claim.ours, &claim.how, &claim.scene] {
        assert!(section.contains(&escape(text)), "{}: no {text:?} in {section}", claim.id);
    }
    for (words, are_said) in [
        ("It holds where", matches!(claim.verdict, Verdict::HoldsWhere(_))),
        ("It fails at", matches!(claim.verdict, Verdict::FailsAt(_))),
        ("Why they differ:", claim.verdict != Verdict::Holds),
    ] {
        assert_eq!(section.contains(words), are_said, "{}: {words}", claim.id);
    }
    let failing = claim.tables.iter().flat_map(|table| table.rows.iter().flatten()).filter(|cell| cell.ends_with(FAILS)).count();
    assert_eq!(section.matches(&format!("{FAILS}</b></t")).count(), failing, "{}: {section}", claim.id);
}

#[test]
fn claims_that_hold_hold_and_the_others_do_not() {
    for id in ["bounded-stiffness", "less-viscous", "frequency-needs-scaling", "viscosity-law", "damping-grows", "travel-order", "any-number"] {
        assert_eq!(claim(id).verdict, Verdict::Holds, "{id}: {}", claim(id).ours);
    }
    for id in ["region-contains", "both-stable", "ap-unaffected"] {
        assert!(matches!(claim(id).verdict, Verdict::FailsAt(_)), "{id}: {}", claim(id).verdict);
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
        assert_eq!((&one.csv, &one.caption), (&other.csv, &other.caption));
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
        let columns = figure.csv.lines().next().unwrap().split(',').count();
        assert!(figure.csv.lines().all(|line| line.split(',').count() == columns), "{}", figure.id);
    }
}

/// A region has one filled area for each law, reading and number of users that is stable anywhere, as the data tell.
#[test]
fn stability_regions_are_filled() {
    for figure in quick().figures.iter().filter(|figure| ["fig-3", "fig-4"].contains(&figure.id.as_str())) {
        let mut rows = figure.csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
        assert_eq!(rows.next().unwrap(), ["strategy", "peers", "mass", "delay_ms", "damping", "stiffness", "coupling_stiffness", "radius"]);
        let stable = rows.filter(|row| row[7].parse::<f64>().unwrap() < 1.0).map(|row| row[..5].join(",")).collect::<BTreeSet<_>>();
        assert!(stable.len() > 30, "{}: {stable:?}", figure.id);
        assert_eq!(figure.svg.matches("<path class=\"tint fr\"").count(), stable.len(), "{}", figure.id);
        // The legend has a filled sample with its own edge for each number of users.
        assert_eq!(figure.svg.matches("<rect class=\"tint fr\"").count(), 5, "{}", figure.id);
        assert!((0..5).all(|number| figure.svg.contains(&format!("<path class=\"line s{number}\""))), "{}", figure.id);
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
