//! List of the self-describing impairments. One line adds an impairment: `code => field: module::Type`.
//!
//! A code is part of the address of each random number, and so of every recorded result. A code therefore never changes and is never used twice. A code is
//! even and at least 14, so no further purpose shares its random words.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

use cohaptic_units::Instant;

use super::impairment::{ExtraDelay, Impairment, ImpairmentStage, Refusal, Values};
use crate::packet::PacketInfo;
use crate::parameters::Key;
use crate::random::Stream;

macro_rules! impairments {
    ($($code:literal => $field:ident: $type:path,)*) => {
        /// Self-describing impairments of a link. By default no impairment is configured.
        #[derive(Clone, PartialEq, Default)]
        pub struct Impairments {
            $($field: Option<$type>,)*
        }

        impl Impairments {
            /// Keys of all impairments, in the order of the impairments on a packet's way.
            pub const KEYS: &[Key] = &[$(<$type as Impairment>::KEY,)*];

            /// Codes of the impairments' random numbers, in the order of [`KEYS`](Self::KEYS).
            pub(crate) const CODES: &[u8] = &[$($code,)*];

            /// Sets the impairment with the key `key`, or removes the impairment if `values` is `None`. An unknown key is ignored.
            ///
            /// # Errors
            ///
            /// [`Refusal`] if the values make no sense together.
            #[allow(unused_variables, reason = "the list may be empty")]
            pub fn set(&mut self, key: &str, values: Option<&Values>) -> Result<(), Refusal> {
                $(if key == <$type as Impairment>::KEY.name {
                    self.$field = values.map(<$type as Impairment>::of).transpose()?;
                })*
                Ok(())
            }

            /// Returns each configured impairment in words with its numbers.
            #[must_use]
            pub fn words(&self) -> Vec<String> {
                let all: &[Option<String>] = &[$(self.$field.as_ref().map(Impairment::words),)*];
                all.iter().flatten().cloned().collect()
            }

            /// Returns the addition to the delay in the long run, summed over all configured impairments, or `None` if no impairment is configured.
            #[must_use]
            pub fn extra_delay(&self) -> Option<ExtraDelay> {
                let all: &[Option<ExtraDelay>] = &[$(self.$field.as_ref().map(Impairment::extra_delay),)*];
                // Impairments draw independent random numbers, so their variances add up like their means.
                let sum = |one: ExtraDelay, other: ExtraDelay| ExtraDelay { mean: one.mean + other.mean, variance: one.variance + other.variance };
                all.iter().flatten().copied().reduce(sum)
            }
        }

        impl fmt::Debug for Impairments {
            /// Shows only configured impairments, so the text of a link does not change with a longer list.
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let mut shown = f.debug_struct("Impairments");
                $(if let Some(config) = &self.$field {
                    shown.field(stringify!($field), config);
                })*
                shown.finish()
            }
        }

        /// Stages of the configured impairments.
        #[derive(Clone, Debug, Default)]
        pub(crate) struct ImpairmentStages {
            $($field: Option<<$type as Impairment>::Stage>,)*
        }

        #[allow(unused_variables, unused_mut, clippy::unused_self, clippy::needless_pass_by_ref_mut, reason = "the list may be empty")]
        impl ImpairmentStages {
            /// Returns the stages with the configuration `config` from `now` on, or `None` if there were no stages and `config` is empty.
            pub(crate) fn reconfigured(before: Option<Box<Self>>, now: Instant, config: &Impairments, draws: Stream) -> Option<Box<Self>> {
                // A link without such impairments needs no allocation.
                if before.is_none() && *config == Impairments::default() {
                    return None;
                }
                let mut stages = before.unwrap_or_default();
                $(stages.$field = ImpairmentStage::reconfigured(stages.$field.take(), now, config.$field.as_ref(), draws, $code);)*
                Some(stages)
            }

            /// Returns whether any impairment loses the packet. Every impairment is asked even after a loss, so the state of a stage does not depend on further
            /// stages.
            pub(crate) fn loses(&mut self, now: Instant, packet: PacketInfo) -> bool {
                let mut lost = false;
                $(lost |= self.$field.as_mut().is_some_and(|stage| stage.loses(now, packet));)*
                lost
            }

            /// Returns the sum of the impairments' additional delays of a packet \[ns\].
            pub(crate) fn delay_nanos(&mut self, now: Instant, packet: PacketInfo) -> u64 {
                let mut nanos = 0_u64;
                $(nanos = nanos.saturating_add(self.$field.as_mut().map_or(0, |stage| stage.delay_nanos(now, packet)));)*
                nanos
            }
        }
    };
}

impairments! {
    14 => spike: crate::stages::spike::Spike,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_even_and_each_is_used_once() {
        let codes: alloc::collections::BTreeSet<u8> = Impairments::CODES.iter().copied().collect();
        assert_eq!(codes.len(), Impairments::CODES.len());
        assert!(codes.iter().all(|code| *code >= 14 && code % 2 == 0));
    }
}
