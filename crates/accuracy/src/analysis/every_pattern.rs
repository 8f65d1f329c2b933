//! Exact probability of an event in a short scene: the sum over all patterns of losses, each with its probability.

use std::sync::Arc;

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_scene::{LinkTable, Scene};
use cohaptic_wan::{Delay, LinkConfig, LinkModel, Loss, Pattern};

use crate::AccuracyError;

/// Probability of a loss.
pub(super) const LOSS: f64 = 0.2;
/// Discrepancy \[m\] above which the event happens.
pub(super) const LIMIT: f64 = 0.0125;
/// Number of samples of each link that arrive before the end.
const SAMPLES: u32 = 7;

/// Two peers that begin to move apart, over links of 16 ms that lose every fifth sample, for 64 ms.
///
/// Seven samples of each link, sent at 0, 8, … 48 ms, arrive before the end. A later sample arrives after the end and cannot count.
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

/// Returns the scene.
pub(super) fn scene() -> Result<Scene, AccuracyError> {
    Ok(Scene::parse(SCENE, "monte-carlo.toml".as_ref(), &[])?)
}

/// Returns whether the copies were further apart than the limit at any tick.
pub(super) fn happens(scene: &Scene) -> bool {
    let Ok(summary) = Simulation::new(scene, Model::Least).run(&mut NoObserver);
    summary.max_discrepancy > LIMIT
}

/// Result over all patterns.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Exact {
    /// Probability of the event.
    pub(super) probability: f64,
    /// Probability of all patterns together: 1, except for rounding.
    pub(super) all: f64,
    /// Number of patterns.
    pub(super) patterns: u32,
}

/// Runs the scene once for every pattern of losses.
pub(super) fn exact(scene: &Scene, mut check: impl FnMut() -> Result<(), AccuracyError>) -> Result<Exact, AccuracyError> {
    // Each link has 2⁷ patterns, and both links together 2¹⁴: link models are made once per pattern of one link.
    let links: Vec<Arc<LinkModel>> = (0..1_u32 << SAMPLES).map(|lost| Arc::new(losing(scene, lost))).collect();
    let mut scene = scene.clone();
    let patterns = 1 << (2 * SAMPLES);
    let mut exact = Exact { probability: 0.0, all: 0.0, patterns };
    for pattern in 0..patterns {
        let [one, other] = [pattern >> SAMPLES, pattern & ((1 << SAMPLES) - 1)].map(|lost| Arc::clone(&links[lost as usize]));
        // The upper bits belong to the link from peer 0 to peer 1, the lower bits to the link back.
        scene.links = LinkTable::new(2, one, [((1, 0), other)]);
        let lost = pattern.count_ones();
        // Losses are independent, so the probability of a pattern is a product over its samples.
        let weight = LOSS.powi(lost.cast_signed()) * (1.0 - LOSS).powi((2 * SAMPLES - lost).cast_signed());
        exact.all += weight;
        if happens(&scene) {
            exact.probability += weight;
        }
        // 256 runs take less time than a user waits for the end, so the watcher need not be asked after each run.
        if pattern.is_multiple_of(256) {
            check()?;
        }
    }
    Ok(exact)
}

/// Returns the link of the scene with another loss: the link loses exactly the early samples with a set bit in `lost`.
fn losing(scene: &Scene, lost: u32) -> LinkModel {
    let chosen = (0..SAMPLES).filter(|sample| lost >> sample & 1 == 1).map(|sample| u64::from(sample)..u64::from(sample) + 1).collect();
    let loss = Pattern::of_packets(chosen, None).map_or(Loss::None, Loss::Pattern);
    let delay = Delay::constant(scene.links.between(0, 1).mean_delay());
    LinkConfig { loss, delay, ..LinkConfig::default() }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the largest discrepancy when both links lose these samples.
    fn discrepancy(lost: Option<std::ops::Range<u64>>) -> f64 {
        let mut scene = scene().unwrap();
        let loss = Loss::Pattern(Pattern::of_packets(lost.into_iter().collect(), None).unwrap());
        let delay = Delay::constant(scene.links.between(0, 1).mean_delay());
        scene.links = LinkTable::uniform(2, LinkConfig { loss, delay, ..LinkConfig::default() });
        let Ok(summary) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
        summary.max_discrepancy
    }

    /// If later samples mattered, there would be more patterns than this module runs.
    #[test]
    fn what_is_sent_after_the_samples_that_are_counted_changes_nothing() {
        let samples = u64::from(SAMPLES);
        assert_eq!(discrepancy(None).to_bits(), discrepancy(Some(samples..samples + 100)).to_bits());
        assert!(discrepancy(None) < discrepancy(Some(3..4)), "and what is lost before does change something");
    }

    /// The scene with random losses has the computed probability: 50,000 runs with seeds of no row, within four standard errors, which fails by chance for
    /// one of 16,000 choices of seeds.
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
