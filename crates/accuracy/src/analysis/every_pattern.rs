//! The exact probability of an event of a short scene: every pattern of losses, each with its probability.

use std::sync::Arc;

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_scene::{LinkTable, Scene};
use cohaptic_wan::{Delay, LinkConfig, LinkModel, Loss, Pattern};

use crate::AccuracyError;

/// How probable a loss is.
pub(super) const LOSS: f64 = 0.2;
/// The event is that objects are further apart than this \[m\].
pub(super) const LIMIT: f64 = 0.0125;
/// Samples of each link that arrive before the end.
const SAMPLES: u32 = 7;

/// Two peers that begin to move apart, over links of 16 ms that lose every fifth sample: 64 ms of it.
///
/// Seven samples of each link, sent at 0, 8, … 48 ms, arrive until the end; a sample sent later arrives after it and cannot count.
const SCENE: &str = r#"
    scene        = { duration = "64ms", count = 2 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1800.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "16ms", loss = "20%" }

    [[peers]]
    name = "peer1"
    velocity = -0.5
    [[peers]]
    name = "peer2"
    velocity = 0.5
"#;

pub(super) fn scene() -> Result<Scene, AccuracyError> {
    Ok(Scene::parse(SCENE, "monte-carlo.toml".as_ref(), &[])?)
}

/// Whether the copies were ever further apart than the limit.
pub(super) fn happens(scene: &Scene) -> bool {
    let Ok(summary) = Simulation::new(scene, Model::Least).run(&mut NoObserver);
    summary.max_discrepancy > LIMIT
}

/// What all patterns come to.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Exact {
    /// The probability of the event.
    pub(super) probability: f64,
    /// The probability of all patterns together: 1, but for rounding.
    pub(super) all: f64,
    pub(super) patterns: u32,
}

/// Runs the scene once for every pattern of losses.
pub(super) fn exact(scene: &Scene, mut check: impl FnMut() -> Result<(), AccuracyError>) -> Result<Exact, AccuracyError> {
    let links: Vec<Arc<LinkModel>> = (0..1_u32 << SAMPLES).map(|lost| Arc::new(losing(scene, lost))).collect();
    let mut scene = scene.clone();
    let patterns = 1 << (2 * SAMPLES);
    let mut exact = Exact { probability: 0.0, all: 0.0, patterns };
    for pattern in 0..patterns {
        let [one, other] = [pattern >> SAMPLES, pattern & ((1 << SAMPLES) - 1)].map(|lost| Arc::clone(&links[lost as usize]));
        scene.links = LinkTable::new(2, one, [((1, 0), other)]);
        let lost = pattern.count_ones();
        let weight = LOSS.powi(lost.cast_signed()) * (1.0 - LOSS).powi((2 * SAMPLES - lost).cast_signed());
        exact.all += weight;
        if happens(&scene) {
            exact.probability += weight;
        }
        if pattern.is_multiple_of(256) {
            check()?;
        }
    }
    Ok(exact)
}

/// The link of the scene, but that it loses those of its first samples whose bits are set, and no other.
fn losing(scene: &Scene, lost: u32) -> LinkModel {
    let chosen = (0..SAMPLES).filter(|sample| lost >> sample & 1 == 1).map(|sample| u64::from(sample)..u64::from(sample) + 1).collect();
    let loss = Pattern::of_packets(chosen, None).map_or(Loss::None, Loss::Pattern);
    let delay = Delay::constant(scene.links.between(0, 1).mean_delay());
    LinkConfig { loss, delay, ..LinkConfig::default() }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest discrepancy when both links lose these samples.
    fn discrepancy(lost: Option<std::ops::Range<u64>>) -> f64 {
        let mut scene = scene().unwrap();
        let loss = Loss::Pattern(Pattern::of_packets(lost.into_iter().collect(), None).unwrap());
        let delay = Delay::constant(scene.links.between(0, 1).mean_delay());
        scene.links = LinkTable::uniform(2, LinkConfig { loss, delay, ..LinkConfig::default() });
        let Ok(summary) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
        summary.max_discrepancy
    }

    /// Else there would be more patterns than are run.
    #[test]
    fn what_is_sent_after_the_samples_that_are_counted_changes_nothing() {
        let samples = u64::from(SAMPLES);
        assert_eq!(discrepancy(None).to_bits(), discrepancy(Some(samples..samples + 100)).to_bits());
        assert!(discrepancy(None) < discrepancy(Some(3..4)), "and what is lost before does change something");
    }

    /// The scene that is left to chance loses what the probability says: 50,000 runs with seeds that no row has, within four standard errors, which happens
    /// by chance once in 16,000 choices of seeds.
    #[test]
    fn the_exact_probability_is_that_of_the_scene() {
        let mut scene = scene().unwrap();
        let exact = exact(&scene, || Ok(())).unwrap().probability;
        let (runs, mut count) = (50_000_u32, 0_u32);
        for run in 0..runs {
            scene.seed = 1_000_000 + u64::from(run);
            count += u32::from(happens(&scene));
        }
        let share = f64::from(count) / f64::from(runs);
        assert!((share - exact).abs() < 4.0 * (exact * (1.0 - exact) / f64::from(runs)).sqrt(), "{share} for {exact}");
    }
}
