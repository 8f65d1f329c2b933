//! Sojourn times: laws of the length of a stay.

use alloc::format;
use alloc::string::String;
use cohaptic_units::print::Span;
use core::time::Duration;

use crate::parameters::{Form, Table, optional, required};
use crate::random::unit;

/// Law of a span of time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sojourn {
    /// Constant span.
    Fixed(Duration),
    /// Exponential law with this mean, without memory.
    Exponential(Duration),
    /// Uniform law between the shortest and the longest span.
    Uniform(Duration, Duration),
    /// Sum of a number of exponential stages (at least 1), given the mean of the sum and the number of stages. The relative deviation falls with the number
    /// of stages.
    Erlang(Duration, u32),
}

impl Sojourn {
    /// Returns the mean span.
    #[must_use]
    pub fn mean(&self) -> Duration {
        match *self {
            Self::Fixed(span) | Self::Exponential(span) | Self::Erlang(span, _) => span,
            Self::Uniform(from, to) => from + to.saturating_sub(from) / 2,
        }
    }

    /// Returns whether spans can be drawn and take time: the mean is above zero, the bounds are in order, and there is at least one stage.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let in_order = match *self {
            Self::Uniform(from, to) => from <= to,
            Self::Erlang(_, stages) => stages > 0,
            Self::Fixed(_) | Self::Exponential(_) => true,
        };
        in_order && !self.mean().is_zero()
    }

    /// Returns a drawn span of at least a nanosecond. `word` gives uniform random words, one per exponential or uniform number.
    pub(crate) fn draw(&self, mut word: impl FnMut() -> u64) -> Duration {
        #[expect(clippy::cast_precision_loss, reason = "a span enters a random law as a real number")]
        let nanos = |span: Duration| span.as_nanos() as f64;
        // 1 − u lies in (0, 1], so its logarithm is finite.
        let mut exponential = || -libm::log(1.0 - unit(word()));
        let drawn = match *self {
            Self::Fixed(span) => return span.max(Duration::from_nanos(1)),
            Self::Exponential(mean) => nanos(mean) * exponential(),
            Self::Uniform(from, to) => nanos(from) + (nanos(to) - nanos(from)) * unit(word()),
            // Each stage has the mean of the whole divided by the number of stages.
            Self::Erlang(mean, stages) => nanos(mean) / f64::from(stages) * (0..stages).map(|_| exponential()).sum::<f64>(),
        };
        // A span of zero would let chains of states change endlessly at one instant.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative; saturates beyond 584 years")]
        Duration::from_nanos((libm::rint(drawn) as u64).max(1))
    }
}

/// Form of a sojourn time.
pub(crate) const SOJOURN: Form = Form::AnyOf(&[Form::Duration, Form::Table(&SOJOURN_TABLE)]);
static SOJOURN_TABLE: Table = Table::of(&[&[
    optional("exponential", Form::Duration, "Mean of an exponential law; a plain duration means the same"),
    optional("fixed", Form::Duration, "Constant time"),
    optional("uniform", Form::Pair(&Form::Duration), "Shortest and longest time of a uniform law"),
    optional("erlang", Form::Table(&ERLANG), "Erlang law: the sum of several exponential stages"),
]]);
static ERLANG: Table = Table::of(&[&[
    required("mean", Form::Duration, "Mean of all stages together").expecting("the mean of all stages together, a duration"),
    required("stages", Form::Integer(1, 1000), "Number of stages").expecting("a number of stages from 1 to 1000"),
]]);

impl Sojourn {
    /// Returns the law and the mean in words.
    pub(crate) fn words(self) -> String {
        let law = match self {
            Self::Fixed(_) => "always",
            Self::Exponential(_) => "exponential,",
            Self::Uniform(..) => "uniform,",
            Self::Erlang(..) => "Erlang,",
        };
        format!("{law} {}", Span(self.mean()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream};

    /// Compares mean and deviation of 100 000 draws with each law. The standard error of the mean is σ/√n, and that of the deviation is below 1.5·σ/√n
    /// (kurtosis ≤ 9).
    #[test]
    fn draws_have_the_mean_and_the_deviation_of_their_law() {
        let ms = Duration::from_millis;
        let laws = [
            (Sojourn::Exponential(ms(10)), 10.0, 10.0),
            (Sojourn::Uniform(ms(4), ms(16)), 10.0, 12.0 / 12.0_f64.sqrt()),
            (Sojourn::Erlang(ms(10), 4), 10.0, 5.0),
        ];
        let stream = Stream::new(6, b"sojourn");
        for (law, mean, sd) in laws {
            let drawn: Vec<f64> = (0..100_000)
                .map(|n| {
                    let mut draws = stream.packet(n).draws(Purpose::Outage);
                    law.draw(|| draws.next_word()).as_secs_f64() * 1e3
                })
                .collect();
            let average = drawn.iter().sum::<f64>() / 1e5;
            let deviation = (drawn.iter().map(|x| (x - average).powi(2)).sum::<f64>() / 1e5).sqrt();
            let error = sd / 1e5_f64.sqrt();
            assert!((average - mean).abs() < 4.5 * error, "{law:?}: {average}");
            assert!((deviation - sd).abs() < 4.5 * 1.5 * error, "{law:?}: {deviation}");
        }
    }

    #[test]
    fn what_never_ends_or_cannot_be_drawn_is_not_sound() {
        let ms = Duration::from_millis;
        for law in [Sojourn::Fixed(ms(0)), Sojourn::Exponential(ms(0)), Sojourn::Uniform(ms(2), ms(1)), Sojourn::Erlang(ms(1), 0)] {
            assert!(!law.is_sound());
        }
        assert_eq!(Sojourn::Fixed(ms(3)).draw(|| 0), ms(3));
    }
}
