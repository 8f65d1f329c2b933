//! The estimated link, and its text for a scene.

use std::fmt::Write as _;
use std::time::Duration;

use cohaptic_units::print::Span;
use serde::Serialize;

use super::law::DelayLaw;
use super::loss::LossModel;

/// A link with the parameters of a scene.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct FittedLink {
    /// Mean one-way delay \[s\].
    pub delay_s: f64,
    /// Jitter around the mean.
    pub jitter: FittedJitter,
    /// Model of losses.
    pub loss: LossModel,
}

/// Law of the jitter.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(into = "&'static str")]
pub enum FittedLaw {
    /// A fitting law.
    Law(DelayLaw),
    /// The measured delays themselves, because no law fits: `empirical`.
    Empirical,
}

impl From<FittedLaw> for &'static str {
    fn from(law: FittedLaw) -> Self {
        match law {
            FittedLaw::Law(law) => law.name(),
            FittedLaw::Empirical => "empirical",
        }
    }
}

/// Jitter with the parameters of a scene.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct FittedJitter {
    /// Standard deviation \[s\].
    pub sd_s: f64,
    /// Law of the delays.
    pub distribution: FittedLaw,
    /// Least delay of a lognormal, gamma or Weibull law \[s\]; `None` for zero or for another law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor_s: Option<f64>,
    /// Autocorrelation of the delays at lag one, as defined in scenes: of the chosen law, with normal scores correlated as in
    /// [`Goodness::correlation`](super::Goodness::correlation). Present only for evenly spaced packets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation: Option<f64>,
    /// Time in which the autocorrelation falls to 1/e \[s\]. Present only for packets that are not evenly spaced, or for a share of the variation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation_time_s: Option<f64>,
    /// Share of the variation that has the memory of `correlation_time_s`, above 0 and below 1; the rest differs from packet to packet. `None` if all of the
    /// variation has the memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation_share: Option<f64>,
}

impl FittedLink {
    /// Returns the `[link]` table of a scene, with a line break at the end. Durations are rounded to nanoseconds, other numbers to six digits. `delays` is
    /// the path of the file of measured delays ([`Fitted::delays_csv`](super::Fitted::delays_csv)), relative to the folder of the scene, and is used only
    /// if no law fits.
    #[must_use]
    pub fn to_scene_toml(&self, delays: &str) -> String {
        let mut text = format!("[link]\ndelay = \"{}\"\n", duration(self.delay_s));
        let jitter = &self.jitter;
        let distribution = match jitter.distribution {
            FittedLaw::Law(law) => format!("\"{}\"", law.name()),
            FittedLaw::Empirical => format!("{{ empirical = {} }}", text_of(delays)),
        };
        let mut keys = format!("sd = \"{}\", distribution = {distribution}", duration(jitter.sd_s));
        let floor = jitter.floor_s.map(|floor| format!(", floor = \"{}\"", duration(floor)));
        let correlation = jitter.correlation.map(|correlation| format!(", correlation = {}", number(correlation)));
        let time = jitter.correlation_time_s.map(|time| format!(", correlation-time = \"{}\"", duration(time)));
        let share = jitter.correlation_share.map(|share| format!(", correlation-share = {}", number(share)));
        keys.extend([floor, correlation, time, share].into_iter().flatten());
        // Writing to a `String` cannot fail.
        let _ = writeln!(text, "jitter = {{ {keys} }}");
        let loss = match self.loss {
            LossModel::None => None,
            LossModel::Independent { probability } => Some(number(probability)),
            LossModel::GilbertElliott { p, r, h, k } => {
                // A scene takes h = 0 and k = 1 for missing keys.
                let h = if h > 0.0 { format!(", h = {}", number(h)) } else { String::new() };
                let k = if k < 1.0 { format!(", k = {}", number(k)) } else { String::new() };
                Some(format!("{{ gilbert-elliott = {{ p = {}, r = {}{h}{k} }} }}", number(p), number(r)))
            }
            LossModel::GilbertElliottInTime { mean_good_s, mean_bad_s } => {
                Some(format!("{{ gilbert-elliott = {{ mean-good = \"{}\", mean-bad = \"{}\" }} }}", duration(mean_good_s), duration(mean_bad_s)))
            }
        };
        if let Some(loss) = loss {
            let _ = writeln!(text, "loss = {loss}");
        }
        text
    }
}

/// Rounds to nanoseconds. Negative spans become zero, and spans too long for a scene the longest span.
fn duration(seconds: f64) -> Span {
    let nanos = Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or(Duration::from_nanos(i64::MAX.unsigned_abs()));
    Span(nanos.min(Duration::from_nanos(i64::MAX.unsigned_abs())))
}

/// Returns a TOML string. Names of files may contain quotes, backslashes and control characters.
pub(super) fn text_of(text: &str) -> String {
    let escaped = |character: char| match character {
        '"' | '\\' => format!("\\{character}"),
        // All control characters are below U+00A0, so four digits are enough.
        control if control.is_control() => format!("\\u{:04X}", u32::from(control)),
        other => other.to_string(),
    };
    format!("\"{}\"", text.chars().map(escaped).collect::<String>())
}

/// Writes a number as a TOML float with six digits.
fn number(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINK: FittedLink = FittedLink {
        delay_s: 0.024,
        jitter: FittedJitter {
            sd_s: 0.002,
            distribution: FittedLaw::Law(DelayLaw::Gamma),
            floor_s: Some(0.02),
            correlation: Some(0.9),
            correlation_time_s: None,
            correlation_share: None,
        },
        loss: LossModel::GilbertElliott { p: 0.01, r: 1.0 / 3.0, h: 0.0, k: 1.0 },
    };

    #[test]
    fn a_link_reads_as_a_scene() {
        assert_eq!(
            LINK.to_scene_toml(""),
            "[link]\n\
             delay = \"24ms\"\n\
             jitter = { sd = \"2ms\", distribution = \"gamma\", floor = \"20ms\", correlation = 0.9 }\n\
             loss = { gilbert-elliott = { p = 0.01, r = 0.333333 } }\n"
        );
    }

    #[test]
    fn measured_delays_are_named() {
        let jitter = FittedJitter { distribution: FittedLaw::Empirical, floor_s: None, correlation: None, ..LINK.jitter };
        let text = FittedLink { jitter, loss: LossModel::None, ..LINK }.to_scene_toml("odd \"\\\n.csv");
        assert!(text.ends_with("jitter = { sd = \"2ms\", distribution = { empirical = \"odd \\\"\\\\\\u000A.csv\" } }\n"), "{text}");
        let table: toml::Table = text.parse().unwrap();
        assert_eq!(table["link"]["jitter"]["distribution"]["empirical"].as_str(), Some("odd \"\\\n.csv"));
    }

    #[test]
    fn every_text_is_toml_with_values_that_scenes_read() {
        let models = [
            LossModel::None,
            LossModel::Independent { probability: 1e-7 },
            LossModel::GilbertElliott { p: 1.234_567_89e-5, r: 1.0, h: 0.25, k: 0.999 },
            LossModel::GilbertElliottInTime { mean_good_s: 12.5, mean_bad_s: 1e300 },
        ];
        for loss in models {
            let jitter = FittedJitter {
                correlation: None,
                correlation_time_s: Some(1.0 / 3.0),
                correlation_share: Some(2.0 / 3.0),
                floor_s: None,
                ..LINK.jitter
            };
            let text = FittedLink { loss, jitter, ..LINK }.to_scene_toml("");
            let table: toml::Table = text.parse().unwrap();
            let link = table["link"].as_table().unwrap();
            let span = |value: &toml::Value| cohaptic_units::parse::duration(value.as_str().unwrap()).unwrap().as_secs_f64();
            assert_eq!(span(&link["jitter"]["correlation-time"]), 0.333_333_333);
            assert_eq!(link["jitter"]["correlation-share"].as_float(), Some(0.666_667));
            match loss {
                LossModel::None => assert!(!link.contains_key("loss")),
                LossModel::Independent { probability } => assert_eq!(link["loss"].as_float(), Some(probability)),
                LossModel::GilbertElliott { r, h, k, .. } => {
                    let chain = &link["loss"]["gilbert-elliott"];
                    assert_eq!(chain["p"].as_float(), Some(1.234_57e-5));
                    assert_eq!(["r", "h", "k"].map(|key| chain[key].as_float().unwrap()), [r, h, k]);
                }
                LossModel::GilbertElliottInTime { mean_good_s, .. } => {
                    let chain = &link["loss"]["gilbert-elliott"];
                    assert_eq!(span(&chain["mean-good"]), mean_good_s);
                    assert!(span(&chain["mean-bad"]) > 9e9);
                }
            }
        }
    }
}
