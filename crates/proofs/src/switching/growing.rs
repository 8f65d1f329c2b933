//! The search for a growing motion with opening and closing contacts.
//!
//! Away from walls a motion times a is a motion too, for any a > 0. So the search follows a motion frame by frame and scales the motion back to the same size
//! after each frame, from several beginnings. A motion with large growth over many frames, the first frames not counted, is taken to grow without
//! bound.

use cohaptic_stability::Watch;
use cohaptic_stability::numerics::real;

use super::contact_frame::ContactFrame;

/// A growing motion.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GrowingMotion {
    /// Mean factor of growth per frame.
    pub growth: f64,
    /// Number of frames over which the growth was measured. As many frames before them let the motion settle.
    pub frames: usize,
    /// Number of openings and closings of contacts in the measured frames.
    pub changes: usize,
}

/// Number of tried beginnings.
pub(super) const BEGINNINGS: usize = 8;
/// Number of followed frames from each beginning.
pub(super) const FRAMES: usize = 4000;
/// Least factor over the second half of the frames of a motion taken to grow.
const MUCH: f64 = 1e4;

/// Returns the fastest growing motion, or `None` if none of the beginnings leads to growth.
pub(super) fn search(frame: &ContactFrame, watch: &dyn Watch) -> Option<GrowingMotion> {
    let found = (0..BEGINNINGS).map_while(|beginning| (!watch.stops()).then(|| follow(frame, beginning)));
    found.flatten().max_by(|one, other| one.growth.total_cmp(&other.growth))
}

/// The state of a motion between two frames.
struct Motion<'a> {
    frame: &'a ContactFrame,
    /// States of the frame, then the inputs of the frame.
    values: Vec<f64>,
    /// Absolute position of the reference of all other positions.
    reference: f64,
    /// `true` if a contact was closed at its last tick, indexed by contact.
    closed: Vec<bool>,
    changes: usize,
}

/// Follows the motion from one beginning. `None` if the motion does not grow enough, dies out entirely or overflows.
fn follow(frame: &ContactFrame, beginning: usize) -> Option<GrowingMotion> {
    let states = frame.next.rows();
    // A beginning without symmetry, different for each number, so motions of every kind take part.
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
        // The first half lets slower motions die out relative to the fastest motion; only the second half is measured.
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
    /// Advances the motion by one frame, and returns the size of the states, loose states not counted.
    fn step(&mut self) -> f64 {
        let frame = self.frame;
        let dot = |row: &[f64], values: &[f64]| row.iter().zip(values).map(|(by, value)| by * value).sum::<f64>();
        let mut ticks = vec![0; frame.contacts.len()];
        // In the order of time, because the depth at a tick depends on the forces of earlier ticks of all contacts.
        for place in &frame.order {
            let contact = &frame.contacts[*place];
            let tick = ticks[*place];
            ticks[*place] += 1;
            // The position of a device with an arm is absolute, the position of its copy is relative to the reference.
            let apart = if contact.contact.armed && frame.reference.is_some() { -contact.contact.sign() * self.reference } else { 0.0 };
            let depth = dot(&contact.depths[tick], &self.values) + apart;
            // A contact pushes only: the damper may reduce the force to zero, but never below.
            let force = if depth > 0.0 { (depth + dot(&contact.rates[tick], &self.values)).max(0.0) } else { 0.0 };
            self.values[contact.first + tick] = force;
            let closed = force > 0.0;
            self.changes += usize::from(std::mem::replace(&mut self.closed[*place], closed) != closed);
        }
        let next: Vec<f64> = (0..frame.next.rows()).map(|row| dot(frame.next.row(row), &self.values)).collect();
        self.reference += frame.reference.as_ref().map_or(0.0, |row| dot(row, &self.values));
        self.values[..next.len()].copy_from_slice(&next);
        self.values[next.len()..].fill(0.0);
        // A loose device may lie anywhere, so its position says nothing about growth.
        next.iter().enumerate().filter(|(row, _)| !frame.loose.contains(row)).map(|(_, value)| value * value).sum::<f64>().sqrt()
    }

    fn shrink(&mut self, size: f64) {
        // The equations of contacts are homogeneous of degree one, so a motion divided by its size is a motion again, with the same contacts.
        self.values.iter_mut().for_each(|value| *value /= size);
        self.reference /= size;
    }
}
