//! Line about the origin of rows: the command, the version, the processor and the date.

use std::time::{SystemTime, UNIX_EPOCH};

/// Returns the line for this command.
pub(crate) fn line(command: &str) -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    format!("{command}, version {}, on {}, {}.", env!("CARGO_PKG_VERSION"), processor(), date(seconds / 86_400))
}

/// Returns the name of the processor if the system reports a name, or else the architecture.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    named.map_or_else(|| format!("a processor of the kind {}", std::env::consts::ARCH), |(_, name)| name.to_owned())
}

/// Returns the date (UTC) of a day since 1 January 1970. Counts in years of 400, 100, 4 and 1 that begin in March, so that leap days come last.
fn date(day: u64) -> String {
    // 1 March 0000 was 719,468 days before 1 January 1970.
    let day = day + 719_468;
    let (era, in_era) = (day / 146_097, day % 146_097);
    let year_of_era = (in_era - in_era / 1460 + in_era / 36_524 - in_era / 146_096) / 365;
    let in_year = in_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * in_year + 2) / 153;
    let of_month = in_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{of_month:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (day, text) in [
            (0, "1970-01-01"),
            (58, "1970-02-28"),
            (59, "1970-03-01"),
            (789, "1972-02-29"),
            (10_957, "2000-01-01"),
            (11_016, "2000-02-29"),
            (47_540, "2100-02-28"),
            (47_541, "2100-03-01"),
        ] {
            assert_eq!(date(day), text, "{day}");
        }
    }
}
