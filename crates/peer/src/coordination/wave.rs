//! Wave variables: every pair of copies is connected by a line of the impedance b/(N − 1), which carries waves and generates no energy.
//!
//! The method is that of Niemeyer & Slotine (2004) between two ports. Each copy is a series junction of its N − 1 lines, so it has the damping b towards
//! ground and the force F = −ρ·Σ sⱼ with ρ = √(2·b/(N − 1)). The wave sⱼ [√W] comes from the newest sample of peer j, and acts from its arrival for the M
//! ticks between samples. A sample to peer j carries the mean wave of the junction into the line over these ticks: ρ·(x − x at the last sample)/(M·h) minus
//! the mean of sⱼ. No wave acts for more ticks than it was sent for, so lost, late and repeated samples dissipate energy and never generate energy.
//!
//! Waves are counted at events: the wave received by a line since the last sample is sⱼ times the number of ticks for which sⱼ acted.

use alloc::vec::Vec;

use super::session::{ControllerKind, SessionParameters};
use super::{Command, Context, LawForm, LawParameter, LawParameters, LawValue, Strategy, UsedGains};
use crate::sample_kind::SampleKind;
use crate::{Gains, Held, State};

/// Words of the parameter `on-loss`, each with its meaning.
const ON_LOSS: &[(&str, &str)] = &[("zero", "no wave"), ("hold", "the last wave, which is not passive")];
/// Index of `hold` in [`ON_LOSS`].
const HOLD: usize = 1;
/// Tick of an end that does not come.
const NEVER: u64 = u64::MAX;

/// Series junction of a copy.
#[derive(Clone, Debug)]
pub struct Wave<const A: usize> {
    /// Factor ρ from a wave to the force of a line [√(N·s/m)].
    root: f64,
    /// M, the number of ticks between samples.
    every: u64,
    /// Factor 1/M from the sum of a wave over the ticks between two samples to the mean wave.
    share: f64,
    /// ρ/(M·h), the wave of a motion of one metre in the ticks between samples [√W/m].
    rate: f64,
    /// `true` if a wave continues after its M ticks.
    holds: bool,
    /// Ticks of each line, indexed by the order of peers without this peer. Both counts of a line are adjacent, because a sample needs both.
    ticks: Vec<Ticks>,
    /// Tick before which no wave ends.
    next_end: u64,
    /// Position of the copy at the last sample \[m\].
    sampled: [f64; A],
    /// All numbers in the unit of waves: first ρ/(M·h)·`sampled`; then for each line sⱼ, and the sum of sⱼ over the ticks from the last sample to
    /// [`Ticks::since`].
    numbers: Vec<[f64; A]>,
    /// Σ sⱼ [√W].
    sum: [f64; A],
    /// Tick of the next command, from 0.
    tick: u64,
}

/// Ticks of a line, as counted at the end of this peer.
#[derive(Clone, Copy, Debug)]
struct Ticks {
    /// Tick up to which the wave is counted in [`Line::received`].
    since: u64,
    /// Tick at which sⱼ ends; [`NEVER`] for a wave of 0 and for a held wave.
    end: u64,
}

/// A line with the counts at the end of this peer.
struct Line<'w, const A: usize> {
    ticks: &'w mut Ticks,
    /// Wave sⱼ [√W].
    wave: &'w mut [f64; A],
    /// Sum of sⱼ over the ticks from the last sample to [`Ticks::since`].
    received: &'w mut [f64; A],
}

impl<const A: usize> Line<'_, A> {
    /// Counts the wave up to `tick`.
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "ticks are counted, far below 2^53")]
    fn count_to(&mut self, tick: u64) {
        // x86 converts a signed integer to a float in one instruction, and an unsigned one in several. The difference of two ticks is far below 2^63.
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
            about: "Wave that acts if the next wave is due and has not come",
            can_change: false,
        },
    ];

    fn damping(parameters: &LawParameters) -> f64 {
        parameters.own.number(0)
    }

    #[expect(clippy::cast_precision_loss, reason = "ticks are counted, far below 2^53")]
    fn new(session: &SessionParameters<A>) -> Self {
        let others = session.initial.len() - 1;
        // (N − 1)·ρ²/2 = b: all lines together give the copy the damping b towards ground.
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
    /// Ends the waves whose ticks are over. `next_end` is a lower bound: the wave that was to end is usually replaced before.
    #[inline]
    fn end_waves(&mut self) {
        if self.tick >= self.next_end {
            self.end_due();
        }
    }

    /// Ends the waves that are due, and finds the next end.
    fn end_due(&mut self) {
        // Usually every wave that was to end has been replaced, and only the next end is searched.
        let next = self.ticks.iter().fold(NEVER, |next, ticks| next.min(ticks.end));
        if next > self.tick {
            self.next_end = next;
            return;
        }
        // A wave is due: all lines are visited, and the next end is the least end left.
        self.next_end = NEVER;
        for other in 0..self.ticks.len() {
            let end = self.ticks[other].end;
            if end > self.tick {
                self.next_end = self.next_end.min(end);
                continue;
            }
            let mut line = self.line(other);
            // The wave counts up to its own end, not up to now: it may be over for some ticks.
            line.count_to(end);
            line.ticks.end = NEVER;
            let wave = core::mem::replace(line.wave, [0.0; A]);
            for (sum, wave) in self.sum.iter_mut().zip(wave) {
                *sum -= wave;
            }
        }
    }

    /// Returns the line to another peer, found once for all accesses by a sample.
    #[inline(always)]
    fn line(&mut self, other: usize) -> Line<'_, A> {
        // `numbers` has one pair of wave and sum per line, after the first entry.
        let [wave, received] = &mut self.numbers[1..].as_chunks_mut().0[other];
        Line { ticks: &mut self.ticks[other], wave, received }
    }

    /// Notes the position of the copy at a sample.
    fn sample(&mut self, position: &[f64; A]) {
        self.sampled = *position;
        self.numbers[0] = position.map(|position| self.rate * position);
    }

    /// Computes Σ sⱼ from the waves.
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
        // Samples of a tick are sent and received before its command, so the tick counts here.
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
        // After the count the sum of sⱼ covers all ticks since the last sample, and starts again from zero.
        let mut line = self.line(receiver);
        line.count_to(tick);
        let received = core::mem::replace(line.received, [0.0; A]);
        core::array::from_fn(|axis| self.rate * (own.position[axis] - self.sampled[axis]) - self.share * received[axis])
    }

    fn sent(&mut self, own: &State<A>) {
        self.sample(&own.position);
        // Differences added to Σ sⱼ at each arrival leave rounding errors. A new sum at each sample keeps the errors from growing.
        self.add_up();
    }

    #[inline]
    fn accept(&mut self, other: usize, numbers: &[f64; A]) {
        let (tick, every, holds) = (self.tick, self.every, self.holds);
        let mut line = self.line(other);
        line.count_to(tick);
        // The old wave counts up to now, before the new wave replaces it.
        let old = core::mem::replace(line.wave, *numbers);
        if !holds {
            line.ticks.end = tick + every;
            self.next_end = self.next_end.min(tick + every);
        }
        // Σ sⱼ changes by the difference, so an arrival costs the same for any number of lines.
        for ((sum, new), old) in self.sum.iter_mut().zip(numbers).zip(old) {
            *sum += new - old;
        }
    }

    /// No effect: waves have no gains.
    fn set_gains(&mut self, _gains: Gains) {}

    fn memory(&self) -> &[f64] {
        self.numbers.as_flattened()
    }

    /// Sets the waves. Waves in use keep their remaining ticks.
    fn set_memory(&mut self, memory: &[f64]) {
        self.numbers.as_flattened_mut().copy_from_slice(memory);
        self.sampled = self.numbers[0].map(|wave| wave / self.rate);
        self.add_up();
    }
}
