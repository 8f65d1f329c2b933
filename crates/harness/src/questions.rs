//! Number of instants between two questions of a run whether to go on.

/// Greatest number of instants, or ticks in arrays, between two calls of [`Observer::keep_going`](crate::Observer::keep_going).
pub(crate) const MOST_INSTANTS_BETWEEN_QUESTIONS: u32 = 1024;

/// Greatest number of ticks of peers, or packets, between two calls of [`Observer::keep_going`](crate::Observer::keep_going), unless a single instant has more.
/// Work of this amount takes a part of a second.
pub(crate) const MOST_WORK_BETWEEN_QUESTIONS: usize = 1 << 22;

/// Returns the number of instants, or of ticks in arrays, between two calls of [`Observer::keep_going`](crate::Observer::keep_going): a power of two. `work` is
/// the greatest number of ticks of peers, or of packets, at an instant.
pub(crate) fn instants_between_questions(work: usize) -> u32 {
    let instants = u32::try_from(MOST_WORK_BETWEEN_QUESTIONS / work.max(1)).unwrap_or(u32::MAX);
    // A power of two, so that the loop over ticks needs no division.
    1 << instants.clamp(1, MOST_INSTANTS_BETWEEN_QUESTIONS).ilog2()
}
