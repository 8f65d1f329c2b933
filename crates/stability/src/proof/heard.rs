//! The samples that classes of peers hold at their ticks, in the steady state.

use crate::timetable::{Event, Timetable};

/// What is in force at each tick of a class of each other.
pub(super) struct Heard {
    /// By receiver, sender and tick in the frame: the number of the sample.
    of: Vec<Vec<Vec<Option<i64>>>>,
    sent: Vec<usize>,
}

impl Heard {
    /// `lasting`: for how many ticks of its receiver, by its class, a sample is in force if none comes; `None`: without end.
    pub(super) fn new(timetable: &Timetable, lasting: Option<&[u64]>) -> Self {
        let classes = timetable.sent.len();
        let number_of_ticks =
            |class: usize| timetable.events.iter().filter(|event| matches!(event, Event::Tick { node, .. } if *node == class)).count();
        let ticks: Vec<usize> = (0..classes).map(number_of_ticks).collect();
        let mut of: Vec<Vec<Vec<Option<i64>>>> = ticks.iter().map(|ticks| vec![vec![None; *ticks]; classes]).collect();
        // The sample held and the tick at which it ends, both counted from the frame that is looked at.
        let mut held = vec![vec![None; classes]; classes];
        // What is held when a frame begins has come in one of the two before it, or in the one before those if nothing lasts as long.
        for frame in -3_i64..=0 {
            let mut tick = vec![0; classes];
            for event in &timetable.events {
                let now = |class: usize, tick: &[usize]| frame * whole(ticks[class]) + whole(tick[class]);
                match *event {
                    Event::Sample { .. } => {}
                    Event::Deliver { from, to, sample } => {
                        let end = lasting.map_or(i64::MAX, |lasting| now(to, &tick) + i64::try_from(lasting[to]).unwrap_or(i64::MAX));
                        held[to][from] = Some((sample + frame * whole(timetable.sent[from]), end));
                    }
                    Event::Tick { node, .. } => {
                        if frame == 0 {
                            for (from, held) in held[node].iter().enumerate() {
                                of[node][from][tick[node]] = held.filter(|(_, end)| now(node, &tick) < *end).map(|(sample, _)| sample);
                            }
                        }
                        tick[node] += 1;
                    }
                }
            }
        }
        Self { of, sent: timetable.sent.clone() }
    }

    /// The sample of one class that another has in force at a tick of its own, counted from the beginning of the frame, also before it.
    pub(super) fn at(&self, from: usize, to: usize, tick: i64) -> Option<i64> {
        let ticks = &self.of[to][from];
        let count = whole(ticks.len()).max(1);
        let place = usize::try_from(tick.rem_euclid(count)).unwrap_or(0);
        let sample = ticks.get(place).copied().flatten()?;
        Some(sample + tick.div_euclid(count) * whole(self.sent[from]))
    }
}

pub(super) fn whole(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}
