//! What an impairment that describes itself says: its parameters, its words, its figures, and the stage that carries it out.
//!
//! Such an impairment is one file and one line in [the list](super::list). Readers of files, `--set`, live changes, schemas, `explain`, configured figures and the
//! analysis take everything from this trait.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Debug;
use core::time::Duration;

use cohaptic_units::{Bytes, Instant, Probability, Rate};

use crate::packet::PacketInfo;
use crate::parameters::Key;
use crate::random::Stream;

/// An impairment: its configuration, checked when it was made.
pub(crate) trait Impairment: Clone + PartialEq + Debug {
    /// The stage, with what it remembers.
    type Stage: ImpairmentStage<Config = Self>;

    /// Its key in a table of link keys, with its default, `"none"`, and its form: a table of parameters, or `"none"`.
    const KEY: Key;

    /// Makes the configuration from the values of its parameters.
    ///
    /// # Errors
    ///
    /// [`Refusal`] if the values make no sense together.
    fn of(values: &Values) -> Result<Self, Refusal>;

    /// The impairment in words, with its numbers, as one stage of a line.
    fn words(&self) -> String;

    /// What it adds to the delay of a packet in the long run.
    fn extra_delay(&self) -> ExtraDelay;
}

/// The stage of an impairment. Whatever it draws has an address: the number of an event, never that of a call.
pub(crate) trait ImpairmentStage: Clone + Debug {
    /// Its configuration.
    type Config;

    /// The stage with a configuration that holds from `now` on, or with none. `before` is the stage that was there, which may stay without a
    /// configuration, so that no number is drawn twice. `code` is that of its random numbers, for [`Purpose::Listed`](crate::random::Purpose::Listed).
    fn reconfigured(before: Option<Self>, now: Instant, config: Option<&Self::Config>, draws: Stream, code: u8) -> Option<Self>;

    /// Whether a packet that is offered `now` is lost. It counts as [`DropCause::Loss`](crate::DropCause::Loss).
    fn loses(&mut self, _now: Instant, _packet: PacketInfo) -> bool {
        false
    }

    /// How much later a packet arrives that begins to propagate `now` \[ns\]. `now` never goes back.
    fn delay_nanos(&mut self, _now: Instant, _packet: PacketInfo) -> u64 {
        0
    }
}

/// The mean and the variance of an addition to the delay.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ExtraDelay {
    /// The mean \[s\].
    pub mean: f64,
    /// The variance \[s²\].
    pub variance: f64,
}

/// Why the values of parameters are refused.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Refusal {
    /// The parameter to blame.
    pub key: &'static str,
    /// The fault, and what was expected.
    pub message: String,
}

/// The value of a parameter, as its form says.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum ParameterValue {
    /// Of [`Form::Duration`](crate::parameters::Form::Duration) and [`Form::PositiveDuration`](crate::parameters::Form::PositiveDuration).
    Duration(Duration),
    /// Of [`Form::Rate`](crate::parameters::Form::Rate).
    Rate(Rate),
    /// Of [`Form::Size`](crate::parameters::Form::Size).
    Size(Bytes),
    /// Of [`Form::Probability`](crate::parameters::Form::Probability).
    Probability(Probability),
    /// Of [`Form::Number`](crate::parameters::Form::Number).
    Number(f64),
    /// Of [`Form::Integer`](crate::parameters::Form::Integer).
    Integer(u64),
    /// Of [`Form::Boolean`](crate::parameters::Form::Boolean).
    Boolean(bool),
    /// Of [`Form::Words`](crate::parameters::Form::Words).
    Word(&'static str),
}

macro_rules! values_of_forms {
    ($($form:ident: $type:ty,)*) => {$(
        impl TryFrom<ParameterValue> for $type {
            /// The value, which is of another form.
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

/// The values of parameters by key, defaults included. A parameter without a default that is not given has none.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Values(pub Vec<(&'static str, ParameterValue)>);

impl Values {
    /// The value of a parameter.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<ParameterValue> {
        self.0.iter().find(|(name, _)| *name == key).map(|(_, value)| *value)
    }

    /// A duration; zero if it is not given.
    pub(crate) fn duration(&self, key: &str) -> Duration {
        if let Some(ParameterValue::Duration(value)) = self.get(key) { value } else { Duration::ZERO }
    }

    /// A number; zero if it is not given.
    pub(crate) fn number(&self, key: &str) -> f64 {
        if let Some(ParameterValue::Number(value)) = self.get(key) { value } else { 0.0 }
    }
}
