//! Damaged parts: each is named and computed again, and the table equals the table of an undisturbed campaign.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use cohaptic_campaign::{Campaign, Format, NoWatch, Report, Shard, Watch};

use crate::bench::{Bench, VARY, finished};

/// Collects the reports about damaged files.
#[derive(Default)]
struct Told(Mutex<Vec<(String, String)>>);

impl Watch for Told {
    fn damaged(&self, file: &Path, fault: &str) {
        self.0.lock().unwrap().push((file.file_name().unwrap().to_str().unwrap().to_owned(), fault.to_owned()));
    }
}

/// A folder with two parts of eight runs, and the table of these parts.
struct Kept {
    bench: Bench,
    files: BTreeMap<String, Vec<u8>>,
    table: Vec<u8>,
}

impl Kept {
    fn new(format: Format) -> Self {
        let mut bench = Bench::new(&VARY, 4);
        (bench.part, bench.format) = (Some(8), format);
        bench.finish("whole", 1);
        // A worker makes parts but no table.
        bench.shard("out", Shard::new(1, 1).unwrap(), "a", 1, &NoWatch).unwrap();
        let files = bench.files("out").into_iter().map(|name| (name.clone(), fs::read(bench.path("out").join(name)).unwrap())).collect();
        let table = bench.table("whole");
        Self { bench, files, table }
    }

    fn part(&self, number: usize) -> String {
        format!("part-{number:05}.{}", self.bench.format.name())
    }

    /// Restores the folder with all parts intact.
    fn restored(&self) -> PathBuf {
        let folder = self.bench.path("out");
        fs::remove_dir_all(&folder).unwrap();
        fs::create_dir(&folder).unwrap();
        self.files.iter().for_each(|(name, bytes)| fs::write(folder.join(name), bytes).unwrap());
        folder
    }

    /// Continues the campaign after some damage, which must be reported for this part only. Returns the report.
    fn assert_mended(&self, damage: impl FnOnce(&Path), damaged: usize, what: &str) -> String {
        damage(&self.restored());
        let told = Told::default();
        let report = finished(self.bench.outcome("out", 2, &told).unwrap());
        let mut told = told.0.into_inner().unwrap();
        assert_eq!((report.computed, told.len()), (8, 1), "{what}: {told:?}");
        let (file, fault) = told.remove(0);
        assert_eq!(file, self.part(damaged), "{what}");
        assert!(self.bench.table("out") == self.table, "{what}: other bytes");
        assert_eq!(self.bench.files("out"), self.bench.files("whole"), "{what}");
        fault
    }
}

/// Flips one bit of a file.
fn flip(path: &Path, bit: usize) {
    let mut bytes = fs::read(path).unwrap();
    bytes[bit / 8] ^= 1 << (bit % 8);
    fs::write(path, bytes).unwrap();
}

/// The unit test of digests flips every bit of a short part. Here a campaign continues after some of these faults.
#[test]
fn a_part_with_a_flipped_bit_is_computed_again() {
    for format in [Format::Csv, Format::Parquet] {
        let kept = Kept::new(format);
        let bits = 8 * kept.files[&kept.part(1)].len();
        // The step is odd, so all eight bit positions within a byte occur.
        for bit in (0..bits).step_by(bits / 23 * 2 + 1) {
            let fault = kept.assert_mended(|folder| flip(&folder.join(kept.part(1)), bit), 1, &format!("bit {bit} of {format:?}"));
            assert!(fault.contains("its bytes hash to") && fault.contains("Its 8 runs are computed again"), "{fault}");
        }
        for bit in (0..8 * kept.files[&format!("{}.sha256", kept.part(1))].len()).step_by(97) {
            kept.assert_mended(|folder| flip(&folder.join(format!("{}.sha256", kept.part(1))), bit), 1, &format!("bit {bit} of the digest"));
        }
    }
}

#[test]
fn a_part_under_the_name_of_another_and_a_shorter_one_are_computed_again() {
    for format in [Format::Csv, Format::Parquet] {
        let kept = Kept::new(format);
        let [first, second] = [kept.part(0), kept.part(1)];
        let digest = |name: &str| format!("{name}.sha256");
        let copy = |folder: &Path, from: &str, to: &str| {
            fs::copy(folder.join(from), folder.join(to)).unwrap();
        };
        kept.assert_mended(|folder| copy(folder, &second, &first), 0, "part 1 under the name of part 0");
        let with_digest = |folder: &Path| {
            copy(folder, &second, &first);
            copy(folder, &digest(&second), &digest(&first));
        };
        let fault = kept.assert_mended(with_digest, 0, "part 1 with its digest under the name of part 0");
        assert!(fault.contains("its digest says \"# part 1 of campaign") && fault.contains("expected \"# part 0 of campaign"), "{fault}");
        let bytes = kept.files[&second].clone();
        for (length, what) in [(0, "nothing"), (bytes.len() / 2, "half"), (bytes.len() - 1, "all but a byte")] {
            kept.assert_mended(|folder| fs::write(folder.join(&second), &bytes[..length]).unwrap(), 1, what);
        }
        kept.assert_mended(|folder| fs::write(folder.join(&second), [bytes.as_slice(), b"\n"].concat()).unwrap(), 1, "a byte more");
        // A part as left by a version of the program without digests.
        let fault = kept.assert_mended(|folder| fs::remove_file(folder.join(digest(&second))).unwrap(), 1, "no digest");
        assert!(fault.contains("it has no digest"), "{fault}");
    }
}

/// A part of another campaign, with the same number, length and number of runs, and with a digest of its own.
#[test]
fn a_part_of_another_campaign_is_computed_again() {
    let kept = Kept::new(Format::Csv);
    let mut other = Bench::new(&VARY, 4);
    (other.part, other.format, other.set) = (Some(8), Format::Csv, vec!["scene.seed=8".to_owned()]);
    other.shard("out", Shard::new(1, 1).unwrap(), "a", 1, &NoWatch).unwrap();
    let part = kept.part(0);
    let mix = |folder: &Path| {
        for name in [part.clone(), format!("{part}.sha256")] {
            fs::copy(other.path("out").join(&name), folder.join(&name)).unwrap();
        }
    };
    kept.assert_mended(mix, 0, "another campaign");
}

#[test]
fn shards_are_put_together_without_damaged_parts() {
    let kept = Kept::new(Format::Parquet);
    flip(&kept.restored().join(kept.part(0)), 1000);
    let told = Told::default();
    let merged = |told: &Told| -> Report {
        let mut campaign = Campaign::open_whole(kept.bench.plan().unwrap(), &kept.bench.path("out")).unwrap();
        finished(campaign.run(told).unwrap())
    };
    assert_eq!(merged(&told).computed, 8);
    assert_eq!(told.0.into_inner().unwrap()[0].0, kept.part(0));
    assert!(kept.bench.table("out") == kept.table);
    // The worker of a shard also computes a damaged part again.
    flip(&kept.restored().join(kept.part(1)), 1000);
    let told = Told::default();
    let report = kept.bench.shard("out", Shard::new(2, 2).unwrap(), "b", 1, &told).unwrap();
    assert_eq!((report.computed, report.left, told.0.into_inner().unwrap().len()), (8, 0, 1));
    assert_eq!(merged(&Told::default()).computed, 0);
    assert!(kept.bench.table("out") == kept.table);
}

/// Damages the first part once runs of the second part are done.
struct Damaging {
    told: Told,
    part: PathBuf,
    is_done: AtomicBool,
}

impl Watch for Damaging {
    fn ran(&self, _: u64) {
        if !self.is_done.swap(true, Ordering::SeqCst) {
            flip(&self.part, 1000);
        }
    }

    fn damaged(&self, file: &Path, fault: &str) {
        self.told.damaged(file, fault);
    }
}

#[test]
fn a_part_that_is_damaged_while_the_campaign_goes_on_is_computed_again() {
    for format in [Format::Csv, Format::Parquet] {
        let kept = Kept::new(format);
        let folder = kept.restored();
        fs::remove_file(folder.join(kept.part(1))).unwrap();
        let watch = Damaging { told: Told::default(), part: folder.join(kept.part(0)), is_done: AtomicBool::new(false) };
        let report = finished(kept.bench.outcome("out", 1, &watch).unwrap());
        let told: Vec<String> = watch.told.0.into_inner().unwrap().into_iter().map(|(file, _)| file).collect();
        assert_eq!((report.computed, told), (16, vec![kept.part(0)]));
        assert!(kept.bench.table("out") == kept.table, "other bytes");
    }
}

#[test]
fn only_the_verdict_of_a_damaged_line_is_judged_again() {
    use crate::verdicts::{ByStiffness, bench, open};
    let bench = bench();
    let judged = |folder: &str, judge: &ByStiffness, watch: &dyn Watch| open(&bench, folder).judge(judge, watch).unwrap();
    assert_eq!(judged("out", &ByStiffness::at_most(8), &NoWatch), 0);
    let table = fs::read(bench.path("out/verdicts.csv")).unwrap();
    let journal = bench.path("out/verdicts.part.csv");
    let line_end = fs::read(&journal).unwrap().iter().position(|byte| *byte == b'\n').unwrap();
    // The fault lies within the first line. The table of an unfinished campaign is not trusted either.
    flip(&journal, 8 * (line_end / 2));
    flip(&bench.path("out/verdicts.csv"), 8 * (table.len() - 20));
    let told = Told::default();
    assert_eq!(judged("out", &ByStiffness::at_most(1), &told), 0);
    assert_eq!(told.0.into_inner().unwrap().into_iter().map(|(file, _)| file).collect::<Vec<_>>(), ["verdicts.part.csv"]);
    assert!(fs::read(bench.path("out/verdicts.csv")).unwrap() == table);
}
