//! A scene in virtual time.

use cohaptic_peer::Strategy;
use cohaptic_peer::coordination::BuiltIn;
use cohaptic_scene::{Axes, FromScene, Scene, Strategies};
use cohaptic_units::Instant;

use crate::arrays::{self, Shape};
use crate::disturbance::Disturbance;
use crate::observer::{INSTANTS_BETWEEN_QUESTIONS, Observer};
use crate::plan::{Model, Plan};
use crate::summary::{Ending, Summary};
use crate::world::{NoRemote, Remote, Step, Watch, World};

/// A scene in virtual time, as fast as the processor goes.
///
/// At one instant, in this order: changes of the timeline; peers that tick sample and send; packets that have arrived are applied; forces are
/// computed; each peer that ticks moves to the next tick. Ties are broken by (instant, step, peer) and (instant, link, sequence).
#[derive(Debug)]
pub struct Simulation<'a, S = FromScene> {
    scene: &'a Scene,
    model: Model,
    disturbance: Option<Disturbance>,
    threads: usize,
    strategies: S,
}

impl<'a> Simulation<'a> {
    /// A scene that is ready to run with the strategy that it names.
    #[must_use]
    pub const fn new(scene: &'a Scene, model: Model) -> Self {
        Self { scene, model, disturbance: None, threads: 1, strategies: FromScene }
    }

    pub(crate) const fn disturbed(scene: &'a Scene, model: Model, disturbance: Disturbance) -> Self {
        Self { scene, model, disturbance: Some(disturbance), threads: 1, strategies: FromScene }
    }
}

impl<'a, S: Strategies> Simulation<'a, S> {
    /// A scene that is ready to run with strategies of the caller's own in place of the one that it names.
    #[must_use]
    pub const fn with_strategies(scene: &'a Scene, model: Model, strategies: S) -> Self {
        Self { scene, model, disturbance: None, threads: 1, strategies }
    }

    /// Takes up to that number of threads for a run, where they pay: the same to the bit for any number.
    #[must_use]
    pub const fn on_threads(self, threads: usize) -> Self
    where
        S: Copy,
    {
        Self { threads, ..self }
    }

    /// Runs the scene from its beginning to its end, until it diverges, or until the observer ends it.
    ///
    /// # Errors
    ///
    /// What the observer's error is.
    ///
    /// # Panics
    ///
    /// If the scene needs events and has more than 23,170 peers; see [`crate::too_large`].
    pub fn run<O: Observer>(&self, observer: &mut O) -> Result<Summary, O::Error> {
        let plan = Plan::new(self.scene, self.model, observer.wants_ticks());
        if let Some((shape, law)) = self.arrays(&plan, Watch::of(observer)) {
            let threads = self.threads.min(shape.threads().0);
            if threads > 1
                && let Some(summary) = arrays::run_on_threads(self.scene, &shape, law, threads, &mut |now| observer.keep_going(now))
            {
                return Ok(summary);
            }
            let looks_ahead = shape.looks_ahead();
            let summary = arrays::run(self.scene, shape, law, &mut |now| observer.keep_going(now));
            // The counters of queues that have looked ahead are those of a later instant.
            let has_looked_too_far = looks_ahead && matches!(summary.ending, Ending::Diverged(at) if at - Instant::ZERO < self.scene.duration);
            if !has_looked_too_far {
                return Ok(summary);
            }
        }
        match plan.axes {
            Axes::One => run_to_end(self.world::<1, _>(&plan, NoRemote), observer),
            Axes::Two => run_to_end(self.world::<2, _>(&plan, NoRemote), observer),
            Axes::Three => run_to_end(self.world::<3, _>(&plan, NoRemote), observer),
        }
    }

    /// The shape of the scene, if it needs no events and nobody watches.
    fn arrays(&self, plan: &Plan, watch: Watch) -> Option<(Shape, BuiltIn)> {
        let is_unseen = watch == Watch::NOTHING && self.disturbance.is_none() && self.model == Model::Least;
        if is_unseen { Shape::of(self.scene, plan, &self.strategies) } else { None }
    }

    pub(crate) fn world<const A: usize, E: Remote<A>>(&self, plan: &Plan, remote: E) -> World<A, S::Strategy<A>, E> {
        World::new(self.scene, plan, self.disturbance, remote, |peer| self.strategies.strategy(self.scene, peer))
    }
}

fn run_to_end<const A: usize, S: Strategy<A>, O: Observer>(mut world: World<A, S>, observer: &mut O) -> Result<Summary, O::Error> {
    let watch = Watch::of(observer);
    loop {
        for _ in 0..INSTANTS_BETWEEN_QUESTIONS {
            if let Step::Ended(ending) = world.step(observer, watch)? {
                return Ok(world.summary(ending));
            }
        }
        if !observer.keep_going(world.now()) {
            return Ok(world.summary(Ending::Interrupted(world.now())));
        }
    }
}
