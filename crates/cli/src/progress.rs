//! A progress bar on standard error, only when that is a terminal.

use std::io::IsTerminal as _;
use std::time::Duration;

use cohaptic_units::{Instant, Visible};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// Progress through a scene, in simulated time.
    pub(crate) fn through_scene(title: &str, duration: Duration) -> Self {
        let bar = bar(u64::try_from(duration.as_millis()).unwrap_or(u64::MAX));
        bar.set_style(style("{prefix} {bar:30} {percent:>3} %  {elapsed} passed, {eta} left{msg}"));
        bar.set_prefix(Visible(title).to_string());
        Self(bar)
    }

    /// Progress through a number of scenes.
    pub(crate) fn through_scenes(count: usize) -> Self {
        let bar = bar(count as u64);
        bar.set_style(style("checking scenes {bar:30} {pos}/{len}"));
        Self(bar)
    }

    /// Progress through a number of packets.
    pub(crate) fn through_packets(count: u64) -> Self {
        let bar = bar(count);
        bar.set_style(style("{bar:30} {percent:>3} %  {pos}/{len} packets, {eta} left"));
        Self(bar)
    }

    /// Progress through the rows of maps.
    pub(crate) fn through_rows(count: usize) -> Self {
        let bar = bar(count as u64);
        bar.set_style(style("{bar:30} {percent:>3} %  {pos}/{len} rows, {eta} left{msg}"));
        Self(bar)
    }

    /// Progress through the combinations of a campaign that are checked.
    pub(crate) fn through_combinations(count: u64) -> Self {
        let bar = bar(count);
        bar.set_style(style("checking combinations {bar:30} {pos}/{len}, {eta} left"));
        Self(bar)
    }

    /// Progress through the combinations of a campaign that are judged.
    pub(crate) fn through_verdicts(count: u64) -> Self {
        let bar = bar(count);
        bar.set_style(style("judging combinations {bar:30} {pos}/{len}, {eta} left"));
        Self(bar)
    }

    /// Progress through the runs of a campaign, some of which are done already.
    pub(crate) fn through_runs(count: u64, done: u64) -> Self {
        let bar = bar(count).with_position(done);
        bar.set_style(style("{bar:30} {percent:>3} %  {pos}/{len} runs, {per_sec}, {eta} left"));
        bar.reset_eta();
        Self(bar)
    }

    /// Progress through values of which nobody knows how many there will be.
    pub(crate) fn through_values() -> Self {
        let bar = bar(0);
        bar.set_style(style("{spinner} {pos} values looked at, {elapsed} passed{msg}"));
        Self(bar)
    }

    /// Progress through measurements of which nobody knows how many there will be.
    pub(crate) fn through_measurements() -> Self {
        let bar = bar(0);
        bar.set_style(style("{spinner} {pos} rows measured, {elapsed} passed: {msg}"));
        Self(bar)
    }

    /// Progress through a number of steps.
    pub(crate) fn through_steps(count: usize) -> Self {
        let bar = bar(count as u64);
        bar.set_style(style("{bar:30} {percent:>3} %  {elapsed} passed, {eta} left"));
        Self(bar)
    }

    /// Progress through operations of a computation whose estimate comes on the way; nothing is shown of one that takes seconds.
    pub(crate) fn through_operations() -> Self {
        let bar = bar(0);
        bar.set_style(style("{bar:30} {percent:>3} %  {elapsed} passed, {msg}"));
        Self(bar)
    }

    /// Shows the elapsed time anew, for work that cannot say how far it is.
    pub(crate) fn tick(&self) {
        self.0.enable_steady_tick(Duration::from_millis(500));
    }

    /// That number of steps more is to be done.
    pub(crate) fn expect(&self, number: u64) {
        self.0.inc_length(number);
    }

    /// One line about a run that goes on until it is stopped.
    pub(crate) fn of_traffic(title: &str) -> Self {
        let bar = bar(0);
        bar.set_style(style("{prefix}: {msg}, {elapsed} passed"));
        bar.set_prefix(Visible(title).to_string());
        Self(bar)
    }

    pub(crate) fn say(&self, line: String) {
        self.0.set_message(line);
    }

    pub(crate) fn reach_number(&self, number: u64) {
        self.0.set_position(number);
    }

    pub(crate) fn reach(&self, now: Instant) {
        self.0.set_position(now.as_nanos() / 1_000_000);
    }

    /// What stands behind the bar.
    pub(crate) fn note(&self, text: String) {
        self.0.set_message(text);
    }

    pub(crate) fn one_more(&self) {
        self.0.inc(1);
    }

    pub(crate) fn more(&self, number: u64) {
        self.0.inc(number);
    }

    pub(crate) fn clear(&self) {
        self.0.finish_and_clear();
    }
}

fn bar(length: u64) -> ProgressBar {
    let target = if std::io::stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    ProgressBar::with_draw_target(Some(length), target)
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
