//! Judgements of combinations without running them: whether each is stable. The method of judging is not known here.

mod file;

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use cohaptic_scene::Scene;

use crate::campaign::Watch;
use crate::error::CampaignError;
use crate::plan::CampaignPlan;

pub(crate) use file::{Journal, Lines, read_whole, write_all};

/// Judges the scene of a combination. Called from many threads.
pub trait Judge: Sync {
    /// The judgement of the scene, which depends on the scene alone; `None` if the judgement was ended before its verdict was known.
    fn judge(&self, scene: &Scene) -> Option<Judgement>;
}

/// The judgement of a combination.
#[derive(Clone, PartialEq, Debug)]
pub enum Judgement {
    /// There is a verdict.
    Known(Verdict),
    /// There is none, for this reason.
    Refused(Arc<str>),
}

/// A verdict and what it rests on.
#[derive(Clone, PartialEq, Debug)]
pub struct Verdict {
    /// The verdict in a word, such as `stable`.
    pub word: Arc<str>,
    /// In a word, by what the combination was judged, such as `mean-square`.
    pub judged: Arc<str>,
    /// The radius that says so.
    pub radius: f64,
    /// How far the true radius may be from it.
    pub error: f64,
}

impl Judgement {
    /// The verdict; `None` where there is none.
    #[must_use]
    pub const fn verdict(&self) -> Option<&Verdict> {
        match self {
            Self::Known(verdict) => Some(verdict),
            Self::Refused(_) => None,
        }
    }

    /// The same judgement with a reason of one line, as a line of a journal keeps it.
    pub(crate) fn in_one_line(self) -> Self {
        match self {
            Self::Refused(reason) if reason.contains(['\n', '\r']) => Self::Refused(reason.replace(['\n', '\r'], " ").into()),
            other @ (Self::Known(_) | Self::Refused(_)) => other,
        }
    }
}

/// Words that were seen: verdicts are millions, and their words few.
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

/// What the threads share.
struct Shared<'a> {
    journal: &'a mut Journal,
    judgements: Vec<Option<Judgement>>,
    words: Words,
    failed: Option<CampaignError>,
}

/// Judges these combinations, and writes each judgement into the journal as soon as it is known. Each has its place, so the number of threads changes nothing.
/// Stops where the watch or the judge ends it; missing judgements are then `None`.
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
