//! Random links and networks: their text, the drawn values, and the results of shrinking.

mod bounds;
mod drawn;
#[cfg(feature = "scenes")]
mod scenes;
mod shrink_link;
mod shrink_network;
mod text;

use std::cell::Cell;

use cohaptic_testkit::proptest::strategy::{Strategy, ValueTree};
use cohaptic_testkit::proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};

/// Returns a runner whose draws depend on the seed alone.
pub(crate) fn runner(seed: u64, cases: u32) -> TestRunner {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let config = Config { cases, failure_persistence: None, max_shrink_iters: 10_000, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &bytes))
}

/// Returns the first `count` values that a strategy draws.
pub(crate) fn sample<S: Strategy>(strategy: &S, seed: u64, count: u32) -> Vec<S::Value> {
    let mut runner = runner(seed, count);
    (0..count).map(|_| strategy.new_tree(&mut runner).unwrap().current()).collect()
}

/// First failing value of a property test, and the value to which the runner shrinks it.
pub(crate) struct Shrunk<V> {
    pub(crate) first: V,
    pub(crate) least: V,
    /// Number of calls of the test while shrinking.
    pub(crate) asked: u32,
}

/// Runs a property test that fails for the values for which `fails` is true. Returns `None` if no drawn value fails.
pub(crate) fn shrink<S: Strategy>(strategy: &S, seed: u64, fails: impl Fn(&S::Value) -> bool) -> Option<Shrunk<S::Value>>
where
    S::Value: Clone,
{
    let (first, asked) = (Cell::new(None), Cell::new(0));
    let result = runner(seed, 2_000).run(strategy, |value| {
        let found = first.take();
        if found.is_some() {
            asked.set(asked.get() + 1);
        }
        let failed = fails(&value);
        first.set(found.or_else(|| failed.then_some(value)));
        if failed { Err(TestCaseError::fail("planted")) } else { Ok(()) }
    });
    match result {
        Ok(()) => None,
        Err(TestError::Fail(_, least)) => Some(Shrunk { first: first.take().unwrap(), least, asked: asked.get() }),
        Err(TestError::Abort(reason)) => panic!("{reason}"),
    }
}
