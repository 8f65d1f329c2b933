//! Clocks and random numbers of the standard library and of libraries of C.

use super::Testbed;
use crate::settings::Standard;

/// Name of the environment variable that switches the clocks and random numbers of this file on for a loopback of `COHAPTIC_TEST_LOOPBACK`.
#[cfg(feature = "loopback")]
const VARIABLE: &str = "COHAPTIC_TEST_STD";

impl Testbed {
    /// Lets the clocks of the standard library follow virtual time, where the package written by `cohaptic tokio` catches the calls of the system:
    /// `std::time::Instant::now` and `std::time::SystemTime::now`. The day of every run begins at midnight UTC of the first of January 2027. Threads without a
    /// test bed read the clocks of the system.
    pub const fn std_clocks(mut self) -> Self {
        self.setup.settings.standard.clocks = true;
        self
    }

    /// Lets random numbers of the system (`getrandom`) come from the seed, where the package written by `cohaptic tokio` catches the calls of the system. A
    /// generator that was seeded before the run, such as that of `std::collections::HashMap` on a thread, stays as it is.
    pub const fn std_random(mut self) -> Self {
        self.setup.settings.standard.random = true;
        self
    }

    /// Returns the calls of these methods on this test bed.
    pub(super) fn standard_calls(&self) -> impl Iterator<Item = String> + use<> {
        let Standard { clocks, random } = self.setup.settings.standard;
        let calls = [clocks.then_some(".std_clocks()"), random.then_some(".std_random()")];
        calls.into_iter().flatten().map(str::to_owned)
    }

    /// Switches on the parts that the environment names.
    ///
    /// # Panics
    ///
    /// If the variable has another word than `clocks` and `random`.
    #[cfg(feature = "loopback")]
    #[expect(clippy::panic, reason = "tests on another system than the one that was asked for are worse than none")]
    pub(super) fn with_standard_of_environment(self) -> Self {
        let words = std::env::var(VARIABLE).unwrap_or_default();
        words.split_whitespace().fold(self, |bed, word| match word {
            "clocks" => bed.std_clocks(),
            "random" => bed.std_random(),
            _ => panic!("{VARIABLE} says `{word}`: expected `clocks`, `random`, or both with a blank between"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_printed_test_has_the_calls() {
        let bed = Testbed::new(["a"]);
        assert_eq!(bed.standard_calls().count(), 0);
        let calls: Vec<String> = bed.std_random().std_clocks().standard_calls().collect();
        assert_eq!(calls, [".std_clocks()", ".std_random()"]);
    }
}
