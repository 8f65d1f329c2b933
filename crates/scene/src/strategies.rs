//! Choice of the strategy of each peer: the strategy of the scene, or a strategy of the caller.

use cohaptic_peer::coordination::{BuiltIn, BuiltInStrategy, LawParameters, LawSettings, LawValue, SessionParameters};
use cohaptic_peer::rotation::Triple;
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{Coordination, Gains, Strategy};

use crate::{ChangeKind, CoordinationSpec, Scene};

/// Factory of the coordination strategy of each peer, for any number of axes.
///
/// [`FromScene`] makes the strategy of the scene. Implement this trait to simulate or to analyse a scene with a strategy of your own.
pub trait Strategies {
    /// Type of the strategy for A axes.
    type Strategy<const A: usize>: Strategy<A>;

    /// True for [`FromScene`] alone. The loops of a run are compiled once for [`FromScene`], and not again for each crate that runs scenes.
    const OF_SCENE: bool = false;

    /// Makes the strategy of a peer. `peer` is the index in [`Scene::peers`].
    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> Self::Strategy<A>;

    /// Returns the law of a peer, if the strategies are a law of the registry. The law gives the forces of the strategies to the bit, so that a run can use
    /// the law in place of the strategies. `peer` is the index in [`Scene::peers`].
    fn law(&self, _scene: &Scene, _peer: usize) -> Option<BuiltIn> {
        None
    }
}

/// Factory of the strategy of the scene, with gains scaled by the number of peers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FromScene;

impl Strategies for FromScene {
    type Strategy<const A: usize> = BuiltInStrategy<A>;

    const OF_SCENE: bool = true;

    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> BuiltInStrategy<A> {
        scene.coordination.strategy.in_session(&scene.session_parameters(peer))
    }

    fn law(&self, scene: &Scene, peer: usize) -> Option<BuiltIn> {
        scene.law(peer)
    }
}

impl Scene {
    /// Returns the coordination law of a peer; `None` if the strategy of the scene is not a law.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn law(&self, peer: usize) -> Option<BuiltIn> {
        self.coordination.strategy.law(&self.law_parameters(peer))
    }

    /// Iterates over [`Scene::law`] at the beginning and after each change of the timeline. Empty if the strategy of the scene is not a law.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    pub fn laws_in_time(&self, peer: usize) -> impl Iterator<Item = BuiltIn> {
        let changes = self.law(peer).into_iter().flat_map(move |begins| {
            self.timeline.iter().scan((self.clone(), begins), move |(then, law), change| {
                match &change.what {
                    ChangeKind::Coordination(gains) => then.coordination.gains = *gains,
                    ChangeKind::Parameters(settings) => then.coordination.settings = **settings,
                    // These changes do not concern the law. The law before is repeated, so that the iterator has a law for each change.
                    ChangeKind::Link(_)
                    | ChangeKind::AllLinks(_)
                    | ChangeKind::Contact { .. }
                    | ChangeKind::Hand { .. }
                    | ChangeKind::HandTorque { .. }
                    | ChangeKind::RotationalGains(_)
                    | ChangeKind::SendWhen(_) => return Some(*law),
                }
                *law = then.law(peer)?;
                Some(*law)
            })
        });
        self.law(peer).into_iter().chain(changes)
    }

    /// Returns β [N·s/m], the damping of the copy of a peer by the strategy.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn own_damping(&self, peer: usize) -> f64 {
        self.coordination.strategy.damping(&self.law_parameters(peer))
    }

    /// Returns the law of a peer's rotation, with gains of one: the law makes the torque from the torques of spring and damper. `None` if the strategy of the
    /// scene is not a law.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn turn_law(&self, peer: usize) -> Option<BuiltIn> {
        let gains = Gains { stiffness: 1.0, damping: 1.0 };
        // Two peers, N − 1 = 1: the gains of rotations contain the number of the other peers already.
        self.coordination.strategy.law(&LawParameters { gains, peers: 2, ..self.law_parameters(peer) })
    }

    /// Returns the damping of the rotation of a peer's copy by the strategy, about each body axis [N·m·s/rad]; zero if the object does not turn.
    ///
    /// A given β is a damping of the mass, so that it is multiplied by inertia over mass. An automatic β is the same about every axis, from the largest
    /// component of KR: a radian of rotation about any axis changes the torque by at most this component, so that the springs of rotations inject no energy
    /// at any angle.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn own_rotational_damping(&self, peer: usize) -> Triple {
        let (Some(rotation), CoordinationSpec { strategy, gains, .. }) = (&self.rotation, &self.coordination) else { return [0.0; 3] };
        let stiffness = self.rotation_gains(*gains, &rotation.gains).map_or([0.0; 3], |gains| gains.stiffness);
        if self.has_automatic_damping() {
            let gains = Gains { stiffness: stiffness.into_iter().fold(0.0, f64::max), damping: 0.0 };
            // KR takes the place of KT in the formula of the automatic damping.
            return [strategy.damping(&LawParameters { gains, ..self.law_parameters(peer) }); 3];
        }
        rotation.over_mass(self.object.mass, self.own_damping(peer))
    }

    /// Returns true if the strategy computes the damping of each copy from the stiffness.
    pub(crate) fn has_automatic_damping(&self) -> bool {
        let CoordinationSpec { strategy, settings, .. } = &self.coordination;
        // Parameter 0 of local-damping is the damping.
        *strategy == Coordination::LocalDamping && settings.of(*strategy).get(0) == LawValue::Automatic
    }

    /// Returns the peer that alone has the object, as an index in [`Scene::peers`]; `None` if every peer has a copy.
    #[must_use]
    pub fn server(&self) -> Option<usize> {
        let CoordinationSpec { strategy, settings, .. } = &self.coordination;
        (*strategy == Coordination::ClientServer).then(|| settings.of(*strategy).place(0))
    }

    /// Returns whether clients send displacements, of which the server of the scene adds each once.
    #[must_use]
    pub fn sends_increments(&self) -> bool {
        self.sample_kind() == SampleKind::Increment
    }

    /// Returns whether clients of the scene's server feel no force.
    #[must_use]
    pub fn returns_nothing(&self) -> bool {
        let CoordinationSpec { strategy, settings, .. } = &self.coordination;
        // Parameter 1 of client-server is `returns`.
        let returns = settings.of(*strategy).get(1);
        self.server().is_some() && matches!(returns, LawValue::Word(word) if strategy.parameters()[1].form.word(word) == "none")
    }

    /// Returns the kind of samples: the values in samples in addition to the state.
    #[must_use]
    pub fn sample_kind(&self) -> SampleKind {
        if self.rotation.is_some() { SampleKind::Attitude } else { self.coordination.strategy.kind(&self.coordination.settings) }
    }

    /// Returns the scene with states in place of displacements in the samples of clients. Over links of constant delay, which lose, repeat and reorder nothing,
    /// both move alike but for rounding.
    #[must_use]
    pub fn with_states(&self) -> Self {
        let mut settings = self.coordination.settings;
        // Parameter 2 of client-server is `sends`, and its first word is `states`.
        settings.of_mut(Coordination::ClientServer).set(2, LawValue::Word(0));
        self.with_parameters(&settings)
    }

    /// Returns the scene with these own parameters of strategies.
    #[must_use]
    pub fn with_parameters(&self, settings: &LawSettings) -> Self {
        Self { coordination: CoordinationSpec { settings: *settings, ..self.coordination }, ..self.clone() }
    }

    /// Returns true if dead bands leave out samples, at the beginning or after a change of the timeline.
    pub(crate) fn leaves_out_samples(&self) -> bool {
        self.coordination.send_when.is_some() || self.timeline.iter().any(|change| matches!(change.what, ChangeKind::SendWhen(_)))
    }

    /// Returns the number of a peer's ticks from sample to sample.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn samples_every(&self, peer: usize) -> u64 {
        u64::try_from(self.coordination.update.as_nanos() / self.peers[peer].clock.tick.as_nanos()).unwrap_or(u64::MAX)
    }

    /// Returns the parameters of a peer's law: gains scaled by the number of peers, the tick of the peer, and the law's own parameters.
    fn law_parameters(&self, peer: usize) -> LawParameters {
        let CoordinationSpec { strategy, gains, settings, .. } = &self.coordination;
        let own = settings.of(*strategy);
        LawParameters {
            gains: self.coordination_gains(*gains, peer),
            // On a topology the gains contain the number of heard peers. The law is made for two peers, N − 1 = 1.
            peers: if self.topology.is_some() { 2 } else { self.number() },
            tick: self.peers[peer].clock.tick,
            // Both ages look at every link, and only automatic parameters need the ages.
            oldest: if own.any_automatic() { self.oldest_sample() } else { None },
            middle: if own.any_automatic() { self.middle_age() } else { None },
            own: *own,
        }
    }

    /// Returns the parameters of a peer's strategy.
    fn session_parameters<const A: usize>(&self, peer: usize) -> SessionParameters<A> {
        // A topology admits laws alone, which need no more than the parameters of the law.
        let places = 0..if self.topology.is_some() { 0 } else { self.peers.len() };
        SessionParameters {
            law: self.law_parameters(peer),
            place: peer,
            samples_every: self.samples_every(peer),
            initial: places.clone().map(|place| self.initial_state(place)).collect(),
            couplings: places.map(|place| (self.peers[place].contact, self.coupling(place))).collect(),
        }
    }
}
