//! Verdicts of a judge: each combination is judged once, each judgement is stored at once, and the rows of the runs contain the judgements.

use std::sync::atomic::{AtomicU64, Ordering};

use cohaptic_campaign::{Campaign, CampaignError, Format, Judge, Judgement, NoWatch, Outcome, Verdict};
use cohaptic_scene::Scene;

use crate::bench::{Bench, comma_separated, finished};

/// Judges by the stiffness alone, refuses stiffnesses divisible by three, and gives up after a number of judgements.
pub(crate) struct ByStiffness(AtomicU64);

impl ByStiffness {
    pub(crate) const fn at_most(most: u64) -> Self {
        Self(AtomicU64::new(most))
    }
}

impl Judge for ByStiffness {
    fn judge(&self, scene: &Scene) -> Option<Judgement> {
        self.0.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1)).ok()?;
        let stiffness = scene.coordination.gains.stiffness;
        Some(if stiffness % 3.0 == 0.0 {
            Judgement::Refused("a third,\nof all".into())
        } else {
            Judgement::Known(Verdict { word: "stable".into(), judged: "by hand".into(), radius: 1.0 / stiffness, error: 0.1 })
        })
    }
}

pub(crate) fn bench() -> Bench {
    let mut bench = Bench::new(&["coordination.stiffness=900..907/8"], 3);
    bench.format = Format::Csv;
    bench
}

pub(crate) fn open(bench: &Bench, folder: &str) -> Campaign {
    Campaign::open(bench.plan().unwrap().with_verdicts(), &bench.path(folder), &NoWatch).unwrap()
}

#[test]
fn each_combination_is_judged_once_however_often_it_is_stopped() {
    let bench = bench();
    let mut missing = 8_u64;
    while missing > 0 {
        let mut campaign = open(&bench, "out");
        assert!(matches!(campaign.run(&NoWatch), Err(CampaignError::NotJudged)));
        let left = campaign.judge(&ByStiffness::at_most(3), &NoWatch).unwrap();
        assert_eq!(left, missing.saturating_sub(3));
        missing = left;
    }
    let mut campaign = open(&bench, "out");
    // No combination is left to judge.
    assert_eq!(campaign.judge(&ByStiffness::at_most(0), &NoWatch).unwrap(), 0);
    let report = finished(campaign.run(&NoWatch).unwrap());
    let mut whole = open(&bench, "whole");
    assert_eq!(whole.judge(&ByStiffness::at_most(8), &NoWatch).unwrap(), 0);
    let Outcome::Finished(other) = whole.run(&NoWatch).unwrap() else { panic!("interrupted") };
    assert_eq!((report.judgements.len(), &report.judgements, &report.quantiles), (8, &other.judgements, &other.quantiles));
    for file in ["runs.csv", "verdicts.csv", "campaign.json"] {
        let read = |folder: &str| std::fs::read(bench.path(folder).join(file)).unwrap();
        assert!(read("out") == read("whole"), "{file}");
    }
    assert_eq!(bench.files("out"), ["campaign.json", "cohaptic.lock", "runs.csv", "verdicts.csv"]);
    let (header, rows) = comma_separated(&bench.path("out/runs.csv"));
    let place = |name: &str| header.iter().position(|found| found == name).unwrap();
    for row in &rows {
        let stiffness: f64 = row[place("coordination.stiffness")].parse().unwrap();
        let cells = ["verdict", "judged", "radius", "error_bound"].map(|name| row[place(name)].clone());
        let known = ["stable".to_owned(), "by hand".to_owned(), format!("{:?}", 1.0 / stiffness), "0.1".to_owned()];
        assert_eq!(cells, if stiffness % 3.0 == 0.0 { [const { String::new() }; 4] } else { known }, "{stiffness}");
    }
    // The quantiles are the quantiles of the rows: of three values by rank, the first, the second and the third.
    for (runs, quantiles) in rows.chunks(3).zip(&report.quantiles) {
        let mut values: Vec<f64> = runs.iter().map(|row| row[place("max_discrepancy_m")].parse().unwrap()).collect();
        values.sort_by(f64::total_cmp);
        let found = quantiles.unwrap();
        assert_eq!([found.p5, found.p25, found.median, found.p75, found.p95], [values[0], values[0], values[1], values[2], values[2]]);
    }
}

#[test]
fn verdicts_that_are_not_as_they_were_written_are_refused_and_a_campaign_without_is_another() {
    let bench = bench();
    let mut campaign = open(&bench, "out");
    assert_eq!(campaign.judge(&ByStiffness::at_most(8), &NoWatch).unwrap(), 0);
    finished(campaign.run(&NoWatch).unwrap());
    drop(campaign);
    let path = bench.path("out/verdicts.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    for damaged in [text.replacen("\n1,", "\n7,", 1), text[..text.len() / 2].rsplit_once('\n').unwrap().0.to_owned() + "\n", text.replace("0.1", "x")]
    {
        std::fs::write(&path, damaged).unwrap();
        let error = open(&bench, "out").judge(&ByStiffness::at_most(8), &NoWatch).unwrap_err();
        assert!(error.to_string().contains("remove it and repeat the command, which judges again"), "{error}");
    }
    std::fs::remove_file(&path).unwrap();
    assert_eq!(open(&bench, "out").judge(&ByStiffness::at_most(8), &NoWatch).unwrap(), 0);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    bench.assert_refused("out", &["--verdicts is given there and not given here"]);
}
