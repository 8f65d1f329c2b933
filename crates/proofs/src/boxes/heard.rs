//! The samples that classes of peers hold at their ticks, once every link has delivered.

use cohaptic_stability::frames::{Event, Timetable};

/// The sample of each sender that is in force at each tick of a receiving class.
pub(super) struct Heard {
    /// Number of the sample in force, indexed by receiver, sender and tick in the frame; `None` if the sender never delivers to the receiver.
    of: Vec<Vec<Vec<Option<i64>>>>,
    /// Number of samples per frame, indexed by class.
    sent: Vec<usize>,
}

impl Heard {
    pub(super) fn new(timetable: &Timetable) -> Self {
        let classes = timetable.sent.len();
        let number_of_ticks =
            |class: usize| timetable.events.iter().filter(|event| matches!(event, Event::Tick { node, .. } if *node == class)).count();
        let mut of: Vec<Vec<Vec<Option<i64>>>> = (0..classes).map(|class| vec![vec![None; number_of_ticks(class)]; classes]).collect();
        // A sample is held until another arrives, also across frames. The first pass (frame −1) finds the samples that are held when frame 0 begins; the second
        // pass overwrites the entries of `of` with the samples of the steady state.
        let mut held = vec![vec![None; classes]; classes];
        for frame in [-1, 0] {
            let mut tick = vec![0; classes];
            for event in &timetable.events {
                match *event {
                    Event::Sample { .. } => {}
                    Event::Deliver { from, to, sample } => held[to][from] = Some(sample + frame * whole(timetable.sent[from])),
                    Event::Tick { node, .. } => {
                        for (from, held) in held[node].iter().enumerate() {
                            of[node][from][tick[node]] = *held;
                        }
                        tick[node] += 1;
                    }
                }
            }
        }
        Self { of, sent: timetable.sent.clone() }
    }

    /// Returns the number of the sample of `from` that `to` has in force at a tick of `to`. Ticks and samples are counted from the beginning of the frame and
    /// are negative before it. `None` if no sample ever arrives.
    pub(super) fn at(&self, from: usize, to: usize, tick: i64) -> Option<i64> {
        // A tick outside the frame maps to the tick of the same place within it; the sample number shifts by the samples of the frames between.
        let ticks = &self.of[to][from];
        let count = whole(ticks.len()).max(1);
        let place = usize::try_from(tick.rem_euclid(count)).unwrap_or(0);
        let sample = ticks.get(place).copied().flatten()?;
        Some(sample + tick.div_euclid(count) * whole(self.sent[from]))
    }
}

fn whole(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}
