//! `cohaptic admittance`.

use serde_json::Value;

use crate::integration::desk::Desk;
use crate::integration::scenes::TWO;
use crate::integration::svg;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// Returns a desk with a scene of the paper's parameters, in which one of two peers touches the object.
fn desk() -> Desk {
    let scene = TWO.replace("mass = 0.3", "mass = 0.45").replace("damping   = 20.0", "damping   = 5.0").replace("\"24ms\"", "\"8ms\"");
    Desk::with("two.toml", &scene.replace("name = \"right\"", "name = \"right\"\ncontact = \"none\""))
}

/// −29.0178 dB, −0.030° and, by extrapolation, 28.24 N·s/m and 0.2363 kg were computed in long arithmetic, 30.97 dB is 1/(2π·0.01·0.45), and 5 + 2·1000·(11.5 ms + δ) is the law of scenarios/README.md.
#[test]
fn the_document_has_points_and_what_is_rendered() {
    let document = desk().json("admittance two.toml --peer left --at 0.01,1 --json");
    let points = document["points"].as_array().unwrap();
    assert_eq!((points.len(), number(&points[0]["hz"]), number(&points[1]["hz"])), (2, 0.01, 1.0));
    assert!((number(&points[0]["magnitude_db"]) + 29.017_827_1).abs() < 1e-6, "{document:#}");
    assert!((number(&points[0]["phase_deg"]) + 0.030_124_7).abs() < 1e-6);
    assert!((number(&points[0]["ideal_db"]) - 30.97).abs() < 0.005);
    let part = |of: &str, what: &str| number(&document[of][what]);
    assert!((part("viscosity", "value") - 28.241_703_6).abs() < 1e-6 && part("viscosity", "error") < 1e-6, "{document:#}");
    assert!((part("viscosity", "value") / (5.0 + 2000.0 * (0.0115 + 5e-6 / 0.225 * 63.0 / 12.0)) - 1.0).abs() < 0.02);
    assert!((part("inertia", "value") - 0.236_326_4).abs() < 1e-6 && part("inertia", "error") < 1e-6);
    assert_eq!((part("stiffness", "value"), part("stiffness", "error")), (0.0, 0.0));
    assert_eq!((&document["peer"], &document["verdict"], &document["warning"]), (&"left".into(), &"stable".into(), &Value::Null));
    assert!(number(&document["spectral_radius"]) < 1.0 && number(&document["error_bound"]) < 1e-6);
    for empty in ["files", "curves", "notes"] {
        assert_eq!(document[empty], Value::Array(vec![]));
    }
}

#[test]
fn frequencies_are_spread_over_decades() {
    let desk = desk();
    let hz = |line: &str| -> Vec<f64> {
        desk.json(&format!("admittance two.toml --peer left --json {line}"))["points"]
            .as_array()
            .unwrap()
            .iter()
            .map(|point| number(&point["hz"]))
            .collect()
    };
    let usual = hz("");
    assert_eq!((usual.len(), usual[0], usual[59]), (60, 0.01, 100.0));
    assert!(usual.windows(2).all(|pair| (pair[1] / pair[0] / 10_000_f64.powf(1.0 / 59.0) - 1.0).abs() < 1e-12));
    assert_eq!(hz("--from 1 --to 100 --points 3"), [1.0, 10.0, 100.0]);
    // Half the rate of ticks of 8 ms.
    assert_eq!(hz("--set peer.tick=8ms --points 2"), [0.01, 62.5]);
}

#[test]
fn the_text_has_a_table_and_says_what_is_felt() {
    let text = desk().text("admittance two.toml --peer left --at 0.01,62.5");
    for part in [
        "Two users\n",
        "Hz            dB",
        "          0.01       -29.018         -0.03        30.972\n",
        "moved slowly, left feels\n",
        "a viscosity of  28.241704 +- ",
        "an inertia of   0.236326 +- ",
        "the scene is stable: ",
    ] {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
    assert!(text.contains("          62.5 "), "{text}");
}

#[test]
fn several_curves_are_laid_over_each_other() {
    let desk = desk();
    let curve = "--curve scene.title=b,coordination.strategy=proportional-derivative --curve 'link.delay=24ms, coordination.stiffness=200'";
    let document = desk.json(&format!("admittance two.toml --peer left --json --points 40 --out out/a {curve}"));
    let alone = desk.json("admittance two.toml --peer left --json --points 40 --set link.delay=24ms --set coordination.stiffness=200");
    assert_eq!(document["curves"].as_array().map(Vec::len), Some(2));
    // For two peers both strategies are the same.
    assert_eq!((&document["curves"][0]["points"], &document["curves"][1]["points"]), (&document["points"], &alone["points"]));
    assert_eq!(document["curves"][1]["name"], "link.delay=24ms, coordination.stiffness=200");
    assert_eq!(document["files"], serde_json::json!(["out/a/admittance.csv", "out/a/admittance.svg", "out/a/admittance.html"]));
    assert_eq!(desk.files("out/a"), ["admittance.csv", "admittance.html", "admittance.svg"]);

    let csv = desk.read("out/a/admittance.csv");
    let mut rows = csv::Reader::from_reader(csv.as_bytes());
    assert_eq!(rows.headers().unwrap(), ["curve", "hz", "magnitude_db", "phase_deg", "ideal_db"].as_slice());
    let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 3 * 40);
    for (document, rows) in [&document, &document["curves"][0], &alone].into_iter().zip(rows.chunks(40)) {
        for (point, row) in document["points"].as_array().unwrap().iter().zip(rows) {
            for (column, key) in ["hz", "magnitude_db", "phase_deg", "ideal_db"].iter().enumerate() {
                // Read by the same reader: the same digits.
                assert_eq!(serde_json::from_str::<Value>(&row[column + 1]).unwrap(), point[*key], "{key}");
            }
        }
    }
    assert_eq!([&rows[0][0], &rows[80][0]], ["as it stands", "link.delay=24ms, coordination.stiffness=200"]);
    let words = sound(&desk.read("out/a/admittance.svg"));
    for word in [
        "Two users: velocity over force of left",
        "Magnitude [dB re 1 m/(N·s)] over Frequency\u{a0}f [Hz] (logarithmic). Phase [degrees] over Frequency\u{a0}f [Hz] (logarithmic).",
        "Magnitude [dB re 1 m/(N·s)]",
        "Phase [degrees]",
        "average-position",
        "average-position, link.delay=24ms, coordination.stiffness=200",
        "free mass of 0.45 kg",
        "0.01",
        "100",
    ] {
        assert!(words.iter().any(|found| found == word), "no {word:?} in {words:?}");
    }
}

/// The texts of a picture without a fault.
fn sound(plot: &str) -> Vec<String> {
    assert_eq!(cohaptic_picture::testing::faults(plot), [""; 0]);
    svg::words(plot)
}

#[test]
fn an_unstable_scene_warns() {
    let desk = desk();
    let line = "admittance two.toml --peer left --at 1 --set coordination.stiffness=20000";
    let (text, document) = (desk.text(line), desk.json(&format!("{line} --json")));
    assert!(text.contains("WARNING: the scene is unstable") && text.contains("the scene is UNSTABLE: spectral radius"), "{text}");
    assert!(document["warning"].as_str().unwrap().contains("unstable") && number(&document["spectral_radius"]) > 1.0);
    assert_eq!((&document["verdict"], document["points"].as_array().map(Vec::len)), (&"unstable".into(), Some(1)));
    // One curve of several.
    let document = desk.json("admittance two.toml --peer left --at 1 --curve coordination.stiffness=20000 --json --out out");
    assert_eq!((&document["verdict"], &document["curves"][0]["verdict"]), (&"stable".into(), &"unstable".into()));
    assert!(document["warning"].is_null() && document["curves"][0]["warning"].is_string());
    let words = sound(&desk.read("out/admittance.svg"));
    assert!(
        ["average-position", "average-position, coordination.stiffness=20000 (UNSTABLE)"].iter().all(|name| words.iter().any(|word| word == name)),
        "{words:?}"
    );
}

/// A point is the same whatever else is asked for, and its phase is between −180 and 180. The picture takes points in any order, and
/// follows the phase from one to the next however far apart they are: at 499 Hz it is −179.8°, and not half a turn or more away from where it came from.
#[test]
fn a_point_does_not_depend_on_the_others() {
    let desk = desk();
    let hz = ["499", "0.01", "300", "10"];
    let all = desk.json(&format!("admittance two.toml --peer left --json --out out --at {}", hz.join(",")));
    for (place, hz) in hz.iter().enumerate() {
        let alone = desk.json(&format!("admittance two.toml --peer left --json --at {hz} --out alone"));
        assert_eq!(alone["points"][0], all["points"][place]);
        assert!(number(&alone["points"][0]["phase_deg"]).abs() <= 180.0);
        sound(&desk.read("alone/admittance.svg"));
    }
    let words = sound(&desk.read("out/admittance.svg"));
    assert!(["\u{2212}180", "45"].iter().all(|end| words.iter().any(|word| word == end)) && !words.iter().any(|word| word == "225"), "{words:?}");
}

#[test]
fn what_a_scene_says_stays_text_in_the_files() {
    let desk = desk();
    let curve = r#"--curve 'scene.title="</svg>",object.mass=0.5'"#;
    desk.text(&format!(r#"admittance two.toml --peer left --points 3 --out out --set 'scene.title="<b>,&"' {curve}"#));
    let words = sound(&desk.read("out/admittance.svg"));
    let name = r#"average-position, scene.title="</svg>", object.mass=0.5"#;
    for word in ["<b>,&: velocity over force of left", name, "free mass of 0.45 kg", "free mass of 0.5 kg"] {
        assert!(words.iter().any(|found| found == word), "no {word:?} in {words:?}");
    }
    let csv = desk.read("out/admittance.csv");
    let rows: Vec<csv::StringRecord> = csv::Reader::from_reader(csv.as_bytes()).records().map(Result::unwrap).collect();
    assert_eq!((rows.len(), &rows[5][0]), (6, r#"scene.title="</svg>", object.mass=0.5"#));
}

#[test]
fn what_is_wrong_is_refused_and_nothing_is_written() {
    let desk = desk();
    for (line, parts) in [
        ("", &["--peer"][..]),
        ("--peer third", &["--peer third: no such peer: expected one of left, right\n"]),
        (
            "--peer left --curve 'peers=[{ name = \"a\" }, { name = \"b\" }]'",
            &["--peer left: no such peer with --curve peers=", "expected one of a, b"],
        ),
        ("--peer left --at 1,", &["--at"]),
        ("--peer left --points 1000001", &["--points 1000001: expected at most 1000000"]),
        ("--peer left --at 0", &["--at 0: expected a frequency above 0 and at most 500 Hz"]),
        ("--peer left --at 1,500.1", &["--at 500.1", "half the rate of the peer's ticks"]),
        ("--peer left --at nan", &["--at NaN"]),
        ("--peer left --at soon", &["soon"]),
        ("--peer left --at 1 --from 2", &["cannot be used with"]),
        ("--peer left --from -1", &["--from -1: expected a frequency above 0"]),
        ("--peer left --from 200", &["from 200 Hz to 100 Hz", "the first below the last"]),
        ("--peer left --to 1000", &["--to 1000"]),
        ("--peer left --points 1", &["1 frequency from 0.01 Hz to 100 Hz"]),
        ("--peer left --points 0", &["--points"]),
        ("--peer left --curve link.delay", &["--curve link.delay: \"link.delay\" has no ="]),
        ("--peer left --curve link.dlay=1ms", &["--curve link.dlay=1ms: link.dlay: unknown key"]),
        ("--peer left --set link.dlay=1ms", &["--set link.dlay=1ms"]),
    ] {
        desk.cohaptic(&format!("admittance two.toml --out out {line}")).assert_refused(2, parts);
        assert!(!desk.path("out").exists(), "{line}");
    }
    desk.cohaptic("admittance gone.toml --peer left").assert_refused(3, &["gone.toml"]);
}
