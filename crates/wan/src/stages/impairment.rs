//! Trait of self-describing impairments: parameters, words, figures, and the stage with the effect.
//!
//! An impairment of this kind is one file and one line in [the list](super::list). Readers of files, `--set`, live changes, schemas, `explain`, configured
//! figures and the analysis take everything from this trait.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Debug;
use core::time::Duration;

use cohaptic_units::{Bytes, Instant, Probability, Rate};

use crate::packet::PacketInfo;
use crate::parameters::Key;
use crate::random::Stream;

/// Configuration of an impairment, checked when made.
pub(crate) trait Impairment: Clone + PartialEq + Debug {
    /// Stage with the effect of the impairment, with its state.
    type Stage: ImpairmentStage<Config = Self>;

    /// Key of the impairment in a table of link keys, with the default `"none"` and the form: a table of parameters, or `"none"`.
    const KEY: Key;

    /// Makes the configuration from the values of its parameters.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the values make no sense together.
    fn of(values: &Values) -> Result<Self, Refusal>;

    /// Returns the impairment in words with its numbers, as one stage of a line.
    fn words(&self) -> String;

    /// Returns mean and variance of the impairment's addition to a packet's delay in the long run.
    fn extra_delay(&self) -> ExtraDelay;
}

/// Stage of an impairment. Random numbers of a stage are addressed by the number of an event and never by the number of a call, so results do not depend on the
/// number of calls.
pub(crate) trait ImpairmentStage: Clone + Debug {
    /// Configuration of the impairment.
    type Config;

    /// Returns the stage for the configuration `config` from `now` on, or for no configuration. `before` is the previous stage. A stage may stay without a
    /// configuration, so no random number is drawn twice if a configuration comes back. `code` is the code of the impairment's random numbers, for
    /// [`Purpose::Listed`](crate::random::Purpose::Listed).
    fn reconfigured(before: Option<Self>, now: Instant, config: Option<&Self::Config>, draws: Stream, code: u8) -> Option<Self>;

    /// Returns whether a packet offered `now` is lost. The loss counts as [`DropCause::Loss`](crate::DropCause::Loss).
    fn loses(&mut self, _now: Instant, _packet: PacketInfo) -> bool {
        false
    }

    /// Returns the additional delay \[ns\] of a packet with its propagation beginning `now`. `now` never decreases from call to call.
    fn delay_nanos(&mut self, _now: Instant, _packet: PacketInfo) -> u64 {
        0
    }
}

/// Mean and variance of an addition to the delay.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ExtraDelay {
    /// Mean \[s\].
    pub mean: f64,
    /// Variance \[s²\].
    pub variance: f64,
}

/// Reason for the refusal of values of parameters.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Refusal {
    /// Name of the refused parameter.
    pub key: &'static str,
    /// Description of the fault and of the expected value.
    pub message: String,
}

/// Value of a parameter, of the kind of the parameter's form.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum ParameterValue {
    /// Value of [`Form::Duration`](crate::parameters::Form::Duration) and [`Form::PositiveDuration`](crate::parameters::Form::PositiveDuration).
    Duration(Duration),
    /// Value of [`Form::Rate`](crate::parameters::Form::Rate).
    Rate(Rate),
    /// Value of [`Form::Size`](crate::parameters::Form::Size).
    Size(Bytes),
    /// Value of [`Form::Probability`](crate::parameters::Form::Probability).
    Probability(Probability),
    /// Value of [`Form::Number`](crate::parameters::Form::Number).
    Number(f64),
    /// Value of [`Form::Integer`](crate::parameters::Form::Integer).
    Integer(u64),
    /// Value of [`Form::Boolean`](crate::parameters::Form::Boolean).
    Boolean(bool),
    /// Value of [`Form::Words`](crate::parameters::Form::Words).
    Word(&'static str),
}

macro_rules! values_of_forms {
    ($($form:ident: $type:ty,)*) => {$(
        impl TryFrom<ParameterValue> for $type {
            /// The refused value, of a different form.
            type Error = ParameterValue;

            fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
                if let ParameterValue::$form(value) = value { Ok(value) } else { Err(value) }
            }
        }
    )*};
}
values_of_forms! {
    Duration: Duration,
    Rate: Rate,
    Size: Bytes,
    Probability: Probability,
    Number: f64,
    Integer: u64,
    Boolean: bool,
    Word: &'static str,
}

/// Values of parameters by key, defaults included. A missing parameter without a default has no entry.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Values(pub Vec<(&'static str, ParameterValue)>);

impl Values {
    /// Returns the value of the parameter `key`, or `None` if the parameter has no entry.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<ParameterValue> {
        self.0.iter().find(|(name, _)| *name == key).map(|(_, value)| *value)
    }

    /// Returns the duration `key`, or zero if `key` is not given or is no duration.
    pub(crate) fn duration(&self, key: &str) -> Duration {
        if let Some(ParameterValue::Duration(value)) = self.get(key) { value } else { Duration::ZERO }
    }

    /// Returns the number `key`, or zero if `key` is not given or is no number.
    pub(crate) fn number(&self, key: &str) -> f64 {
        if let Some(ParameterValue::Number(value)) = self.get(key) { value } else { 0.0 }
    }
}
