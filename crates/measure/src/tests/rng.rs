//! Random numbers for tests, independent of the emulator's generator: SplitMix64 (Steele, Lea & Flood 2014).

use core::convert::Infallible;

use rand::TryRng;
use rand_distr::{Distribution, StandardNormal};

pub(crate) struct TestRng(u64);

impl TestRng {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Returns a uniform number in 0..1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.word() >> 11) as f64 / 9_007_199_254_740_992.0
    }
}

impl TestRng {
    /// Returns an element of a list, each with the same probability.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and below the length of a list")]
    pub(crate) fn pick<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[(self.unit() * of.len() as f64) as usize]
    }
}

impl TryRng for TestRng {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(u32::try_from(self.word() >> 32).expect("the upper half"))
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.word())
    }

    fn try_fill_bytes(&mut self, dst: &mut [u8]) -> Result<(), Infallible> {
        for chunk in dst.chunks_mut(8) {
            chunk.copy_from_slice(&self.word().to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

/// Returns a normal series of mean 0 and deviation 1, with the autocorrelation φ at lag one.
pub(crate) fn autoregressive(seed: u64, phi: f64, n: usize) -> Vec<f64> {
    let mut rng = TestRng::new(seed);
    let mut last: f64 = StandardNormal.sample(&mut rng);
    (0..n)
        .map(|_| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            last = phi * last + (1.0 - phi * phi).sqrt() * noise;
            last
        })
        .collect()
}
