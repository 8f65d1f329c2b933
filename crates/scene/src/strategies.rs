//! Which strategy each peer runs: the scene's, or one of the caller's own.

use cohaptic_peer::coordination::{BuiltIn, BuiltInStrategy, LawParameters, LawSettings, LawValue, SessionParameters};
use cohaptic_peer::rotation::Triple;
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{Coordination, Gains, Strategy};

use crate::{ChangeKind, CoordinationSpec, Scene};

/// Makes the coordination strategy of each peer, for as many axes as are simulated.
///
/// [`FromScene`] makes what the scene names. Implement this to simulate or to analyse a scene with a strategy of your own.
pub trait Strategies {
    /// The strategy for A axes.
    type Strategy<const A: usize>: Strategy<A>;

    /// Whether they are [`FromScene`], for which the loops of a run are compiled once, and not again for each crate that runs scenes.
    const OF_SCENE: bool = false;

    /// Makes the strategy of the peer in that place of [`Scene::peers`].
    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> Self::Strategy<A>;

    /// The law of the peer in that place of [`Scene::peers`], if these strategies are one of the registry: it gives their forces to the bit, so a run can do
    /// without the strategies.
    fn law(&self, _scene: &Scene, _peer: usize) -> Option<BuiltIn> {
        None
    }
}

/// The strategy that the scene names, with its gains scaled by the number of peers.
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
    /// The coordination law of a peer; `None` if the strategy of the scene is not a law.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn law(&self, peer: usize) -> Option<BuiltIn> {
        self.coordination.strategy.law(&self.law_parameters(peer))
    }

    /// [`Scene::law`] at the beginning and after each change of the timeline; nothing if the strategy of the scene is not a law.
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

    /// β [N·s/m]: by how much the strategy damps the copy of a peer.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn own_damping(&self, peer: usize) -> f64 {
        self.coordination.strategy.damping(&self.law_parameters(peer))
    }

    /// The law of the turns of a peer, with gains of one: it makes the torque from those of spring and damper. `None` if the strategy of the scene is not a law.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn turn_law(&self, peer: usize) -> Option<BuiltIn> {
        let gains = Gains { stiffness: 1.0, damping: 1.0 };
        // The number of the others counts in the gains of the turns.
        self.coordination.strategy.law(&LawParameters { gains, peers: 2, ..self.law_parameters(peer) })
    }

    /// By how much the strategy damps the turn of the copy of a peer about each body axis [N·m·s/rad]; zero if the object does not turn.
    ///
    /// A β that is given is damping of the mass, and counts times inertia over mass. An automatic one is made about every axis from the largest component of KR: no
    /// radian of turn, about whatever axis, changes the torque by more, so the springs of turns inject no energy at any angle.
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
            return [strategy.damping(&LawParameters { gains, ..self.law_parameters(peer) }); 3];
        }
        rotation.over_mass(self.object.mass, self.own_damping(peer))
    }

    /// Whether the strategy damps each copy by as much as its stiffness asks for.
    pub(crate) fn has_automatic_damping(&self) -> bool {
        let CoordinationSpec { strategy, settings, .. } = &self.coordination;
        *strategy == Coordination::LocalDamping && settings.of(*strategy).get(0) == LawValue::Automatic
    }

    /// The peer that alone has the object; `None` if every peer has a copy.
    #[must_use]
    pub fn server(&self) -> Option<usize> {
        let CoordinationSpec { strategy, settings, .. } = &self.coordination;
        (*strategy == Coordination::ClientServer).then(|| settings.of(*strategy).place(0))
    }

    /// What samples carry beyond the state.
    #[must_use]
    pub const fn sample_kind(&self) -> SampleKind {
        if self.rotation.is_some() { SampleKind::Attitude } else { self.coordination.strategy.kind() }
    }

    /// The scene with these parameters of strategies.
    #[must_use]
    pub fn with_parameters(&self, settings: &LawSettings) -> Self {
        Self { coordination: CoordinationSpec { settings: *settings, ..self.coordination }, ..self.clone() }
    }

    /// Whether there are dead bands, at the beginning or later.
    pub(crate) fn leaves_out_samples(&self) -> bool {
        self.coordination.send_when.is_some() || self.timeline.iter().any(|change| matches!(change.what, ChangeKind::SendWhen(_)))
    }

    /// How many of its ticks are between two samples of a peer.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn samples_every(&self, peer: usize) -> u64 {
        u64::try_from(self.coordination.update.as_nanos() / self.peers[peer].clock.tick.as_nanos()).unwrap_or(u64::MAX)
    }

    /// What the law of a peer is made from: the gains scaled by the number of peers, its tick, and the parameters of the law itself.
    fn law_parameters(&self, peer: usize) -> LawParameters {
        let CoordinationSpec { strategy, gains, settings, .. } = &self.coordination;
        let own = settings.of(*strategy);
        LawParameters {
            gains: self.coordination_gains(*gains, peer),
            // On a topology the number of those heard counts in the gains.
            peers: if self.topology.is_some() { 2 } else { self.number() },
            tick: self.peers[peer].clock.tick,
            oldest: if own.any_automatic() { self.oldest_sample() } else { None },
            middle: if own.any_automatic() { self.middle_age() } else { None },
            own: *own,
        }
    }

    /// What the strategy of a peer is made from.
    fn session_parameters<const A: usize>(&self, peer: usize) -> SessionParameters<A> {
        // A topology has laws alone, which need no more than their parameters.
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
