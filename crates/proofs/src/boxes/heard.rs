//! The samples that classes of peers hold at their ticks, in the steady state.

use cohaptic_stability::frames::{Event, Timetable};

/// The sample in force at each tick of a class, of each other.
pub(super) struct Heard {
    /// By receiver, sender and tick in the frame: the number of the sample.
    of: Vec<Vec<Vec<Option<i64>>>>,
    sent: Vec<usize>,
}

impl Heard {
    pub(super) fn new(timetable: &Timetable) -> Self {
        let classes = timetable.sent.len();
        let number_of_ticks =
            |class: usize| timetable.events.iter().filter(|event| matches!(event, Event::Tick { node, .. } if *node == class)).count();
        let mut of: Vec<Vec<Vec<Option<i64>>>> = (0..classes).map(|class| vec![vec![None; number_of_ticks(class)]; classes]).collect();
        // A sample is held until another comes, also across frames: those of the frame before are held when this one begins.
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

    /// The sample of one class that another has in force at a tick of its own, counted from the beginning of the frame, also before it; `None` if none ever comes.
    pub(super) fn at(&self, from: usize, to: usize, tick: i64) -> Option<i64> {
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
