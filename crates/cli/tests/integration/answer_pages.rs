//! Pages of campaigns, maps, boundaries, admittances and proofs: one file with what was asked, the answer, the pictures, the tables, the notes and the scene.

use std::path::Path;
use std::process::Command;

use cohaptic_picture::escape;
use cohaptic_picture::testing::{page_faults, page_in_browser};

use crate::integration::desk::Desk;
use crate::integration::scenes::{PAPER, RANDOM, TWO};

/// A command, its page, and what the page must show: a sentence of the answer, and a row of a table.
struct Case {
    line: &'static str,
    page: &'static str,
    sentence: &'static str,
    row: &'static str,
}

/// Title that is text everywhere, and nothing else.
const TITLE: &str = "<b>Two</b> & $HOME's";

const CASES: [Case; 7] = [
    Case {
        line: "campaign it.toml --vary link.delay=8ms,24ms --vary coordination.stiffness=500,1000,1e9 --runs 2 --verdicts --format csv",
        page: "campaign.html",
        // 1e9 N/m diverges with both delays.
        sentence: "<p>12 runs of 6 combinations, 2 of each.</p>\n<p>4 diverged; the largest discrepancy of the others is ",
        row: "<th scope=\"row\" class=\"number\">24ms</th><td class=\"number\">1e9</td><td class=\"number\">unstable</td><td class=\"number\">spectral-radius</td><td class=\"number\">1.513863e28</td>",
    },
    Case {
        line: "stability map it.toml --x coordination.stiffness=100..6000 --y link.delay=8ms..24ms --grid 4x3 --curve object.mass=1,coordination.damping=7 --against object.damping=1",
        page: "map.html",
        sentence: "<p>As it stands: ",
        row: "<th scope=\"row\">object.mass=1, coordination.damping=7</th><td>spectral radius</td><td class=\"number\">12</td>",
    },
    Case {
        line: "stability map it.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..50 --prove 3",
        page: "proof.html",
        sentence: "<p>Proven stable ",
        row: "<th scope=\"row\">as it stands</th><td class=\"number\">",
    },
    Case {
        line: "stability boundary it.toml --along coordination.stiffness=100..6000 --samples 20",
        page: "boundary.html",
        sentence: "<p>Stable from coordination.stiffness=100; unstable from coordination.stiffness=",
        row: "</th><td>stable</td><td>unstable</td>",
    },
    Case {
        line: "stability boundary it.toml --along coordination.stiffness=100..6000 --prove --tolerance 1",
        page: "proof.html",
        sentence: "; 1 crossing enclosed.</p>",
        row: "<th scope=\"row\">stable</th><td>coordination.stiffness=100</td>",
    },
    Case {
        line: "admittance it.toml --peer left --points 5 --curve object.mass=0.5",
        page: "admittance.html",
        sentence: "<p>As it stands: moved slowly, left feels a viscosity of ",
        row: "<th scope=\"row\" class=\"number\">0.1</th><td class=\"number\">",
    },
    Case {
        line: "admittance it.toml --peer right --at 0.5 --set link.jitter=1ms",
        page: "admittance.html",
        sentence: "<p>Moved slowly, right feels a viscosity of ",
        row: "<th scope=\"row\" class=\"number\">0.5</th><td class=\"number\">",
    },
];

fn scene() -> String {
    TWO.replace("\"Two users\"", &format!("\"{TITLE}\""))
}

#[test]
fn a_page_has_the_question_the_answer_the_pictures_the_tables_and_the_scene() {
    let desk = Desk::with("it.toml", &scene());
    for (number, Case { line, page, sentence, row }) in CASES.iter().enumerate() {
        let folder = format!("out{number}");
        let said = desk.cohaptic(&format!("{line} --out {folder}"));
        assert_eq!(said.status, Some(0), "{line}: {}", said.stderr);
        // The page is the last file that the command writes.
        assert!(said.stderr.ends_with(&format!("wrote {folder}/{page}\n")), "{line}: {}", said.stderr);
        let html = desk.read(&format!("{folder}/{page}"));
        assert_eq!(page_faults(&html), [""; 0], "{line}");
        for part in
            [format!("<h1>{}: ", escape(TITLE)), (*sentence).to_owned(), (*row).to_owned(), escape(&scene()), "<code>it.toml</code>".to_owned()]
        {
            assert!(html.contains(&part), "{line}: no {part} in {html}");
        }
        let pictures: Vec<String> = desk.files(&folder).into_iter().filter(|file| file.ends_with(".svg")).collect();
        assert_eq!(html.matches("<svg ").count(), pictures.len(), "{line}");
        for picture in pictures {
            assert!(html.contains(&desk.read(&format!("{folder}/{picture}"))), "{line}: {picture}");
        }
    }
}

/// Neither the folder, nor `--json`, nor threads, nor an earlier part of the work changes a byte of the page, and the command on the page makes the page again.
#[test]
fn the_command_on_a_page_makes_the_page_again() {
    let desk = Desk::with("it.toml", &scene());
    let program = Path::new(env!("CARGO_BIN_EXE_cohaptic")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    for (number, Case { line, page, .. }) in CASES.iter().enumerate() {
        let folder = format!("out{number}");
        let threads = if line.contains("--vary") || line.contains("--grid") { "--threads 1" } else { "" };
        desk.text(&format!("{line} {threads} --json --size two-columns --out {folder}"));
        let first = desk.read(&format!("{folder}/{page}"));
        let command = first.split_once("<pre>").unwrap().1.split_once("</pre>").unwrap().0;
        let command = command.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&");
        assert!(command.contains("--out DIR") && command.ends_with("--size two-columns"), "{command}");
        let again = Command::new("sh").args(["-c", &command]).env("PATH", &path).current_dir(desk.path("")).output().unwrap();
        assert!(again.status.success(), "{command}: {}", String::from_utf8_lossy(&again.stderr));
        assert!(desk.read(&format!("DIR/{page}")) == first, "{command}");
        std::fs::remove_dir_all(desk.path("DIR")).unwrap();
    }
}

#[test]
fn a_page_names_what_was_left_out_and_what_was_not_settled() {
    let desk = Desk::with("random.toml", RANDOM);
    desk.text("admittance random.toml --peer left --at 1 --out bode --set link.jitter=1ms");
    let page = desk.read("bode/admittance.html");
    for part in ["<h2>Notes</h2>", "<li>The admittance is that with every delay at its mean and no losses.</li>", "<code>link.jitter=1ms</code>"] {
        assert!(page.contains(part), "no {part} in {page}");
    }
    desk.write("two.toml", TWO);
    desk.text("stability boundary two.toml --along coordination.stiffness=100..6000 --values 20 --out cut");
    let page = desk.read("cut/boundary.html");
    assert!(page.contains("<p class=\"warning\">NOT SETTLED: ") && page.contains("--values 20 --out DIR"), "{page}");
    desk.text("admittance two.toml --peer left --at 1 --set coordination.stiffness=6000 --out unstable");
    let page = desk.read("unstable/admittance.html");
    assert!(page.contains("<p class=\"warning\">The scene is unstable and has no steady state"), "{page}");
    // A campaign that varies nothing has one row.
    desk.text("campaign two.toml --runs 3 --out one");
    let page = desk.read("one/campaign.html");
    assert!(page.contains("<th scope=\"row\">all runs</th>") && page.contains("<dd>0 to 2, the same for every combination</dd>"), "{page}");
    assert!(!page.contains("<svg"), "{page}");
    desk.text("campaign two.toml --vary scene.seed=1,2 --out seeds");
    assert!(desk.read("seeds/campaign.html").contains("<dt>Seeds</dt><dd>varied</dd>"));
    // 20 values, and those by which the crossing was found.
    desk.text("stability boundary two.toml --along coordination.stiffness=100..6000 --samples 20 --out settled");
    let page = desk.read("settled/boundary.html");
    assert!(page.contains("<h2>Notes</h2>") && page.contains(" values checked, with neighbours ") && !page.contains("\"warning\""), "{page}");
}

/// The second moment of random outages is not followed, so that every verdict is nominal.
#[test]
fn every_kind_of_page_says_how_many_verdicts_are_nominal() {
    let desk = Desk::with("paper.toml", PAPER);
    let outages = "--set link.outage={random={up=\"5s\",down=\"50ms\"}}";
    for (line, page, note) in [
        ("stability map paper.toml --x coordination.stiffness=100..600 --y coordination.damping=1..30 --grid 2x2", "map", "4 cells are"),
        ("stability boundary paper.toml --along coordination.stiffness=100..6000 --samples 5", "boundary", "5 of the values looked at are"),
        ("campaign paper.toml --set scene.duration=20ms --verdicts", "campaign", "1 combination is"),
    ] {
        desk.cohaptic(&format!("{line} {outages} --out {page}"));
        let html = desk.read(&format!("{page}/{page}.html"));
        assert!(html.contains(&format!("<li>{note} nominal: the second moment cannot be followed there")), "{line}: {html}");
    }
}

/// 401 combinations are one more than a page shows.
#[test]
fn a_page_shows_the_first_rows_of_a_long_table() {
    let desk = Desk::with("two.toml", &TWO.replace("200ms", "2ms"));
    desk.text("campaign two.toml --vary coordination.stiffness=1..401/401 --out many");
    let page = desk.read("many/campaign.html");
    assert!(page.contains("400 of 401 combinations are shown; runs.parquet has all."), "{page}");
    assert!(page.contains("<th scope=\"row\" class=\"number\">400</th>") && !page.contains("<th scope=\"row\" class=\"number\">401</th>"), "{page}");
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_browser_shows_each_page_without_scrolling_and_its_texts_apart() {
    let desk = Desk::with("it.toml", &scene());
    std::fs::create_dir(desk.path("browser")).unwrap();
    for (number, Case { line, page, .. }) in CASES.iter().enumerate() {
        desk.text(&format!("{line} --out out{number}"));
        match page_in_browser(&desk.path("browser"), &desk.read(&format!("out{number}/{page}"))) {
            Some(found) => assert_eq!(found, [""; 0], "{line}"),
            None => eprintln!("skipped: there is no chromium"),
        }
    }
}
