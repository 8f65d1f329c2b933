//! Comparisons of strategies: refused combinations are left out, and the other runs equal the runs of a campaign without them.

use std::sync::atomic::{AtomicU64, Ordering};

use cohaptic_campaign::{
    Campaign, CampaignError, CampaignPlan, Comparison, Format, Judge, Judgement, NoWatch, Outcome, Row, SpreadCampaign, Strategies, Verdict, Watch,
};
use cohaptic_scene::Scene;

use crate::bench::{Bench, StopAfter, comma_separated, finished};

/// A damping of "auto" is refused on links with random delays, hence in the last of four combinations.
const REFUSING: [&str; 2] = ["coordination.strategy=average-position,local-damping", "link.jitter=0ms,1ms"];

fn bench(vary: &[&str]) -> Bench {
    let mut bench = Bench::new(vary, 10);
    bench.set = vec!["link.loss=0%".to_owned()];
    bench.part = Some(8);
    bench
}

fn plan(bench: &Bench) -> Result<CampaignPlan, CampaignError> {
    Ok(bench.plan()?.leaving_out(Strategies::fallback()))
}

fn open(bench: &Bench, folder: &str) -> Result<Campaign, CampaignError> {
    Campaign::open(plan(bench)?, &bench.path(folder), &NoWatch)
}

fn outcome(bench: &Bench, folder: &str, threads: usize, watch: &dyn Watch) -> Outcome {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| Campaign::open(plan(bench).unwrap(), &bench.path(folder), watch)?.run(watch)).unwrap()
}

/// Runs the campaign to its end, and compares.
fn compare(bench: &Bench, folder: &str) -> Comparison {
    let mut campaign = open(bench, folder).unwrap();
    finished(campaign.run(&NoWatch).unwrap());
    campaign.compare().unwrap()
}

#[test]
fn where_nothing_is_refused_it_is_the_plain_campaign_to_the_last_byte() {
    for format in [Format::Parquet, Format::Csv] {
        let mut bench = bench(&["coordination.strategy=average-position,extrapolated{horizon=3ms},extrapolated", "link.jitter=0ms,1ms"]);
        bench.format = format;
        bench.finish("plain", 1);
        compare(&bench, "compared");
        assert!(bench.table("plain") == bench.table("compared"), "other bytes");
        assert_eq!(bench.files("plain"), bench.files("compared"));
        // Either plan continues the campaign in the folder of the other plan.
        assert_eq!(finished(outcome(&bench, "plain", 1, &NoWatch)).computed, 0);
        assert_eq!(bench.finish("compared", 1).computed, 0);
    }
}

#[test]
fn what_a_strategy_refuses_is_known_before_anything_runs_and_stops_nothing_else() {
    let mut bench = bench(&REFUSING);
    bench.format = Format::Csv;
    bench.assert_refused("plain", &["damping of \"auto\""]);
    let campaign = open(&bench, "out").unwrap();
    assert_eq!((campaign.refused().keys().copied().collect::<Vec<u64>>(), campaign.runs(), campaign.kept()), (vec![3], 30, 0));
    assert!(campaign.refused()[&3].starts_with("a damping of \"auto\" needs the age"), "{:?}", campaign.refused());
    drop(campaign);
    let report = finished(outcome(&bench, "out", 2, &NoWatch));
    assert_eq!(report.combinations.iter().map(|combination| combination.runs).collect::<Vec<u64>>(), [10, 10, 10, 0]);
    // The accepted runs equal the runs of a campaign without the refused strategy.
    let (_, rows) = comma_separated(&bench.path("out/runs.csv"));
    assert_eq!(rows.iter().map(|row| row[0].clone()).collect::<Vec<String>>(), (0..30).map(|run| run.to_string()).collect::<Vec<String>>());
    // The first combination is left out, and the numbers of the runs still count it.
    bench.vary = ["coordination.strategy=local-damping,average-position", "link.jitter=1ms"].map(str::to_owned).to_vec();
    finished(outcome(&bench, "other", 1, &NoWatch));
    let (_, other) = comma_separated(&bench.path("other/runs.csv"));
    assert_eq!(
        other.iter().map(|row| [&row[0], &row[1], &row[2]].map(String::as_str).join(" ")).collect::<Vec<String>>(),
        (0..10).map(|run| format!("{} 1 {}", run + 10, run + 7)).collect::<Vec<String>>()
    );
    let figures = |rows: &[Vec<String>]| rows.iter().map(|row| row[5..].to_vec()).collect::<Vec<Vec<String>>>();
    assert_eq!(figures(&other), figures(&rows[10..20]));
}

#[test]
fn however_it_was_interrupted_the_table_without_the_refused_is_the_same() {
    for format in [Format::Parquet, Format::Csv] {
        let mut bench = bench(&REFUSING);
        bench.format = format;
        let whole = compare(&bench, "whole");
        for (stop, threads) in [(1, 1), (1, 2)] {
            assert!(matches!(outcome(&bench, "parts", threads, &StopAfter::runs(stop)), Outcome::Interrupted { .. }));
        }
        assert_eq!(compare(&bench, "parts"), whole);
        assert!(bench.table("parts") == bench.table("whole"), "other bytes");
        assert_eq!(bench.files("parts"), bench.files("whole"));
        // A plan which leaves nothing out is another campaign.
        bench.assert_refused("whole", &["another campaign", "1 of them, are left out there and not here"]);
    }
}

#[test]
fn a_table_of_either_format_is_compared_alike() {
    let mut bench = bench(&REFUSING);
    let parquet = compare(&bench, "parquet");
    bench.format = Format::Csv;
    assert_eq!(parquet, compare(&bench, "csv"));
    // Combination 0 has no random delays, so its runs are equal and its interval has no width. Combination 2 is paired with combination 0, and combination 3 is
    // refused.
    let figures = |combination: usize| parquet.cells[combination].figures[0];
    assert_eq!(figures(0).mean.unwrap().half_width, Some(0.0));
    assert!(figures(1).mean.unwrap().half_width > Some(0.0) && figures(1).difference.is_none());
    assert_eq!(figures(2).difference.map(|difference| difference.count), Some(10));
    assert_eq!((figures(3).mean, parquet.cells[3].diverged), (None, None));
}

#[test]
fn a_fault_that_no_strategy_is_the_reason_of_is_an_error() {
    for (vary, part) in [
        (&["coordination.strategy=average-position,local-damping{damping=-5}"][..], "coordination.local-damping.damping"),
        (&["coordination.strategy=average-position,local-damping", "link.jitter=0ms,1"], "link.jitter"),
        // No combination is left to run.
        (&["coordination.strategy=local-damping,local-damping{age=\"auto\"}", "link.jitter=1ms"], "damping of \"auto\""),
    ] {
        let bench = bench(vary);
        let error = open(&bench, "out").map(drop).unwrap_err();
        assert!(matches!(error, CampaignError::Scene { .. }) && error.to_string().contains(part), "{error}");
        assert!(!bench.path("out").exists());
    }
}

/// Stops judging after this number of verdicts.
struct Few(AtomicU64);

impl Judge for Few {
    fn judge(&self, scene: &Scene) -> Option<Judgement> {
        self.0.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1)).ok()?;
        let word = scene.coordination.strategy.name().into();
        Some(Judgement::Known(Verdict { word, judged: "by name".into(), radius: f64::NAN, error: f64::NAN }))
    }
}

#[test]
fn verdicts_apart_are_kept_as_they_are_made_and_leave_the_table_alone() {
    let bench = bench(&REFUSING);
    let judge = |folder: &str, most: u64| open(&bench, folder).unwrap().judge_apart(&Few(AtomicU64::new(most)), &NoWatch).unwrap();
    // The refused combination needs no judge.
    assert_eq!(judge("parts", 1), Err(2));
    assert_eq!(judge("parts", 2).map(|judgements| judgements.len()), Ok(4));
    let again = judge("parts", 0).unwrap();
    assert!(matches!(&again[3], Judgement::Refused(reason) if reason.contains("damping")), "{:?}", again[3]);
    assert_eq!(again[2].verdict().map(|verdict| &*verdict.word), Some("local-damping"));
    judge("whole", 9).unwrap();
    for folder in ["parts", "whole"] {
        finished(outcome(&bench, folder, 1, &NoWatch));
        assert_eq!(bench.files(folder), ["campaign.json", "runs.parquet", "stability.csv"]);
    }
    let read = |name: &str| std::fs::read(bench.path(name)).unwrap();
    assert_eq!(read("parts/stability.csv"), read("whole/stability.csv"));
}

/// Gives each scene a verdict of its own, so that two exchanged verdicts would be noticed.
struct Numbered;

impl Judge for Numbered {
    fn judge(&self, scene: &Scene) -> Option<Judgement> {
        let radius = f64::from(u32::try_from(scene.clone().fingerprint().get() % 1_000_003).unwrap());
        Some(Judgement::Known(Verdict { word: "stable".into(), judged: "test".into(), radius, error: 0.0 }))
    }
}

/// Rows in memory are judged, summed up and compared like the table in a folder, whatever process computed them.
#[test]
fn a_comparison_in_memory_is_that_of_the_folder() {
    let bench = bench(&REFUSING);
    let mut campaign = open(&bench, "out").unwrap();
    let stability = campaign.judge_apart(&Numbered, &NoWatch).unwrap().unwrap();
    let report = finished(campaign.run(&NoWatch).unwrap());
    let first = SpreadCampaign::check(plan(&bench).unwrap(), &NoWatch).unwrap();
    let other = SpreadCampaign::with_roster(plan(&bench).unwrap(), &first.roster()).unwrap();
    assert_eq!((first.runs(), other.runs()), (30, 30));
    let rows: Vec<Row> = [0..7, 7..30].into_iter().flat_map(|runs| other.rows(runs, &NoWatch).unwrap()).collect();
    for spread in [&first, &other] {
        assert_eq!(spread.report(&rows, Vec::new()).unwrap(), report);
        assert_eq!(spread.compare(&rows).unwrap(), campaign.compare().unwrap());
        assert_eq!(spread.judge(&Numbered, &NoWatch).unwrap(), stability);
    }
    assert!(first.report(&rows[1..], Vec::new()).is_err() && first.compare(&rows[1..]).is_err());
    assert!(matches!(first.judge(&Numbered, &StopAfter::runs(0)), Err(CampaignError::Stopped)));
}
