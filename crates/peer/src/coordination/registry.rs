//! The laws that a scene can name.

use core::time::Duration;

use super::law::LawKind as _;
use super::{
    AveragePosition, Coefficients as _, Extrapolated, Law, LawParameter, LawParameters, LawStrategy, LawValues, LawVisitor, LocalDamping,
    Observation, ProportionalDerivative, Pull, SmoothedAveragePosition, UsedGains,
};
use crate::{Gains, Motion, Number};

macro_rules! registry {
    ($($law:ident: $name:literal, $about:literal;)+) => {
        /// The laws that a scene can name: the registry.
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        pub enum Coordination {
            $(#[doc = concat!("Each copy is drawn ", $about, ".")] $law,)+
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

            /// Where it draws each copy, in words.
            #[must_use]
            pub const fn about(self) -> &'static str {
                match self {
                    $(Self::$law => $about,)+
                }
            }

            /// How it pulls towards the others.
            #[must_use]
            pub const fn pull(self) -> Pull {
                match self {
                    $(Self::$law => <$law>::PULL,)+
                }
            }

            /// Which gains it uses.
            #[must_use]
            pub const fn gains(self) -> UsedGains {
                match self {
                    $(Self::$law => <$law>::GAINS,)+
                }
            }

            /// The parameters that this law alone has.
            #[must_use]
            pub const fn parameters(self) -> &'static [LawParameter] {
                match self {
                    $(Self::$law => <$law>::PARAMETERS,)+
                }
            }

            /// The strategy of one peer out of `peers` whose tick has that period, with the law's own parameters at their defaults.
            #[must_use]
            pub fn strategy<const A: usize>(self, gains: Gains, peers: usize, tick: Duration) -> LawStrategy<A> {
                LawStrategy::new(self, LawParameters { gains, peers, tick, oldest: None, own: LawValues::defaults(self.parameters()) })
            }

            /// The law with these parameters.
            #[must_use]
            pub fn law(self, parameters: &LawParameters) -> BuiltIn {
                match self {
                    $(Self::$law => BuiltIn::$law(<$law>::new(parameters)),)+
                }
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
            pub fn map<D: Copy>(&self, coefficient: impl FnMut(&C) -> D) -> BuiltIn<D> {
                match self {
                    $(Self::$law(law) => BuiltIn::$law(law.map(coefficient)),)+
                }
            }

            /// Does something with the law by its own type.
            #[inline(always)]
            pub fn visit<V: LawVisitor<C>>(&self, visitor: V) -> V::Output {
                match self {
                    $(Self::$law(law) => visitor.visit(law),)+
                }
            }
        }

        impl<N: Number> Law<N> for BuiltIn<N> {
            fn memory(&self) -> usize {
                match self {
                    $(Self::$law(law) => law.memory(),)+
                }
            }

            fn damping(&self) -> f64 {
                match self {
                    $(Self::$law(law) => law.damping(),)+
                }
            }

            fn horizon(&self) -> Option<f64> {
                match self {
                    $(Self::$law(law) => law.horizon(),)+
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
    AveragePosition: "average-position", "to the mean of the others";
    ProportionalDerivative: "proportional-derivative", "to each of the others";
    SmoothedAveragePosition: "smoothed-average-position", "to the mean of the others, by a force that follows with a lag";
    Extrapolated: "extrapolated", "to the mean of where the others are by now, by their velocities";
    LocalDamping: "local-damping", "to the mean of the others without damping between them, while ground damps it";
}

/// The parameters that laws alone have, of every law: a scene has them whatever its strategy is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LawSettings([LawValues; Coordination::ALL.len()]);

impl Default for LawSettings {
    /// Every parameter at its default.
    fn default() -> Self {
        Self(core::array::from_fn(|law| LawValues::defaults(Coordination::ALL[law].parameters())))
    }
}

impl LawSettings {
    /// Those of a law.
    #[must_use]
    pub const fn of(&self, law: Coordination) -> &LawValues {
        &self.0[law as usize]
    }

    /// Those of a law, to be changed.
    pub const fn of_mut(&mut self, law: Coordination) -> &mut LawValues {
        &mut self.0[law as usize]
    }
}
