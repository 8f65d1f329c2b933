//! Registry of the strategies that a scene can name.

use core::fmt;
use core::time::Duration;

use super::law::LawKind as _;
use super::session::ControllerKind;
use super::{
    AveragePosition, ClientServer, Coefficients as _, Command, Context, Extrapolated, Law, LawParameter, LawParameters, LawStrategy, LawValues,
    LawVisitor, LocalDamping, LocalLag, Observation, PassivityControl, ProportionalDerivative, Pull, Role, SessionParameters, SetPosition,
    SmoothedAveragePosition, Strategy, UsedGains, Wave,
};
use crate::sample_kind::SampleKind;
use crate::{Contact, Gains, Held, Motion, Number, State};

macro_rules! registry {
    (
        laws { $($law:ident: $name:literal, $about:literal;)+ }
        controllers { $($controller:ident: $controller_name:literal, $controller_about:literal;)+ }
    ) => {
        /// A strategy that a scene can name: the registry. [Laws](Law) come first.
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        pub enum Coordination {
            $(#[doc = concat!("Each copy is drawn ", $about, ".")] $law,)+
            $(#[doc = concat!("Each copy is drawn ", $controller_about, ".")] $controller,)+
        }

        impl Coordination {
            /// All strategies, the laws first.
            pub const ALL: &'static [Self] = &[$(Self::$law,)+ $(Self::$controller,)+];

            /// Returns the name in a scene file.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$law => $name,)+
                    $(Self::$controller => $controller_name,)+
                }
            }

            /// Returns the strategy with this name in a scene file, or with this [short name](Self::short_name).
            #[must_use]
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.iter().find(|strategy| strategy.name() == name || strategy.short_name() == Some(name)).copied()
            }

            /// Returns the short name of the two laws of Rakhsha & Constantinescu (2015), which a scene file accepts too: `AP` and `PD`.
            #[must_use]
            pub const fn short_name(self) -> Option<&'static str> {
                match self {
                    Self::AveragePosition => Some("AP"),
                    Self::ProportionalDerivative => Some("PD"),
                    _ => None,
                }
            }

            /// Returns the destination of the pull in words, to follow "each copy is drawn".
            #[must_use]
            pub const fn about(self) -> &'static str {
                match self {
                    $(Self::$law => $about,)+
                    $(Self::$controller => $controller_about,)+
                }
            }

            /// Returns the pull of the strategy: towards the mean, or towards each copy.
            #[must_use]
            pub const fn pull(self) -> Pull {
                match self {
                    $(Self::$law => <$law>::PULL,)+
                    $(Self::$controller => <$controller<1>>::PULL,)+
                }
            }

            /// Returns the gains used by the strategy.
            #[must_use]
            pub const fn gains(self) -> UsedGains {
                match self {
                    $(Self::$law => <$law>::GAINS,)+
                    $(Self::$controller => <$controller<1>>::GAINS,)+
                }
            }

            /// Returns the parameters of this strategy alone.
            #[must_use]
            pub const fn parameters(self) -> &'static [LawParameter] {
                match self {
                    $(Self::$law => <$law>::PARAMETERS,)+
                    $(Self::$controller => <$controller<1>>::PARAMETERS,)+
                }
            }

            /// Returns the kind of data in samples beyond position and velocity, with these own parameters of strategies.
            #[must_use]
            pub fn kind(self, settings: &LawSettings) -> SampleKind {
                match self {
                    $(Self::$law)|+ => SampleKind::State,
                    $(Self::$controller => <$controller<1> as ControllerKind<1>>::kind(settings.of(self)),)+
                }
            }

            /// Returns the law with these parameters; `None` for a strategy that is not a law.
            #[must_use]
            pub fn law(self, parameters: &LawParameters) -> Option<BuiltIn> {
                match self {
                    $(Self::$law => Some(BuiltIn::$law(<$law>::new(parameters))),)+
                    $(Self::$controller => None,)+
                }
            }

            /// Returns β [N·s/m], the damping of the peer's own copy by the strategy, as part of the body.
            #[must_use]
            pub fn damping(self, parameters: &LawParameters) -> f64 {
                match self {
                    $(Self::$law => Law::<f64>::damping(&<$law>::new(parameters)),)+
                    $(Self::$controller => <$controller<1>>::damping(parameters),)+
                }
            }

            /// Returns the strategy of one peer in a session of `peers` peers with the period `tick`. The law's own parameters have their defaults.
            ///
            /// # Panics
            ///
            /// If the strategy is not a law.
            #[must_use]
            pub fn strategy<const A: usize>(self, gains: Gains, peers: usize, tick: Duration) -> LawStrategy<A> {
                LawStrategy::new(self, LawParameters { gains, peers, tick, oldest: None, middle: None, own: LawValues::defaults(self.parameters()) })
            }

            /// Returns the strategy of a peer in a session.
            #[must_use]
            pub fn in_session<const A: usize>(self, session: &SessionParameters<A>) -> BuiltInStrategy<A> {
                match self {
                    $(Self::$law => BuiltInStrategy::Law(LawStrategy::new(self, session.law)),)+
                    $(Self::$controller => BuiltInStrategy::$controller(<$controller<A>>::new(session)),)+
                }
            }
        }

        /// A strategy of the registry.
        #[derive(Clone, Debug)]
        pub enum BuiltInStrategy<const A: usize> {
            /// A law.
            Law(LawStrategy<A>),
            $(#[doc = concat!("See [`", stringify!($controller), "`].")] $controller($controller<A>),)+
        }

        impl<const A: usize> BuiltInStrategy<A> {
            /// Returns the command of a strategy with a memory.
            #[cold]
            #[inline(never)]
            fn command_apart(&mut self, context: &Context<'_, A>) -> Command<A> {
                match self {
                    Self::Law(law) => law.command(context),
                    $(Self::$controller(controller) => controller.command(context),)+
                }
            }
        }

        impl<const A: usize> Strategy<A> for BuiltInStrategy<A> {
            #[inline(always)]
            fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
                // The laws of most scenes become part of the loop over peers, and the others stay out of it: with all of them in it, the loop needs more
                // registers than there are (`benches/peers`, rows of watched packets).
                match self {
                    Self::Law(law) if law.is_of_the_present() => law.at_once(context),
                    // Copies of the context and of the command: without them, the context is written to memory for `at_once` too.
                    Self::Law(_) $(| Self::$controller(_))+ => {
                        let Command { force, target } = self.command_apart(&Context { ..*context });
                        Command { force, target }
                    }
                }
            }

            fn horizon(&self) -> Option<f64> {
                match self {
                    Self::Law(law) => law.horizon(),
                    $(Self::$controller(controller) => controller.horizon(),)+
                }
            }

            fn needs_prediction(&self) -> bool {
                match self {
                    Self::Law(law) => law.needs_prediction(),
                    $(Self::$controller(controller) => controller.needs_prediction(),)+
                }
            }

            fn role(&self) -> Role {
                match self {
                    Self::Law(law) => law.role(),
                    $(Self::$controller(controller) => controller.role(),)+
                }
            }

            fn kind(&self) -> SampleKind {
                match self {
                    Self::Law(_) => SampleKind::State,
                    $(Self::$controller(controller) => Strategy::kind(controller),)+
                }
            }

            #[inline(always)]
            fn extra(&mut self, receiver: usize, own: &State<A>, held: &Held<A>) -> [f64; A] {
                match self {
                    Self::Law(law) => law.extra(receiver, own, held),
                    $(Self::$controller(controller) => controller.extra(receiver, own, held),)+
                }
            }

            fn sent(&mut self, own: &State<A>) {
                match self {
                    Self::Law(law) => law.sent(own),
                    $(Self::$controller(controller) => controller.sent(own),)+
                }
            }

            #[inline(always)]
            fn accept(&mut self, other: usize, numbers: &[f64; A]) {
                match self {
                    Self::Law(law) => law.accept(other, numbers),
                    $(Self::$controller(controller) => controller.accept(other, numbers),)+
                }
            }

            fn heard_coupling(&self) -> Option<[f64; A]> {
                match self {
                    Self::Law(law) => law.heard_coupling(),
                    $(Self::$controller(controller) => controller.heard_coupling(),)+
                }
            }

            fn set_contact(&mut self, other: usize, contact: Contact) {
                match self {
                    Self::Law(law) => law.set_contact(other, contact),
                    $(Self::$controller(controller) => controller.set_contact(other, contact),)+
                }
            }

            fn set_gains(&mut self, gains: Gains) {
                match self {
                    Self::Law(law) => law.set_gains(gains),
                    $(Self::$controller(controller) => controller.set_gains(gains),)+
                }
            }

            fn set_parameters(&mut self, own: &LawValues) {
                match self {
                    Self::Law(law) => law.set_parameters(own),
                    $(Self::$controller(controller) => controller.set_parameters(own),)+
                }
            }

            fn memory(&self) -> &[f64] {
                match self {
                    Self::Law(law) => law.memory(),
                    $(Self::$controller(controller) => controller.memory(),)+
                }
            }

            fn set_memory(&mut self, memory: &[f64]) {
                match self {
                    Self::Law(law) => law.set_memory(memory),
                    $(Self::$controller(controller) => controller.set_memory(memory),)+
                }
            }
        }

        /// A law of the registry.
        #[derive(Clone, Copy, PartialEq, Debug)]
        pub enum BuiltIn<C = f64> {
            $(#[doc = concat!("See [`", stringify!($law), "`].")] $law($law<C>),)+
        }

        impl<C: Copy> BuiltIn<C> {
            /// Returns the law with `coefficient` applied to each coefficient, always in the same order.
            #[must_use]
            #[inline(always)]
            pub fn map<D: Copy>(&self, coefficient: impl FnMut(&C) -> D) -> BuiltIn<D> {
                match self {
                    $(Self::$law(law) => BuiltIn::$law(law.map(coefficient)),)+
                }
            }

            /// Applies an operation to the law in its own type.
            #[inline(always)]
            pub fn visit<V: LawVisitor<C>>(&self, visitor: V) -> V::Output {
                match self {
                    $(Self::$law(law) => visitor.visit(law),)+
                }
            }
        }

        impl<N: Number> BuiltIn<N> {
            /// Returns [`Law::force`] and [`Law::target`] with one selection of the law.
            #[inline(always)]
            pub(super) fn command(&self, seen: &Observation<N>, memory: &mut [N]) -> (N, Motion<N>) {
                match self {
                    $(Self::$law(law) => (law.force(seen, memory), law.target(seen)),)+
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
            fn lag(&self) -> usize {
                match self {
                    $(Self::$law(law) => law.lag(),)+
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
    laws {
        AveragePosition: "average-position", "to the mean of the others";
        ProportionalDerivative: "proportional-derivative", "to each of the others";
        SmoothedAveragePosition: "smoothed-average-position", "to the mean of the others, by a force that follows with a lag";
        Extrapolated: "extrapolated", "to the mean of where the others are by now, by their velocities";
        LocalDamping: "local-damping", "to the mean of the others without damping between them, while ground damps it";
        LocalLag: "local-lag", "from where it was some ticks ago to the mean of the others";
    }
    controllers {
        PassivityControl: "passivity-control", "to the mean of the others, with no more energy than they have taken";
        SetPosition: "set-position", "to the mean of the others, as far as there is energy for the way";
        Wave: "wave", "by waves that it exchanges with each of the others";
        ClientServer: "client-server", "to the object of a server, which alone has one";
    }
}

/// Own parameters of every strategy. A scene has the values of all strategies, whatever its own strategy is.
#[derive(Clone, Copy, PartialEq)]
pub struct LawSettings([LawValues; Coordination::ALL.len()]);

impl Default for LawSettings {
    /// Returns every parameter at its default.
    fn default() -> Self {
        Self(core::array::from_fn(|law| LawValues::defaults(Coordination::ALL[law].parameters())))
    }
}

impl LawSettings {
    /// Returns the parameters of `law`.
    #[must_use]
    pub const fn of(&self, law: Coordination) -> &LawValues {
        &self.0[law as usize]
    }

    /// Returns the parameters of `law`, for a change.
    pub const fn of_mut(&mut self, law: Coordination) -> &mut LawValues {
        &mut self.0[law as usize]
    }
}

impl fmt::Debug for LawSettings {
    /// Leaves out strategies with default parameters, so that the text of a scene does not change when the registry grows.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let usual = Self::default();
        let changed = Coordination::ALL.iter().filter(|law| self.of(**law) != usual.of(**law));
        f.debug_map().entries(changed.map(|law| (law.name(), self.of(*law)))).finish()
    }
}
