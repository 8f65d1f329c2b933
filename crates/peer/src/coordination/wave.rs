//! Wave variables: between each two copies runs a line of the impedance b/(N − 1), which carries waves and keeps no energy from nothing.
//!
//! Niemeyer & Slotine (2004) between two ports; each copy is a series junction of its N − 1 lines, so it has the damping b towards ground and the force
//! F = −ρ·Σ sⱼ with ρ = √(2·b/(N − 1)). The wave sⱼ [√W] is that of the newest sample of peer j, from its arrival on for the M ticks between samples.
//! A sample to peer j carries what the junction sends into the line over these ticks, on average: ρ·(x − x at the last sample)/(M·h) less the mean of sⱼ.
//! No wave is used for longer than it was sent for, so lost, late and repeated samples take energy and never give any.
//!
//! All is counted at events: what a line has received since the last sample is its wave times the ticks it acted.

use alloc::vec::Vec;

use super::session::{ControllerKind, SessionParameters};
use super::{Command, Context, LawForm, LawParameter, LawParameters, LawValue, Strategy, UsedGains};
use crate::wire::SampleKind;
use crate::{Gains, Held, State};

/// The words of `on-loss`, and what they mean.
const ON_LOSS: &[(&str, &str)] = &[("zero", "no wave"), ("hold", "the last wave, which is not passive")];
const HOLD: usize = 1;
const NEVER: u64 = u64::MAX;

/// The junction of a copy.
#[derive(Clone, Debug)]
pub struct Wave<const A: usize> {
    /// ρ [√(N·s/m)].
    root: f64,
    /// M, and 1/M.
    every: u64,
    share: f64,
    /// ρ/(M·h), the wave of a motion of a metre in the ticks between samples [√W/m].
    rate: f64,
    /// Whether a wave goes on when its ticks are over.
    holds: bool,
    /// The ticks of each line: with 50 peers it pays that both of a line lie side by side.
    ticks: Vec<Ticks>,
    /// No wave ends before this tick.
    next_end: u64,
    /// Where the copy was at the last sample.
    sampled: [f64; A],
    /// All of them waves: ρ/(M·h)·`sampled`; then for each line sⱼ, and the sum of sⱼ over the ticks from the last sample to [`Ticks::since`].
    numbers: Vec<[f64; A]>,
    /// Σ sⱼ.
    sum: [f64; A],
    /// The tick whose command comes next.
    tick: u64,
}

/// The ticks of a line, as seen from one of its ends.
#[derive(Clone, Copy, Debug)]
struct Ticks {
    /// Up to which tick its waves are counted.
    since: u64,
    /// At which tick sⱼ ends: never, if it is 0 or held.
    end: u64,
}

/// A line, with the counts of one of its ends.
struct Line<'w, const A: usize> {
    ticks: &'w mut Ticks,
    /// sⱼ.
    wave: &'w mut [f64; A],
    /// The sum of sⱼ over the ticks from the last sample to [`Ticks::since`].
    received: &'w mut [f64; A],
}

impl<const A: usize> Line<'_, A> {
    /// Counts the ticks up to that one.
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "ticks are counted, far below 2^53")]
    fn count_to(&mut self, tick: u64) {
        // One instruction for a number with a sign, six without.
        let ticks = (tick - core::mem::replace(&mut self.ticks.since, tick)).cast_signed() as f64;
        for (received, wave) in self.received.iter_mut().zip(&*self.wave) {
            *received += ticks * wave;
        }
    }
}

impl<const A: usize> ControllerKind<A> for Wave<A> {
    const GAINS: UsedGains = UsedGains::Neither;
    const KIND: SampleKind = SampleKind::Wave;
    const PARAMETERS: &[LawParameter] = &[
        LawParameter {
            key: "impedance",
            form: LawForm::Impedance,
            default: "20",
            about: "Wave impedance at each copy, b, shared by its lines",
            can_change: false,
        },
        LawParameter {
            key: "on-loss",
            form: LawForm::Words(ON_LOSS),
            default: "\"zero\"",
            about: "What acts when the next wave is due and has not come",
            can_change: false,
        },
    ];

    fn damping(parameters: &LawParameters) -> f64 {
        parameters.own.number(0)
    }

    #[expect(clippy::cast_precision_loss, reason = "ticks are counted, far below 2^53")]
    fn new(session: &SessionParameters<A>) -> Self {
        let others = session.initial.len() - 1;
        let root = libm::sqrt(2.0 * Self::damping(&session.law) / session.others());
        let every = session.samples_every as f64;
        let mut wave = Self {
            root,
            every: session.samples_every,
            share: 1.0 / every,
            rate: root / (every * session.law.tick.as_secs_f64()),
            holds: session.law.own.get(1) == LawValue::Word(HOLD),
            ticks: alloc::vec![Ticks { since: 0, end: NEVER }; others],
            next_end: NEVER,
            sampled: [0.0; A],
            numbers: alloc::vec![[0.0; A]; 1 + 2 * others],
            sum: [0.0; A],
            tick: 0,
        };
        wave.sample(&session.initial[session.place].position);
        wave
    }
}

impl<const A: usize> Wave<A> {
    /// Ends the waves whose ticks are over. Lines are looked at when a wave was to end, which is mostly replaced by then.
    #[inline]
    fn end_waves(&mut self) {
        if self.tick >= self.next_end {
            self.end_due();
        }
    }

    fn end_due(&mut self) {
        // Mostly every wave that was to end is replaced, and the next end alone is looked for.
        let next = self.ticks.iter().fold(NEVER, |next, ticks| next.min(ticks.end));
        if next > self.tick {
            self.next_end = next;
            return;
        }
        self.next_end = NEVER;
        for other in 0..self.ticks.len() {
            let end = self.ticks[other].end;
            if end > self.tick {
                self.next_end = self.next_end.min(end);
                continue;
            }
            let mut line = self.line(other);
            line.count_to(end);
            line.ticks.end = NEVER;
            let wave = core::mem::replace(line.wave, [0.0; A]);
            for (sum, wave) in self.sum.iter_mut().zip(wave) {
                *sum -= wave;
            }
        }
    }

    /// The line to another peer: found once for all that a sample needs of it.
    #[inline(always)]
    fn line(&mut self, other: usize) -> Line<'_, A> {
        let [wave, received] = &mut self.numbers[1..].as_chunks_mut().0[other];
        Line { ticks: &mut self.ticks[other], wave, received }
    }

    fn sample(&mut self, position: &[f64; A]) {
        self.sampled = *position;
        self.numbers[0] = position.map(|position| self.rate * position);
    }

    /// Adds the waves up anew.
    fn add_up(&mut self) {
        self.sum = [0.0; A];
        for other in 0..self.ticks.len() {
            for (sum, wave) in self.sum.iter_mut().zip(self.numbers[1 + 2 * other]) {
                *sum += wave;
            }
        }
    }
}

impl<const A: usize> Strategy<A> for Wave<A> {
    #[inline]
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        self.end_waves();
        self.tick += 1;
        Command { force: self.sum.map(|sum| -self.root * sum), target: *context.held.mean() }
    }

    fn kind(&self) -> SampleKind {
        Self::KIND
    }

    #[inline]
    fn extra(&mut self, receiver: usize, own: &State<A>, _held: &Held<A>) -> [f64; A] {
        self.end_waves();
        let tick = self.tick;
        let mut line = self.line(receiver);
        line.count_to(tick);
        let received = core::mem::replace(line.received, [0.0; A]);
        core::array::from_fn(|axis| self.rate * (own.position[axis] - self.sampled[axis]) - self.share * received[axis])
    }

    fn sent(&mut self, own: &State<A>) {
        self.sample(&own.position);
        // What additions and subtractions round must not add up.
        self.add_up();
    }

    #[inline]
    fn accept(&mut self, other: usize, numbers: &[f64; A]) {
        let (tick, every, holds) = (self.tick, self.every, self.holds);
        let mut line = self.line(other);
        line.count_to(tick);
        let old = core::mem::replace(line.wave, *numbers);
        if !holds {
            line.ticks.end = tick + every;
            self.next_end = self.next_end.min(tick + every);
        }
        for ((sum, new), old) in self.sum.iter_mut().zip(numbers).zip(old) {
            *sum += new - old;
        }
    }

    /// Waves have no gains.
    fn set_gains(&mut self, _gains: Gains) {}

    fn memory(&self) -> &[f64] {
        self.numbers.as_flattened()
    }

    /// Waves that were in use keep the ticks that are left to them.
    fn set_memory(&mut self, memory: &[f64]) {
        self.numbers.as_flattened_mut().copy_from_slice(memory);
        self.sampled = self.numbers[0].map(|wave| wave / self.rate);
        self.add_up();
    }
}
