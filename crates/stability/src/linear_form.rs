//! The linear form of a coordination law: the law computed in linear forms of what it sees.

use std::ops::{Add, Mul, Neg, Sub};

use cohaptic_peer::coordination::{BuiltIn, Law, Observation};
use cohaptic_peer::{Gains, Motion, Number};

/// Own position and velocity, and those of the mean of the samples held.
const UNKNOWNS: usize = 4;

/// A constant plus a multiple of each unknown; or the knowledge that it is no such sum.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Form {
    constant: f64,
    by: [f64; UNKNOWNS],
    is_linear: bool,
}

impl Form {
    const fn unknown(place: usize) -> Self {
        let mut by = [0.0; UNKNOWNS];
        by[place] = 1.0;
        Self { constant: 0.0, by, is_linear: true }
    }

    fn motion(place: usize) -> Motion<Self> {
        Motion { position: Self::unknown(2 * place), velocity: Self::unknown(2 * place + 1) }
    }

    fn is_constant(&self) -> bool {
        self.by.iter().all(|by| *by == 0.0)
    }

    fn with(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            constant: of(self.constant, other.constant),
            by: std::array::from_fn(|place| of(self.by[place], other.by[place])),
            is_linear: self.is_linear && other.is_linear,
        }
    }

    fn times(self, factor: f64) -> Self {
        // An unknown that does not occur does not come in by a factor that has overflowed.
        let product = |by: f64| if by == 0.0 { 0.0 } else { by * factor };
        Self { constant: product(self.constant), by: self.by.map(product), ..self }
    }
}

impl Number for Form {
    fn of(value: f64) -> Self {
        Self { constant: value, by: [0.0; UNKNOWNS], is_linear: true }
    }
}

impl Add for Form {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.with(other, |one, other| one + other)
    }
}

impl Sub for Form {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.with(other, |one, other| one - other)
    }
}

impl Neg for Form {
    type Output = Self;

    fn neg(self) -> Self {
        self.times(-1.0)
    }
}

impl Mul for Form {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let is_linear = self.is_linear && other.is_linear;
        if self.is_constant() {
            Self { is_linear, ..other.times(self.constant) }
        } else {
            Self { is_linear: is_linear && other.is_constant(), ..self.times(other.constant) }
        }
    }
}

/// KT and BT of a law that pulls the copy towards the mean of the samples held and remembers nothing: FT = KT·(x − x̄) + BT·(v − v̄). `None` for any other
/// law.
///
/// The gains are those that the law multiplies with, to the bit: every other factor on the way is 1 or 0.
#[expect(clippy::float_cmp, reason = "a pull has equal gains for both ends to the bit")]
pub(crate) fn pull_towards_mean(law: &BuiltIn) -> Option<Gains> {
    if Law::<f64>::memory(law) > 0 {
        return None;
    }
    let seen = Observation { own: Form::motion(0), mean: Form::motion(1) };
    let Form { constant, by: [stiffness, damping, mean_position, mean_velocity], is_linear } =
        law.map(|number| Form::of(*number)).force(&seen, &mut []);
    let is_pull = is_linear && constant == 0.0 && mean_position == -stiffness && mean_velocity == -damping;
    is_pull.then_some(Gains { stiffness, damping })
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::Coordination;
    use cohaptic_peer::coordination::LawParameters;

    use super::*;

    /// Equation (10), and equation (2) as the sum of two pulls: KT·(x − x₁) + KT·(x − x₂) with x₁ + x₂ = 2·x̄.
    #[test]
    fn the_gains_of_both_laws_come_out_to_the_bit() {
        let gains = Gains { stiffness: 1234.567, damping: 0.1 };
        let pull = |coordination: Coordination| pull_towards_mean(&coordination.law(&LawParameters { gains, peers: 3 }));
        assert_eq!(pull(Coordination::AveragePosition), Some(gains));
        assert_eq!(pull(Coordination::ProportionalDerivative), Some(Gains { stiffness: 2.0 * 1234.567, damping: 0.2 }));
    }

    #[test]
    fn gains_beyond_all_numbers_are_still_a_pull() {
        let gains = Gains { stiffness: f64::MAX, damping: 0.0 };
        let law = Coordination::ProportionalDerivative.law(&LawParameters { gains, peers: 3 });
        assert_eq!(pull_towards_mean(&law), Some(Gains { stiffness: f64::INFINITY, damping: 0.0 }));
    }

    #[test]
    fn a_product_of_two_unknowns_is_no_linear_form() {
        let (x, y, two) = (Form::unknown(0), Form::unknown(1), Form::of(2.0));
        assert!(!(x * y).is_linear);
        assert!(!(two - x * y).is_linear);
        assert!(!(x * x * Form::of(0.0)).is_linear);
        let form = two * (x - y) * two + -two;
        assert_eq!(form, Form { constant: -2.0, by: [4.0, -4.0, 0.0, 0.0], is_linear: true });
    }
}
