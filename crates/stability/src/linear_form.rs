//! The linear form of a coordination law. The law is computed once with linear forms in place of numbers, as a function of everything the law sees and
//! remembers; the coefficients of the resulting forms are the gains of the law.

use std::ops::{Add, Mul, Neg, Sub};

use cohaptic_peer::coordination::{BuiltIn, Law, Observation};
use cohaptic_peer::{Gains, Motion, Number};

/// The number of unknowns, in this order: position and velocity of the own copy, of the mean of the samples held, and of the own copy in the past; the lead,
/// by which extrapolation moves the samples; and one number of the memory of the law.
const UNKNOWNS: usize = 8;

/// A constant plus a multiple of each unknown. `is_linear` is false if a value is no such sum; the coefficients then have no meaning.
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
        // A coefficient of zero stays zero, even if the factor has overflowed: 0·∞ would be NaN.
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
        // A product is linear if at least one factor is a constant.
        let is_linear = self.is_linear && other.is_linear;
        if self.is_constant() {
            Self { is_linear, ..other.times(self.constant) }
        } else {
            Self { is_linear: is_linear && other.is_constant(), ..self.times(other.constant) }
        }
    }
}

/// One result of a law in linear form: FT \[N\], or a number of the law's memory after this tick.
///
/// The result is own·(x, v) + past·(x, v)(L ticks ago) − heard·(x̄, v̄) − ahead·lead + Σ memory·m, with x̄, v̄ and the lead of an [`Observation`].
#[derive(Clone, PartialEq, Debug)]
pub struct LawRow {
    /// Gains of the present own state.
    pub own: Gains,
    /// Gains of the own state of L ticks ago.
    pub past: Gains,
    /// Gains of the mean of the samples held.
    pub heard: Gains,
    /// Factor of the lead: the gain of a sample's velocity for each second of the sample's age \[N/m\].
    pub ahead: f64,
    /// Factor of each number of the law's memory, indexed like the memory.
    pub memory: Vec<f64>,
}

/// A coordination law in linear form.
#[derive(Clone, PartialEq, Debug)]
pub struct LinearLaw {
    /// The row of FT.
    pub force: LawRow,
    /// Rows of the numbers of the law's memory, indexed like the memory.
    pub memory: Vec<LawRow>,
    /// Age up to which samples are extrapolated \[s\]; `None` if samples are used without extrapolation.
    pub horizon: Option<f64>,
    /// Lag L of the law in ticks. A law with L > 0 has no other memory.
    pub lag: usize,
}

impl LawRow {
    /// Returns the row of the parts of `form` without the memory; `None` if `form` is not linear, has a constant, or changes when everything is moved alike.
    #[expect(clippy::float_cmp, reason = "what moves with everything has equal gains for both ends to the bit")]
    fn of(form: &Form) -> Option<Self> {
        let Form { constant, by: [stiffness, damping, mean_position, mean_velocity, past_stiffness, past_damping, lead, _], is_linear } = *form;
        // A displacement of everything alike moves own, past and heard positions together. The force stays if the three gains add up to zero.
        let fits = is_linear && constant == 0.0 && mean_position == -(stiffness + past_stiffness);
        let negative = |value: f64| if value == 0.0 { 0.0 } else { -value };
        fits.then(|| Self {
            own: Gains { stiffness, damping },
            past: Gains { stiffness: past_stiffness, damping: past_damping },
            heard: Gains { stiffness: negative(mean_position), damping: negative(mean_velocity) },
            ahead: negative(lead),
            memory: Vec::new(),
        })
    }

    /// Returns the row with the gains of all inputs of the law multiplied by a factor. The factors of the memory stay.
    fn scaled(&self, factor: f64) -> Self {
        let Self { own, past, heard, ahead, memory } = self;
        Self { own: own.scaled(factor), past: past.scaled(factor), heard: heard.scaled(factor), ahead: ahead * factor, memory: memory.clone() }
    }
}

impl LinearLaw {
    /// Returns the linear form of a law; `None` if the law has no linear form, or if its forces change when everything is moved alike.
    ///
    /// The coefficients are to the bit the factors in the law, if every other factor in the law is 1 or 0.
    pub(crate) fn of(law: &BuiltIn) -> Option<Self> {
        let remembered = Law::<f64>::memory(law);
        let lag = Law::<f64>::lag(law);
        if lag > 0 && remembered > 0 {
            return None;
        }
        let past = Form::motion(if lag > 0 { 2 } else { 0 });
        let seen = Observation { own: Form::motion(0), past, mean: Form::motion(1), lead: Form::unknown(6) };
        let forms = law.map(|number| Form::of(*number));
        // FT and the memory after the tick. At most one number of the memory before the tick is an unknown, the rest is zero. So one unknown is enough for
        // memories of any length, and the law is computed once for each number.
        let come_out = |unknown: Option<usize>| {
            let mut memory = vec![Form::of(0.0); remembered];
            if let Some(unknown) = unknown {
                memory[unknown] = Form::unknown(7);
            }
            (forms.force(&seen, &mut memory), memory)
        };
        let (force, memory) = come_out(None);
        let memory = memory.iter().map(LawRow::of).collect::<Option<_>>()?;
        let mut law = Self { force: LawRow::of(&force)?, memory, horizon: Law::<f64>::horizon(law), lag };
        for unknown in 0..remembered {
            let (force, memory) = come_out(Some(unknown));
            for (row, form) in law.rows_mut().zip(std::iter::once(&force).chain(&memory)) {
                LawRow::of(form)?;
                row.memory.push(form.by[7]);
            }
        }
        if law.horizon.is_none() {
            // Without a horizon samples are not extrapolated and the lead is zero.
            law.rows_mut().for_each(|row| row.ahead = 0.0);
        }
        Some(law)
    }

    /// Returns the law without a force and without a memory.
    pub const fn none() -> Self {
        let none = Gains { stiffness: 0.0, damping: 0.0 };
        Self { force: LawRow { own: none, past: none, heard: none, ahead: 0.0, memory: Vec::new() }, memory: Vec::new(), horizon: None, lag: 0 }
    }

    /// Iterates over the row of FT and then the rows of the memory.
    pub fn rows(&self) -> impl Iterator<Item = &LawRow> {
        std::iter::once(&self.force).chain(&self.memory)
    }

    fn rows_mut(&mut self) -> impl Iterator<Item = &mut LawRow> {
        std::iter::once(&mut self.force).chain(&mut self.memory)
    }

    /// Returns stiffness and damping of FT against a motion of the own copy: the gains of the present and of the past own state together.
    pub fn held_by(&self) -> Gains {
        let LawRow { own, past, .. } = &self.force;
        Gains { stiffness: own.stiffness + past.stiffness, damping: own.damping + past.damping }
    }

    /// Returns KT and BT of a law without memory and with a pull of the copy towards the mean of the held samples: FT = KT·(x − x̄) + BT·(v − v̄). `None` for
    /// any other law.
    pub(crate) fn pull(&self) -> Option<Gains> {
        let LawRow { own, heard, ahead, .. } = &self.force;
        (self.memory.is_empty() && self.lag == 0 && own == heard && *ahead == 0.0).then_some(*own)
    }

    /// Returns the law with all inputs of the law multiplied by a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        let memory = self.memory.iter().map(|row| row.scaled(factor)).collect();
        Self { force: self.force.scaled(factor), memory, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::Coordination;
    use std::time::Duration;

    use cohaptic_peer::coordination::{LawParameters, LawValues};

    use super::*;

    fn parameters(gains: Gains) -> LawParameters {
        LawParameters { gains, peers: 3, tick: Duration::from_millis(1), oldest: None, middle: None, own: LawValues::default() }
    }

    /// Checks equation (10), and equation (2) as the sum of two pulls: KT·(x − x₁) + KT·(x − x₂) with x₁ + x₂ = 2·x̄.
    #[test]
    fn the_gains_of_both_laws_come_out_to_the_bit() {
        let gains = Gains { stiffness: 1234.567, damping: 0.1 };
        let pull = |coordination: Coordination| LinearLaw::of(&coordination.law(&parameters(gains)).unwrap()).unwrap().pull();
        assert_eq!(pull(Coordination::AveragePosition), Some(gains));
        assert_eq!(pull(Coordination::ProportionalDerivative), Some(Gains { stiffness: 2.0 * 1234.567, damping: 0.2 }));
    }

    #[test]
    fn gains_beyond_all_numbers_are_still_a_pull() {
        let gains = Gains { stiffness: f64::MAX, damping: 0.0 };
        let law = Coordination::ProportionalDerivative.law(&parameters(gains)).unwrap();
        assert_eq!(LinearLaw::of(&law).unwrap().pull(), Some(Gains { stiffness: f64::INFINITY, damping: 0.0 }));
    }

    #[test]
    fn a_product_of_two_unknowns_is_no_linear_form() {
        let (x, y, two) = (Form::unknown(0), Form::unknown(1), Form::of(2.0));
        assert!(!(x * y).is_linear);
        assert!(!(two - x * y).is_linear);
        assert!(!(x * x * Form::of(0.0)).is_linear);
        let form = two * (x - y) * two + -two;
        assert_eq!(form, Form { constant: -2.0, by: [4.0, -4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], is_linear: true });
    }
}
