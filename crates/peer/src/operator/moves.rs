//! Movements toward a target, each after a look at the result of the movement before.

use core::time::Duration;

use super::{MovesConfig, View, ticks};
use crate::State;

/// Least and greatest estimated gain ĝ.
const GAINS: (f64, f64) = (0.1, 1.2);

/// Peak of the velocity of a minimum jerk movement, over the mean velocity: f′(½) = 15/8.
const PEAK: f64 = 1.875;

/// Law of movements.
///
/// A movement is a minimum jerk (Flash & Hogan 1985). The next one begins when the result of the movement can be seen, as people do with a delay: move and wait
/// (Sheridan & Ferrell 1963).
#[derive(Clone, Debug)]
pub(super) struct Moves<const A: usize> {
    /// Wait R after a surprise, in ticks.
    reaction: u64,
    /// Wait m + E after the end of a movement, in ticks.
    wait: u64,
    /// Least duration T/h of a movement in ticks, not rounded.
    duration: f64,
    /// Length of a movement of the least duration with the largest speed \[m\]; infinite without a limit.
    reach: f64,
    /// Largest length of a movement \[m\]; infinite without a limit.
    step: f64,
    noise: f64,
    learns: f64,
    /// Period of the tick \[s\].
    tick: f64,
    /// Number k of the present tick.
    now: u64,
    /// Earliest tick K of the next plan.
    next_plan: u64,
    /// Estimated gain ĝ: what a movement of the hand moves the object by, over the movement.
    gain: f64,
    /// Wanted position at rest \[m\]: where the movement before has ended.
    place: [f64; A],
    /// Movement under way.
    under_way: Option<Movement<A>>,
    /// Vector of the latest movement \[m\] and the position seen when the movement was planned \[m\]; `None` if the movement is judged.
    planned: Option<([f64; A], [f64; A])>,
    /// Number of planned movements.
    count: u64,
}

/// A movement of the hand.
#[derive(Clone, Copy, Debug)]
struct Movement<const A: usize> {
    /// Tick of the beginning.
    from: u64,
    /// Duration q in ticks, above zero.
    ticks: u64,
    /// Position at the beginning \[m\].
    start: [f64; A],
    /// Way from the beginning to the end \[m\].
    way: [f64; A],
}

impl<const A: usize> Moves<A> {
    pub(super) fn new(config: &MovesConfig, visual_ticks: u64, tick: Duration, expects: Duration, place: [f64; A]) -> Self {
        let reaction = ticks(config.reaction, tick);
        Self {
            reaction,
            wait: visual_ticks.saturating_add(ticks(expects, tick)),
            // A quotient of whole nanoseconds: 0.29 s over 1 ms must be 290, and not the next number above.
            duration: nanos(config.duration) / nanos(tick),
            reach: config.speed.map_or(f64::INFINITY, |speed| speed * config.duration.as_secs_f64() / PEAK),
            step: config.step.unwrap_or(f64::INFINITY),
            noise: config.noise,
            learns: config.learns,
            tick: tick.as_secs_f64(),
            now: 0,
            next_plan: reaction,
            gain: 1.0,
            place,
            under_way: None,
            planned: None,
            count: 0,
        }
    }

    /// Returns the wanted motion at a tick.
    #[inline]
    pub(super) fn tick(&mut self, seen: &View<A>, draw: impl FnOnce(u64) -> [f64; A]) -> State<A> {
        let now = self.now;
        self.now += 1;
        if self.under_way.is_none() && now >= self.next_plan {
            self.plan(now, seen, draw);
        }
        let Some(movement) = &self.under_way else { return State { position: self.place, velocity: [0.0; A] } };
        let elapsed = now - movement.from;
        let wanted = movement.at(elapsed, self.tick);
        if elapsed == movement.ticks {
            self.place = wanted.position;
            self.under_way = None;
        }
        wanted
    }

    /// Judges the latest movement and plans the next one, if any is needed.
    #[inline(never)]
    fn plan(&mut self, now: u64, seen: &View<A>, draw: impl FnOnce(u64) -> [f64; A]) {
        // Each movement is judged once, by the first look after it: a second look would see the same.
        if let Some((way, before)) = self.planned.take()
            && self.learns > 0.0
        {
            let moved: [f64; A] = core::array::from_fn(|axis| seen.position[axis] - before[axis]);
            let got = dot(&moved, &way) / dot(&way, &way);
            if got < 0.5 * self.gain {
                // Nothing or little came through: the person is surprised and waits for more.
                self.next_plan = now.saturating_add(self.reaction);
                return;
            }
            self.gain = (self.gain + self.learns * (got - self.gain)).clamp(GAINS.0, GAINS.1);
        }
        let error: [f64; A] = core::array::from_fn(|axis| seen.target[axis] - seen.position[axis]);
        let distance = libm::sqrt(dot(&error, &error));
        if distance <= seen.radius {
            return;
        }
        let share = (self.step / distance).min(1.0) / self.gain;
        let mut way = error.map(|error| share * error);
        if self.noise > 0.0 {
            let spread = self.noise * libm::sqrt(dot(&way, &way));
            let drawn = draw(self.count);
            for (way, normal) in way.iter_mut().zip(drawn) {
                *way += spread * normal;
            }
        }
        let length = libm::sqrt(dot(&way, &way));
        let ticks = whole(self.duration * (length / self.reach).max(1.0));
        self.under_way = Some(Movement { from: now, ticks, start: self.place, way });
        self.planned = Some((way, seen.position));
        self.count += 1;
        self.next_plan = now.saturating_add(ticks).saturating_add(self.wait);
    }
}

impl<const A: usize> Movement<A> {
    /// Returns the wanted motion some ticks after the beginning.
    #[inline]
    #[expect(clippy::cast_precision_loss, reason = "durations are far below 2^53 ticks")]
    fn at(&self, elapsed: u64, tick: f64) -> State<A> {
        let ticks = self.ticks as f64;
        let s = elapsed as f64 / ticks;
        // f(s) = 10s³ − 15s⁴ + 6s⁵ and its derivative.
        let share = s * s * s * (10.0 + s * (6.0 * s - 15.0));
        let rate = 30.0 * (s * (1.0 - s)) * (s * (1.0 - s)) / (ticks * tick);
        State { position: core::array::from_fn(|axis| self.start[axis] + self.way[axis] * share), velocity: self.way.map(|way| way * rate) }
    }
}

#[expect(clippy::cast_precision_loss, reason = "spans are far below 2^53 ns")]
fn nanos(span: Duration) -> f64 {
    span.as_nanos() as f64
}

fn dot<const A: usize>(one: &[f64; A], other: &[f64; A]) -> f64 {
    (0..A).map(|axis| one[axis] * other[axis]).sum()
}

/// Returns the least whole number of ticks that is not below `ticks`, and at least 1.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float saturates; the number is not negative")]
fn whole(ticks: f64) -> u64 {
    (libm::ceil(ticks) as u64).max(1)
}
