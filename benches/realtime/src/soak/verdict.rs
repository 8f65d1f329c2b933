//! What an outcome is worth.

use core::fmt;
use core::time::Duration;

use super::{Outcome, Row, TICK};

/// The additional memory that may be held in the last quarter than in the first \[kB\].
///
/// Nothing may grow with time. Memory that is touched for the first time after a quarter is bounded: pages of at most six histograms of 190 kB, when something
/// is as late as nothing was before, and of the buffers of four sockets for 32 datagrams (512 kB). Small datagrams that come at once touch a page each. The rest, 400 kB, is for the table of the soak itself and for the allocator. In an hour more than six million packets pass between the middle of the
/// first quarter and that of the last: to keep a byte of each would be three times this.
pub const MEMORY_BOUND: u64 = 2048;

/// How one rule came out.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// It was kept.
    Kept,
    /// It was broken.
    Broken,
    /// It could not be judged.
    Skipped,
}

/// One rule, how it came out, and by which numbers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Judgement {
    /// The rule.
    pub rule: &'static str,
    /// How it came out.
    pub verdict: Verdict,
    /// The numbers.
    pub why: String,
}

/// Returns a span in nanoseconds, signed for differences of spans.
pub(super) fn nanos(span: Duration) -> i128 {
    i128::try_from(span.as_nanos()).unwrap_or(i128::MAX)
}

/// Judges an outcome by every rule.
#[must_use]
pub fn judge(outcome: &Outcome) -> Vec<Judgement> {
    let ended = outcome.fault.as_ref().map_or(Verdict::Kept, |_| Verdict::Broken);
    let why = outcome.fault.clone().unwrap_or_else(|| format!("the session ran until it was stopped, {:.1} s", outcome.elapsed.as_secs_f64()));
    vec![
        Judgement { rule: "nothing ends by itself", verdict: ended, why },
        memory(&outcome.rows),
        files(&outcome.rows),
        ahead(outcome),
        behind(outcome),
        conserved(outcome),
        visited(outcome),
    ]
}

/// The rows of the first quarter and of the last.
fn quarters(rows: &[Row]) -> Option<[&[Row]; 2]> {
    let quarter = rows.len() / 4;
    (quarter > 0).then(|| [&rows[..quarter], &rows[rows.len() - quarter..]])
}

pub(super) fn median(mut numbers: Vec<u64>) -> u64 {
    numbers.sort_unstable();
    numbers.get(numbers.len() / 2).copied().unwrap_or(0)
}

fn memory(rows: &[Row]) -> Judgement {
    let rule = "memory does not grow";
    let Some(quarters) = quarters(rows) else { return too_few(rule, rows.len()) };
    let [first, last] = quarters.map(|rows| median(rows.iter().map(|row| row.memory).collect()));
    let grown = last.saturating_sub(first);
    let why = format!("median of the first quarter {first} kB, of the last {last} kB; bound {MEMORY_BOUND} kB more");
    Judgement { rule, verdict: verdict(first > 0 && grown <= MEMORY_BOUND), why }
}

fn files(rows: &[Row]) -> Judgement {
    let rule = "open files do not grow";
    let Some(quarters) = quarters(rows) else { return too_few(rule, rows.len()) };
    // The least: a file that is open for a moment, such as one of /proc, is no growth.
    let [first, last] = quarters.map(|rows| rows.iter().map(|row| row.files).min().unwrap_or(0));
    Judgement { rule, verdict: verdict(first > 0 && last <= first), why: format!("least of the first quarter {first}, of the last {last}") }
}

fn ahead(outcome: &Outcome) -> Judgement {
    let rule = "logical time is never ahead of the wall";
    let least = outcome.rows.iter().map(|row| row.lag.least_at_most).min();
    let Some(least) = least else { return too_few(rule, outcome.rows.len()) };
    let [ahead, _] = outcome.at_end;
    let looks: u64 = outcome.rows.iter().map(|row| row.lag.looks).sum();
    let why = format!(
        "at {looks} looks, the wall was at least {:.1} µs later; at the end logical time was ahead by {} ns",
        micros(least),
        ahead.as_nanos()
    );
    Judgement { rule, verdict: verdict(least >= 0 && ahead.is_zero()), why }
}

/// That it was late for a moment is lateness, which has columns of its own. Drift is what does not go away: then no look between two rows finds it less than a tick behind.
fn behind(outcome: &Outcome) -> Judgement {
    let rule = "logical time does not fall behind: once up to date, less than a tick";
    let least = outcome.rows.iter().map(|row| row.lag.least_at_least).max();
    let Some(least) = least else { return too_few(rule, outcome.rows.len()) };
    let [_, missing] = outcome.at_end;
    let why = format!(
        "the wall less logical time, at the most favourable look before each row, was at most {:.1} µs; when asked to stop, logical time caught up but for {} ns; when the \
         session began is known to {:.0} µs",
        micros(least),
        missing.as_nanos(),
        outcome.unknown.as_secs_f64() * 1e6
    );
    let verdict = if outcome.unknown >= TICK && least < nanos(TICK) { Verdict::Skipped } else { verdict(least < nanos(TICK)) };
    let verdict = if missing.is_zero() { verdict } else { Verdict::Broken };
    Judgement { rule, verdict, why }
}

fn conserved(outcome: &Outcome) -> Judgement {
    let at_end = outcome.accounts.iter().filter(|account| !account.balances()).map(|account| (outcome.elapsed, account));
    let seen = outcome.unbalanced.iter().map(|(at, account)| (*at, account));
    let broken: Vec<String> = seen.chain(at_end).map(|(at, account)| format!("after {:.1} s, {account}", at.as_secs_f64())).collect();
    let open = outcome.accounts.iter().filter(|account| account.open.is_some()).count();
    let why = if broken.is_empty() {
        format!("all accounts balance, at {} looks and at the end; {open} of them could not be closed", outcome.rows.len())
    } else {
        broken.join("; ")
    };
    Judgement { rule: "counts of one thing in two places are equal", verdict: verdict(broken.is_empty() && !outcome.accounts.is_empty()), why }
}

fn visited(outcome: &Outcome) -> Judgement {
    let visits = &outcome.visits;
    let why = format!(
        "{} visits, {} joinings, {} datagrams sent, {} received ({} new samples, {} late ones, {} of a joining that was over)",
        visits.visits, visits.joinings, visits.sent, visits.received, visits.newest, visits.late, visits.ignored
    );
    Judgement { rule: "the visitor was let in and heard the others", verdict: verdict(visits.joinings > 0 && visits.newest > 0), why }
}

pub(super) fn too_few(rule: &'static str, looks: usize) -> Judgement {
    Judgement { rule, verdict: Verdict::Skipped, why: format!("{looks} looks are too few") }
}

pub(super) const fn verdict(is_kept: bool) -> Verdict {
    if is_kept { Verdict::Kept } else { Verdict::Broken }
}

#[expect(clippy::cast_precision_loss, reason = "a few digits of it are printed")]
fn micros(nanos: i128) -> f64 {
    nanos as f64 / 1000.0
}

/// Something that was counted in two places.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Account {
    /// What was counted, in words.
    pub what: &'static str,
    /// In the first place.
    pub first: u64,
    /// In the second.
    pub second: u64,
    /// Why the two may differ, if they may.
    pub open: Option<&'static str>,
}

impl Account {
    /// Of two numbers that are known.
    pub(super) const fn of(what: &'static str, first: u64, second: u64) -> Self {
        Self { what, first, second, open: None }
    }

    /// Of what was sent over loopback, and what was received and what the kernel dropped, if it tells.
    pub(super) fn with_drops(what: &'static str, sent: u64, received: u64, drops: Option<u64>) -> Self {
        Self {
            what,
            first: sent,
            second: received + drops.unwrap_or(0),
            open: if drops.is_none() { Some("the system does not tell what the kernel dropped") } else { None },
        }
    }

    /// Returns whether it balances, as far as that can be told.
    #[must_use]
    pub const fn balances(&self) -> bool {
        self.open.is_some() || self.first == self.second
    }
}

impl fmt::Display for Account {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, first, second, open } = self;
        let sign = if first == second { "=" } else { "≠" };
        write!(f, "{what}: {first} {sign} {second}")?;
        open.map_or(Ok(()), |why| write!(f, " ({why})"))
    }
}
