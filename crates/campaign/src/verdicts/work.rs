//! Judges the combinations that are not judged yet, on all threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::{Journal, Judge, Judgement, Words};
use crate::error::CampaignError;
use crate::plan::CampaignPlan;
use crate::watch::Watch;

/// What the threads share.
struct Shared<'a> {
    journal: &'a mut Journal,
    judgements: Vec<Option<Judgement>>,
    words: Words,
    failed: Option<CampaignError>,
}

/// Judges the combinations without a judgement, and writes each judgement into the journal as soon as it is known. Each has its place, so the number of threads changes nothing.
/// Stops where the watch or the judge ends it; missing judgements are then `None`.
pub(crate) fn judge(
    plan: &CampaignPlan,
    judge: &dyn Judge,
    watch: &dyn Watch,
    journal: &mut Journal,
    judgements: Vec<Option<Judgement>>,
) -> Result<Vec<Option<Judgement>>, CampaignError> {
    let missing: Vec<u64> = (0..).zip(&judgements).filter(|(_, known)| known.is_none()).map(|(combination, _)| combination).collect();
    let (next, ended) = (AtomicUsize::new(0), AtomicBool::new(false));
    let shared = Mutex::new(Shared { journal, judgements, words: Words::default(), failed: None });
    let lock = || shared.lock().unwrap_or_else(PoisonError::into_inner);
    rayon::broadcast(|_| {
        while !ended.load(Ordering::Relaxed) && watch.keep_going() {
            let Some(combination) = missing.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
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
