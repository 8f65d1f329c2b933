//! The operator of a node: a hand that moves the wanted place of its arm with a velocity in proportion to the distance from the target that the eye saw some
//! ticks ago (the crossover model of a person who tracks: McRuer & Jex 1967).
//!
//! With the target at the origin, a tick k of the law is
//!
//! ```text
//! vw(k) = −ωc·S(k − m)        F(k) = ka·xw(k) + ba·vw(k)        xw(k + 1) = xw(k) + h·vw(k)
//! ```
//!
//! S(k) is the place that is seen at the tick: the position of the own copy, or of the sample of another node that is held at this tick. F is the force of the
//! arm's spring and damper at the wanted motion; their other ends act in the plant of the device. A target that moves is a given function of time. It moves a
//! solution of the equations, not the difference of two solutions, and so has no part in stability.
//!
//! The seen places of the latest m ticks are states. They stand beside the samples of earlier frames, as one more series of numbers: one number for each tick
//! of the node. A frame uses only the numbers that reach the hand within the frame.

use cohaptic_peer::Gains;

use super::node::Rows;
use crate::Matrix;

/// The operator of a node.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Operator {
    /// Crossover frequency ωc [rad/s]: the velocity of the wanted place over the seen distance.
    pub crossover: f64,
    /// Stiffness ka and damping ba of the arm.
    pub arm: Gains,
    /// Delay m from the eye to the hand, in ticks of the node.
    pub lag: usize,
    /// Time h \[s\] from tick to tick by which the wanted place moves on.
    pub tick: f64,
    /// The place that is seen.
    pub sees: Seen,
}

/// Place that an operator sees.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Seen {
    /// Position of the own copy.
    Own,
    /// Position in the sample of another node that the own node holds.
    Held {
        /// The other node.
        from: usize,
    },
    /// The origin, at all times. Members of a class that see one place see equal positions, so the differences of members see nothing.
    Nothing,
}

impl Operator {
    /// Tells whether the wanted place is a state. Without a spring the hand feels the velocity of the wanted place alone.
    pub(crate) fn has_wanted(&self) -> bool {
        self.arm.stiffness > 0.0
    }

    /// Returns the velocity of the wanted place over the seen place, −ωc [1/s].
    pub(crate) const fn rate(&self) -> f64 {
        -self.crossover
    }

    /// Returns the operator of the differences between members of a class: what another node shows is equal for all members.
    pub(crate) const fn apart(self) -> Self {
        let sees = match self.sees {
            Seen::Own => Seen::Own,
            Seen::Held { .. } | Seen::Nothing => Seen::Nothing,
        };
        Self { sees, ..self }
    }

    /// Makes one tick: sets the force of the arm at the wanted motion \[N\], and then moves the wanted place. `seen` is the place seen m ticks ago. Each slice
    /// has one entry per column.
    pub(crate) fn act(&self, mut wanted: Option<&mut [f64]>, seen: &[f64], force: &mut [f64]) {
        for (column, force) in force.iter_mut().enumerate() {
            let speed = self.rate() * seen[column];
            *force = self.arm.damping * speed;
            if let Some(wanted) = &mut wanted {
                *force += self.arm.stiffness * wanted[column];
                wanted[column] += self.tick * speed;
            }
        }
    }

    /// Returns the largest force of the arm on the device per unit of wanted and seen places [N/m].
    pub(crate) fn force_norm(&self) -> f64 {
        self.arm.stiffness.abs() + (self.arm.damping * self.crossover).abs()
    }
}

/// Rows of the seen places of an operator, among the rows of the samples that a frame uses or sends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    pub(super) node: usize,
    pub(super) operator: Operator,
    /// Number of ticks of the node in the frame.
    pub(super) ticks: usize,
    /// Row of the newest place of earlier frames that the frame uses; older places follow.
    first_used: usize,
    /// Row of the place seen at the first tick of the frame; the places of later ticks follow.
    pub(super) first_sent: usize,
    /// Number of ticks made in the frame so far.
    made: usize,
}

impl Sight {
    pub(super) const fn new(node: usize, operator: Operator, ticks: usize) -> Self {
        Self { node, operator, ticks, first_used: 0, first_sent: 0, made: 0 }
    }

    /// Returns the ages, in ticks, of the places of earlier frames that the frame uses; the place seen at the last tick before the frame has age 1.
    pub(super) fn ages(&self) -> std::ops::RangeInclusive<usize> {
        // The last tick of the frame looks back m ticks, to an age of m + 1 less the number of ticks.
        let newest = (self.operator.lag + 1).saturating_sub(self.ticks).max(1);
        newest..=self.operator.lag
    }

    /// Gives the places their rows: places of earlier frames from row `first_used` on, of this frame from row `first_sent` on. Returns the next free row.
    pub(super) const fn place(&mut self, first_used: usize, first_sent: usize) -> usize {
        (self.first_used, self.first_sent) = (first_used, first_sent);
        first_sent + self.ticks
    }

    /// Makes a tick of the operator: sees a place, sets the force of the arm at the wanted motion \[N\], and moves the wanted place. `z` has the node's states,
    /// with the rows `rows`, and `store` the samples and seen places. `held` returns the row of the sample of a node that is held at this tick.
    pub(super) fn tick(&mut self, z: &mut Matrix, rows: Rows, store: &mut Matrix, held: impl Fn(usize) -> Option<usize>, force: &mut [f64]) {
        let (now, acts) = self.next_rows();
        // The eye sees before the hand acts: without a lag, a place acts at the tick at which it is seen.
        match self.operator.sees {
            Seen::Own => store.row_mut(now).copy_from_slice(z.row(rows.object)),
            // The first number of a whole sample is the position. Without a sample the place stays where everything was at first.
            Seen::Held { from } => {
                if let Some(position) = held(from) {
                    store.move_rows(position..position + 1, now);
                }
            }
            Seen::Nothing => {}
        }
        self.operator.act(rows.wanted.map(|row| z.row_mut(row)), store.row(acts), force);
    }

    /// Counts a tick. Returns the row of the place seen at this tick, and the row of the place that comes to the hand at this tick.
    fn next_rows(&mut self) -> (usize, usize) {
        let (now, lag) = (self.made, self.operator.lag);
        self.made += 1;
        let acts = if now >= lag { self.first_sent + now - lag } else { self.first_used + (lag - now) - self.ages().start() };
        (self.first_sent + now, acts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sight(lag: usize, ticks: usize) -> Sight {
        let operator = Operator { crossover: 3.0, arm: Gains { stiffness: 300.0, damping: 20.0 }, lag, tick: 1e-3, sees: Seen::Own };
        Sight::new(0, operator, ticks)
    }

    /// Rows 100 … are the places of earlier frames, rows 200 … those of this frame.
    #[test]
    fn a_place_comes_to_the_hand_after_the_lag() {
        let acting = |lag: usize, ticks: usize| -> (Vec<usize>, Vec<usize>) {
            let mut sight = sight(lag, ticks);
            assert_eq!(sight.place(100, 200), 200 + ticks);
            let rows: Vec<usize> = (0..ticks).map(|_| sight.next_rows().1).collect();
            (sight.ages().collect(), rows)
        };
        // Five ticks back: ages 5, 4, 3 at the three ticks, of which 3 is the newest.
        assert_eq!(acting(5, 3), (vec![3, 4, 5], vec![102, 101, 100]));
        // Two ticks back: ages 2 and 1, and then places of this frame.
        assert_eq!(acting(2, 4), (vec![1, 2], vec![101, 100, 200, 201]));
        assert_eq!(acting(0, 2), (vec![], vec![200, 201]));
    }

    #[test]
    fn the_hand_pulls_from_where_the_wanted_place_was_at_the_tick() {
        let mut wanted = [2.0];
        let mut force = [f64::NAN];
        sight(1, 1).operator.act(Some(&mut wanted), &[0.5], &mut force);
        assert_eq!((force[0].to_bits(), wanted[0].to_bits()), ((20.0 * -1.5 + 300.0 * 2.0_f64).to_bits(), (2.0 - 1e-3 * 1.5_f64).to_bits()));
        sight(1, 1).operator.act(None, &[0.5], &mut force);
        assert_eq!(force[0].to_bits(), (-30.0_f64).to_bits());
    }
}
