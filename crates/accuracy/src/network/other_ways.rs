//! Ways of others: Box and Muller's, those of the crate `rand_distr`, and the kernel's tables as iproute2 ships them.

use std::convert::Infallible;

use cohaptic_wan::netem::kernel::{Prng, Table};
use cohaptic_wan::random::unit;
use rand::TryRng;

use super::ways::{MEAN, SD, next_word};

/// A way that can only be drawn from.
pub(super) type Sampler = Box<dyn FnMut() -> f64>;

/// The ways to draw from the law of that name, with the names of their methods.
pub(super) fn samplers(law: &str) -> Vec<(&'static str, Sampler)> {
    let mut words = Words(1);
    match law {
        "normal" => vec![("Box-Muller", Box::new(box_muller())), ("rand_distr", normal(words))],
        "Pareto" => vec![("rand_distr", sampler(rand_distr::Pareto::new(1.0, 3.0), words, |x: f64| MEAN + SD * (x - 1.5) / 0.75_f64.sqrt()))],
        // From 20: mean 4 and deviation 2 above it.
        "gamma" => vec![("rand_distr", sampler(rand_distr::Gamma::new(4.0, 1.0), words, |x: f64| 20.0 + x))],
        "lognormal" => {
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
            let half = 3.0_f64.sqrt() * SD;
            vec![("one multiplication", Box::new(move || MEAN - half + 2.0 * half * unit(words.next())))]
        }
        _ => Vec::new(),
    }
}

fn normal(words: Words) -> Sampler {
    sampler(rand_distr::Normal::new(MEAN, SD), words, |x: f64| x)
}

fn sampler<D: rand_distr::Distribution<f64> + 'static, E: std::fmt::Debug>(law: Result<D, E>, mut words: Words, delay: fn(f64) -> f64) -> Sampler {
    let law = law.expect("the parameters are constants that the law takes");
    Box::new(move || delay(law.sample(&mut words)))
}

/// Two numbers of two uniform ones (Box & Muller 1958).
fn box_muller() -> impl FnMut() -> f64 {
    let (mut state, mut spare) = (1, None);
    move || {
        let z = spare.take().unwrap_or_else(|| {
            // In (0, 1], so that the logarithm is finite.
            let radius = libm::sqrt(-2.0 * libm::log(1.0 - unit(next_word(&mut state))));
            let (sine, cosine) = libm::sincos(2.0 * std::f64::consts::PI * unit(next_word(&mut state)));
            spare = Some(radius * sine);
            radius * cosine
        });
        MEAN + SD * z
    }
}

/// The shape of the Weibull law whose deviation is this multiple of its mean: halving, as Γ(1 + 2/k)/Γ(1 + 1/k)² falls with k.
fn weibull_shape(variation: f64) -> f64 {
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

/// Uniform words for `rand_distr`.
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

/// A table that iproute2 ships, drawn as the kernel draws.
pub(super) struct KernelTable {
    table: Table,
    prng: Prng,
}

impl KernelTable {
    /// The one for the law of that name, if there is one.
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

    /// The equally probable delays, sorted.
    pub(super) fn delays(&self) -> Vec<f64> {
        let mut delays: Vec<f64> = self.table.entries().iter().map(|entry| delay(*entry)).collect();
        delays.sort_by(f64::total_cmp);
        delays
    }
}

fn delay(entry: i16) -> f64 {
    MEAN + SD / 8192.0 * f64::from(entry)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Γ(1 + 2/k)/Γ(1 + 1/k)² − 1 is 5 for k = 1/2 · 1 for k = 1: an exponential law varies as much as its mean.
    #[test]
    fn the_shape_of_an_exponential_law_is_one() {
        assert!((weibull_shape(1.0) - 1.0).abs() < 1e-12);
        assert!((weibull_shape(5.0_f64.sqrt()) - 0.5).abs() < 1e-12);
    }
}
