//! Shards in any number and order, stopped anywhere and done twice, give the bytes of one process.

use std::fs;

use cohaptic_campaign::{CampaignError, FolderState, Format, Judge, Judgement, NoWatch, Outcome, Shard, SharedCampaign, Verdict, worker_log};
use cohaptic_scene::Scene;
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::bench::{Bench, StopAfter, VARY};

fn shard(index: u64, count: u64) -> Shard {
    Shard::new(index, count).unwrap()
}

/// The work of one worker on one shard.
#[derive(Clone, Debug)]
struct Turn {
    index: u64,
    count: u64,
    threads: usize,
    /// Number of runs after which the worker is stopped; `None` for no stop.
    stop: Option<u64>,
    /// `true` if the leftovers of a killed process are put into the folder.
    killed: bool,
}

fn turns() -> impl Strategy<Value = Vec<Turn>> {
    let turn = (1_u64..7).prop_flat_map(|count| (1..=count, Just(count), 1_usize..3, prop::option::of(0_u64..30), any::<bool>()));
    let turn = turn.prop_map(|(index, count, threads, stop, killed)| Turn { index, count, threads, stop, killed });
    prop::collection::vec(turn, 0..12)
}

properties! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn whatever_the_split_and_the_order_the_table_is_that_of_one_process(
        turns in turns(), last in 1_u64..6, backwards: bool, part in 1_u64..20, runs in 1_u64..12, csv: bool,
    ) {
        let mut bench = Bench::new(&VARY, runs);
        (bench.part, bench.format) = (Some(part), if csv { Format::Csv } else { Format::Parquet });
        let whole = bench.finish("whole", 1);
        for (number, turn) in turns.iter().enumerate() {
            let watch = turn.stop.map_or_else(|| StopAfter::runs(u64::MAX), StopAfter::runs);
            let done = bench.shard("shards", shard(turn.index, turn.count), &format!("worker-{number}"), turn.threads, &watch);
            match done {
                Ok(report) => prop_assert!(report.computed + report.left <= report.runs && (turn.stop.is_some() || report.left == 0)),
                // Stopped before anything was written.
                Err(error) => prop_assert!(matches!(error, CampaignError::Stopped) && turn.stop == Some(0), "{error}"),
            }
            if turn.killed && bench.path("shards").exists() {
                let of_killed = [
                    format!("part-00000.{}.killed-{number}.partial", bench.format.name()),
                    "campaign.json.killed.partial".to_owned(),
                    worker_log(&format!("killed-{number}")),
                ];
                for name in of_killed {
                    fs::write(bench.path("shards").join(name), "half").unwrap();
                }
            }
        }
        let missing = bench.merge("shards");
        // These shards complete the campaign, whatever was done before.
        let mut indices: Vec<u64> = (1..=last).collect();
        if backwards {
            indices.reverse();
        }
        for index in indices {
            let report = bench.shard("shards", shard(index, last), &format!("last-{index}"), 1, &NoWatch).unwrap();
            prop_assert_eq!(report.left, 0);
        }
        if let Err(error) = missing {
            prop_assert!(matches!(error, CampaignError::Missing { .. } | CampaignError::NoCampaign { .. }), "{error}");
        }
        let report = bench.merge("shards").unwrap();
        prop_assert_eq!(&report.combinations, &whole.combinations);
        prop_assert!(bench.table("shards") == bench.table("whole"), "other bytes");
        prop_assert_eq!(bench.files("shards"), bench.files("whole"));
    }

    /// Each shard is done by two workers at the same time.
    #[test]
    fn workers_at_the_same_time_do_each_other_no_harm(count in 1_u64..4, part in 1_u64..9, csv: bool) {
        let mut bench = Bench::new(&VARY, 6);
        (bench.part, bench.format) = (Some(part), if csv { Format::Csv } else { Format::Parquet });
        bench.finish("whole", 1);
        std::thread::scope(|scope| {
            for worker in 0..2 * count {
                let bench = &bench;
                scope.spawn(move || bench.shard("shards", shard(worker % count + 1, count), &worker.to_string(), 1, &NoWatch).unwrap());
            }
        });
        bench.merge("shards").unwrap();
        prop_assert!(bench.table("shards") == bench.table("whole"), "other bytes");
        prop_assert_eq!(bench.files("shards"), bench.files("whole"));
    }
}

#[test]
fn a_merge_says_what_is_missing_and_computes_nothing() {
    let mut bench = Bench::new(&VARY, 6);
    bench.part = Some(4);
    let merged = |folder: &str| bench.merge(folder).unwrap_err();
    assert!(matches!(merged("nowhere"), CampaignError::NoCampaign { .. }) && !bench.path("nowhere").exists());
    let report = bench.shard("out", shard(2, 3), "a", 1, &NoWatch).unwrap();
    // Parts 1 and 4 of six, with four runs each.
    assert_eq!((report.parts, report.runs, report.computed, report.left), (2, 8, 8, 0));
    let before = bench.files("out");
    let error = merged("out");
    assert!(error.to_string().contains("4 of 6 parts are missing, counted from 0: 0, 2 to 3, 5") && error.is_io(), "{error}");
    assert_eq!(bench.files("out"), before);
    let state = || {
        let FolderState { parts, is_merged } = SharedCampaign::state_in(bench.plan().unwrap(), &bench.path("out")).unwrap();
        (parts.iter().map(|part| (part.runs, part.is_done)).collect::<Vec<_>>(), is_merged)
    };
    assert_eq!(state(), ([false, true, false, false, true, false].map(|done| (4, done)).to_vec(), false));
    // A shard done again computes nothing, and a process alone does the remaining shards.
    assert_eq!(bench.shard("out", shard(2, 3), "b", 1, &NoWatch).unwrap().computed, 0);
    assert_eq!(bench.finish("out", 1).computed, 16);
    assert_eq!(bench.shard("out", shard(1, 3), "c", 1, &NoWatch).unwrap().computed, 0);
    assert_eq!(bench.files("out"), ["campaign.json", "runs.parquet"]);
    assert_eq!(state(), (vec![(4, true); 6], true));
}

#[test]
fn shards_of_another_campaign_are_refused() {
    let mut bench = Bench::new(&VARY, 6);
    bench.shard("out", shard(1, 2), "a", 1, &NoWatch).unwrap();
    bench.runs = 7;
    for error in [bench.shard("out", shard(2, 2), "b", 1, &NoWatch).map(drop).unwrap_err(), bench.merge("out").map(drop).unwrap_err()] {
        assert!(error.to_string().contains("--runs is 6 there and 7 here"), "{error}");
    }
    fs::create_dir(bench.path("thesis")).unwrap();
    fs::write(bench.path("thesis/chapter.tex"), "mine").unwrap();
    let error = bench.shard("thesis", shard(1, 2), "a", 1, &NoWatch).unwrap_err();
    assert!(matches!(error, CampaignError::Foreign { .. }));
    assert_eq!(bench.files("thesis"), ["chapter.tex"]);
}

#[test]
fn a_process_alone_and_workers_do_not_work_at_the_same_time() {
    let bench = Bench::new(&VARY, 6);
    let alone = bench.open("out").unwrap();
    let error = bench.shard("out", shard(1, 2), "a", 1, &NoWatch).unwrap_err();
    assert!(matches!(error, CampaignError::Busy { .. }), "{error}");
    drop(alone);
    let owner = cohaptic_files::Owner::here(1);
    let lease = cohaptic_files::Lease::take(&bench.path("out").join(shard(1, 2).lease()), &owner).unwrap();
    let error = bench.assert_refused("out", &["works on the campaign in", "shard 1/2"]);
    assert!(matches!(error, CampaignError::Shards { .. }) && error.is_io());
    bench.shard("out", shard(1, 2), "a", 1, &NoWatch).unwrap();
    drop(lease);
    bench.shard("out", shard(2, 2), "b", 1, &NoWatch).unwrap();
    bench.merge("out").unwrap();
}

/// Judges by the stiffness alone, and counts its calls.
struct Counting(std::sync::atomic::AtomicU64);

impl Judge for Counting {
    fn judge(&self, scene: &Scene) -> Option<Judgement> {
        self.0.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
        let radius = scene.coordination.gains.stiffness / 1000.0;
        Some(Judgement::Known(Verdict { word: "stable".into(), judged: "mean-square".into(), radius, error: 0.25 }))
    }
}

struct Nobody;

impl Judge for Nobody {
    fn judge(&self, _: &Scene) -> Option<Judgement> {
        None
    }
}

#[test]
fn verdicts_are_made_where_they_are_needed_and_are_those_of_one_process() {
    let mut bench = Bench::new(&VARY, 6);
    bench.part = Some(8);
    let plan = || bench.plan().unwrap().with_verdicts();
    let counting = || Counting(0.into());
    let mut whole = cohaptic_campaign::Campaign::open(plan(), &bench.path("whole"), &NoWatch).unwrap();
    whole.judge(&counting(), &NoWatch).unwrap();
    assert!(matches!(whole.run(&NoWatch), Ok(Outcome::Finished(_))));
    drop(whole);
    // With parts of eight runs and six runs per combination, part 0 has combinations 0 and 1, part 1 has 1 and 2, part 2 has 2 and 3.
    for (index, expected) in [(3, 2), (1, 2), (2, 0)] {
        let mut shared = SharedCampaign::open(plan(), &bench.path("out"), &index.to_string(), &NoWatch).unwrap();
        assert!(matches!(shared.run(shard(index, 3), &NoWatch), Err(CampaignError::NotJudged)));
        let judge = counting();
        assert_eq!(shared.judge(shard(index, 3), &judge, &NoWatch).unwrap(), 0);
        assert_eq!(judge.0.into_inner(), expected, "shard {index}");
        shared.run(shard(index, 3), &NoWatch).unwrap();
    }
    let mut merged = cohaptic_campaign::Campaign::open_whole(plan(), &bench.path("out")).unwrap();
    assert_eq!(merged.judge(&Nobody, &NoWatch).unwrap(), 0);
    assert!(matches!(merged.run(&NoWatch), Ok(Outcome::Finished(_))));
    drop(merged);
    assert!(bench.table("out") == bench.table("whole"));
    assert_eq!(bench.files("out"), bench.files("whole"));
    assert_eq!(fs::read(bench.path("out/verdicts.csv")).unwrap(), fs::read(bench.path("whole/verdicts.csv")).unwrap());
}
