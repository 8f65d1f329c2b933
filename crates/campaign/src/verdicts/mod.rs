//! Judgements: whether each combination is stable, without running it. The method of judging belongs to the caller's [`Judge`] and is not known here.

mod file;

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use cohaptic_scene::Scene;

use crate::error::CampaignError;
use crate::judgement::{Judgement, Verdict};
use crate::plan::CampaignPlan;
use crate::watch::Watch;

pub(crate) use file::{Journal, Lines, read_whole, write_all};

/// A judge of scenes, supplied by the caller. The method is called from many threads.
pub trait Judge: Sync {
    /// Judges a scene. The judgement must depend on the scene alone. `None`: the judging was stopped before its end.
    fn judge(&self, scene: &Scene) -> Option<Judgement>;
}

/// Words seen so far, shared between judgements: a campaign has millions of verdicts with few different words.
#[derive(Debug, Default)]
pub(crate) struct Words(BTreeSet<Arc<str>>);

impl Words {
    fn one(&mut self, word: &str) -> Arc<str> {
        if let Some(known) = self.0.get(word) {
            return known.clone();
        }
        let word: Arc<str> = Arc::from(word);
        self.0.insert(word.clone());
        word
    }

    fn all(&mut self, judgement: Judgement) -> Judgement {
        match judgement.in_one_line() {
            Judgement::Known(verdict) => Judgement::Known(Verdict { word: self.one(&verdict.word), judged: self.one(&verdict.judged), ..verdict }),
            Judgement::Refused(reason) => Judgement::Refused(self.one(&reason)),
        }
    }
}

/// State shared by the judging threads.
struct Shared<'a> {
    journal: &'a mut Journal,
    judgements: Vec<Option<Judgement>>,
    words: Words,
    failed: Option<CampaignError>,
}

/// Judges the combinations `missing`, and writes each judgement to the journal at once. Returns `judgements` with the new judgements added, indexed by
/// combination; an entry stays `None` if the watch or the judge stopped the work before. The number of threads does not change the result.
pub(crate) fn judge(
    plan: &CampaignPlan,
    judge: &dyn Judge,
    watch: &dyn Watch,
    journal: &mut Journal,
    missing: &[u64],
    judgements: Vec<Option<Judgement>>,
) -> Result<Vec<Option<Judgement>>, CampaignError> {
    let (next, ended) = (AtomicUsize::new(0), AtomicBool::new(false));
    let shared = Mutex::new(Shared { journal, judgements, words: Words::default(), failed: None });
    let lock = || shared.lock().unwrap_or_else(PoisonError::into_inner);
    rayon::broadcast(|_| {
        while !ended.load(Ordering::Relaxed) && watch.keep_going() {
            let Some(combination) = missing.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
            // The slow part runs without the lock.
            let judged = plan.scene(*combination).map(|scene| judge.judge(&scene));
            let mut shared = lock();
            let Shared { journal, judgements, words, failed } = &mut *shared;
            let kept = match judged {
                Ok(Some(judgement)) => {
                    let judgement = words.all(judgement);
                    journal.add(*combination, &judgement).map(|()| Some(judgement))
                }
                Ok(None) => Ok(None),
                Err(error) => Err(error),
            };
            match kept {
                Ok(Some(judgement)) => {
                    if let Some(place) = usize::try_from(*combination).ok().and_then(|place| judgements.get_mut(place)) {
                        *place = Some(judgement);
                    }
                    watch.judged(1);
                }
                // The judge gave up, so no other thread begins another combination.
                Ok(None) => ended.store(true, Ordering::Relaxed),
                Err(error) => {
                    failed.get_or_insert(error);
                    ended.store(true, Ordering::Relaxed);
                }
            }
        }
    });
    let Shared { judgements, failed, .. } = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    failed.map_or(Ok(judgements), Err)
}
