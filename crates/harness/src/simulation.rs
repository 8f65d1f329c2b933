//! Scenes in virtual time.

use cohaptic_peer::Strategy;
use cohaptic_peer::coordination::BuiltIn;
use cohaptic_scene::{Axes, FromScene, Scene, Strategies};
use cohaptic_units::Instant;

use crate::arrays::{self, Onlooker, Shape, Ticks};
use crate::disturbance::Disturbance;
use crate::observer::{AnyObserver, Ended, Erased, Observer};
use crate::plan::{Model, Plan};
use crate::questions::instants_between_questions;
use crate::rows::InstantRow;
use crate::summary::{Ending, Summary};
use crate::world::{NoRemote, Remote, Step, Watch, World};

/// A scene in virtual time, as fast as the processor allows.
///
/// Each instant has this order: changes of the timeline; ticking peers sample and send; arrived packets are applied; forces are computed; each ticking
/// peer moves to its next tick. Ties are broken by (instant, step, peer) and (instant, link, sequence).
#[derive(Debug)]
pub struct Simulation<'a, S = FromScene> {
    scene: &'a Scene,
    model: Model,
    /// Displacement of the initial states; `None` for the scene as written.
    disturbance: Option<Disturbance>,
    /// Largest number of threads of a run.
    threads: usize,
    strategies: S,
}

impl<'a> Simulation<'a> {
    /// Returns a scene ready to run with its own strategy.
    #[must_use]
    pub const fn new(scene: &'a Scene, model: Model) -> Self {
        Self { scene, model, disturbance: None, threads: 1, strategies: FromScene }
    }

    pub(crate) const fn disturbed(scene: &'a Scene, model: Model, disturbance: Disturbance) -> Self {
        Self { scene, model, disturbance: Some(disturbance), threads: 1, strategies: FromScene }
    }

    /// Like [`Simulation::run`], with an event loop compiled for this type of observer.
    pub(crate) fn run_compiled<O: Observer>(&self, observer: &mut O) -> Result<Summary, O::Error> {
        let plan = Plan::new(self.scene, self.model, observer.wants_ticks());
        Erased::run_as_itself(observer, |observer| self.run_in_arrays(&plan, observer).unwrap_or_else(|| self.run_with_events(&plan, observer)))
    }
}

impl<'a, S: Strategies> Simulation<'a, S> {
    /// Returns a scene ready to run with strategies of the caller instead of its own.
    #[must_use]
    pub const fn with_strategies(scene: &'a Scene, model: Model, strategies: S) -> Self {
        Self { scene, model, disturbance: None, threads: 1, strategies }
    }

    /// Sets the largest number of threads of a run. Threads are used only if they shorten the run. The result is the same to the bit for any number.
    #[must_use]
    pub const fn on_threads(self, threads: usize) -> Self
    where
        S: Copy,
    {
        Self { threads, ..self }
    }

    /// Runs the scene to its end, until its task [ends the run](cohaptic_scene::TaskEnd::Stop), until its numbers overflow, or until the observer ends the run.
    ///
    /// # Errors
    ///
    /// The error of the observer.
    ///
    /// # Panics
    ///
    /// If the scene needs events and has more than 23,170 peers; see [`crate::too_large`].
    pub fn run<O: Observer>(&self, observer: &mut O) -> Result<Summary, O::Error> {
        Erased::run(observer, |observer| {
            // The scene's own strategies have one compiled engine in this crate; only strategies of the caller compile another.
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

    /// Runs the scene in arrays. Returns `None` if the run needs events; the observer has then seen nothing.
    fn run_in_arrays(&self, plan: &Plan, observer: &mut AnyObserver<'_>) -> Option<Result<Summary, Ended>> {
        let watch = Watch::of(observer);
        let law = self.arrays(plan, watch)?;
        Some(self.run_in_lockstep(plan, law, watch, observer))
    }

    fn run_in_lockstep(&self, plan: &Plan, (shape, law): (Shape, BuiltIn), watch: Watch, observer: &mut AnyObserver<'_>) -> Result<Summary, Ended> {
        // Threads and groups meet at ticks of sending only and show no rows in between, so only a run without rows is divided.
        if watch == Watch::NOTHING {
            let threads = self.threads.clamp(1, shape.threads().0);
            if (threads > 1 || shape.pays_in_groups())
                // Groups notice a divergence only at their next meeting. The run is then repeated with all peers together, to find the instant.
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
            Axes::One => run_to_end(self.world::<1, _>(plan, NoRemote).stopping_with_task(self.scene), questions_of(self.scene), observer),
            Axes::Two | Axes::Three => {
                run_to_end(self.world::<3, _>(plan, NoRemote).stopping_with_task(self.scene), questions_of(self.scene), observer)
            }
        }
    }

    /// Returns the shape and the law of the scene if its run needs no events and only ticks and instants are watched; else `None`.
    fn arrays(&self, plan: &Plan, watch: Watch) -> Option<(Shape, BuiltIn)> {
        // A disturbance changes initial states that arrays read from the scene, and a full model asks for all events.
        let fits = watch.is_of_ticks() && self.disturbance.is_none() && self.model == Model::Least;
        if fits { Shape::of(self.scene, plan, &self.strategies).ok() } else { None }
    }

    pub(crate) fn world<const A: usize, E: Remote<A>>(&self, plan: &Plan, remote: E) -> World<A, S::Strategy<A>, E> {
        World::new(self.scene, plan, self.disturbance, remote, |peer| self.strategies.strategy(self.scene, peer))
    }
}

/// Runs a scene with its own strategy. Not generic, so the engine is compiled once, in this crate.
fn run_with_strategies_of_scene(simulation: &Simulation<'_>, observer: &mut AnyObserver<'_>) -> Result<Summary, Ended> {
    simulation.run_observed(observer)
}

/// Onlooker of a run in arrays. Passes rows to an observer and keeps its error.
struct Watching<'o, 'a> {
    observer: &'o mut AnyObserver<'a>,
    watch: Watch,
    /// First error of the observer.
    result: Result<(), Ended>,
}

impl Onlooker for Watching<'_, '_> {
    fn on_ticks(&mut self, ticks: &Ticks<'_>) {
        if self.watch.ticks {
            self.result = self.observer.on_ticks(ticks);
        }
    }

    fn on_instant(&mut self, row: &InstantRow) -> bool {
        // After an error of `on_ticks` at the same instant the observer gets no further row.
        if self.watch.instants && self.result.is_ok() {
            self.result = self.observer.on_instant(row);
        }
        self.result.is_ok()
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        self.observer.keep_going(now)
    }
}

/// Returns the number of instants between two calls of [`Observer::keep_going`] in a run with events.
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
        let mut instants = between_questions;
        while instants > 0 {
            match world.step(instants, observer, watch)? {
                Step::Ticked(computed) => instants -= computed,
                Step::Ended(ending) => return Ok(world.summary(ending)),
            }
        }
        // The latest step is complete, so the summary is consistent.
        if !observer.keep_going(world.now()) {
            return Ok(world.summary(Ending::Interrupted(world.now())));
        }
    }
}
