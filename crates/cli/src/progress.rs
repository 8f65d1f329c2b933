//! Progress bar on standard error, shown only if standard error is a terminal and `--quiet` is not given.

use std::io::IsTerminal as _;
use std::time::Duration;

use cohaptic_units::{Instant, Visible};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::output;

pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// Creates a bar with `length` steps, in the format of an indicatif template. A length of 0 stands for an unknown length.
    pub(crate) fn new(length: u64, template: &str) -> Self {
        // In a file or a pipe the control characters of a bar would be garbage.
        let target = if std::io::stderr().is_terminal() && !output::is_quiet() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        // A wrong template must not end the work, so the default bar stands in.
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        Self(ProgressBar::with_draw_target(Some(length), target).with_style(style))
    }

    fn titled(self, title: &str) -> Self {
        // A title comes from a file and may contain control characters.
        Self(self.0.with_prefix(Visible(title).to_string()))
    }

    /// Creates a bar through the simulated time of a scene, in steps of 1 ms.
    pub(crate) fn through_scene(title: &str, duration: Duration) -> Self {
        let length = u64::try_from(duration.as_millis()).unwrap_or(u64::MAX);
        Self::new(length, "{prefix} {bar:30} {percent:>3} %  {elapsed} passed, {eta} left{msg}").titled(title)
    }

    /// Creates a bar through `count` runs of a campaign. `done` runs are done already.
    pub(crate) fn through_runs(count: u64, done: u64) -> Self {
        let progress = Self::new(count, "{bar:30} {percent:>3} %  {pos}/{len} runs, {per_sec}, {eta} left");
        progress.reach_number(done);
        // Runs of an earlier command took none of this command's time and must not enter its rate.
        progress.0.reset_eta();
        progress
    }

    /// Refreshes the elapsed time every half second, for work without reports of progress.
    pub(crate) fn tick(&self) {
        self.0.enable_steady_tick(Duration::from_millis(500));
    }

    /// Adds a number of steps to the length.
    pub(crate) fn expect(&self, number: u64) {
        self.0.inc_length(number);
    }

    /// Creates a line without a bar, for a run without a known end.
    pub(crate) fn of_traffic(title: &str) -> Self {
        Self::new(0, "{prefix}: {msg}, {elapsed} passed").titled(title)
    }

    pub(crate) fn reach_number(&self, number: u64) {
        self.0.set_position(number);
    }

    pub(crate) fn reach(&self, now: Instant) {
        self.0.set_position(now.as_nanos() / 1_000_000);
    }

    /// Sets the text after the bar.
    pub(crate) fn note(&self, text: String) {
        self.0.set_message(text);
    }

    pub(crate) fn one_more(&self) {
        self.0.inc(1);
    }

    pub(crate) fn more(&self, number: u64) {
        self.0.inc(number);
    }

    /// Shows a line in place of the line before.
    pub(crate) fn show(&self, line: String) {
        self.0.set_message(line);
        self.0.tick();
    }

    /// Returns whether the bar is shown on a terminal.
    pub(crate) fn is_seen(&self) -> bool {
        !self.0.is_hidden()
    }

    /// Hides the bar while `work` writes to the terminal.
    pub(crate) fn aside(&self, work: impl FnOnce()) {
        self.0.suspend(work);
    }

    pub(crate) fn clear(&self) {
        self.0.finish_and_clear();
    }
}
