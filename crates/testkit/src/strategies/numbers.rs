//! Numbers in netem's words as whole numbers: nanoseconds, ten-thousandths of a percent, bits per second, counts.

use core::num::{NonZeroU32, NonZeroU64};
use core::time::Duration;

use cohaptic_wan::netem::{ChanceSpec, GemodelSpec, JitterSpec, LossSpec, Netem, RateSpec, SlotGap, StateSpec};

use super::bounds::LinkBounds;
use super::shrink::Number;
use super::stage::Stage;
use super::units::{ALL, nanos, percent, whole};

/// Least impairing value of a number.
#[derive(Clone, Copy, Debug)]
enum Goal {
    /// Lower end of the range of the stage.
    Low(Stage),
    /// Upper end of the range of the stage.
    High(Stage),
    At(u64),
}

/// A number in netem's words, with functions to read and write it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knob {
    goal: Goal,
    read: fn(&Netem) -> Option<u64>,
    /// Sets the number. Does nothing if the words do not contain the number.
    write: fn(&mut Netem, u64),
}

impl Knob {
    pub(super) fn number(&self, netem: &Netem, bounds: &LinkBounds) -> Option<Number> {
        let value = (self.read)(netem)?;
        let goal = match self.goal {
            Goal::Low(stage) => bounds.span(stage).low,
            Goal::High(stage) => bounds.span(stage).high,
            Goal::At(goal) => goal,
        };
        let step = if let Goal::High(stage) = self.goal { bounds.span(stage).step } else { 1 };
        Some(Number { value, goal, step })
    }

    pub(super) fn set(&self, netem: &Netem, value: u64) -> Netem {
        let mut changed = netem.clone();
        (self.write)(&mut changed, value);
        changed
    }
}

/// Numbers of netem's words, in the order of shrinking. A correlation shrinks to one percent, a gap to two packets.
pub(super) const KNOBS: [Knob; 27] = [
    // Jitter comes before the delay, because the delay must not be less than the jitter.
    Knob { goal: Goal::Low(Stage::Jitter), read: |n| Some(nanos(jitter(n)?.time)), write: |n, v| put(jitter_mut(n).map(|j| &mut j.time), time(v)) },
    Knob {
        goal: Goal::At(ONE),
        read: |n| jitter(n)?.correlation.map(whole),
        write: |n, v| put(jitter_mut(n).map(|j| &mut j.correlation), Some(percent(v))),
    },
    Knob {
        goal: Goal::Low(Stage::Delay),
        read: |n| Some(nanos(n.delay.as_ref()?.time)),
        write: |n, v| put(n.delay.as_mut().map(|d| &mut d.time), time(v)),
    },
    Knob { goal: Goal::Low(Stage::Loss), read: |n| share(random(n)), write: |n, v| put_share(random_mut(n), v) },
    Knob { goal: Goal::At(ONE), read: |n| likeness(random(n)), write: |n, v| put_likeness(random_mut(n), v) },
    Knob { goal: Goal::At(1), read: |n| Some(whole(gemodel(n)?.p)), write: |n, v| put(gemodel_mut(n).map(|g| &mut g.p), percent(v)) },
    Knob { goal: Goal::At(ALL), read: |n| gemodel(n)?.r.map(whole), write: |n, v| put(gemodel_mut(n).map(|g| &mut g.r), Some(percent(v))) },
    Knob {
        goal: Goal::At(1),
        read: |n| gemodel(n)?.loss_in_bad.map(whole),
        write: |n, v| put(gemodel_mut(n).map(|g| &mut g.loss_in_bad), Some(percent(v))),
    },
    Knob { goal: Goal::At(1), read: |n| Some(whole(state(n)?.p13)), write: |n, v| put(state_mut(n).map(|s| &mut s.p13), percent(v)) },
    Knob { goal: Goal::At(0), read: |n| state(n)?.p14.map(whole), write: |n, v| put(state_mut(n).map(|s| &mut s.p14), Some(percent(v))) },
    Knob { goal: Goal::At(1), read: |n| state(n)?.p23.map(whole), write: |n, v| put(state_mut(n).map(|s| &mut s.p23), Some(percent(v))) },
    Knob { goal: Goal::At(0), read: |n| state(n)?.p32.map(whole), write: |n, v| put(state_mut(n).map(|s| &mut s.p32), Some(percent(v))) },
    Knob { goal: Goal::At(ALL), read: |n| state(n)?.p31.map(whole), write: |n, v| put(state_mut(n).map(|s| &mut s.p31), Some(percent(v))) },
    Knob { goal: Goal::Low(Stage::Corrupt), read: |n| share(n.corrupt), write: |n, v| put_share(n.corrupt.as_mut(), v) },
    Knob { goal: Goal::At(ONE), read: |n| likeness(n.corrupt), write: |n, v| put_likeness(n.corrupt.as_mut(), v) },
    Knob { goal: Goal::Low(Stage::Duplicate), read: |n| share(n.duplicate), write: |n, v| put_share(n.duplicate.as_mut(), v) },
    Knob { goal: Goal::At(ONE), read: |n| likeness(n.duplicate), write: |n, v| put_likeness(n.duplicate.as_mut(), v) },
    Knob { goal: Goal::Low(Stage::Reorder), read: |n| share(reorder(n)), write: |n, v| put_share(reorder_mut(n), v) },
    Knob { goal: Goal::At(ONE), read: |n| likeness(reorder(n)), write: |n, v| put_likeness(reorder_mut(n), v) },
    Knob { goal: Goal::At(2), read: |n| Some(n.reorder?.gap?.get().into()), write: |n, v| put(n.reorder.as_mut().map(|r| &mut r.gap), count(v)) },
    Knob {
        goal: Goal::High(Stage::Rate),
        read: |n| Some(n.rate?.bytes_per_sec.get().saturating_mul(8)),
        write: |n, v| n.rate = NonZeroU64::new(v / 8).map(|bytes_per_sec| RateSpec { bytes_per_sec, framing: n.rate.and_then(|r| r.framing) }),
    },
    Knob { goal: Goal::High(Stage::Limit), read: |n| n.limit.map(Into::into), write: |n, v| n.limit = u32::try_from(v).ok() },
    Knob { goal: Goal::Low(Stage::Slot), read: |n| slot_time(n, |min, _| Some(*min)), write: |n, v| put_slot(n, Some(time(v)), None) },
    Knob { goal: Goal::Low(Stage::Slot), read: |n| slot_time(n, |_, max| *max), write: |n, v| put_slot(n, None, Some(time(v))) },
    Knob { goal: Goal::Low(Stage::Slot), read: |n| drawn(n).map(|(delay, _)| nanos(*delay)), write: |n, v| put(drawn_mut(n).map(|d| d.0), time(v)) },
    Knob { goal: Goal::At(1), read: |n| drawn(n).map(|(_, jitter)| nanos(*jitter)), write: |n, v| put(drawn_mut(n).map(|d| d.1), time(v)) },
    Knob {
        // The more packets may leave in a slot, the fewer packets wait.
        goal: Goal::At(100),
        read: |n| Some(n.slot.as_ref()?.packets?.get().into()),
        write: |n, v| put(n.slot.as_mut().map(|s| &mut s.packets), count(v)),
    },
];

/// One percent in ten-thousandths: the goal of correlations.
const ONE: u64 = 10_000;

const fn time(nanos: u64) -> Duration {
    Duration::from_nanos(nanos)
}

fn count(value: u64) -> Option<NonZeroU32> {
    NonZeroU32::new(u32::try_from(value).ok()?)
}

fn put<T>(place: Option<&mut T>, value: T) {
    if let Some(place) = place {
        *place = value;
    }
}

fn share(chance: Option<ChanceSpec>) -> Option<u64> {
    Some(whole(chance?.percent))
}

fn put_share(chance: Option<&mut ChanceSpec>, value: u64) {
    put(chance.map(|chance| &mut chance.percent), percent(value));
}

fn likeness(chance: Option<ChanceSpec>) -> Option<u64> {
    chance?.correlation.map(whole)
}

fn put_likeness(chance: Option<&mut ChanceSpec>, value: u64) {
    put(chance.map(|chance| &mut chance.correlation), Some(percent(value)));
}

pub(super) fn jitter(netem: &Netem) -> Option<&JitterSpec> {
    netem.delay.as_ref()?.jitter.as_ref()
}

pub(super) fn jitter_mut(netem: &mut Netem) -> Option<&mut JitterSpec> {
    netem.delay.as_mut()?.jitter.as_mut()
}

const fn random(netem: &Netem) -> Option<ChanceSpec> {
    if let Some(LossSpec::Random(chance)) = netem.loss { Some(chance) } else { None }
}

pub(super) const fn random_mut(netem: &mut Netem) -> Option<&mut ChanceSpec> {
    if let Some(LossSpec::Random(chance)) = &mut netem.loss { Some(chance) } else { None }
}

const fn gemodel(netem: &Netem) -> Option<GemodelSpec> {
    if let Some(LossSpec::Gemodel(model)) = netem.loss { Some(model) } else { None }
}

const fn gemodel_mut(netem: &mut Netem) -> Option<&mut GemodelSpec> {
    if let Some(LossSpec::Gemodel(model)) = &mut netem.loss { Some(model) } else { None }
}

const fn state(netem: &Netem) -> Option<StateSpec> {
    if let Some(LossSpec::State(model)) = netem.loss { Some(model) } else { None }
}

const fn state_mut(netem: &mut Netem) -> Option<&mut StateSpec> {
    if let Some(LossSpec::State(model)) = &mut netem.loss { Some(model) } else { None }
}

fn reorder(netem: &Netem) -> Option<ChanceSpec> {
    netem.reorder.map(|reorder| reorder.chance)
}

pub(super) fn reorder_mut(netem: &mut Netem) -> Option<&mut ChanceSpec> {
    netem.reorder.as_mut().map(|reorder| &mut reorder.chance)
}

fn slot_time(netem: &Netem, which: fn(&Duration, &Option<Duration>) -> Option<Duration>) -> Option<u64> {
    match &netem.slot.as_ref()?.gap {
        SlotGap::Range { min, max } => which(min, max).map(nanos),
        SlotGap::Drawn { .. } => None,
    }
}

fn put_slot(netem: &mut Netem, shortest: Option<Duration>, longest: Option<Duration>) {
    if let Some(SlotGap::Range { min, max }) = netem.slot.as_mut().map(|slot| &mut slot.gap) {
        *min = shortest.unwrap_or(*min);
        *max = longest.or(*max);
    }
}

fn drawn(netem: &Netem) -> Option<(&Duration, &Duration)> {
    match &netem.slot.as_ref()?.gap {
        SlotGap::Drawn { delay, jitter, .. } => Some((delay, jitter)),
        SlotGap::Range { .. } => None,
    }
}

fn drawn_mut(netem: &mut Netem) -> Option<(&mut Duration, &mut Duration)> {
    match &mut netem.slot.as_mut()?.gap {
        SlotGap::Drawn { delay, jitter, .. } => Some((delay, jitter)),
        SlotGap::Range { .. } => None,
    }
}
