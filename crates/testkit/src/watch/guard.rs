//! Limit of the watchdog, and the exception for debuggers.

use std::time::Duration;

use cohaptic_units::parse;

/// Name of the environment variable for the time that a task or node may run without returning to the test bed. The variable takes precedence over the limits
/// of the tests. The value is a span such as `10min`, or `off`.
pub const STALL_VARIABLE: &str = "COHAPTIC_TEST_STALL";

/// Returns the limit from the environment, otherwise the limit `said` by the test.
///
/// # Panics
///
/// If the value of the environment variable is no span.
pub(crate) fn limit(said: Duration) -> Duration {
    span(STALL_VARIABLE, said)
}

/// Returns the span of an environment variable, otherwise `said`. The value `off` stands for [`Duration::MAX`].
///
/// # Panics
///
/// If the value of the environment variable is no span.
pub(crate) fn span(variable: &str, said: Duration) -> Duration {
    of(variable, std::env::var(variable).ok().as_deref(), said)
}

#[expect(clippy::panic, reason = "a test with another limit than was asked for is worse than none")]
fn of(variable: &str, environment: Option<&str>, said: Duration) -> Duration {
    match environment {
        None => said,
        Some("off") => Duration::MAX,
        Some(text) => match parse::duration(text) {
            Ok(span) if !span.is_zero() => span,
            Ok(_) => panic!("{variable} is `{text}`; expected a span such as `10min`, or `off`"),
            Err(error) => panic!("{variable}: {error}, or `off`"),
        },
    }
}

/// Returns whether a debugger holds this process, which somebody may then inspect for hours. Works on Linux only.
pub(super) fn is_debugged() -> bool {
    std::fs::read_to_string("/proc/self/status").is_ok_and(|status| is_traced(&status))
}

fn is_traced(status: &str) -> bool {
    status.lines().filter_map(|line| line.strip_prefix("TracerPid:")).any(|id| id.trim() != "0")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_comes_before_the_test() {
        let second = Duration::from_secs(1);
        assert_eq!(of(STALL_VARIABLE, None, second), second);
        assert_eq!(of(STALL_VARIABLE, Some("10min"), second), Duration::from_secs(600));
        assert_eq!(of(STALL_VARIABLE, Some("off"), second), Duration::MAX);
    }

    #[test]
    #[should_panic(expected = "COHAPTIC_TEST_STALL is `0s`; expected a span such as `10min`, or `off`")]
    fn no_span_at_all_is_refused() {
        of(STALL_VARIABLE, Some("0s"), Duration::MAX);
    }

    #[test]
    #[should_panic(expected = "COHAPTIC_TEST_STALL: no unit in \"60\": expected a duration")]
    fn a_span_without_a_unit_is_refused() {
        of(STALL_VARIABLE, Some("60"), Duration::MAX);
    }

    #[test]
    fn a_debugger_is_known() {
        assert!(is_traced("Name:\tx\nTracerPid:\t123\nUid:\t0"));
        assert!(!is_traced("Name:\tx\nTracerPid:\t0\nUid:\t0"));
        assert!(!is_traced(""));
    }
}
