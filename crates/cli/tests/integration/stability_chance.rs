//! Maps and boundaries of scenes whose links leave something to chance: they judge as `stability point` does.

use serde_json::Value;

use crate::integration::desk::Desk;
use crate::integration::scenes::PAPER;

const LOSSY: &str = "--set scene.count=2 --set coordination.stiffness=1400";

fn point(desk: &Desk, options: &str) -> Value {
    desk.json(&format!("stability point paper.toml --json {options}"))
}

#[test]
fn a_boundary_along_a_loss_lies_where_the_mean_square_changes() {
    let desk = Desk::with("paper.toml", PAPER);
    let along = format!("stability boundary paper.toml {LOSSY} --along link.loss=0%..90% --samples 40");
    let document = desk.json(&format!("{along} --json"));
    assert_eq!((&document["criterion"], &document["first"]), (&"mean-square".into(), &"stable".into()));
    let crossings = document["crossings"].as_array().unwrap();
    // Loss does both: it takes a stable loop beyond its limit, and opens it in the end.
    assert_eq!(crossings.len(), 2, "{document}");
    for crossing in crossings {
        let value = crossing["value"].as_f64().unwrap();
        let verdict = |loss: f64| point(&desk, &format!("{LOSSY} --set link.loss={loss}%"))["verdict"].clone();
        assert_eq!((verdict(value - 1e-3), verdict(value + 1e-3)), (crossing["from"].clone(), crossing["to"].clone()), "{value}");
    }
    let text = desk.text(&along);
    assert!(text.contains("stable in the mean square from link.loss=0%"), "{text}");
}

#[test]
fn a_map_has_the_mean_square_radii_of_its_cells() {
    let desk = Desk::with("paper.toml", PAPER);
    let command = format!("stability map paper.toml {LOSSY} --x coordination.stiffness=1000..1800 --y link.loss=0%..60% --grid 3x4");
    let document = desk.json(&format!("{command} --json"));
    assert_eq!((&document["criterion"], &document["nominal_cells"]), (&"mean-square".into(), &0.into()));
    assert!(document.get("spectral_radius").is_none());
    for (row, loss) in [0.0, 20.0, 40.0, 60.0].into_iter().enumerate() {
        for (column, stiffness) in [1000.0, 1400.0, 1800.0].into_iter().enumerate() {
            let point = point(&desk, &format!("--set scene.count=2 --set coordination.stiffness={stiffness} --set link.loss={loss}%"));
            // Without loss a mean-square radius is the square of the spectral one.
            let radius = point["mean_square_radius"].as_f64().unwrap_or_else(|| point["spectral_radius"].as_f64().unwrap().powi(2));
            let found = document["mean_square_radius"][row][column].as_f64().unwrap();
            assert!((found - radius).abs() < 1e-8, "{stiffness} {loss}: {found}, {radius}");
        }
    }
    desk.text(&format!("{command} --out out"));
    let table = desk.read("out/map.csv");
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("coordination.stiffness,link.loss,mean_square_radius,verdict,judged"));
    assert!(lines.all(|line| line.ends_with(",mean-square")));
    let picture = desk.read("out/map.svg");
    assert!(picture.contains("mean-square radius") && picture.contains("stable in the mean square"), "{picture}");
}

#[test]
fn cells_that_cannot_be_followed_are_marked_and_counted() {
    let desk = Desk::with("paper.toml", PAPER);
    let failing = "--set link.outage={random={up=\"5s\",down=\"50ms\"}}";
    let map = format!("stability map paper.toml {failing} --x coordination.stiffness=1000..2000 --y coordination.damping=1..5 --grid 2x3");
    let document = desk.json(&format!("{map} --json"));
    assert_eq!((&document["criterion"], &document["nominal_cells"]), (&"mean-square".into(), &6.into()));
    assert!(document["notes"][0].as_str().unwrap().starts_with("6 cells are nominal"), "{document}");
    desk.text(&format!("{map} --out out"));
    assert!(desk.read("out/map.csv").lines().skip(1).all(|line| line.ends_with(",nominal")));
    let boundary = desk.json(&format!("stability boundary paper.toml {failing} --along coordination.stiffness=100..200 --samples 5 --json"));
    assert_eq!(boundary["nominal"], boundary["samples"]);
    // No text, title or legend says "in the mean square" of cells that are all nominal.
    assert_eq!(document["verdicts"], serde_json::json!([{ "judged": "nominal", "count": 6, "stable_fraction": document["stable_fraction"] }]));
    assert_eq!(document["left_out"], serde_json::json!(["random outages"]));
    let text = desk.text(&map);
    assert!(
        text.contains("\n  nominal (random outages left out): ")
            && text.contains(" % of 6 cells are nominally stable; the least nominal radius squared is ")
    );
    let picture = desk.read("out/map.svg");
    assert!(
        picture.contains(": nominal radius squared below 1")
            && picture.contains("nominally stable: ")
            && picture.contains("nominal (random outages left out)")
    );
    assert!(!text.contains("in the mean square") && !picture.contains("mean square") && !picture.contains("mean-square"), "{text}{picture}");
    let along = format!("stability boundary paper.toml {failing} --along coordination.stiffness=100..200 --samples 5 --out line");
    let text = desk.text(&along);
    assert!(text.contains("nominal (random outages left out)\n  nominally stable from coordination.stiffness=100"), "{text}");
    let picture = desk.read("line/boundary.svg");
    assert!(picture.contains("Nominal radius squared") && !picture.contains("ean-square"), "{picture}");
}

/// With losses in bursts two peers are followed in the mean square, and the twelve links of four have 2¹² joint states, which are too many.
#[test]
fn a_map_of_both_kinds_counts_each_by_itself() {
    let desk = Desk::with("paper.toml", PAPER);
    let bursts = "--set link.loss={gilbert-elliott={p=0.1,r=0.5}} --set link.delay=8ms";
    let map = format!("stability map paper.toml {bursts} --x coordination.stiffness=500..1000 --y scene.count=2..4 --grid 2x2");
    let document = desk.json(&format!("{map} --json"));
    let judged = |loss: &str, count: usize| {
        let of =
            |stiffness: usize| point(&desk, &format!("--set scene.count={count} --set coordination.stiffness={stiffness} --set link.loss={loss}"));
        [500, 1000].map(|stiffness| f64::from(u8::from(of(stiffness)["verdict"] == "stable"))).iter().sum::<f64>() / 2.0
    };
    // Nominal is the scene without loss.
    let expected = [judged("{gilbert-elliott={p=0.1,r=0.5}}", 2), judged("0%", 4)];
    let of = |kind: &str, share: f64| serde_json::json!({ "judged": kind, "count": 2, "stable_fraction": share });
    assert_eq!(document["verdicts"], serde_json::json!([of("mean-square", expected[0]), of("nominal", expected[1])]));
    let text = desk.text(&format!("{map} --out out")) + &desk.text(&map);
    assert!(
        text.contains(&format!("\n  {:.2} % of 2 cells judged in the mean square are stable in the mean square; ", 100.0 * expected[0])),
        "{text}"
    );
    assert!(
        text.contains(&format!("nominal (random loss left out): {:.2} % of 2 cells judged nominally are nominally stable; ", 100.0 * expected[1])),
        "{text}"
    );
    let picture = desk.read("out/map.svg");
    assert!(picture.contains("stable in the mean square, nominally stable where hatched"), "{picture}");
    let along = desk.text(&format!("stability boundary paper.toml {bursts} --along scene.count=2..4 --samples 3 --tolerance 1"));
    assert!(along.contains("nominal (random loss left out): ") && along.contains("stable in the mean square from scene.count=2"), "{along}");
}

#[test]
fn an_admittance_says_what_the_mean_square_does() {
    let desk = Desk::with("paper.toml", PAPER);
    let options = format!("{LOSSY} --set link.loss=30%");
    let document = desk.json(&format!("admittance paper.toml --peer peer1 --points 3 --json {options}"));
    let point = point(&desk, &options);
    assert_eq!((&document["verdict"], &document["mean_square"]["verdict"]), (&"stable".into(), &"unstable".into()));
    assert_eq!(document["mean_square"]["radius"], point["mean_square_radius"]);
    let text = desk.text(&format!("admittance paper.toml --peer peer1 --points 3 {options}"));
    assert!(
        text.contains("WARNING: the scene is unstable in the mean square") && text.contains("in the mean square the scene is UNSTABLE"),
        "{text}"
    );
}
