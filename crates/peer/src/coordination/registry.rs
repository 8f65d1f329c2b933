//! The laws that a scene can name.

use super::{AveragePosition, Law, LawParameters, LawStrategy, Observation, ProportionalDerivative};
use crate::{Gains, Motion, Number};

macro_rules! registry {
    ($($(#[$doc:meta])+ $law:ident: $name:literal,)+) => {
        /// The laws that a scene can name: the registry.
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        pub enum Coordination {
            $($(#[$doc])+ $law,)+
        }

        impl Coordination {
            /// Every law.
            pub const ALL: &'static [Self] = &[$(Self::$law,)+];

            /// The name in a scene file.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$law => $name,)+
                }
            }

            /// The law with these parameters.
            #[must_use]
            pub fn law(self, parameters: &LawParameters) -> BuiltIn {
                match self {
                    $(Self::$law => BuiltIn::$law($law::new(parameters)),)+
                }
            }

            /// The strategy of one peer out of `peers`.
            #[must_use]
            pub fn strategy<const A: usize>(self, gains: Gains, peers: usize) -> LawStrategy<A> {
                LawStrategy::new(self, LawParameters { gains, peers })
            }
        }

        /// A law of the registry.
        #[derive(Clone, Copy, PartialEq, Debug)]
        pub enum BuiltIn<C = f64> {
            $(#[doc = concat!("See [`", stringify!($law), "`].")] $law($law<C>),)+
        }

        impl<C: Copy> BuiltIn<C> {
            /// The law with each coefficient replaced by what `coefficient` makes of it, always in one order.
            #[must_use]
            #[inline(always)]
            pub fn map<D>(&self, coefficient: impl FnMut(&C) -> D) -> BuiltIn<D> {
                match self {
                    $(Self::$law(law) => BuiltIn::$law(law.map(coefficient)),)+
                }
            }
        }

        impl<N: Number> Law<N> for BuiltIn<N> {
            fn memory(&self) -> usize {
                match self {
                    $(Self::$law(law) => law.memory(),)+
                }
            }

            #[inline(always)]
            fn force(&self, seen: &Observation<N>, memory: &mut [N]) -> N {
                match self {
                    $(Self::$law(law) => law.force(seen, memory),)+
                }
            }

            #[inline(always)]
            fn target(&self, seen: &Observation<N>) -> Motion<N> {
                match self {
                    $(Self::$law(law) => law.target(seen),)+
                }
            }
        }
    };
}

registry! {
    /// Each copy is pulled towards the mean of the others.
    AveragePosition: "average-position",
    /// Each copy is pulled towards each of the others.
    ProportionalDerivative: "proportional-derivative",
}
