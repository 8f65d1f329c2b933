//! The pictures of `cohaptic campaign`.

use cohaptic_picture::testing::{faults, in_browser};

use crate::integration::desk::Desk;
use crate::integration::scenes::{PAPER, RANDOM, TWO};
use crate::integration::svg::words;

const STRATEGIES: &str = "--vary coordination.strategy=average-position,proportional-derivative";
const UNFOLLOWED: &str = "link.outage={random={up=\"5s\",down=\"50ms\"}}";

fn desk() -> Desk {
    let desk = Desk::with("random.toml", RANDOM);
    desk.write("paper.toml", PAPER);
    desk.write("two.toml", TWO);
    desk
}

/// Every kind of picture: a command, and words that its pictures must have: of the discrepancy, and of the verdicts.
fn kinds() -> Vec<(String, Vec<&'static str>, Vec<&'static str>)> {
    let random = |rest: &str| format!("campaign random.toml --runs 20 --verdicts {rest}");
    let bands = ["90 % of the runs", "50 % of the runs", "median", "Largest discrepancy [mm]"];
    let with = |more: &[&'static str]| bands.iter().chain(more).copied().collect();
    vec![
        (random("--vary link.loss=0%..40%/5"), with(&["Loss on links [%]"]), vec!["Loss on links [%]", "Nominal radius squared", "1"]),
        (
            random(STRATEGIES),
            with(&["The rows are the values of coordination.strategy.", "average-position"]),
            vec!["proportional-derivative", "Nominal radius squared"],
        ),
        (
            random(&format!("--vary link.loss=0%..40%/5 {STRATEGIES}")),
            with(&["coordination.strategy=average-position", "coordination.strategy=proportional-derivative"]),
            vec!["coordination.strategy=proportional-derivative"],
        ),
        (
            random("--vary link.loss=0%..40%/5 --vary coordination.stiffness=500..2000/4:log"),
            vec!["Median of the largest discrepancy [mm]", "Coordination stiffness", "Loss on links [%]"],
            vec!["nominal: nothing is left to chance", "nominally stable: average-position"],
        ),
        (
            random(&format!("--vary link.loss=0%,40% --vary coordination.stiffness=500,900 {STRATEGIES}")),
            vec!["Median of the largest discrepancy", "coordination.strategy=average-position"],
            // Of two laws the title of the panel names each, and the legend none.
            vec!["coordination.strategy=average-position", "nominally stable"],
        ),
        // With the last stiffness all runs diverge: there is no median.
        (
            format!("campaign two.toml --verdicts {DIVERGING} --set link.loss=5% --runs 2"),
            vec!["Share of runs that diverged", "diverged", "Quantiles of the runs that did not diverge, of which each combination has 2."],
            vec!["What goes far beyond 1 is cut off.", "Mean-square radius"],
        ),
        (
            format!("campaign two.toml --verdicts {DIVERGING} --vary coordination.damping=5,20"),
            vec!["all runs diverged", "Share of runs that diverged"],
            vec!["stable: average-position", "unstable"],
        ),
        (
            format!("campaign paper.toml --set {UNFOLLOWED} --verdicts --vary coordination.stiffness=500..1000/3"),
            vec!["Coordination stiffness"],
            vec!["nominal: nothing is left to chance", "Nominal radius squared"],
        ),
    ]
}

/// The last of these multiplies a disturbance by hundreds in each of many frames.
const DIVERGING: &str = "--set scene.duration=60s --vary coordination.stiffness=500,1000,1e6";

#[test]
fn every_kind_of_picture_is_fit_to_print() {
    let desk = desk();
    let mut pictures = Vec::new();
    for (number, (command, discrepancy, verdicts)) in kinds().into_iter().enumerate() {
        desk.text(&format!("{command} --out out{number}"));
        for (name, parts) in [("discrepancy", discrepancy), ("verdicts", verdicts)] {
            let svg = desk.read(&format!("out{number}/{name}.svg"));
            assert_eq!(faults(&svg), [""; 0], "{command} {name}");
            let words = words(&svg);
            assert!(parts.iter().all(|part| words.iter().any(|word| word == part)), "{command}: {parts:?} in {words:?}");
            pictures.push((format!("{number} {name}"), svg));
        }
        desk.text(&format!("{command} --out out{number} --size one-column"));
        let svg = desk.read(&format!("out{number}/discrepancy.svg"));
        assert!(svg.contains("width=\"85mm\"") && faults(&svg).is_empty(), "{:?}", faults(&svg));
        pictures.push((format!("{number} one column"), svg));
    }
    let folder = tempfile::tempdir().unwrap();
    let found = in_browser(folder.path(), &pictures);
    assert!(found.as_ref().is_none_or(Vec::is_empty), "{found:#?}");
}

/// The median is that of the rows by the definition: the smallest value that at least half of the runs do not exceed; the median of 25 is the 13th, by rank.
#[test]
fn the_line_is_the_median_of_the_rows() {
    let desk = desk();
    desk.text("campaign random.toml --runs 25 --vary link.loss=10%,40%,0%,30% --format csv --out out");
    let mut reader = csv::Reader::from_path(desk.path("out/runs.csv")).unwrap();
    let place = reader.headers().unwrap().iter().position(|name| name == "max_discrepancy_m").unwrap();
    let values: Vec<f64> = reader.records().map(|row| row.unwrap()[place].parse().unwrap()).collect();
    let mut medians: Vec<f64> = values
        .chunks(25)
        .map(|runs| {
            let mut runs = runs.to_vec();
            runs.sort_by(f64::total_cmp);
            runs[12]
        })
        .collect();
    // As along the axis: 0, 10, 30 and 40 %.
    medians = [2, 0, 3, 1].map(|place| medians[place]).to_vec();
    let svg = desk.read("out/discrepancy.svg");
    let number = |circle: &str, name: &str| circle.split_once(&format!(" {name}=\"")).unwrap().1.split_once('"').unwrap().0.parse::<f64>().unwrap();
    let marks: Vec<(f64, f64)> =
        svg.lines().filter(|line| line.starts_with("<circle")).map(|line| (number(line, "cx"), number(line, "cy"))).collect();
    // The last circle is that of the legend.
    let marks = &marks[..4];
    assert_eq!(marks.len(), medians.len());
    let (left, right) = (marks[0], marks[3]);
    for ((x, y), (median, loss)) in marks.iter().zip(medians.iter().zip([0.0, 10.0, 30.0, 40.0])) {
        // Coordinates have two decimals.
        let along = left.0 + (right.0 - left.0) * loss / 40.0;
        let up = left.1 + (right.1 - left.1) * (median - medians[0]) / (medians[3] - medians[0]);
        assert!((x - along).abs() < 0.02 && (y - up).abs() < 0.03, "{marks:?} {medians:?}");
    }
    assert!((left.1 - right.1).abs() > 20.0, "the medians differ");
}

/// With the last of three values the run diverges, so that the line of the medians joins the first two.
#[test]
fn a_line_ends_before_runs_that_diverge() {
    let desk = desk();
    desk.text(&format!("campaign two.toml {DIVERGING} --out out"));
    let svg = desk.read("out/discrepancy.svg");
    let line = svg.lines().find(|line| line.contains("class=\"line s0\"")).unwrap();
    assert_eq!(line.matches('L').count(), 1, "{line}");
}

#[test]
fn pictures_are_the_same_for_any_number_of_threads_and_when_the_command_is_repeated() {
    let desk = desk();
    let command = "campaign random.toml --runs 20 --verdicts --vary link.loss=0%..40%/5 --vary coordination.stiffness=500..2000/4";
    let read = |folder: &str| ["discrepancy.svg", "verdicts.svg", "campaign.html"].map(|file| desk.read(&format!("{folder}/{file}")));
    desk.text(&format!("{command} --threads 1 --out one"));
    desk.text(&format!("{command} --threads 3 --out three"));
    let drawn = read("one");
    assert!(drawn == read("three"));
    for file in ["discrepancy.svg", "verdicts.svg", "verdicts.csv", "campaign.html"] {
        std::fs::remove_file(desk.path(&format!("one/{file}"))).unwrap();
    }
    let again = desk.cohaptic(&format!("{command} --out one"));
    assert_eq!(
        again.stderr,
        "wrote one/runs.parquet\nwrote one/verdicts.csv\nwrote one/discrepancy.svg\nwrote one/verdicts.svg\nwrote one/campaign.html\n"
    );
    assert!(drawn == read("one") && again.stdout.contains("nothing was run"));
    let document = desk.json(&format!("{command} --out one --json"));
    let files: Vec<&str> = document["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()).collect();
    assert_eq!(files, ["one/runs.parquet", "one/verdicts.csv", "one/discrepancy.svg", "one/verdicts.svg", "one/campaign.html"]);
}

/// With the last stiffness all runs diverge, by far more than 1 m. The scale ends at the other runs, which stay within millimetres.
#[test]
fn cells_whose_runs_diverged_have_a_colour_of_their_own_and_do_not_set_the_scale() {
    let desk = desk();
    desk.text(&format!("campaign two.toml {DIVERGING} --vary coordination.damping=5,20 --out out"));
    let svg = desk.read("out/discrepancy.svg");
    let words = words(&svg);
    assert!(["Median of the largest discrepancy [mm]", "all runs diverged"].iter().all(|part| words.iter().any(|word| word == part)), "{words:?}");
    // A tint and a hatching over it, in the panel of medians and in the legend.
    for class in ["tint f1", "back-hatch"] {
        assert_eq!(["path", "rect"].map(|shape| svg.matches(&format!("<{shape} class=\"{class}\"")).count()), [1, 1], "{class}");
    }
}

#[test]
fn what_is_not_drawn_is_said() {
    let desk = desk();
    desk.text("campaign random.toml --runs 2 --vary link.loss=0%,10% --no-plot --out none");
    assert_eq!(desk.files("none"), ["campaign.json", "runs.parquet"]);
    desk.text("campaign random.toml --runs 2 --vary link.loss=10% --out one-value");
    assert_eq!(desk.files("one-value"), ["campaign.html", "campaign.json", "runs.parquet"]);
    let three = "--vary link.loss=0%..10%/2 --vary coordination.stiffness=500,1000 --vary object.mass=0.3..0.6/13 --set scene.duration=50ms";
    let text = desk.text(&format!("campaign random.toml {three} --out three"));
    assert!(text.contains("note: no picture is drawn: a panel for each value of object.mass would be 13 panels, and at most 12 are drawn"), "{text}");
    assert_eq!(desk.files("three"), ["campaign.html", "campaign.json", "runs.parquet"]);
    let names =
        format!("--vary link.delay={}ms --set scene.duration=50ms", (10..35).map(|n| format!("{n}000us")).collect::<Vec<_>>().join(",") + ",1");
    let text = desk.text(&format!("campaign random.toml {names} --out names"));
    assert!(text.contains("link.delay has 26 values that are no different numbers, and at most 24 are drawn"), "{text}");
    desk.cohaptic("campaign random.toml --vary link.loss=0%,10% --out small --size 20x20mm").assert_refused(2, &["a picture is 160 px"]);
}
