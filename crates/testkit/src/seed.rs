//! The seed of a test.

use std::thread;

/// This variable of the environment sets the seed of every test bed of a process, whatever the tests say.
pub const SEED_VARIABLE: &str = "COHAPTIC_TEST_SEED";

/// The seed of a test, and where it is from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Seed {
    pub(crate) value: u64,
    pub(crate) test: String,
}

impl Seed {
    /// What the environment says; what the test says; else one that is made of the test's name, so that it is the same in every run, and another for every test.
    ///
    /// # Panics
    ///
    /// If what the environment says is no number.
    pub(crate) fn choose(said: Option<u64>) -> Self {
        let value = std::env::var(SEED_VARIABLE).ok();
        Self::of(value.as_deref(), said, thread::current().name().unwrap_or("main"))
    }

    #[expect(clippy::panic, reason = "a test that is not run with the seed that was asked for is worse than none")]
    fn of(environment: Option<&str>, said: Option<u64>, test: &str) -> Self {
        let asked =
            environment.map(|text| number(text).unwrap_or_else(|| panic!("{SEED_VARIABLE} is `{text}`; expected a number from 0 to {}", u64::MAX)));
        Self { value: asked.or(said).unwrap_or_else(|| hash(test.as_bytes())), test: test.to_owned() }
    }

    /// What to do to see it again.
    pub(crate) fn advice(&self) -> String {
        format!("test bed of `{}`: seed {}; {SEED_VARIABLE}={} runs it again", self.test, self.value, self.value)
    }
}

/// A seed as it is written: decimal, or hexadecimal after `0x`.
pub(crate) fn number(text: &str) -> Option<u64> {
    text.strip_prefix("0x").map_or_else(|| text.parse().ok(), |digits| u64::from_str_radix(digits, 16).ok())
}

/// FNV-1a: the same everywhere and for ever.
pub(crate) fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_comes_before_the_test_and_the_test_before_its_name() {
        assert_eq!(Seed::of(Some("7"), Some(8), "a").value, 7);
        assert_eq!(Seed::of(Some("0xff"), None, "a").value, 255);
        assert_eq!(Seed::of(None, Some(8), "a").value, 8);
        // FNV's own vector.
        assert_eq!(Seed::of(None, None, "a").value, 0xaf63_dc4c_8601_ec8c);
        assert_eq!(
            Seed::of(None, None, "a").advice(),
            "test bed of `a`: seed 12638187200555641996; COHAPTIC_TEST_SEED=12638187200555641996 runs it again"
        );
    }

    #[test]
    #[should_panic(expected = "COHAPTIC_TEST_SEED is `seven`; expected a number")]
    fn a_seed_that_is_none_is_refused() {
        Seed::of(Some("seven"), None, "a");
    }
}
