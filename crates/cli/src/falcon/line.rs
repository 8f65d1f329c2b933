//! What moves on a terminal: a bar while firmware is loaded, a line while a device is watched. Nothing where standard error is none.

use std::io::IsTerminal as _;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

#[derive(Debug)]
pub(super) struct LoadingBar(ProgressBar);

impl LoadingBar {
    pub(super) fn new(bytes: usize) -> Self {
        let bar = drawn(ProgressBar::new(bytes as u64));
        bar.set_style(style("loading {bar:30} {percent:>3} %  {pos}/{len} bytes"));
        Self(bar)
    }

    pub(super) fn reach(&self, bytes: usize) {
        self.0.set_position(bytes as u64);
    }

    /// Does something else to the terminal.
    pub(super) fn aside(&self, work: impl FnOnce()) {
        self.0.suspend(work);
    }

    pub(super) fn clear(&self) {
        self.0.finish_and_clear();
    }
}

/// One line that is written again and again.
#[derive(Debug)]
pub(super) struct StatusLine(ProgressBar);

impl StatusLine {
    pub(super) fn new() -> Self {
        let bar = drawn(ProgressBar::no_length());
        bar.set_style(style("{msg}"));
        Self(bar)
    }

    /// Whether anybody sees it.
    pub(super) fn is_seen(&self) -> bool {
        !self.0.is_hidden()
    }

    pub(super) fn show(&self, line: String) {
        self.0.set_message(line);
        self.0.tick();
    }

    pub(super) fn aside(&self, work: impl FnOnce()) {
        self.0.suspend(work);
    }

    pub(super) fn clear(&self) {
        self.0.finish_and_clear();
    }
}

fn drawn(bar: ProgressBar) -> ProgressBar {
    bar.set_draw_target(if std::io::stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() });
    bar
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
