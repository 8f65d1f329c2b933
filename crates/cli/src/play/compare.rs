//! Compares a finished part with two variants: replays the recorded hand in virtual time with the part's own strategy and links, with the other strategy,
//! and without a network. The answer has the curves of all three runs, for the page.

use std::convert::Infallible;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant as Clock};

use cohaptic_harness::live::{Inputs, replay};
use cohaptic_harness::{DIVERGED_DISTANCE, Ending, Observer, TickRow};
use cohaptic_scene::{PeerKind, link_keys_of_text};
use cohaptic_units::Instant;
use serde_json::{Value, json};

use super::scene::{PlayedScene, said};

/// Number of steps into which a record is divided, unless a step would then be shorter than 1 ms. Each curve has a value per step.
const VALUES: u64 = 600;

const AP: &str = "average-position";
const PD: &str = "proportional-derivative";

/// A finished part, with the file of the recorded inputs.
pub(super) struct Finished {
    pub(super) number: usize,
    pub(super) scene: PlayedScene,
    pub(super) inputs: PathBuf,
}

/// A variant of the part to replay.
struct Variant {
    name: &'static str,
    scene: PlayedScene,
    has_network: bool,
}

/// Replays the part in three variants, in parallel, and returns the curves of each as JSON.
///
/// The error is a text for the page: the record cannot be read, nothing was recorded, or a scene is refused.
pub(super) fn compare(finished: &Finished) -> Result<Value, String> {
    let began = Clock::now();
    let text = std::fs::read_to_string(&finished.inputs).map_err(|error| format!("{}: {error}", finished.inputs.display()))?;
    let scene = finished.scene.scene().map_err(|error| said(&error))?;
    let strategy = scene.coordination.strategy.name();
    let (other, other_name) = if strategy == AP { (PD, "PD") } else { (AP, "AP") };
    let own_name = match strategy {
        AP => "AP",
        PD => "PD",
        other => other,
    };
    let variants = [
        Variant { name: own_name, scene: finished.scene.clone(), has_network: true },
        Variant { name: other_name, scene: finished.scene.clone().with_strategy(other), has_network: true },
        Variant { name: "without network", scene: finished.scene.clone().without_network(), has_network: false },
    ];
    let keys = link_keys_of_text(&finished.scene.text(), finished.scene.file(), &[]).map_err(|error| said(&error))?;
    let inputs = Inputs::read(&text, &scene, &keys.into_values().next().unwrap_or_default());
    // The error may quote the content of files that the record names, and people at the page must not see the content.
    let inputs = inputs.map_err(|_| "the record of the part cannot be read again: `cohaptic run --inputs` says why".to_owned())?;
    let lasted = inputs.last_instant().unwrap_or(Instant::ZERO);
    if inputs.is_empty() || lasted == Instant::ZERO {
        return Err("nothing was recorded: move the cube, then compare".to_owned());
    }
    // The force is drawn for the busiest recorded device or, without a recorded device, for the first pointer of the scene.
    let hand = scene.peers.iter().position(|peer| matches!(peer.kind, PeerKind::Pointer(..))).unwrap_or(0);
    let hand = inputs.busiest_device().unwrap_or(hand);
    // A step of at least one millisecond also keeps the divisor in `on_tick` above zero.
    let step = Duration::from_nanos((lasted.as_nanos() / VALUES).max(1_000_000));
    let run = |variant: &Variant| curve(variant, &inputs, hand, step, lasted);
    let runs: Vec<Result<Value, String>> = thread::scope(|scope| {
        // Each replay has a thread of its own, because people wait for the answer.
        let threads: Vec<_> = variants.iter().map(|variant| scope.spawn(move || run(variant))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    Ok(json!({
        "part": finished.number,
        "lasted_s": lasted.as_secs_f64(),
        "step_s": step.as_secs_f64(),
        "hand": scene.peers[hand].name,
        "runs": runs.into_iter().collect::<Result<Vec<_>, _>>()?,
        "took_s": began.elapsed().as_secs_f64(),
        "command": "cohaptic run scene.toml --inputs inputs.csv",
    }))
}

/// Replays a variant, and returns the curves with the largest values as JSON. `lasted` is the length of the record.
fn curve(variant: &Variant, inputs: &Inputs, hand: usize, step: Duration, lasted: Instant) -> Result<Value, String> {
    let scene = variant.scene.scene().map_err(|error| said(&error))?;
    let mut curves = Curves::new(hand, step, scene.peers.len());
    let without_links;
    let inputs = if variant.has_network {
        inputs
    } else {
        without_links = inputs.without_links();
        &without_links
    };
    let Ok(summary) = replay(&scene, inputs, &mut curves);
    curves.end_instant();
    let ended = match summary.ending {
        Ending::Diverged(at) => Some(at),
        Ending::Complete | Ending::Interrupted(_) => None,
    };
    // The copies are apart before a number is not finite any more.
    let diverged = curves.apart.or(ended).map(Instant::as_secs_f64);
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    Ok(json!({
        "name": variant.name,
        "discrepancy_m": curves.discrepancy,
        "force_n": curves.force,
        "largest_discrepancy_m": largest(&curves.discrepancy),
        "largest_force_n": largest(&curves.force),
        // A divergence after the end of the record is left out, because the part itself did not last so long.
        "diverged_s": diverged.filter(|at| *at < lasted.as_secs_f64()),
    }))
}

/// Observer of a replay. Keeps, per step, the largest distance between two copies \[m\] and the largest coupling force on the hand \[N\].
struct Curves {
    /// Index of the peer of the force curve.
    hand: usize,
    step: Duration,
    /// Instant of the ticks seen last; `None` before the first tick.
    now: Option<Instant>,
    /// Last position of each copy \[m\], indexed by peer. NaN before the first tick of the peer.
    at: Vec<[f64; 3]>,
    discrepancy: Vec<f64>,
    force: Vec<f64>,
    /// First instant with two copies farther apart than a run may be that has not diverged.
    apart: Option<Instant>,
}

impl Curves {
    fn new(hand: usize, step: Duration, peers: usize) -> Self {
        Self { hand, step, now: None, at: vec![[f64::NAN; 3]; peers], discrepancy: Vec::new(), force: Vec::new(), apart: None }
    }

    /// Returns the index of the step with the instant `at`.
    fn place(&self, at: Instant) -> usize {
        usize::try_from(at.as_nanos() / u64::try_from(self.step.as_nanos()).unwrap_or(u64::MAX)).unwrap_or(usize::MAX)
    }

    /// Takes the distances at an instant, after all ticks of the instant. Called once more after the last tick.
    ///
    /// Peers tick one after the other within an instant. Between the ticks of two peers, a copy is a tick older than the next copy, and fast copies at the same
    /// place would look apart.
    fn end_instant(&mut self) {
        let Some(now) = self.now else { return };
        let pairs = self.at.iter().enumerate().flat_map(|(place, one)| self.at[..place].iter().map(move |other| (one, other)));
        let distances = pairs.map(|(one, other)| length(&[one[0] - other[0], one[1] - other[1], one[2] - other[2]]));
        // Distances to copies without a tick so far are NaN, and are left out.
        let most = distances.filter(|apart| !apart.is_nan()).fold(0.0, f64::max);
        if most > DIVERGED_DISTANCE {
            self.apart.get_or_insert(now);
        }
        let place = self.place(now);
        Self::raise(&mut self.discrepancy, place, most);
    }

    /// Raises the value of step `place` to at least `value`. Steps that do not exist yet begin at zero.
    fn raise(values: &mut Vec<f64>, place: usize, value: f64) {
        if values.len() <= place {
            values.resize(place + 1, 0.0);
        }
        values[place] = values[place].max(value);
    }
}

impl Observer for Curves {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        if self.now != Some(row.at) {
            self.end_instant();
            self.now = Some(row.at);
        }
        self.at[row.peer] = core::array::from_fn(|axis| row.object.position.get(axis).copied().unwrap_or(0.0));
        if row.peer == self.hand {
            let place = self.place(row.at);
            Self::raise(&mut self.force, place, length(row.coupling_force));
        }
        Ok(())
    }
}

/// Returns the length of a vector. The length of a vector with finite components does not overflow before the components do.
fn length(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::hypot)
}

#[cfg(test)]
mod tests {
    use cohaptic_harness::{Model, Simulation};
    use cohaptic_scene::Scene;

    use super::*;

    const SCENE: &str = r#"
        scene = { duration = "1s", count = 3 }
        object = { mass = 0.45 }
        coordination = { strategy = "proportional-derivative", stiffness = 2000.0, damping = 5.0, update = "8ms" }
        peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    "#;

    fn run(overrides: &[&str]) -> (Curves, cohaptic_harness::Summary) {
        let overrides: Vec<String> = overrides.iter().map(|key| (*key).to_owned()).collect();
        let scene = Scene::parse(SCENE, "scene.toml".as_ref(), &overrides).unwrap();
        let mut curves = Curves::new(0, Duration::from_millis(1), scene.peers.len());
        let Ok(summary) = Simulation::new(&scene, Model::General).run(&mut curves);
        curves.end_instant();
        (curves, summary)
    }

    fn largest(values: &[f64]) -> f64 {
        values.iter().copied().fold(0.0, f64::max)
    }

    /// Three equal peers that are pushed alike are at one place at every instant, however fast they go.
    #[test]
    fn copies_that_go_together_are_not_apart() {
        let (curves, summary) = run(&["peer.hand={ force = 20.0 }", "coordination.stiffness=100", "link.delay=8ms"]);
        assert!(summary.peers.iter().all(|peer| peer.velocity[0] > 0.5), "{summary:?}");
        assert_eq!((curves.discrepancy.len(), largest(&curves.discrepancy), curves.apart), (1000, 0.0, None));
        assert!(largest(&curves.force) > 1.0);
    }

    /// Along one axis the distance is what every run calls the largest discrepancy. The second spring is so stiff that the copies part.
    #[test]
    fn the_largest_distance_is_the_discrepancy_of_the_run() {
        for (stiffness, diverges) in [("coordination.stiffness=5000", false), ("coordination.stiffness=20000", true)] {
            let (curves, summary) = run(&["peers.peer1.hand={ force = 2.0 }", "link.delay=24ms", stiffness]);
            assert_eq!(largest(&curves.discrepancy).to_bits(), summary.max_discrepancy.to_bits(), "{stiffness}");
            assert_eq!((curves.apart.is_some(), summary.has_diverged()), (diverges, diverges), "{stiffness}: {}", summary.max_discrepancy);
        }
    }
}
