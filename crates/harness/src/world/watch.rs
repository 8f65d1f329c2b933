//! Selection of the rows that an observer wants, read once before a run.

use crate::observer::Observer;

/// Wanted kinds of rows, one flag for each `Observer::wants_…`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Watch {
    pub(crate) ticks: bool,
    pub(crate) packets: bool,
    pub(crate) steps: bool,
    pub(crate) instants: bool,
    pub(crate) sends: bool,
    pub(crate) holds: bool,
}

impl Watch {
    pub(crate) const NOTHING: Self = Self { ticks: false, packets: false, steps: false, instants: false, sends: false, holds: false };

    /// Returns whether the observer wants at most ticks and instants.
    pub(crate) fn is_of_ticks(self) -> bool {
        Self { ticks: false, instants: false, ..self } == Self::NOTHING
    }

    pub(crate) fn of(observer: &(impl Observer + ?Sized)) -> Self {
        Self {
            ticks: observer.wants_ticks(),
            packets: observer.wants_packets(),
            steps: observer.wants_steps(),
            instants: observer.wants_instants(),
            sends: observer.wants_sends(),
            holds: observer.wants_holds(),
        }
    }
}
