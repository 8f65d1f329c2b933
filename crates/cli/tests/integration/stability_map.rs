//! `cohaptic stability map`: the region of two keys. Cells are compared with `stability point` at the same place, and maps with one another where a
//! law relates them.

use serde_json::Value;

use crate::integration::desk::Desk;
use crate::integration::scenes::{PAPER, TWO};
use crate::integration::svg::words;

const MAP: &str = "stability map paper.toml --x coordination.stiffness=200..5000 --y coordination.damping=1..31";

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// The radii, row after row.
fn cells(document: &Value) -> Vec<f64> {
    document["spectral_radius"].as_array().unwrap().iter().flat_map(numbers).collect()
}

#[test]
fn every_cell_is_the_verdict_at_its_place() {
    let desk = Desk::with("paper.toml", PAPER);
    let document = desk.json(&format!("{MAP} --grid 3x4 --json"));
    let (x, y) = (numbers(&document["x"]), numbers(&document["y"]));
    assert_eq!((x.as_slice(), y.as_slice()), (&[200.0, 2600.0, 5000.0][..], &[1.0, 11.0, 21.0, 31.0][..]));
    assert_eq!(document["spectral_radius"].as_array().unwrap().len(), 4, "a row for each value of y");
    let mut cells = cells(&document).into_iter();
    let mut stable = 0;
    for damping in &y {
        for stiffness in &x {
            let set = format!("--set coordination.stiffness={stiffness} --set coordination.damping={damping}");
            let point = desk.json(&format!("stability point paper.toml --json {set}"));
            let (there, error) = (point["spectral_radius"].as_f64().unwrap(), point["error_bound"].as_f64().unwrap());
            let here = cells.next().unwrap();
            assert!((here - there).abs() <= 1e-9 + error, "{stiffness} {damping}: {here} {there}");
            stable += i32::from(point["verdict"] == "stable");
        }
    }
    assert!((document["stable_fraction"].as_f64().unwrap() - f64::from(stable) / 12.0).abs() < 1e-12 && stable > 0 && stable < 12);
    assert!(document["wall_s"].as_f64() > Some(0.0) && document["cells_per_s"].as_f64() > Some(0.0));
    assert_eq!(desk.files(""), ["paper.toml"], "nothing is written without --out");
}

#[test]
fn the_table_has_the_numbers_of_the_document() {
    let desk = Desk::with("paper.toml", PAPER);
    let document = desk.json(&format!("{MAP} --grid 7x5 --json --out out"));
    assert_eq!(desk.files("out"), ["map.csv", "map.html", "map.svg"]);
    let mut table = csv::Reader::from_path(desk.path("out/map.csv")).unwrap();
    assert_eq!(table.headers().unwrap(), vec!["coordination.stiffness", "coordination.damping", "spectral_radius", "verdict"]);
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let column = |place: usize| rows.iter().map(|row| row[place].parse().unwrap()).collect::<Vec<f64>>();
    // The reader of JSON in this test may be off by the last bit.
    assert!(
        column(2).iter().zip(cells(&document)).all(|(table, document)| (table - document).abs() <= 4.0 * f64::EPSILON * document) && rows.len() == 35
    );
    let (x, y) = (numbers(&document["x"]), numbers(&document["y"]));
    assert_eq!(column(0), x.repeat(5));
    assert_eq!(column(1), y.iter().flat_map(|y| [*y; 7]).collect::<Vec<f64>>());
    for row in &rows {
        assert_eq!(&row[3], if row[2].parse::<f64>().unwrap() < 1.0 { "stable" } else { "unstable" });
    }
}

/// With two peers both strategies are the same; with three, PD with gains K is AP with gains 2 K.
#[test]
fn curves_obey_the_law_of_the_two_strategies() {
    let desk = Desk::with("paper.toml", PAPER);
    let document = desk.json(&format!(
        "{MAP} --grid 5x4 --json --set scene.count=2 --curve coordination.strategy=proportional-derivative \
         --curve 'scene.count=3, coordination.strategy=proportional-derivative' --against coordination.strategy=average-position --against scene.count=3"
    ));
    let curves = document["curves"].as_array().unwrap();
    let names: Vec<&str> = curves.iter().map(|curve| curve["name"].as_str().unwrap()).collect();
    let pd = "coordination.strategy=proportional-derivative";
    assert_eq!(names, [pd, &format!("scene.count=3, {pd}"), "coordination.strategy=average-position, scene.count=3"]);
    let close = |one: &[f64], other: &[f64]| one.len() == other.len() && one.iter().zip(other).all(|(one, other)| (one - other).abs() < 1e-9);
    assert!(close(&cells(&document), &cells(&curves[0])));
    let doubled = desk
        .json("stability map paper.toml --x coordination.stiffness=400..10000 --y coordination.damping=2..62 --grid 5x4 --json --set scene.count=3");
    assert!(close(&cells(&curves[1]), &cells(&doubled)) && !close(&cells(&curves[2]), &cells(&doubled)));
}

#[test]
fn every_curve_has_a_table_and_an_entry_in_the_legend() {
    let desk = Desk::with("paper.toml", &format!("{PAPER}\n").replace("duration = ", "title = \"<A> & B\", duration = "));
    let text = desk.text(&format!("{MAP} --grid 20x16 --out a/b --curve scene.count=2 --curve scene.count=5,link.delay=24ms"));
    assert_eq!(desk.files("a/b"), ["map-2.csv", "map-3.csv", "map.csv", "map.html", "map.svg"]);
    let svg = desk.read("a/b/map.svg");
    assert_eq!(cohaptic_picture::testing::faults(&svg), [""; 0]);
    let words = words(&svg);
    for part in [
        "<A> & B: spectral radius below 1",
        "Coordination stiffness",
        "[N/m]",
        "Coordination damping",
        "[N·s/m]",
        "stable: average-position",
        "stable: average-position, scene.count=2",
        "stable: average-position, scene.count=5, link.delay=24ms",
    ] {
        assert!(words.iter().any(|word| word == part), "no {part:?} in {words:?}");
        assert!(!text.contains('\u{28ff}'), "no small picture where there is a large one");
    }
    assert!(text.contains(" of 320 cells are stable"), "{text}");
    let alone = desk.cohaptic(&format!("{MAP} --grid 20x16 --out c --set scene.count=2"));
    assert_eq!(alone.stderr, "wrote c/map.csv\nwrote c/map.svg\nwrote c/map.html\n");
    assert_eq!(desk.read("c/map.csv"), desk.read("a/b/map-2.csv"), "a curve is the map with these overrides");
}

/// A colour belongs to a law: the picture has a filled area and an entry for each, and so has the text with its small pictures.
#[test]
fn legends_name_the_law_of_each_region() {
    let desk = Desk::with("paper.toml", PAPER);
    let command = format!("{MAP} --grid 20x16 --set scene.count=3 --curve coordination.strategy=PD");
    let text = desk.text(&command);
    let entries: Vec<&str> = text.lines().filter(|line| line.starts_with("  \u{28ff} ")).collect();
    assert_eq!(entries, ["  \u{28ff} stable: average-position", "  \u{28ff} stable: proportional-derivative"], "{text}");
    desk.text(&format!("{command} --out out"));
    let svg = desk.read("out/map.svg");
    let words = words(&svg);
    for (number, law) in ["average-position", "proportional-derivative"].into_iter().enumerate() {
        assert!(words.contains(&format!("stable: {law}")), "{words:?}");
        assert_eq!(svg.matches(&format!("<path class=\"tint f{number}\"")).count(), 1, "the region of {law} is filled");
    }
    desk.text(&format!("{MAP} --prove 3 --out proven"));
    assert!(desk.read("proven/proof.svg").contains(">proven stable: average-position</text>"));
}

#[test]
fn people_get_a_small_picture() {
    let text = Desk::with("paper.toml", PAPER).text(&format!("{MAP} --grid 30x30"));
    for part in [
        "coordination.stiffness [N/m]\n",
        "  coordination.damping [N·s/m]\n",
        "        31 |",
        "         1 |",
        " of 900 cells are stable; the least",
        " per second\n",
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    assert!(text.contains('\u{28ff}'), "{text}");
}

#[test]
fn threads_change_nothing() {
    let desk = Desk::with("paper.toml", PAPER);
    for jobs in ["1", "2", "5"] {
        desk.text(&format!("{MAP} --grid 40x30 --out {jobs} --jobs {jobs} --curve scene.count=8"));
        for file in ["map.csv", "map-2.csv", "map.svg", "map.html"] {
            assert_eq!(desk.read(&format!("{jobs}/{file}")), desk.read(&format!("1/{file}")));
        }
    }
}

#[test]
fn a_key_with_a_unit_keeps_it() {
    let desk = Desk::with("two.toml", TWO);
    let document = desk.json("stability map two.toml --x link.delay=8ms..24ms --y coordination.stiffness=100..900 --grid 3x2 --json --out out");
    assert_eq!((numbers(&document["x"]), &document["x_unit"], &document["y_unit"]), (vec![8.0, 16.0, 24.0], &"ms".into(), &"".into()));
    assert!(words(&desk.read("out/map.svg")).iter().any(|word| word == "Delay of links"));
    let point = desk.json("stability point two.toml --json --set link.delay=16ms --set coordination.stiffness=900");
    assert!((cells(&document)[4] - point["spectral_radius"].as_f64().unwrap()).abs() < 1e-9);
}

#[test]
fn what_makes_no_sense_is_refused_and_nothing_is_written() {
    let desk = Desk::with("two.toml", TWO);
    let (x, y) = ("--x coordination.stiffness=0..6000", "--y coordination.damping=0..50");
    let elsewhere = y.replace("--y", "--x");
    let same = x.replace("--x", "--y");
    for (rest, parts) in [
        (format!("{x} {y} --grid 0x5"), &["0x5", "at least 2x2"][..]),
        (format!("{x} {y} --grid 1x5"), &["at least 2x2"]),
        (format!("{x} {y} --grid 100000x10000"), &["100000x10000", "at most 10000000"]),
        (format!("{x} {y} --grid 99999999999999999999x2"), &["WIDTHxHEIGHT"]),
        (format!("{x} {y} --grid 5"), &["WIDTHxHEIGHT"]),
        (format!("{x} {y} --grid 3000x3000 --curve scene.seed=1"), &["2 maps", "at most 10000000"]),
        (format!("{x} --grid 5x5"), &["--y"]),
        (format!("{elsewhere} {y} --grid 5x5"), &["coordination.damping", "twice"]),
        (format!("{x} {same} --grid 5x5"), &["coordination.stiffness", "twice"]),
        (format!("--x coordination.stifness=0..1 {y} --grid 5x5"), &["--x coordination.stifness=", "unknown key", "stiffness"]),
        (format!("{x} --y peers.nobody.device.mass=1..2 --grid 5x5"), &["--y peers.nobody.device.mass=1", "nobody", "left, right"]),
        (format!("--x coordination.strategy=0..1 {y} --grid 5x5"), &["coordination.strategy is not a number"]),
        (format!("--x coordination.stiffness=-5..1 {y} --grid 5x5"), &["--x coordination.stiffness=-5", "^"]),
        (format!("--x coordination.stiffness=5..1 {y} --grid 5x5"), &["--x: ", "5 is not below 1"]),
        (format!("--x coordination.stiffness {y} --grid 5x5"), &["--x: ", "KEY=LOW..HIGH"]),
        (format!("{x} {y} --grid 5x5 --curve scene.count"), &["--curve scene.count", "KEY=VALUE"]),
        (format!("{x} {y} --grid 5x5 --curve peers.left.contct=none"), &["--curve peers.left.contct=none", "contact"]),
        (format!("{x} {y} --grid 5x5 --against link.delay=8"), &["--against link.delay=8", "^"]),
        (format!("{x} {y} --grid 5x5 --set link.delay=8"), &["--set link.delay=8", "^"]),
        (format!("{x} {y} --grid 5x5 --set peers.left.clock.drift=0.0123456789"), &["two.toml: ", "clocks"]),
        (format!("{x} {y} --grid 5x5 --threads 0"), &["--threads"]),
        (format!("{x} {y} --grid 5x5 --jobs 100000"), &["--threads", "from 1 to 1024"]),
    ] {
        let outcome = desk.cohaptic(&format!("stability map two.toml {rest} --out out --json"));
        outcome.assert_refused(2, parts);
        assert_eq!((desk.files(""), desk.path("out").exists()), (vec!["two.toml".to_owned()], false), "{rest}");
    }
    desk.cohaptic(&format!("stability map gone.toml {x} {y} --grid 5x5 --out out")).assert_refused(3, &["gone.toml: cannot be read"]);
    desk.write("file", "");
    desk.cohaptic(&format!("stability map two.toml {x} {y} --grid 5x5 --out file/out")).assert_refused(3, &["cannot ", "file/out"]);
}

/// A delay is found out to be refused only where it stands in the grid: a period that is no multiple of a tick.
#[test]
fn a_cell_that_makes_no_sense_leaves_nothing_behind() {
    let desk = Desk::with("two.toml", TWO);
    let line = "stability map two.toml --x coordination.stiffness=0..6000 --y coordination.update=8ms..9ms --grid 3x3 --out out";
    desk.cohaptic(line).assert_refused(2, &["--y coordination.update=8.5ms", "^"]);
    assert!(!desk.path("out").exists());
}

#[cfg(unix)]
mod interrupted {
    use super::*;
    use crate::integration::interrupt::interrupted;

    const ROWS: &str = "out/map.rows.partial";
    /// About two seconds of work: every row is a delay of its own, for which the scene is read anew.
    const LONG: &str = "--x coordination.stiffness=200..5000 --y link.delay=1ms..40ms --grid 200x500 --curve scene.count=4";

    fn rows(desk: &Desk) -> usize {
        std::fs::read_to_string(desk.path(ROWS)).map_or(0, |text| text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())).count())
    }

    #[test]
    #[ignore = ".ci/nightly runs it: it takes long"]
    fn the_same_command_goes_on_and_ends_with_the_same_bytes() {
        let desk = Desk::with("paper.toml", PAPER);
        let line = format!("stability map paper.toml {LONG} --out out");
        let outcome = interrupted(&desk, &line, |_| rows(&desk) > 3);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(130), ""));
        for part in ["interrupted: ", " of 1000 rows are finished", "kept in out/map.rows.partial", "repeat the command to go on"] {
            assert!(outcome.stderr.contains(part), "no {part:?} in {}", outcome.stderr);
        }
        assert_eq!(desk.files("out"), ["map.rows.partial"]);
        let kept = rows(&desk);
        assert!(outcome.stderr.contains(&format!(" {kept} of 1000 rows")), "{}", outcome.stderr);

        // Another grid, range, scene or curve is not mixed in, and the rows stay.
        let before = desk.read(ROWS);
        desk.write("other.toml", PAPER.replace("0.45", "0.5"));
        for other in [
            line.replace("200x500", "200x400"),
            line.replace("..5000", "..5001"),
            line.replace("paper.toml", "other.toml"),
            line.replace("scene.count=4", "scene.count=5"),
            format!("{line} --set object.damping=1"),
        ] {
            desk.cohaptic(&other).assert_refused(2, &["out/map.rows.partial holds the rows of another command"]);
            assert_eq!(desk.read(ROWS), before, "{other}");
        }

        let document = desk.json(&format!("{line} --json"));
        assert_eq!(document["cells_computed"].as_u64(), Some(200 * (1000 - kept as u64)), "what is known is not computed again");
        desk.text(&line.replace("--out out", "--out whole"));
        assert_eq!(desk.files("out"), desk.files("whole"));
        for file in desk.files("whole") {
            assert_eq!(desk.read(&format!("out/{file}")), desk.read(&format!("whole/{file}")), "{file}");
        }
    }
}
