//! A spread campaign has the same rows as the table written by one process.

use std::path::Path;

use cohaptic_campaign::{Campaign, CampaignPlan, Format, NoWatch, PlanSpec, SpreadCampaign, Value, Variation};

const TEXT: &str = r#"
    scene = { duration = "100ms", count = 2 }
    object = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 }, hand = { force = 1.0 } }
    link = { delay = "24ms", loss = "10%" }
"#;

fn plan() -> CampaignPlan {
    let variations = ["scene.count=2,3", "coordination.stiffness=500..1500/3"].map(|text| Variation::parse(text).unwrap()).to_vec();
    let spec =
        PlanSpec { text: TEXT, file: Path::new("two.toml"), set: &[], variations, runs: 5, format: Format::Csv, part: None, program: "a test" };
    CampaignPlan::new(spec).unwrap()
}

fn cell(value: &Value) -> String {
    match value {
        Value::Absent => String::new(),
        Value::Integer(count) => count.to_string(),
        Value::Number(number) => format!("{number:?}"),
        Value::Text(text) => text.to_string(),
    }
}

#[test]
fn the_rows_are_those_of_one_process_whoever_has_which() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    Campaign::open(plan(), &out, &NoWatch).unwrap().run(&NoWatch).unwrap();
    let mut table = csv::Reader::from_path(out.join("runs.csv")).unwrap();
    let names: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    let expected: Vec<Vec<String>> = table.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();

    let first = SpreadCampaign::check(plan(), &NoWatch).unwrap();
    assert_eq!(first.columns().iter().map(|column| column.name.clone()).collect::<Vec<_>>(), names);
    let mut rows = Vec::new();
    for runs in [0..1, 1..13, 13..30] {
        // Another process knows the plan and the roster only.
        let other = SpreadCampaign::with_roster(plan(), &first.roster()).unwrap();
        rows.extend(other.rows(runs, &NoWatch).unwrap());
    }
    assert_eq!((rows.len(), first.runs()), (30, 30));
    for (row, expected) in rows.iter().zip(&expected) {
        for ((value, expected), name) in row.iter().zip(expected).zip(&names) {
            // Numbers are written with the fewest digits that read back as the same `f64`.
            if let Value::Number(number) = value {
                assert_eq!(expected.parse::<f64>().unwrap().to_bits(), number.to_bits(), "{name}");
            } else {
                assert_eq!(&cell(value), expected, "{name}");
            }
        }
    }
    assert!(first.rows(29..31, &NoWatch).is_err());
    assert!(SpreadCampaign::with_roster(plan(), "{}").is_err());
}
