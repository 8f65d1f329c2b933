//! What the network injects with `passivity-control`, over any links and clocks.
//!
//! **Claim** (derived in `docs/claims.md`). W ≤ U + N·reserve at every tick, with W as in [`crate::claims::injected`] and U what the springs store at the beginning.

use cohaptic_harness::{Model, Simulation};
use cohaptic_peer::coordination::LawValue;
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{Command, Context, Coordination, Gains, Held, State};
use cohaptic_scene::{Scene, Strategies};
use cohaptic_tests::{Draft, keep, run};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::claims::cases;
use crate::claims::energy::springs;
use crate::claims::injected::{Injected, has_rates, stored_at_first};

fn with_reserve(draft: &mut Draft, reserve: f64) {
    draft.strategy = Coordination::PassivityControl;
    draft.settings.of_mut(Coordination::PassivityControl).set(0, LawValue::Number(reserve));
}

properties! {
    #![proptest_config(cases(150))]

    #[test]
    fn the_network_gives_no_more_than_it_has_taken(
        mut draft in springs(),
        damping in 0.0..20.0,
        object in prop_oneof![Just(0.0), 0.0..5.0],
        reserve in prop_oneof![Just(0.0), 0.0..0.01],
        clocks in prop_oneof![Just(None), (0..3_000_000_u64, -100_000..100_000_i32).prop_map(Some)],
    ) {
        (draft.gains.damping, draft.damping) = (damping, object);
        if let Some((offset, drift)) = clocks {
            (draft.peers[0].offset, draft.peers[1].drift) = (offset, drift);
        }
        with_reserve(&mut draft, reserve);
        let scene = draft.scene();
        let most = stored_at_first(&scene) + scene.peers.len() as f64 * reserve;
        Injected::of(&scene, &run(&scene, Model::Least)).is_at_most(most)?;
    }

    /// With more energy than is ever asked for the force is that of average-position, to the bit.
    #[test]
    fn with_a_large_reserve_it_is_average_position(mut draft in springs(), damping in 0.0..8.0) {
        prop_assume!(!has_rates(&draft));
        (draft.gains.damping, draft.strategy) = (damping, Coordination::AveragePosition);
        let average = run(&draft.scene(), Model::Least);
        prop_assume!(average.ticks.iter().all(|tick| tick.object.position[0].abs() < 1e3));
        with_reserve(&mut draft, 1e9);
        prop_assert_eq!(run(&draft.scene(), Model::Least).ticks, average.ticks);
    }
}

/// The rule of the publication: F·v·h stands for the work of a tick, and an excess is given back through a variable damper at the next one.
struct ByVelocity {
    gains: Gains,
    taken: f64,
    given: f64,
    heard: f64,
    initial: f64,
    before: f64,
}

impl cohaptic_peer::Strategy<1> for ByVelocity {
    fn command(&mut self, context: &Context<'_, 1>) -> Command<1> {
        let (own, mean) = (context.own, context.held.mean());
        let v = own.velocity[0];
        let work = self.before * v * 1e-3;
        self.taken += work.max(0.0);
        self.given += (-work).max(0.0);
        let mut force = self.gains.stiffness * (own.position[0] - mean.position[0]) + self.gains.damping * (v - mean.velocity[0]);
        let available = self.initial + self.heard - self.given;
        // What is missing is dissipated by a damper, F = α·v with α = −A/(h·v²).
        if available < 0.0 && v != 0.0 {
            force += -available / (1e-3 * v * v) * v;
        }
        self.before = force;
        Command { force: [force], target: *mean }
    }

    fn kind(&self) -> SampleKind {
        SampleKind::Energy
    }

    fn extra(&mut self, _receiver: usize, _own: &State<1>, _held: &Held<1>) -> [f64; 1] {
        [self.taken]
    }

    fn accept(&mut self, _other: usize, numbers: &[f64; 1]) {
        self.heard = numbers[0];
    }

    fn set_gains(&mut self, gains: Gains) {
        self.gains = gains;
    }
}

struct Published;

impl Strategies for Published {
    type Strategy<const A: usize> = Box<dyn cohaptic_peer::Strategy<A>>;

    fn strategy<const A: usize>(&self, scene: &Scene, _peer: usize) -> Self::Strategy<A> {
        let gains = scene.coordination.gains;
        let rule = ByVelocity { gains, taken: 0.0, given: 0.0, heard: 0.0, initial: 0.0, before: 0.0 };
        let boxed: Box<dyn std::any::Any> = Box::new(Box::new(rule) as Box<dyn cohaptic_peer::Strategy<1>>);
        *boxed.downcast().expect("the scene has one axis")
    }
}

/// Two copies without damping over 24 ms: the rule of the publication counts work that was not done, and the copies fly apart; the exact one injects nothing.
#[test]
fn work_counted_by_the_velocity_at_the_tick_injects_energy() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/counterexamples/passivity-by-velocity.toml");
    let scene = Scene::read(&file, &[]).unwrap_or_else(|error| panic!("{error}"));
    let exact = Injected::of(&scene, &run(&scene, Model::Least));
    assert!(exact.peak() <= 1e-12, "{}", exact.peak());
    let published = Injected::of(&scene, &keep(&Simulation::with_strategies(&scene, Model::Least, Published)));
    assert!(published.peak() > 1.0, "{}", published.peak());
}
