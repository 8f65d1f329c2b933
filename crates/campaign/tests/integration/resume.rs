//! Campaigns stopped anywhere and continued give the same bytes.

use cohaptic_campaign::{Format, Outcome};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::bench::{Bench, StopAfter, VARY};

properties! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// The campaign is stopped again and again, with any number of threads, and parts are torn off or half written as by a kill. The table equals the table of
    /// an undisturbed campaign.
    #[test]
    fn however_it_was_interrupted_the_table_is_the_same(
        stops in prop::collection::vec((0_u64..60, 1_usize..4, prop::option::of(0_usize..18), any::<bool>()), 0..5),
        part in 1_u64..30, runs in 1_u64..20, csv: bool, threads in 1_usize..4,
    ) {
        let mut bench = Bench::new(&VARY, runs);
        (bench.part, bench.format) = (Some(part), if csv { Format::Csv } else { Format::Parquet });
        let whole = bench.finish("whole", 1);
        for (stop, threads, lost, torn) in stops {
            match bench.outcome("parts", threads, &StopAfter::runs(stop)).unwrap() {
                Outcome::Finished(report) => prop_assert_eq!(report.combinations, whole.combinations.clone()),
                Outcome::Interrupted { kept } => {
                    // Only the last part may have fewer runs than the other parts.
                    let parts = bench.parts("parts").len() as u64;
                    prop_assert!(kept <= parts * part && (parts == 0 || kept > (parts - 1) * part), "{} runs in {} parts of {}", kept, parts, part);
                    prop_assert!(bench.files("parts").iter().all(|name| !name.ends_with(".partial") && !name.starts_with("runs")));
                }
            }
            // The process was killed before a part had its digest, or the part itself is lost.
            let parts: Vec<String> = bench.files("parts").into_iter().filter(|name| name.starts_with("part-")).collect();
            if let Some(name) = lost.and_then(|place| parts.get(place)) {
                std::fs::remove_file(bench.path("parts").join(name)).unwrap();
            }
            if torn {
                // A killed process leaves a partial file, and a lock file held by nobody.
                let name = format!("parts/part-00000.{}.partial", bench.format.name());
                std::fs::write(bench.path(&name), "PAR1 or half a row").unwrap();
                std::fs::write(bench.path("parts/cohaptic.lock"), "").unwrap();
            }
        }
        let report = bench.finish("parts", threads);
        prop_assert_eq!(&report.combinations, &whole.combinations);
        prop_assert!(bench.table("parts") == bench.table("whole"), "other bytes");
        prop_assert_eq!(bench.files("parts"), bench.files("whole"));
    }
}

#[test]
fn threads_and_time_change_nothing() {
    for format in [Format::Parquet, Format::Csv] {
        let mut bench = Bench::new(&VARY, 23);
        (bench.format, bench.part) = (format, Some(16));
        for threads in [1, 2, 5] {
            assert_eq!(bench.finish(&threads.to_string(), threads).computed, 92);
            assert_eq!(bench.table(&threads.to_string()), bench.table("1"));
        }
    }
}

#[test]
fn what_is_kept_is_not_computed_again() {
    let mut bench = Bench::new(&VARY, 10);
    bench.part = Some(8);
    let Outcome::Interrupted { kept } = bench.outcome("out", 1, &StopAfter::runs(17)).unwrap() else { panic!("it was to be interrupted") };
    // One thread does chunks of 8 runs and asks the watch before each chunk, so the campaign stops after 24 runs.
    assert_eq!((kept, bench.parts("out").len(), bench.files("out").len()), (24, 3, 7));
    let campaign = bench.open("out").unwrap();
    assert_eq!((campaign.kept(), campaign.is_finished(), campaign.plan().runs()), (24, false, 40));
    drop(campaign);
    let report = bench.finish("out", 2);
    assert_eq!((report.runs, report.computed), (40, 16));
    // A finished campaign is not changed at all.
    let before = bench.path("out/runs.parquet").metadata().unwrap().modified().unwrap();
    assert!(bench.open("out").unwrap().is_finished());
    let again = bench.finish("out", 2);
    assert_eq!((again.computed, &again.combinations), (0, &report.combinations));
    assert_eq!(bench.path("out/runs.parquet").metadata().unwrap().modified().unwrap(), before);
}

/// The process was killed after the table got its name and before the parts were removed.
#[test]
fn parts_beside_the_table_are_removed() {
    let mut bench = Bench::new(&VARY, 4);
    bench.part = Some(8);
    bench.finish("out", 1);
    let table = bench.table("out");
    std::fs::write(bench.path("out/part-00001.parquet"), "").unwrap();
    bench.finish("out", 1);
    assert_eq!((bench.files("out"), bench.table("out")), (vec!["campaign.json".to_owned(), "runs.parquet".to_owned()], table));
}
