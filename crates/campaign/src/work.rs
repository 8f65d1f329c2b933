//! The runs that are missing, on all threads.
//!
//! Chunks of runs are handed out in order. A part is written by the thread that finishes its last chunk; so no more parts are open at once than there are
//! threads, and one, and memory stays bounded however long the campaign is.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use cohaptic_harness::measures::{MeasuredValue, Measures};
use cohaptic_harness::{Model, Summary, run_side_by_side};
use cohaptic_scene::Scene;

use crate::campaign::Watch;
use crate::error::CampaignError;
use crate::plan::{Accepted, CHUNK, CampaignPlan, Parts};
use crate::table::{Roster, Row, RunId, row};
use crate::verdicts::Judgement;

/// Keeps the rows of the part of that number.
pub(crate) type Keep<'a> = dyn Fn(u64, &[Row]) -> Result<(), CampaignError> + Sync + 'a;

/// The work of a campaign.
pub(crate) struct Work<'a> {
    pub(crate) plan: &'a CampaignPlan,
    pub(crate) roster: &'a Roster,
    /// One for each combination; none if none are asked for.
    pub(crate) judgements: &'a [Judgement],
    pub(crate) accepted: &'a Accepted,
    pub(crate) parts: Parts,
    pub(crate) watch: &'a dyn Watch,
    /// Puts a whole part away.
    pub(crate) keep: &'a Keep<'a>,
}

/// Some runs of a part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chunk {
    pub(crate) part: u64,
    /// Its place in the part.
    pub(crate) place: usize,
    pub(crate) start: u64,
    pub(crate) end: u64,
}

/// A part some chunks of which are done.
struct Open {
    chunks: Vec<Vec<Row>>,
    left: usize,
}

/// Scenes of the combinations that were last asked for.
#[derive(Default)]
pub(crate) struct Scenes(Mutex<BTreeMap<u64, Arc<Scene>>>);

impl Work<'_> {
    /// Does the missing parts, on all threads of the pool that it is called in, until all are done or the watch ends it; parts that are not whole are then
    /// forgotten. Gives how many runs have been put away.
    pub(crate) fn run(&self, missing: &[u64]) -> Result<u64, CampaignError> {
        let (next, ended) = (AtomicU64::new(0), AtomicBool::new(false));
        let open: Mutex<BTreeMap<u64, Open>> = Mutex::default();
        let failed: Mutex<Option<CampaignError>> = Mutex::new(None);
        let kept = Mutex::new(0);
        let scenes = Scenes::default();
        rayon::broadcast(|_| {
            while !ended.load(Ordering::Relaxed) && self.watch.keep_going() {
                let Some(chunk) = self.chunk(next.fetch_add(1, Ordering::Relaxed), missing) else { break };
                let done = self.rows(chunk, &scenes).and_then(|rows| self.put(chunk, rows, &open));
                match done {
                    Ok(runs) => *lock(&kept) += runs,
                    Err(error) => {
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

    /// The chunk of this number among those of the missing parts; `None` behind the last.
    fn chunk(&self, number: u64, missing: &[u64]) -> Option<Chunk> {
        // Only the last part may have fewer chunks than the others, and nothing comes behind it.
        let of_each = self.parts.size.div_ceil(CHUNK);
        let (part, place) = (*missing.get(usize::try_from(number / of_each).ok()?)?, number % of_each);
        let runs = self.parts.range(part);
        let start = runs.start + place * CHUNK;
        (start < runs.end).then(|| Chunk { part, place: usize::try_from(place).unwrap_or_default(), start, end: (start + CHUNK).min(runs.end) })
    }

    /// Runs a chunk.
    pub(crate) fn rows(&self, chunk: Chunk, known: &Scenes) -> Result<Vec<Row>, CampaignError> {
        let runs = chunk.start..chunk.end;
        let scenes = runs.clone().map(|run| self.scene(run, known)).collect::<Result<Vec<Scene>, CampaignError>>()?;
        let outcomes: Vec<(Summary, Vec<MeasuredValue>)> = if scenes.iter().all(|scene| scene.measure.is_none()) {
            run_side_by_side(&scenes).into_iter().map(|summary| (summary, Vec::new())).collect()
        } else {
            // Scenes with measures are watched, one run after the other.
            scenes.iter().map(|scene| Measures::run(scene, Model::Least)).collect()
        };
        let rows = runs.zip(scenes.iter().zip(&outcomes)).map(|(run, (scene, (summary, measured)))| {
            let (combination, _) = self.accepted.run(run);
            let place = RunId { run: self.accepted.number(run), combination, seed: scene.seed };
            let judgement = usize::try_from(combination).ok().and_then(|place| self.judgements.get(place));
            row(place, self.plan.values(combination), judgement, (summary, measured), self.roster)
        });
        let rows = rows.collect();
        self.watch.ran(chunk.end - chunk.start);
        Ok(rows)
    }

    /// The scene of a run: that of its combination with a seed of its own.
    fn scene(&self, run: u64, known: &Scenes) -> Result<Scene, CampaignError> {
        let (combination, of_it) = self.accepted.run(run);
        let mut scene = Scene::clone(&*known.get(combination, self.plan)?);
        scene.seed += of_it;
        Ok(scene)
    }

    /// Puts the rows of a chunk to their part, and puts that away if it is whole: then gives how many runs it has.
    fn put(&self, chunk: Chunk, rows: Vec<Row>, open: &Mutex<BTreeMap<u64, Open>>) -> Result<u64, CampaignError> {
        let whole = {
            let mut open = lock(open);
            let part = open.entry(chunk.part).or_insert_with(|| {
                let left = usize::try_from(self.parts.len(chunk.part).div_ceil(CHUNK)).unwrap_or_default();
                Open { chunks: vec![Vec::new(); left], left }
            });
            part.chunks[chunk.place] = rows;
            part.left -= 1;
            if part.left == 0 { open.remove(&chunk.part) } else { None }
        };
        let Some(whole) = whole else { return Ok(0) };
        let rows: Vec<Row> = whole.chunks.into_iter().flatten().collect();
        (self.keep)(chunk.part, &rows)?;
        Ok(rows.len() as u64)
    }
}

impl Scenes {
    /// The most that are kept.
    const MOST: usize = 64;

    fn get(&self, combination: u64, plan: &CampaignPlan) -> Result<Arc<Scene>, CampaignError> {
        if let Some(scene) = lock(&self.0).get(&combination) {
            return Ok(scene.clone());
        }
        // Not under the lock: two threads may read the same scene, which is no more than wasted work.
        let scene = Arc::new(plan.scene(combination)?);
        let mut known = lock(&self.0);
        known.insert(combination, scene.clone());
        if known.len() > Self::MOST {
            // Runs come in order, so the first will be asked for no more, or by few.
            known.pop_first();
        }
        Ok(scene)
    }
}

/// What a thread that panicked leaves is never looked at: its panic ends the whole.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
