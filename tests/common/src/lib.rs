//! Property tests with one compiled runner.
//!
//! `proptest!` compiles a runner for each property: the loop over cases, the search for a smaller case, and the messages. [`properties!`] has the form of
//! `proptest!`, and gives all properties to one runner, which knows values and tests as trait objects. Strategies of arguments are boxed, so that properties
//! with arguments of the same types share their code too. Cases, seeds and the variables `PROPTEST_*` are those of `proptest!`.

use std::fmt;

use proptest::prelude::{ProptestConfig, Strategy};
use proptest::strategy::BoxedStrategy;
use proptest::test_runner::{RngSeed, TestCaseResult, TestRunner, contextualize_config};

#[doc(hidden)]
pub use proptest;

/// The variable of the environment with which a property test draws all of its cases. `.ci/nightly` sets it.
pub const ALL_CASES_VARIABLE: &str = "COHAPTIC_TEST_ALL_CASES";

/// Returns whether all cases are asked for, by [`ALL_CASES_VARIABLE`].
#[must_use]
pub fn are_all() -> bool {
    std::env::var_os(ALL_CASES_VARIABLE).is_some()
}

/// Returns `all` draws, ticks, packets or milliseconds of a test if [`ALL_CASES_VARIABLE`] is set, and a quarter of them otherwise.
#[must_use]
pub fn quarter_by_day(all: u64) -> u64 {
    if are_all() { all } else { all.div_ceil(4) }
}

/// Returns the configuration of a property test that leaves no files behind. The test draws `count` cases if [`ALL_CASES_VARIABLE`] is set, and the first
/// quarter of these cases otherwise.
#[must_use]
pub fn cases(count: u32) -> ProptestConfig {
    let cases = if are_all() { count } else { count.div_ceil(4) };
    ProptestConfig { cases, failure_persistence: None, max_shrink_iters: 400, ..ProptestConfig::default() }
}

/// Returns the configuration of [`cases`] that are the same at every run.
#[must_use]
pub fn same_cases(count: u32, seed: u64) -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(seed), ..cases(count) }
}

/// Declares property tests in the form of `proptest!`.
///
/// Arguments are `PATTERN in STRATEGY` or `NAME: TYPE`, at most twelve. `#![proptest_config(CONFIG)]` at the begin sets the configuration of all tests.
#[macro_export]
macro_rules! properties {
    (@arguments $test:tt [$($known:tt)*] $argument:ident: $kind:ty $(, $($rest:tt)*)?) => {
        $crate::properties!(@arguments $test [$($known)* ($argument, $crate::proptest::arbitrary::any::<$kind>())] $($($rest)*)?)
    };
    (@arguments $test:tt [$($known:tt)*] $argument:pat in $strategy:expr $(, $($rest:tt)*)?) => {
        $crate::properties!(@arguments $test [$($known)* ($argument, $strategy)] $($($rest)*)?)
    };
    (@arguments ($config:expr, $name:ident, $body:block) [$(($argument:pat, $strategy:expr))+]) => {
        $crate::check(
            $config,
            [::core::concat!(::core::module_path!(), "::", ::core::stringify!($name)), ::core::file!(), ::core::stringify!($($argument),+)],
            ($($crate::proptest::strategy::Strategy::boxed($strategy),)+),
            |($($argument,)+)| {
                let () = $body;
                ::core::result::Result::Ok(())
            },
        )
    };
    (#![proptest_config($config:expr)] $($(#[$meta:meta])* fn $name:ident($($arguments:tt)+) $body:block)*) => {$(
        $(#[$meta])*
        fn $name() {
            $crate::properties!(@arguments ($config, $name, $body) [] $($arguments)+)
        }
    )*};
    ($($(#[$meta:meta])* fn $name:ident $arguments:tt $body:block)*) => {
        $crate::properties! {
            #![proptest_config($crate::proptest::test_runner::Config::default())]
            $($(#[$meta])* fn $name $arguments $body)*
        }
    };
}

/// Values of a case, and the test of the values.
trait Case: fmt::Debug {
    fn test(self: Box<Self>) -> TestCaseResult;
}

struct Drawn<V> {
    /// Patterns of the arguments, in the order of the values.
    arguments: &'static str,
    values: V,
    test: fn(V) -> TestCaseResult,
}

impl<V: fmt::Debug> fmt::Debug for Drawn<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}) = ", self.arguments)?;
        self.values.fmt(f)
    }
}

impl<V: fmt::Debug> Case for Drawn<V> {
    fn test(self: Box<Self>) -> TestCaseResult {
        (self.test)(self.values)
    }
}

/// Tests a property on drawn values. The texts are the name of the test with its module, the source file, and the patterns of the arguments.
///
/// # Panics
///
/// With the smallest case found that fails, or if the strategy draws no values.
pub fn check<S: Strategy<Value: 'static> + 'static>(
    config: ProptestConfig,
    texts: [&'static str; 3],
    strategy: S,
    test: fn(S::Value) -> TestCaseResult,
) {
    let [name, file, arguments] = texts;
    let cases = strategy.prop_map(move |values| -> Box<dyn Case> { Box::new(Drawn { arguments, values, test }) }).boxed();
    run(ProptestConfig { test_name: Some(name), source_file: Some(file), ..contextualize_config(config) }, &cases);
}

/// Not generic: the only compiled runner.
#[expect(clippy::panic, reason = "a test that fails panics")]
fn run(config: ProptestConfig, cases: &BoxedStrategy<Box<dyn Case>>) {
    let mut runner = TestRunner::new(config);
    if let Err(error) = runner.run(cases, |case| case.test()) {
        panic!("{error}\n{runner}");
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    fn cases(cases: u32) -> ProptestConfig {
        ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
    }

    #[test]
    fn by_day_a_quarter_of_the_cases_is_drawn_and_never_none() {
        let share = if crate::are_all() { 1 } else { 4 };
        assert_eq!(crate::cases(400).cases, 400 / share);
        assert_eq!(crate::cases(1).cases, 1);
    }

    properties! {
        #![proptest_config(cases(40))]

        #[test]
        fn arguments_have_patterns_and_types(number in 3..9_u32, flag: bool, (low, mut high) in (0..5_u8, 5..9_u8)) {
            high -= u8::from(flag);
            prop_assume!(low != high);
            prop_assert!((3..9).contains(&number) && low < high);
        }

        #[test]
        #[should_panic(expected = "minimal failing input: (number, _) = (\n    10,\n    0,\n)")]
        fn a_failure_names_the_smallest_case(number in 0..1000_u32, _ in 0..3_u32) {
            prop_assert!(number < 10);
        }

        #[test]
        #[should_panic(expected = "the numbers differ")]
        fn a_panic_is_a_failure(number in Just(1_u8)) {
            assert_eq!(number, 2, "the numbers differ");
        }
    }

    properties! {
        #[test]
        fn the_configuration_may_be_left_out(text in "[a-c]{1,3}") {
            prop_assert!(text.len() <= 3 && !text.contains('d'));
        }
    }
}
