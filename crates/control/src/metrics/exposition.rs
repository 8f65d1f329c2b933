//! Prometheus' text format, version 0.0.4
//! (<https://prometheus.io/docs/instrumenting/exposition_formats/#text-based-format>).

use core::fmt::Write as _;

/// Why writing to a `String` cannot fail.
const NO_FAILURE: &str = "a String takes what it is given";

/// Prometheus type of a family.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measure {
    Counter,
    Gauge,
    Summary,
}

impl Measure {
    const fn name(self) -> &'static str {
        match self {
            Self::Counter => "counter",
            Self::Gauge => "gauge",
            Self::Summary => "summary",
        }
    }
}

/// Writer of the text format: families, each followed by its samples.
#[derive(Debug, Default)]
pub(super) struct Exposition {
    text: String,
    /// Name of the present family, the first part of each sample's name.
    family: &'static str,
}

impl Exposition {
    /// Begins a family with a help text.
    pub(super) fn family(&mut self, name: &'static str, measure: Measure, help: &str) {
        self.family = name;
        let help = help.replace('\\', r"\\").replace('\n', r"\n");
        writeln!(self.text, "# HELP {name} {help}\n# TYPE {name} {}", measure.name()).expect(NO_FAILURE);
    }

    /// Writes a sample with an integer value.
    pub(super) fn count(&mut self, labels: &[(&str, &str)], count: u64) {
        self.line("", labels, format_args!("{count}"));
    }

    /// Writes a sample with a floating-point value.
    pub(super) fn number(&mut self, labels: &[(&str, &str)], number: f64) {
        self.number_of("", labels, number);
    }

    /// Writes the number of observations of a summary.
    pub(super) fn summary_count(&mut self, labels: &[(&str, &str)], count: u64) {
        self.line("_count", labels, format_args!("{count}"));
    }

    /// Writes the sum of the observations of a summary.
    pub(super) fn summary_sum(&mut self, labels: &[(&str, &str)], sum: f64) {
        self.number_of("_sum", labels, sum);
    }

    pub(super) fn finish(self) -> String {
        self.text
    }

    fn number_of(&mut self, suffix: &str, labels: &[(&str, &str)], number: f64) {
        // Rust prints infinities as "inf", and Prometheus expects "+Inf" and "-Inf". NaN is the same in both.
        if number.is_infinite() {
            let infinity = if number > 0.0 { "+Inf" } else { "-Inf" };
            self.line(suffix, labels, format_args!("{infinity}"));
        } else {
            self.line(suffix, labels, format_args!("{number:?}"));
        }
    }

    fn line(&mut self, suffix: &str, labels: &[(&str, &str)], value: core::fmt::Arguments<'_>) {
        write!(self.text, "{}{suffix}", self.family).expect(NO_FAILURE);
        for (place, (name, value)) in labels.iter().enumerate() {
            let before = if place == 0 { '{' } else { ',' };
            // The backslash must be escaped first: the other escapes contain backslashes.
            let value = value.replace('\\', r"\\").replace('"', "\\\"").replace('\n', r"\n");
            write!(self.text, "{before}{name}=\"{value}\"").expect(NO_FAILURE);
        }
        let after = if labels.is_empty() { "" } else { "}" };
        writeln!(self.text, "{after} {value}").expect(NO_FAILURE);
    }
}
