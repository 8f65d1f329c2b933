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
