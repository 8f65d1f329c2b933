//! The kernel's seeded generator, and a generator for values without the kernel's seed.

/// Four combined linear feedback shift registers with a period of about 2¹¹³ (L'Ecuyer 1999, LFSR113), seeded as by netem: without a warm-up.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Prng {
    registers: [u32; 4],
}

/// Constants of each register: the mask of the bits kept by a step, the two shifts of the feedback, and the shift of the kept bits.
const STEPS: [(u32, u32, u32, u32); 4] = [(!1, 6, 13, 18), (!7, 2, 27, 2), (!15, 13, 21, 7), (!127, 3, 12, 13)];

impl Prng {
    /// Makes the generator of `seed SEED`.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "the seed is folded into 32 bits")]
        let folded = ((seed >> 32) ^ (seed << 10) ^ seed) as u32;
        Self { registers: [at_least(folded, 2), at_least(folded, 8), at_least(folded, 16), at_least(folded, 128)] }
    }

    /// Returns 32 uniform bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        let mut output = 0;
        for (register, (kept, left, right, shift)) in self.registers.iter_mut().zip(STEPS) {
            let feedback = ((*register << left) ^ *register) >> right;
            *register = ((*register & kept) << shift) ^ feedback;
            output ^= *register;
        }
        output
    }
}

/// Returns `value`, raised if needed, so the register has a bit among the bits kept by its step.
const fn at_least(value: u32, least: u32) -> u32 {
    if value < least { value + least } else { value }
}

/// SplitMix64 (Steele, Lea & Flood 2014), in place of the kernel's global generator.
#[derive(Clone, Debug)]
pub(super) struct Unseeded {
    state: u64,
}

impl Unseeded {
    pub(super) const fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Returns 32 uniform bits.
    pub(super) const fn next_u32(&mut self) -> u32 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut word = self.state;
        word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((word ^ (word >> 31)) >> 32) as u32
    }

    /// Returns a number below `bound`, or 0 if `bound` is 0. The bias is at most bound/2³².
    pub(super) fn below(&mut self, bound: u32) -> u32 {
        ((u64::from(self.next_u32()) * u64::from(bound)) >> 32) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generator_gives_what_the_kernel_gives() {
        let mut prng = Prng::new(1);
        let drawn: [u32; 5] = core::array::from_fn(|_| prng.next_u32());
        assert_eq!(drawn, [276_959_246, 18_909_696, 2_298_495_022, 9_442_690, 3_222_971_081]);
    }

    #[test]
    fn a_seed_is_folded_into_32_bits() {
        // By hand, (seed ≫ 32) ⊕ (seed ≪ 10) ⊕ seed folds 2³² to 1, and 1 to 1 + 2¹⁰.
        assert_eq!(Prng::new(1 << 32).registers, [3, 9, 17, 129]);
        assert_eq!(Prng::new(1).registers, [1025; 4]);
        assert_eq!(Prng::new(0).registers, [2, 8, 16, 128]);
    }

    /// First outputs of SplitMix64 from seed 1234567, from Vigna's reference. `Unseeded` takes the upper halves.
    #[test]
    fn what_is_not_seeded_by_the_kernel_comes_from_splitmix() {
        let mut unseeded = Unseeded::new(1_234_567);
        for word in [6_457_827_717_110_365_317_u64, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423] {
            assert_eq!(u64::from(unseeded.next_u32()), word >> 32);
        }
        assert_eq!(unseeded.below(0), 0);
    }
}
