//! The search for a motion that grows while contacts open and close.
//!
//! Away from walls a motion that is a times as large is a motion too, for any a > 0. So a motion is followed frame by frame, each time brought back to the same
//! size, from several beginnings. One that grows by much over many frames, whatever its first frames do, has no bound.

use cohaptic_stability::Watch;
use cohaptic_stability::numerics::real;

use super::contact_frame::ContactFrame;

/// A motion that grows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GrowingMotion {
    /// By what factor a frame.
    pub growth: f64,
    /// Over how many frames this was seen, after as many in which the motion settled.
    pub frames: usize,
    /// How often a contact opened or closed in them.
    pub changes: usize,
}

/// How many beginnings are tried, and how many frames of each are followed.
pub(super) const BEGINNINGS: usize = 8;
pub(super) const FRAMES: usize = 4000;
/// A motion is taken to grow if half of its frames magnify it by this at least.
const MUCH: f64 = 1e4;

/// The fastest motion of those followed, if it grows.
pub(super) fn search(frame: &ContactFrame, watch: &dyn Watch) -> Option<GrowingMotion> {
    let found = (0..BEGINNINGS).map_while(|beginning| (!watch.stops()).then(|| follow(frame, beginning)));
    found.flatten().max_by(|one, other| one.growth.total_cmp(&other.growth))
}

/// A motion.
struct Motion<'a> {
    frame: &'a ContactFrame,
    /// The states and then the inputs of a frame.
    values: Vec<f64>,
    /// Where the position is that others are relative to.
    reference: f64,
    closed: Vec<bool>,
    changes: usize,
}

fn follow(frame: &ContactFrame, beginning: usize) -> Option<GrowingMotion> {
    let states = frame.next.rows();
    // Nothing special, and different for each beginning.
    let some = |place: usize| libm::sin(1.0 + 7.3 * real(place) + 2.9 * real(beginning) * (1.0 + real(place % 5)));
    let mut values: Vec<f64> = (0..states).map(some).collect();
    values.resize(frame.next.columns(), 0.0);
    let mut motion = Motion { frame, values, reference: some(states), closed: vec![false; frame.contacts.len()], changes: 0 };
    let mut logarithm = 0.0;
    for number in 0..FRAMES {
        let size = motion.step();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        if number == FRAMES / 2 {
            (logarithm, motion.changes) = (0.0, 0);
        }
        logarithm += libm::log(size);
        motion.shrink(size);
    }
    let frames = FRAMES - FRAMES / 2;
    (logarithm > libm::log(MUCH)).then(|| GrowingMotion { growth: libm::exp(logarithm / real(frames)), frames, changes: motion.changes })
}

impl Motion<'_> {
    /// Goes a frame further; answers the size of the states that take part in the motion.
    fn step(&mut self) -> f64 {
        let frame = self.frame;
        let dot = |row: &[f64], values: &[f64]| row.iter().zip(values).map(|(by, value)| by * value).sum::<f64>();
        let mut ticks = vec![0; frame.contacts.len()];
        for place in &frame.order {
            let contact = &frame.contacts[*place];
            let tick = ticks[*place];
            ticks[*place] += 1;
            // An arm is tied to ground, and what it pushes is not.
            let apart = if contact.contact.armed && frame.reference.is_some() { -contact.contact.sign() * self.reference } else { 0.0 };
            let depth = dot(&contact.depths[tick], &self.values) + apart;
            let force = if depth > 0.0 { (depth + dot(&contact.rates[tick], &self.values)).max(0.0) } else { 0.0 };
            self.values[contact.first + tick] = force;
            let closed = force > 0.0;
            self.changes += usize::from(std::mem::replace(&mut self.closed[*place], closed) != closed);
        }
        let next: Vec<f64> = (0..frame.next.rows()).map(|row| dot(frame.next.row(row), &self.values)).collect();
        self.reference += frame.reference.as_ref().map_or(0.0, |row| dot(row, &self.values));
        self.values[..next.len()].copy_from_slice(&next);
        self.values[next.len()..].fill(0.0);
        next.iter().enumerate().filter(|(row, _)| !frame.loose.contains(row)).map(|(_, value)| value * value).sum::<f64>().sqrt()
    }

    fn shrink(&mut self, size: f64) {
        self.values.iter_mut().for_each(|value| *value /= size);
        self.reference /= size;
    }
}
