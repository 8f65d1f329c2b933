//! Seed of a test.

use std::any::type_name;
use std::fmt;
use std::panic::Location;
use std::thread;

/// Name of the environment variable for the seed of every test bed of a process. The variable takes precedence over the seeds of the tests.
pub const SEED_VARIABLE: &str = "COHAPTIC_TEST_SEED";

/// Seed of a test, and its origin.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Seed {
    pub(crate) value: u64,
    pub(crate) test: String,
    /// `true` if the seed is derived from the place. The failed test then fails again as it stands.
    pub(crate) is_of_place: bool,
}

impl Seed {
    /// Chooses the seed: from the environment, otherwise from the test (`said`), otherwise from `place`. The seed of a place is the same in every run and
    /// differs between tests.
    ///
    /// # Panics
    ///
    /// If the value of the environment variable is no number.
    pub(crate) fn choose(said: Option<u64>, place: &Place) -> Self {
        let value = std::env::var(SEED_VARIABLE).ok();
        Self::of(value.as_deref(), said, place, thread::current().name())
    }

    #[expect(clippy::panic, reason = "a test that is not run with the seed that was asked for is worse than none")]
    fn of(environment: Option<&str>, said: Option<u64>, place: &Place, thread: Option<&str>) -> Self {
        let asked =
            environment.map(|text| number(text).unwrap_or_else(|| panic!("{SEED_VARIABLE} is `{text}`; expected a number from 0 to {}", u64::MAX)));
        // The name of the main thread is not the name of a test.
        let test = thread.filter(|name| *name != "main").unwrap_or(&place.function);
        let said = asked.or(said);
        Self { value: said.unwrap_or_else(|| hash(place.to_string().as_bytes())), test: test.to_owned(), is_of_place: said.is_none() }
    }

    /// Returns the advice how to repeat the run.
    pub(crate) fn advice(&self) -> String {
        format!("test bed of `{}`: seed {}; {SEED_VARIABLE}={} runs it again", self.test, self.value, self.value)
    }
}

/// Place at which a test bed is run. The place does not depend on threads, machines, or edits elsewhere. The text of the place is the file, a blank and the
/// function, and the [`hash`] of the text is the seed.
///
/// The file is the file of the call. The function is the path of the program's closure in the form of [`type_name`]: only the identifiers up to the first
/// brace, joined by `::`. So a plain function has its own path, and the spelling of closures, brackets and generics by the compiler has no influence. Line and
/// column would depend even less on the compiler, but each edit above would change the seeds of all tests below. Line and column count only without a closure.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Place {
    file: String,
    /// Path of the function that contains the program; or file, line and column.
    function: String,
}

impl Place {
    /// Returns the place where the caller runs this program.
    #[track_caller]
    pub(crate) fn of<P>(_program: &P) -> Self {
        Self { file: file(Location::caller().file()), function: function(type_name::<P>()) }
    }

    /// Returns the place of the caller by line and column, for callers without a closure.
    #[track_caller]
    pub(crate) fn here() -> Self {
        let caller = Location::caller();
        let file = file(caller.file());
        Self { function: format!("{file}:{}:{}", caller.line(), caller.column()), file }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.file, self.function)
    }
}

/// Returns the path of a source file in the same form on every machine: with slashes. An absolute path belongs to a file outside of the workspace, and only
/// the name of the file is kept.
fn file(path: &str) -> String {
    let path = path.replace('\\', "/");
    let is_absolute = path.starts_with('/') || path.as_bytes().get(1) == Some(&b':');
    if is_absolute { path.rsplit('/').next().unwrap_or_default().to_owned() } else { path }
}

/// Returns the function in the name of a type: the function that contains a closure, or the function itself.
fn function(name: &str) -> String {
    let path = name.split('{').next().unwrap_or(name);
    let identifiers: Vec<_> =
        path.split(|character: char| !character.is_alphanumeric() && character != '_').filter(|part| !part.is_empty()).collect();
    identifiers.join("::")
}

/// Parses a seed: decimal, or hexadecimal after `0x`.
pub(crate) fn number(text: &str) -> Option<u64> {
    text.strip_prefix("0x").map_or_else(|| text.parse().ok(), |digits| u64::from_str_radix(digits, 16).ok())
}

/// Computes the FNV-1a hash, which is the same on every machine and in every version.
pub(crate) fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> Place {
        Place { file: "tests/x.rs".into(), function: "x::a".into() }
    }

    #[test]
    fn the_environment_comes_before_the_test_and_the_test_before_its_place() {
        let seed = |environment, said, thread| Seed::of(environment, said, &place(), thread);
        assert_eq!(seed(Some("7"), Some(8), None).value, 7);
        assert_eq!(seed(Some("0xff"), None, None).value, 255);
        assert_eq!(seed(None, Some(8), None).value, 8);
        assert_eq!(seed(None, None, Some("b")).value, hash(b"tests/x.rs x::a"));
        assert_eq!(seed(None, None, Some("main")).value, seed(None, None, Some("b")).value);
        // A test vector of FNV's authors.
        assert_eq!(hash(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(seed(None, Some(7), Some("b")).advice(), "test bed of `b`: seed 7; COHAPTIC_TEST_SEED=7 runs it again");
        assert_eq!(seed(None, Some(7), Some("main")).test, "x::a");
        assert_eq!(seed(None, Some(7), None).test, "x::a");
    }

    #[test]
    #[should_panic(expected = "COHAPTIC_TEST_SEED is `seven`; expected a number")]
    fn a_seed_that_is_none_is_refused() {
        Seed::of(Some("seven"), None, &place(), None);
    }

    #[test]
    fn a_place_is_the_same_on_every_machine_and_wherever_it_stands_in_its_file() {
        let places = [Place::of(&|| ()), Place::of(&|| 1)];
        assert_eq!(places[0], places[1]);
        let expected = "cohaptic_testkit::seed::tests::a_place_is_the_same_on_every_machine_and_wherever_it_stands_in_its_file";
        assert_eq!(places[0].to_string(), format!("crates/testkit/src/seed.rs {expected}"));
        assert_ne!(Place::here(), Place::here());
        for spelled in ["a::b::{{closure}}", "a::b", "a::b::{closure#0}::{closure#1}", "a::b::{async closure}", "a::b::{{closure}}<i32>"] {
            assert_eq!(function(spelled), "a::b");
        }
        for spelled in ["<a::B<i32> as c::D>::run_1::{{closure}}", "<a::B::<i32> as c::D>::run_1::{closure#2}"] {
            assert_eq!(function(spelled), "a::B::i32::as::c::D::run_1");
        }
        assert_eq!(file(r"crates\x\src\lib.rs"), "crates/x/src/lib.rs");
        assert_eq!(file("/home/a/.cargo/registry/x-1/src/lib.rs"), "lib.rs");
        assert_eq!(file(r"C:\x\src\lib.rs"), "lib.rs");
    }
}
