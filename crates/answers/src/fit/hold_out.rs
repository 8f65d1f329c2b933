//! Judges the link by packets that the fit has not seen.

use std::convert::Infallible;
use std::time::Duration;

use cohaptic_measure::fit::hold_out::{Figures, HoldOut, LAGS};
use cohaptic_measure::fit::transfer::Transfers;
use cohaptic_measure::fit::{Fitted, Measurement, Measurements};
use cohaptic_measure::steady::SteadyStream;
use cohaptic_units::{Bytes, Ecn};
use cohaptic_wan::{Fate, Link, LinkConfig, LinkName, PacketInfo};
use serde::Serialize;

/// Packets that are sent over the link to find its figures: so many that chance hardly counts beside that of the measurement.
const PACKETS: u64 = 400_000;
/// Seed of the link. Any seed serves.
const SEED: u64 = 1;

/// Judgement of a link by packets that the fit has not seen.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct Judged {
    #[serde(flatten)]
    pub(super) held_out: HoldOut,
    transfer_s: Transfers,
}

/// Judges the link `fitted`, which a scene reads as `config`, by `rest`.
pub(super) fn judge(fitted: &Fitted, config: LinkConfig, first: &Measurements, rest: &Measurements) -> Judged {
    // The gap between bursts at least is above zero, as the fit has checked.
    let every = Duration::try_from_secs_f64(fitted.goodness.spacing_s).unwrap_or(Duration::from_secs(1)).max(Duration::from_nanos(1));
    let held_out = HoldOut::of(first, rest, &packets_of(config.clone(), every), fitted.goodness.resolution_s);
    let transfer_s = Transfers::of(&config, first, rest, &held_out.replay);
    Judged { held_out, transfer_s }
}

/// Sends packets over a link, and returns them as measurements.
fn packets_of(config: LinkConfig, every: Duration) -> Measurements {
    let stream = SteadyStream { packets: PACKETS, every, info: PacketInfo { size: Bytes::new(64), ecn: Ecn::NotCapable } };
    let mut delays: Vec<Option<f64>> = vec![None; usize::try_from(PACKETS).unwrap_or(usize::MAX)];
    let mut link = Link::new(SEED, &LinkName::between("sender", "receiver"), config);
    let sent = stream.over(
        &mut link,
        |record| {
            if let (Fate::Delivered(at), Ok(number)) = (record.fate, usize::try_from(record.sequence)) {
                // The stream numbers its packets from 0, so the index is valid. A fitted link makes no copies, so no delay is written twice.
                delays[number] = Some(at.saturating_duration_since(record.offered).as_secs_f64());
            }
            Ok::<(), Infallible>(())
        },
        |_, _| true,
    );
    debug_assert_eq!(sent, Ok(PACKETS));
    let packets = (0..).zip(delays).map(|(number, delay_s)| Measurement { sent_s: stream.sent(number).as_secs_f64(), delay_s });
    // Instants of a stream are finite and never go back, so the packets are always accepted.
    Measurements::new(packets.collect()).unwrap_or_default()
}

/// Returns the text about the held-out packets.
pub(super) fn words(judged: &Judged) -> String {
    let HoldOut { fitted, held_out, measured, best, independent, gilbert, replay, refused } = &judged.held_out;
    let columns = [measured, best, independent, gilbert, replay];
    let mut text = format!("\nfitted to the first {fitted} packets, judged by the {held_out} after them\n");
    text.push_str(&format!("\n  {:<22}{:>14}{:>14}{:>14}{:>14}{:>14}\n", "", "held out", "this link", "independent", "Gilbert", "first part"));
    let mut row = |name: &str, figure: &dyn Fn(&Figures) -> Option<String>| {
        let cells: String = columns.iter().map(|figures| format!("{:>14}", figure(figures).unwrap_or_else(|| "-".to_owned()))).collect();
        text.push_str(&format!("  {name:<22}{cells}\n"));
    };
    let millis = |seconds: f64| format!("{:.4} ms", seconds * 1e3);
    row("mean delay", &|figures| Some(millis(figures.mean_s)));
    row("95 % of delays", &|figures| Some(millis(figures.quantiles_s[0])));
    row("99 % of delays", &|figures| Some(millis(figures.quantiles_s[1])));
    row("W1 from held out", &|figures| figures.wasserstein_s.map(millis));
    for (place, lag) in LAGS.iter().enumerate() {
        row(&format!("correlation, {lag} apart"), &|figures| figures.autocorrelation[place].map(|correlation| format!("{correlation:.3}")));
    }
    row("loss", &|figures| Some(format!("{:.4} %", figures.loss * 100.0)));
    row("mean run of losses", &|figures| figures.mean_run.map(|run| format!("{run:.4}")));
    row("runs of 2 or more", &|figures| figures.longer_runs.map(|longer| format!("{:.3}", longer[0])));
    row("runs of 3 or more", &|figures| figures.longer_runs.map(|longer| format!("{:.3}", longer[1])));
    let Transfers { measured, best, independent, gilbert, replay } = judged.transfer_s;
    let cells: String = [measured, best, independent, gilbert, replay]
        .map(|seconds| format!("{:>14}", seconds.map_or_else(|| "-".to_owned(), |seconds| format!("{seconds:.3} s"))))
        .concat();
    text.push_str(&format!("  {:<22}{cells}\n", "TCP, 10^6 bytes"));
    for reason in refused {
        text.push_str(&format!("refused: {reason}\n"));
    }
    if refused.is_empty() {
        text.push_str("not refused: the held-out packets are as this link says, as far as they tell\n");
    }
    text
}
