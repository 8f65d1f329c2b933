//! `run.html`: a run on one page.

use cohaptic_picture::testing::{page_faults, page_in_browser};
use cohaptic_units::print::SixDigits;

use crate::integration::desk::Desk;
use crate::integration::scenes::{RANDOM, TWO};

fn page(desk: &Desk, line: &str) -> String {
    desk.text(&format!("{line} --out out"));
    let page = desk.read("out/run.html");
    assert_eq!(page_faults(&page), [""; 0], "{line}");
    page
}

#[test]
fn a_run_is_one_page_that_depends_on_its_inputs_alone() {
    let desk = Desk::with("three.toml", RANDOM);
    let first = page(&desk, "run three.toml --seed 7 --set link.loss=5%");
    desk.text("run three.toml --seed 7 --set link.loss=5% --out elsewhere --json");
    assert_eq!(first, desk.read("elsewhere/run.html"), "neither the folder nor --json changes it");
    assert_ne!(first, page(&desk, "run three.toml --seed 8 --set link.loss=5%"));
    // Each picture of the folder as it is there, and the scene as it is written.
    assert_eq!(first.matches("<svg ").count(), 3);
    for file in ["positions.svg", "forces.svg", "network.svg"] {
        assert!(first.contains(&desk.read(&format!("elsewhere/{file}"))), "{file}");
    }
    assert!(first.contains(&cohaptic_picture::escape(RANDOM)));
    assert!(first.contains("<pre>cohaptic run three.toml --set link.loss=5% --seed 7 --out DIR</pre>"), "{first}");
}

#[test]
fn the_command_on_the_page_makes_the_page_again() {
    let desk = Desk::with("it's two.toml", TWO);
    let mut command = desk.command("run");
    let words = ["it's two.toml", "--set", "scene.title=\"<b> & $HOME\"", "--out", "DIR", "--size", "two-columns"];
    assert!(command.args(words).output().unwrap().status.success());
    let first = desk.read("DIR/run.html");
    let shown = first.split_once("<pre>").unwrap().1.split_once("</pre>").unwrap().0;
    let line = shown.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&");
    assert!(line.ends_with("--out DIR --size two-columns"), "{line}");
    std::fs::remove_dir_all(desk.path("DIR")).unwrap();
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_cohaptic")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let again = std::process::Command::new("sh").args(["-c", &line]).env("PATH", path).current_dir(desk.path("")).output().unwrap();
    assert!(again.status.success(), "{line}: {}", String::from_utf8_lossy(&again.stderr));
    assert_eq!(desk.read("DIR/run.html"), first);
}

#[test]
fn what_a_scene_says_is_text_on_the_page() {
    let hostile = "<script>alert(1)</script>";
    let desk = Desk::with("two.toml", &TWO.replace("Two users", hostile));
    let page = page(&desk, "run two.toml");
    assert!(!page.contains("<script") && page.contains("<h1>&lt;script&gt;alert(1)&lt;/script&gt;</h1>"), "{page}");
}

/// 13 of 25 packets a link are sent until 96 ms and arrive; those of 104 ms, ... 192 ms are 12, which are lost: 48 %.
#[test]
fn tables_have_the_figures_of_links_and_peers_the_timeline_and_the_expectations() {
    let scene = format!(
        "{TWO}\n[[timeline]]\nat = \"100ms\"\nlink = \"all\"\nset = {{ loss = \"100%\" }}\n\n[expect]\nstable = true\nloss = [{{ cause = \"loss\", max = \"1%\" }}]\n"
    );
    let page = page(&Desk::with("two.toml", &scene), "run two.toml");
    for row in [
        "<th scope=\"row\">left-&gt;right</th><td class=\"number\">25</td><td class=\"number\">0</td><td class=\"number\">13</td><td class=\"number\">12</td><td class=\"number\">0</td>\
         <td class=\"number\">24.000</td>",
        "<th scope=\"row\">100ms</th><td>link = &quot;all&quot;, set.loss = &quot;100%&quot;</td>",
        "✗ FAILED</b></th><td>fraction of packets dropped on all links (loss)</td><td>at most 0.01</td><td>0.48 (24 of 50)</td>",
        "expected to be stable, which one run cannot tell",
        "<th scope=\"row\">left</th><td class=\"number\">",
    ] {
        assert!(page.contains(row), "no {row} in {page}");
    }
}

#[test]
fn the_page_of_a_run_against_another_holds_both() {
    let desk = Desk::with("two.toml", TWO);
    let document = desk.json("run two.toml --measure all --against link.delay=8ms --out both --json");
    assert_eq!((&document["files"][6], &document["against"]["files"][6]), (&"both/run.html".into(), &"both/against/run.html".into()));
    let (first, second) = (desk.read("both/run.html"), desk.read("both/against/run.html"));
    assert_eq!((page_faults(&first), page_faults(&second)), (Vec::new(), Vec::new()));
    let command = "--against link.delay=8ms --measure all --out DIR";
    assert!(first.contains(command) && second.contains(command), "{first}");
    // Each picture of both folders, pair by pair, and the links of both runs.
    let pictures: Vec<String> =
        ["positions", "forces", "network"].iter().flat_map(|name| [format!("both/{name}.svg"), format!("both/against/{name}.svg")]).collect();
    let places: Vec<usize> = pictures.iter().map(|file| first.find(&desk.read(file)).unwrap_or_else(|| panic!("{file} is missing"))).collect();
    assert!(places.is_sorted() && first.matches("<svg ").count() == 6, "{places:?}");
    for part in [
        "<figure id=\"against/positions.svg\">",
        "<th scope=\"col\">Two users</th><th scope=\"col\">Two users, with link.delay=8ms</th>",
        "<th scope=\"row\">Overrides</th><td><code>measure.names=&quot;all&quot;</code></td><td><code>measure.names=&quot;all&quot;</code>, <code>link.delay=8ms</code></td>",
        "<th scope=\"col\" class=\"number\">Two users</th><th scope=\"col\" class=\"number\">Two users, with link.delay=8ms</th><th scope=\"col\">unit</th>",
        "<h3>Two users, with link.delay=8ms</h3>",
        "24.000</td>",
        "8.000</td>",
    ] {
        assert!(first.contains(part), "no {part} in {first}");
    }
    // Each measure has a value of each run, to six digits.
    let value = |document: &serde_json::Value, name: &str| {
        document["measures"][name].as_f64().map_or_else(|| "–".to_owned(), |value| SixDigits(value).to_string())
    };
    let names = document["measures"].as_object().unwrap().keys();
    let differ = names.filter(|name| {
        let values = [value(&document, name), value(&document["against"], name)];
        let row = format!("<code>{name}</code></th><td class=\"number\">{}</td><td class=\"number\">{}</td>", values[0], values[1]);
        assert!(first.contains(&row), "no {row} in {first}");
        values[0] != values[1]
    });
    assert!(differ.count() > 5);
    // The second run has a page of its own too, which has only that run.
    assert!(second.contains("<h1>Two users, with link.delay=8ms</h1>") && second.contains("8.000</td>") && !second.contains("24.000</td>"));
    assert_eq!(second.matches("<svg ").count(), 3);
}

/// Within 2 s a stiffness of 1e12 N/m diverges, and 1000 N/m does not.
#[test]
fn the_page_of_both_runs_says_which_of_them_diverged_and_what_both_expected() {
    let desk = Desk::with("two.toml", &format!("{TWO}\n[expect]\ndelay = [{{ max = \"1ms\" }}]\n").replace("200ms", "2s"));
    desk.cohaptic("run two.toml --against coordination.stiffness=1e12 --out out");
    let page = desk.read("out/run.html");
    let second = "<h3>Two users, with coordination.stiffness=1e12</h3>\n";
    assert_eq!(page.matches("DIVERGED: at ").count(), 1, "{page}");
    assert!(page.contains(&format!("{second}<p class=\"warning\">DIVERGED: at ")), "{page}");
    let expected = page.split_once("<h2>Expectations</h2>").unwrap().1.split_once("<h2>").unwrap().0;
    assert!(expected.contains("<td>at most 1ms</td><td>24ms</td>") && expected.contains(second), "{expected}");
}

#[test]
fn no_plot_leaves_the_page_away() {
    let desk = Desk::with("two.toml", TWO);
    desk.text("run two.toml --no-plot --out plain --against link.delay=8ms");
    for folder in ["plain", "plain/against"] {
        assert!(!desk.path(&format!("{folder}/run.html")).exists() && desk.path(&format!("{folder}/positions.svg")).exists());
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it needs a browser"]
fn a_browser_shows_the_page_without_scrolling_and_its_texts_apart() {
    let desk = Desk::with("three.toml", RANDOM);
    let page = page(&desk, "run three.toml");
    std::fs::create_dir(desk.path("browser")).unwrap();
    match page_in_browser(&desk.path("browser"), &page) {
        Some(found) => assert_eq!(found, [""; 0]),
        None => eprintln!("skipped: there is no chromium"),
    }
}
