//! Computes missing runs on all threads.
//!
//! The threads take chunks of runs in order. The thread which finishes the last chunk of a part passes the part on. So at most one part more than there are
//! threads is open at once, and the memory stays bounded however long the campaign is.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use cohaptic_harness::measures::{MeasuredRun, Measures};
use cohaptic_harness::{Model, run_side_by_side};
use cohaptic_scene::Scene;

use crate::error::CampaignError;
use crate::judgement::Judgement;
use crate::plan::{Accepted, CHUNK, CampaignPlan, Parts};
use crate::table::{Roster, Row, RunId, row};
use crate::watch::Watch;

/// Stores the rows of the part with this number.
pub(crate) type Keep<'a> = dyn Fn(u64, &[Row]) -> Result<(), CampaignError> + Sync + 'a;

/// The work of a campaign.
pub(crate) struct Work<'a> {
    pub(crate) plan: &'a CampaignPlan,
    pub(crate) roster: &'a Roster,
    /// Judgements, indexed by combination; empty without verdicts.
    pub(crate) judgements: &'a [Judgement],
    pub(crate) accepted: &'a Accepted,
    pub(crate) parts: Parts,
    pub(crate) watch: &'a dyn Watch,
    /// Stores a whole part.
    pub(crate) keep: &'a Keep<'a>,
}

/// Consecutive runs of a part, computed by one thread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chunk {
    pub(crate) part: u64,
    /// Index of the chunk within its part.
    pub(crate) place: usize,
    pub(crate) start: u64,
    pub(crate) end: u64,
}

/// A part with some finished chunks.
struct Open {
    chunks: Vec<Vec<Row>>,
    left: usize,
}

/// Scenes of the recently used combinations, by combination.
#[derive(Default)]
pub(crate) struct Scenes(Mutex<BTreeMap<u64, Arc<Scene>>>);

impl Work<'_> {
    /// Computes the missing parts, on all threads of the current thread pool, until all are done or the watch stops the work. The rows of unfinished parts are
    /// then dropped. Returns the number of stored runs.
    pub(crate) fn run(&self, missing: &[u64]) -> Result<u64, CampaignError> {
        // `Relaxed` suffices for both: they carry no data, and the locks below order the rows.
        let (next, ended) = (AtomicU64::new(0), AtomicBool::new(false));
        let open: Mutex<BTreeMap<u64, Open>> = Mutex::default();
        let failed: Mutex<Option<CampaignError>> = Mutex::new(None);
        let kept = Mutex::new(0);
        let scenes = Scenes::default();
        rayon::broadcast(|_| {
            while !ended.load(Ordering::Relaxed) && self.watch.keep_going() {
                let Some(chunk) = self.chunk(next.fetch_add(1, Ordering::Relaxed), missing) else { break };
                // A chunk is finished even if the watch stops the work meanwhile. Its rows are stored only if its part is whole.
                let done = self.rows(chunk, &scenes).and_then(|rows| self.put(chunk, rows, &open));
                match done {
                    Ok(runs) => *lock(&kept) += runs,
                    Err(error) => {
                        // The other threads finish their chunk, see `ended` and stop. The first error is returned.
                        lock(&failed).get_or_insert(error);
                        ended.store(true, Ordering::Relaxed);
                    }
                }
            }
        });
        let failed = lock(&failed).take();
        match failed {
            Some(error) => Err(error),
            None => Ok(*lock(&kept)),
        }
    }

    /// Returns chunk `number` of the missing parts, counted from 0; `None` after the last chunk.
    fn chunk(&self, number: u64, missing: &[u64]) -> Option<Chunk> {
        // Only the last part of a campaign may have fewer chunks than the other parts, and it is the last of the missing parts. So a chunk beyond its end is
        // the end of all chunks.
        let of_each = self.parts.size.div_ceil(CHUNK);
        let (part, place) = (*missing.get(usize::try_from(number / of_each).ok()?)?, number % of_each);
        let runs = self.parts.range(part);
        let start = runs.start + place * CHUNK;
        (start < runs.end).then(|| Chunk { part, place: usize::try_from(place).unwrap_or_default(), start, end: (start + CHUNK).min(runs.end) })
    }

    /// Computes the rows of a chunk.
    pub(crate) fn rows(&self, chunk: Chunk, known: &Scenes) -> Result<Vec<Row>, CampaignError> {
        let runs = chunk.start..chunk.end;
        let scenes = runs.clone().map(|run| self.scene(run, known)).collect::<Result<Vec<Scene>, CampaignError>>()?;
        // Runs without measures and tasks share one pass over eight scenes, see `cohaptic_harness::run_side_by_side`.
        let outcomes: Vec<MeasuredRun> = if scenes.iter().all(|scene| scene.measure.is_none() && scene.task.is_none()) {
            run_side_by_side(&scenes).into_iter().map(|summary| MeasuredRun { summary, values: Vec::new(), task: None }).collect()
        } else {
            // A measure needs an observer of its run, so these scenes are run one after the other.
            scenes.iter().map(|scene| Measures::run(scene, Model::Least)).collect()
        };
        let rows = runs.zip(scenes.iter().zip(&outcomes)).map(|(run, (scene, measured))| {
            let (combination, _) = self.accepted.run(run);
            // The table numbers the runs of refused combinations too, while `run` counts accepted runs only.
            let place = RunId { run: self.accepted.number(run), combination, seed: scene.seed };
            let judgement = usize::try_from(combination).ok().and_then(|place| self.judgements.get(place));
            row(place, self.plan.values(combination), judgement, measured, self.roster)
        });
        let rows = rows.collect();
        self.watch.ran(chunk.end - chunk.start);
        Ok(rows)
    }

    /// Returns the scene of the run at a place: the scene of its combination with the run's own seed.
    fn scene(&self, run: u64, known: &Scenes) -> Result<Scene, CampaignError> {
        let (combination, of_it) = self.accepted.run(run);
        // Only the seed differs between the runs of a combination, so the runs share the scene which was read for the combination.
        let mut scene = Scene::clone(&*known.get(combination, self.plan)?);
        scene.seed += of_it;
        Ok(scene)
    }

    /// Adds the rows of a chunk to their part. Stores a part with all chunks and returns the number of its runs; returns 0 for an unfinished part.
    fn put(&self, chunk: Chunk, rows: Vec<Row>, open: &Mutex<BTreeMap<u64, Open>>) -> Result<u64, CampaignError> {
        let whole = {
            let mut open = lock(open);
            let part = open.entry(chunk.part).or_insert_with(|| {
                let left = usize::try_from(self.parts.len(chunk.part).div_ceil(CHUNK)).unwrap_or_default();
                Open { chunks: vec![Vec::new(); left], left }
            });
            part.chunks[chunk.place] = rows;
            // Each chunk is handed out once, so the count reaches 0 with the last chunk of the part.
            part.left -= 1;
            // Removed under the lock, stored after it.
            if part.left == 0 { open.remove(&chunk.part) } else { None }
        };
        let Some(whole) = whole else { return Ok(0) };
        let rows: Vec<Row> = whole.chunks.into_iter().flatten().collect();
        // Outside of the lock: writing a file must not hold up the other threads.
        (self.keep)(chunk.part, &rows)?;
        Ok(rows.len() as u64)
    }
}

impl Scenes {
    /// Greatest number of scenes kept at once.
    const MOST: usize = 64;

    fn get(&self, combination: u64, plan: &CampaignPlan) -> Result<Arc<Scene>, CampaignError> {
        if let Some(scene) = lock(&self.0).get(&combination) {
            return Ok(scene.clone());
        }
        // The lock is not held while a scene is read. Two threads may then read the same scene, and both get equal scenes.
        let scene = Arc::new(plan.scene(combination)?);
        let mut known = lock(&self.0);
        known.insert(combination, scene.clone());
        if known.len() > Self::MOST {
            // Runs come in order, so the combination with the lowest number is needed least.
            known.pop_first();
        }
        Ok(scene)
    }
}

/// Locks a mutex, also after a panic of another thread: rayon passes the panic on, and the data are not used.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
