//! Judgements of combinations without running them: whether each is stable. The method of judging is not known here.

mod file;
mod work;

use std::collections::BTreeSet;
use std::sync::Arc;

use cohaptic_scene::Scene;

pub(crate) use file::{Journal, read_whole, write_all};
pub(crate) use work::judge;

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
        match judgement {
            Judgement::Known(verdict) => Judgement::Known(Verdict { word: self.one(&verdict.word), judged: self.one(&verdict.judged), ..verdict }),
            // A line of the journal is one line.
            Judgement::Refused(reason) => Judgement::Refused(self.one(&reason.replace(['\n', '\r'], " "))),
        }
    }
}
