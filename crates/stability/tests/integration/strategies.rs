//! Strategies of a user on the general path: analysed if they are linear and show all that they remember, refused otherwise.

use cohaptic_peer::{Command, Context, Gains, State, Strategy};
use cohaptic_scene::{Scene, Strategies};
use cohaptic_stability::{AnalysisError, Method, analyse, analyse_with};

use crate::anchors::scene;

/// Average position, altered as [`Kind`] says.
#[derive(Clone)]
struct Altered {
    gains: Gains,
    kind: Kind,
    /// A low-pass filtered force, one for each axis.
    filtered: [f64; 3],
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    /// Average position without a change.
    Plain,
    /// With a constant force added, which does not change the free motion of the scene.
    Offset,
    /// No force below a distance of 0.1 mm.
    DeadBand,
    /// At most 100 N.
    Limited,
    /// Low-pass filtered, with the state of the filter shown by `memory`.
    Filtered,
    /// Low-pass filtered, with the state of the filter hidden.
    Hidden,
    /// With a force that grows with the time.
    Timed,
    /// With a spring to the origin added.
    Anchored,
    /// With damping of the peer's own velocity in place of the velocity difference.
    OwnDamping,
}

impl<const A: usize> Strategy<A> for Altered {
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let (own, target) = (context.own, *context.held.mean());
        let Gains { stiffness, damping } = self.gains;
        let plain = |axis: usize| stiffness * (own.position[axis] - target.position[axis]) + damping * (own.velocity[axis] - target.velocity[axis]);
        let mut force: [f64; A] = core::array::from_fn(plain);
        for axis in 0..A {
            force[axis] = match self.kind {
                Kind::Plain => force[axis],
                Kind::Offset => force[axis] + 3.0,
                Kind::DeadBand => {
                    if (own.position[axis] - target.position[axis]).abs() < 1e-4 {
                        0.0
                    } else {
                        force[axis]
                    }
                }
                Kind::Limited => force[axis].clamp(-100.0, 100.0),
                Kind::Filtered | Kind::Hidden => {
                    self.filtered[axis] += 0.5 * (force[axis] - self.filtered[axis]);
                    self.filtered[axis]
                }
                Kind::Timed => force[axis] * (1.0 + context.now.as_secs_f64()),
                Kind::Anchored => force[axis] + 50.0 * own.position[axis],
                Kind::OwnDamping => stiffness * (own.position[axis] - target.position[axis]) + damping * own.velocity[axis],
            };
        }
        Command { force, target: State::REST }
    }

    fn set_gains(&mut self, gains: Gains) {
        self.gains = gains;
    }

    fn memory(&self) -> &[f64] {
        if self.kind == Kind::Filtered { &self.filtered[..A] } else { &[] }
    }

    fn set_memory(&mut self, memory: &[f64]) {
        self.filtered[..memory.len()].copy_from_slice(memory);
    }
}

impl Strategies for Kind {
    // Boxed, as in `graphs`.
    type Strategy<const A: usize> = Box<dyn Strategy<A>>;

    fn strategy<const A: usize>(&self, scene: &Scene, _peer: usize) -> Self::Strategy<A> {
        Box::new(Altered { gains: scene.coordination.gains, kind: *self, filtered: [0.0; 3] })
    }
}

#[test]
fn a_constant_force_changes_nothing() {
    let scene = scene(&["scene.axes=2"]);
    let built_in = analyse(&scene, Method::Full).unwrap();
    for kind in [Kind::Plain, Kind::Offset] {
        let own = analyse_with(&scene, &kind).unwrap();
        assert!((own.radius.value - built_in.radius.value).abs() < 1e-9, "{kind:?}");
        assert_eq!((own.rigid_modes, own.dimension), (built_in.rigid_modes, built_in.dimension));
    }
}

#[test]
fn what_is_not_linear_is_found_out() {
    for kind in [Kind::DeadBand, Kind::Limited] {
        assert!(matches!(analyse_with(&scene(&[]), &kind), Err(AnalysisError::NotLinear { .. })), "{kind:?}");
    }
}

#[test]
fn what_is_hidden_is_found_out() {
    for kind in [Kind::Hidden, Kind::Timed] {
        assert!(matches!(analyse_with(&scene(&[]), &kind), Err(AnalysisError::Remembers)), "{kind:?}");
    }
}

/// A filter that is shown adds a state for each peer and axis, and changes the radius.
#[test]
fn what_is_shown_is_analysed() {
    let scene = scene(&["scene.axes=2"]);
    let (filtered, plain) = (analyse_with(&scene, &Kind::Filtered).unwrap(), analyse_with(&scene, &Kind::Plain).unwrap());
    assert_eq!(filtered.dimension, plain.dimension + 3 * 2);
    assert!((filtered.radius.value - plain.radius.value).abs() > 1e-4);
}

/// A strategy that ties the object to the origin leaves no rigid-body mode to remove.
#[test]
fn a_strategy_that_knows_the_origin_leaves_no_rigid_mode() {
    let (anchored, plain) = (analyse_with(&scene(&[]), &Kind::Anchored).unwrap(), analyse_with(&scene(&[]), &Kind::Plain).unwrap());
    assert_eq!((anchored.rigid_modes, plain.rigid_modes), (0, 1));
    assert_eq!(anchored.dimension, plain.dimension + 1);
    // A slow return to the origin: over a frame little less than 1.
    assert!(anchored.radius.value < 1.0 && anchored.radius.value > plain.radius.value);
}

/// Local damping injection: with the delayed velocity dropped, b > K·T (T: delay and hold) makes the copies stable whatever the delay; well below, they are not.
#[test]
fn local_damping_above_the_bound_is_stable() {
    // Nobody touches: copies alone. T = 24 ms + 8 ms; K·T = 32 N·s/m.
    let radius = |damping: f64| {
        let scene = scene(&["peer.contact=none", "link.delay=24ms", &format!("coordination.damping={damping}")]);
        analyse_with(&scene, &Kind::OwnDamping).unwrap().radius
    };
    assert!(radius(35.0).value < 1.0);
    assert!(radius(5.0).value > 1.0);
}
