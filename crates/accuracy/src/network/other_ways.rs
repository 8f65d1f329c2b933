//! Samplers of other programs: the method of Box and Muller, the crate `rand_distr`, and the kernel's tables as shipped by iproute2.

use std::convert::Infallible;

use cohaptic_wan::netem::kernel::{Prng, Table};
use cohaptic_wan::random::unit;
use rand::TryRng;

use super::ways::{MEAN, SD, next_word};

/// A sampler without a table or a function of its distribution.
pub(super) type Sampler = Box<dyn FnMut() -> f64>;

/// Returns the samplers of the law `law`, with the names of their methods.
pub(super) fn samplers(law: &str) -> Vec<(&'static str, Sampler)> {
    let mut words = Words(1);
    match law {
        "normal" => vec![("Box-Muller", Box::new(box_muller())), ("rand_distr", normal(words))],
        // Shape 3 and scale 1 have the mean 3/2 and the variance 3/4. The result is moved and scaled to the mean and the deviation of all laws.
        "Pareto" => vec![("rand_distr", sampler(rand_distr::Pareto::new(1.0, 3.0), words, |x: f64| MEAN + SD * (x - 1.5) / 0.75_f64.sqrt()))],
        // A half-line from 20 with the mean 4 and the deviation 2 above it.
        "gamma" => vec![("rand_distr", sampler(rand_distr::Gamma::new(4.0, 1.0), words, |x: f64| 20.0 + x))],
        "lognormal" => {
            // Above the floor the mean is 4 and the deviation 2, so the variance of the logarithm is ln(1 + (2/4)²).
            let variance = 1.25_f64.ln();
            let law = rand_distr::LogNormal::new(4.0_f64.ln() - 0.5 * variance, variance.sqrt());
            vec![("rand_distr", sampler(law, words, |x: f64| 20.0 + x))]
        }
        "Weibull" => {
            let shape = weibull_shape(0.5);
            let law = rand_distr::Weibull::new(4.0 / libm::tgamma(1.0 + 1.0 / shape), shape);
            vec![("rand_distr", sampler(law, words, |x: f64| 20.0 + x))]
        }
        "uniform" => {
            // A uniform law with the deviation σ reaches √3·σ from the mean.
            let half = 3.0_f64.sqrt() * SD;
            vec![("one multiplication", Box::new(move || MEAN - half + 2.0 * half * unit(words.next())))]
        }
        _ => Vec::new(),
    }
}

/// Returns the normal sampler of `rand_distr`.
fn normal(words: Words) -> Sampler {
    sampler(rand_distr::Normal::new(MEAN, SD), words, |x: f64| x)
}

/// Returns a sampler of `rand_distr`, with its result mapped to a delay.
fn sampler<D: rand_distr::Distribution<f64> + 'static, E: std::fmt::Debug>(law: Result<D, E>, mut words: Words, delay: fn(f64) -> f64) -> Sampler {
    let law = law.expect("the parameters are constants that the law takes");
    Box::new(move || delay(law.sample(&mut words)))
}

/// Returns a sampler that makes two normal numbers from two uniform numbers (Box & Muller 1958).
fn box_muller() -> impl FnMut() -> f64 {
    let (mut state, mut spare) = (1, None);
    move || {
        let z = spare.take().unwrap_or_else(|| {
            // The argument lies in (0, 1], so that the logarithm is finite.
            let radius = libm::sqrt(-2.0 * libm::log(1.0 - unit(next_word(&mut state))));
            let (sine, cosine) = libm::sincos(2.0 * std::f64::consts::PI * unit(next_word(&mut state)));
            spare = Some(radius * sine);
            radius * cosine
        });
        MEAN + SD * z
    }
}

/// Returns the shape of the Weibull law whose deviation is `variation` times its mean, by bisection: Γ(1 + 2/k)/Γ(1 + 1/k)² falls with k.
fn weibull_shape(variation: f64) -> f64 {
    // The variation is √5 at a shape of 0.5, and about 0.025 at 50, which covers every law of this crate.
    let (mut low, mut high) = (0.5, 50.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let mean = libm::tgamma(1.0 + 1.0 / middle);
        if libm::tgamma(1.0 + 2.0 / middle) / (mean * mean) - 1.0 > variation * variation {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Generator of uniform words for `rand_distr`.
#[derive(Clone, Copy)]
struct Words(u64);

impl Words {
    fn next(&mut self) -> u64 {
        next_word(&mut self.0)
    }
}

impl TryRng for Words {
    type Error = Infallible;

    #[inline]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok((self.next() >> 32) as u32)
    }

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.next())
    }

    fn try_fill_bytes(&mut self, dst: &mut [u8]) -> Result<(), Infallible> {
        for chunk in dst.chunks_mut(8) {
            chunk.copy_from_slice(&self.next().to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

/// A table shipped by iproute2, drawn as the kernel draws.
pub(super) struct KernelTable {
    table: Table,
    prng: Prng,
}

impl KernelTable {
    /// Returns the table for the law `law`; `None` without such a table.
    pub(super) fn of(law: &str) -> Option<Self> {
        let table = match law {
            "normal" => Table::normal(),
            "Pareto" => Table::pareto(),
            "Pareto-normal" => Table::pareto_normal(),
            _ => return None,
        };
        Some(Self { table, prng: Prng::new(1) })
    }

    pub(super) fn draw(&mut self) -> f64 {
        let entries = self.table.entries();
        delay(entries[self.prng.next_u32() as usize % entries.len()])
    }

    /// Returns the equally probable delays in ascending order.
    pub(super) fn delays(&self) -> Vec<f64> {
        let mut delays: Vec<f64> = self.table.entries().iter().map(|entry| delay(*entry)).collect();
        delays.sort_by(f64::total_cmp);
        delays
    }
}

/// Returns the delay of a table entry \[ms\]: the mean plus the entry, which counts 8192ths of the standard deviation.
fn delay(entry: i16) -> f64 {
    MEAN + SD / 8192.0 * f64::from(entry)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Γ(1 + 2/k)/Γ(1 + 1/k)² − 1 is 5 for k = 1/2 and 1 for k = 1: the deviation of an exponential law equals its mean.
    #[test]
    fn the_shape_of_an_exponential_law_is_one() {
        assert!((weibull_shape(1.0) - 1.0).abs() < 1e-12);
        assert!((weibull_shape(5.0_f64.sqrt()) - 0.5).abs() < 1e-12);
    }
}
