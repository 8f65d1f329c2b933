//! A scene in virtual time.

use cohaptic_peer::Strategy;
use cohaptic_peer::coordination::BuiltIn;
use cohaptic_scene::{Axes, FromScene, Scene, Strategies};
use cohaptic_units::Instant;

use crate::arrays::{self, Onlooker, Shape, Ticks};
use crate::disturbance::Disturbance;
use crate::measures::Measures;
use crate::observer::{AnyObserver, Ended, Erased, InstantRow, Observer, instants_between_questions};
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

    /// [`Simulation::run`], with loops of events that are compiled for measures.
    pub(crate) fn run_measured(&self, measures: &mut Measures) -> Summary {
        let plan = Plan::new(self.scene, self.model, measures.wants_ticks());
        let run = |observer: &mut Erased<'_, Measures>| self.run_in_arrays(&plan, observer).unwrap_or_else(|| self.run_with_events(&plan, observer));
        let Ok(summary) = Erased::run_as_itself(measures, run);
        summary
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
        Erased::run(observer, |observer| {
            if S::OF_SCENE {
                let Self { scene, model, disturbance, threads, .. } = *self;
                run_with_strategies_of_scene(&Simulation { scene, model, disturbance, threads, strategies: FromScene }, observer)
            } else {
                self.run_observed(observer)
            }
        })
    }

    fn run_observed(&self, observer: &mut AnyObserver<'_>) -> Result<Summary, Ended> {
        let plan = Plan::new(self.scene, self.model, observer.wants_ticks());
        self.run_in_arrays(&plan, observer).unwrap_or_else(|| self.run_with_events(&plan, observer))
    }

    /// `None` if the run needs events: the observer has seen nothing.
    fn run_in_arrays(&self, plan: &Plan, observer: &mut AnyObserver<'_>) -> Option<Result<Summary, Ended>> {
        let watch = Watch::of(observer);
        let law = self.arrays(plan, watch)?;
        Some(self.run_in_lockstep(plan, law, watch, observer))
    }

    fn run_in_lockstep(&self, plan: &Plan, (shape, law): (Shape, BuiltIn), watch: Watch, observer: &mut AnyObserver<'_>) -> Result<Summary, Ended> {
        if watch == Watch::NOTHING {
            let threads = self.threads.clamp(1, shape.threads().0);
            if (threads > 1 || shape.pays_in_groups())
                // Groups that diverge know it later than it happens: then all run together from the beginning.
                && let Some(summary) = arrays::run_on_threads(self.scene, &shape, law, threads, &mut |now| observer.keep_going(now))
            {
                return Ok(summary);
            }
            return Ok(arrays::run(self.scene, shape, law, &mut |now| observer.keep_going(now)));
        }
        let mut watching = Watching { observer, watch, result: Ok(()) };
        let summary = arrays::run_watched(self.scene, (shape, law), plan, &mut watching);
        watching.result?;
        Ok(summary)
    }

    fn run_with_events(&self, plan: &Plan, observer: &mut (impl Observer<Error = Ended> + ?Sized)) -> Result<Summary, Ended> {
        match plan.axes {
            Axes::One => run_to_end(self.world::<1, _>(plan, NoRemote), questions_of(self.scene), observer),
            Axes::Two | Axes::Three => run_to_end(self.world::<3, _>(plan, NoRemote), questions_of(self.scene), observer),
        }
    }

    /// The shape of the scene, if it needs no events and nobody watches more than ticks and instants.
    fn arrays(&self, plan: &Plan, watch: Watch) -> Option<(Shape, BuiltIn)> {
        let fits = watch.is_of_ticks() && self.disturbance.is_none() && self.model == Model::Least;
        if fits { Shape::of(self.scene, plan, &self.strategies).ok() } else { None }
    }

    pub(crate) fn world<const A: usize, E: Remote<A>>(&self, plan: &Plan, remote: E) -> World<A, S::Strategy<A>, E> {
        World::new(self.scene, plan, self.disturbance, remote, |peer| self.strategies.strategy(self.scene, peer))
    }
}

/// A run with the strategy that its scene names: compiled here, once for all crates.
fn run_with_strategies_of_scene(simulation: &Simulation<'_>, observer: &mut AnyObserver<'_>) -> Result<Summary, Ended> {
    simulation.run_observed(observer)
}

/// An observer of a run in arrays, and whether it has ended the run.
struct Watching<'o, 'a> {
    observer: &'o mut AnyObserver<'a>,
    watch: Watch,
    result: Result<(), Ended>,
}

impl Onlooker for Watching<'_, '_> {
    fn on_ticks(&mut self, ticks: &Ticks<'_>) {
        if self.watch.ticks {
            self.result = self.observer.on_ticks(ticks);
        }
    }

    fn on_instant(&mut self, row: &InstantRow) -> bool {
        if self.watch.instants && self.result.is_ok() {
            self.result = self.observer.on_instant(row);
        }
        self.result.is_ok()
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        self.observer.keep_going(now)
    }
}

/// Instants between two calls of [`Observer::keep_going`] in a run with events.
pub(crate) fn questions_of(scene: &Scene) -> u32 {
    let peers = scene.peers.len();
    let links = scene.topology.as_ref().map_or_else(|| peers.saturating_mul(peers), |topology| topology.links());
    instants_between_questions(links.max(peers))
}

fn run_to_end<const A: usize, S: Strategy<A>>(
    mut world: World<A, S>,
    between_questions: u32,
    observer: &mut (impl Observer<Error = Ended> + ?Sized),
) -> Result<Summary, Ended> {
    let watch = Watch::of(observer);
    loop {
        for _ in 0..between_questions {
            if let Step::Ended(ending) = world.step(observer, watch)? {
                return Ok(world.summary(ending));
            }
        }
        if !observer.keep_going(world.now()) {
            return Ok(world.summary(Ending::Interrupted(world.now())));
        }
    }
}
