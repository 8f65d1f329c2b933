//! Simulated incremental encoders: whole counts with a random zero until the index has passed.

use cohaptic_device::Dice;

use crate::kinematics::Triple;

/// Greatest offset of an encoder that is not homed \[counts\].
const FARTHEST_OFF: i64 = 3000;

#[derive(Clone, Copy, Debug)]
pub(super) struct Encoders {
    /// Position of the index, in counts from the home angle.
    index: f64,
    /// True counts of the arms, with their fractions.
    counts: Triple,
    /// Offsets of the reported counts until homing.
    offsets: [i64; 3],
    homed: [bool; 3],
    /// Slipped counts of each encoder, unnoticed by the device.
    slipped: [i64; 3],
}

impl Encoders {
    pub(super) fn new(index: f64, counts: Triple, dice: &mut Dice) -> Self {
        let mut offset = || {
            // An offset of at least a hundred counts, so that a test notices it.
            let size = 100 + i64::from(dice.byte()) * (FARTHEST_OFF - 100) / 255;
            if dice.byte().is_multiple_of(2) { size } else { -size }
        };
        let offsets = [offset(), offset(), offset()];
        Self { index, counts, offsets, homed: [false; 3], slipped: [0; 3] }
    }

    /// Sets the counts of the arms. With `homing`, an encoder that passes its index is homed.
    pub(super) fn turn(&mut self, counts: Triple, homing: bool) {
        for (encoder, count) in counts.into_iter().enumerate() {
            // A change of sign is a passage of the index in either direction.
            let (before, after) = (self.counts[encoder] - self.index, count - self.index);
            self.homed[encoder] |= homing && (before < 0.0) != (after < 0.0);
        }
        self.counts = counts;
    }

    /// Returns the reported counts: the low sixteen bits of any count.
    #[expect(clippy::cast_possible_truncation, reason = "a counter of sixteen bits wraps")]
    pub(super) fn read(&self) -> [i16; 3] {
        core::array::from_fn(|encoder| {
            // A homed encoder counts from its index; slips afterwards stay unnoticed.
            let offset = if self.homed[encoder] { self.slipped[encoder] } else { self.offsets[encoder] };
            (libm::rint(self.counts[encoder]) as i64 + offset) as i16
        })
    }

    pub(super) const fn homed(&self) -> [bool; 3] {
        self.homed
    }

    pub(super) const fn forget(&mut self) {
        self.homed = [false; 3];
    }

    pub(super) fn slip(&mut self, encoder: usize, counts: i16) {
        if let Some(slipped) = self.slipped.get_mut(encoder) {
            *slipped += i64::from(counts);
        }
    }

    pub(super) const fn lose(&mut self, encoder: usize) {
        if encoder < 3 {
            self.homed[encoder] = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_is_off_until_its_index_passes_while_homing() {
        let mut encoders = Encoders::new(-600.0, [-700.0; 3], &mut Dice::new(1));
        assert!(encoders.read().iter().all(|count| count.abs_diff(-700) >= 100));
        // The first and the third arm pass the index at −600, but without the homing bit.
        encoders.turn([-500.0, -650.0, -500.0], false);
        assert_eq!(encoders.homed(), [false; 3]);
        encoders.turn([-700.0, -640.0, -500.0], true);
        assert_eq!(encoders.homed(), [true, false, false]);
        assert_eq!(encoders.read()[0], -700);
        encoders.turn([-700.4, -599.5, -600.6], true);
        assert_eq!((encoders.homed(), encoders.read()), ([true; 3], [-700, -600, -601]));
        encoders.lose(1);
        assert_eq!(encoders.homed(), [true, false, true]);
        encoders.forget();
        assert_eq!(encoders.homed(), [false; 3]);
    }
}
