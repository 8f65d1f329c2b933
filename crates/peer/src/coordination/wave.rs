//! Wave variables: between each two copies runs a line of the impedance b/(N − 1), which carries waves and keeps no energy from nothing.
//!
//! Niemeyer & Slotine (2004) between two ports; each copy is a series junction of its N − 1 lines, so it has the damping b towards ground and the force
//! F = −ρ·Σ sⱼ with ρ = √(2·b/(N − 1)). The wave sⱼ [√W] is that of the newest sample of peer j, from its arrival on for the M ticks between samples.
//! A sample to peer j carries what the junction sends into the line over these ticks, on average: ρ·(x − x at the last sample)/(M·h) less the mean of sⱼ.
//! No wave is used for longer than it was sent for, so lost, late and repeated samples take energy and never give any.
//!
//! All is counted at events: what a line has received since the last sample is its wave times the ticks it acted.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use super::session::{ControllerKind, SessionParameters};
use super::{Command, Context, LawForm, LawParameter, LawParameters, LawValue, Strategy, UsedGains};
use crate::wire::SampleKind;
use crate::{Gains, Held, State};

/// The words of `on-loss`, and what they mean.
const ON_LOSS: &[(&str, &str)] = &[("zero", "no wave"), ("hold", "the last wave, which is not passive")];
const HOLD: usize = 1;

/// The junction of a copy.
#[derive(Clone, Debug)]
pub struct Wave<const A: usize> {
    /// ρ [√(N·s/m)].
    root: f64,
    /// M, and M·h \[s\].
    every: u64,
    period: f64,
    /// Whether a wave goes on when its ticks are over.
    holds: bool,
    lines: Vec<Line<A>>,
    /// Σ sⱼ.
    sum: [f64; A],
    /// The waves that end, with the tick of their end, in order.
    ends: VecDeque<(u64, usize)>,
    /// The tick whose command comes next.
    tick: u64,
    /// Where the copy was at the last sample.
    sampled: [f64; A],
}

/// A line as seen from one of its ends.
#[derive(Clone, Debug)]
struct Line<const A: usize> {
    /// sⱼ.
    wave: [f64; A],
    /// The sum of sⱼ over the ticks from the last sample to `since`.
    received: [f64; A],
    since: u64,
    /// The tick at which sⱼ ends.
    end: u64,
}

impl<const A: usize> Line<A> {
    #[expect(clippy::cast_precision_loss, reason = "ticks are counted, far below 2^53")]
    fn count_to(&mut self, tick: u64) {
        let ticks = (tick - self.since) as f64;
        for axis in 0..A {
            self.received[axis] += ticks * self.wave[axis];
        }
        self.since = tick;
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
        let line = Line { wave: [0.0; A], received: [0.0; A], since: 0, end: 0 };
        Self {
            root: libm::sqrt(2.0 * Self::damping(&session.law) / session.others()),
            every: session.samples_every,
            period: session.samples_every as f64 * session.law.tick.as_secs_f64(),
            holds: session.law.own.get(1) == LawValue::Word(HOLD),
            lines: alloc::vec![line; session.initial.len() - 1],
            sum: [0.0; A],
            ends: VecDeque::new(),
            tick: 0,
            sampled: session.initial[session.place].position,
        }
    }
}

impl<const A: usize> Wave<A> {
    /// Ends the waves whose ticks are over.
    fn end_waves(&mut self) {
        while let Some(&(end, other)) = self.ends.front().filter(|(end, _)| *end <= self.tick) {
            self.ends.pop_front();
            let line = &mut self.lines[other];
            if line.end == end {
                line.count_to(end);
                for axis in 0..A {
                    self.sum[axis] -= line.wave[axis];
                    line.wave[axis] = 0.0;
                }
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

    #[expect(clippy::cast_precision_loss, reason = "ticks are counted, far below 2^53")]
    fn extra(&mut self, receiver: usize, own: &State<A>, _held: &Held<A>) -> [f64; A] {
        self.end_waves();
        let line = &mut self.lines[receiver];
        line.count_to(self.tick);
        let received = core::mem::replace(&mut line.received, [0.0; A]);
        let moved = |axis: usize| own.position[axis] - self.sampled[axis];
        core::array::from_fn(|axis| self.root * moved(axis) / self.period - received[axis] / self.every as f64)
    }

    fn sent(&mut self, own: &State<A>) {
        self.sampled = own.position;
        // Anew, so that what additions and subtractions round does not add up.
        self.sum = [0.0; A];
        for line in &self.lines {
            for axis in 0..A {
                self.sum[axis] += line.wave[axis];
            }
        }
    }

    fn accept(&mut self, other: usize, numbers: &[f64; A]) {
        let line = &mut self.lines[other];
        line.count_to(self.tick);
        for ((sum, new), old) in self.sum.iter_mut().zip(numbers).zip(line.wave) {
            *sum += new - old;
        }
        line.wave = *numbers;
        if !self.holds {
            line.end = self.tick + self.every;
            self.ends.push_back((line.end, other));
        }
    }

    /// Waves have no gains.
    fn set_gains(&mut self, _gains: Gains) {}
}
