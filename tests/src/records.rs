//! Every byte that a recorder writes, and where two records first differ.

use std::collections::BTreeMap;

use cohaptic_harness::record::Recorder;
use cohaptic_harness::{Model, Simulation};
use cohaptic_scene::Scene;

/// The files of a record, by name.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Records(BTreeMap<String, Vec<u8>>);

/// Runs a scene with a recorder into a folder of its own.
#[must_use]
pub fn record(scene: &Scene, model: Model) -> Records {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(folder.path(), scene).unwrap();
    let summary = Simulation::new(scene, model).run(&mut recorder).unwrap();
    recorder.finish(&summary).unwrap();
    let files = std::fs::read_dir(folder.path()).unwrap().map(|entry| {
        let entry = entry.unwrap();
        (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap())
    });
    Records(files.collect())
}

impl Records {
    /// The names of the files.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// The first line of the first file in which the two differ; in `trajectory.csv` and `packets.csv` it holds the time. The tables come first:
    /// where a plot differs, one of them usually does.
    #[must_use]
    pub fn first_difference(&self, other: &Self) -> Option<String> {
        if !self.names().eq(other.names()) {
            return Some(format!("files {:?} and {:?}", self.0.keys(), other.0.keys()));
        }
        let mut names: Vec<&str> = self.names().collect();
        names.sort_by_key(|name| ["trajectory.csv", "packets.csv", "links.csv"].iter().position(|first| first == name).unwrap_or(9));
        let differing = names.into_iter().find(|name| self.0[*name] != other.0[*name])?;
        let lines = |records: &Self| String::from_utf8_lossy(&records.0[differing]).lines().map(str::to_owned).collect::<Vec<_>>();
        let (one, two) = (lines(self), lines(other));
        let number = one.iter().zip(&two).position(|(a, b)| a != b).unwrap_or_else(|| one.len().min(two.len()));
        let line = |lines: &[String]| lines.get(number).map_or_else(|| "(no such line)".to_owned(), |line| line.chars().take(400).collect());
        Some(format!("{differing}, line {}:\n  {}\n  {}", number + 1, line(&one), line(&two)))
    }
}
