//! `cohaptic fit`.

mod clocks;
mod ends;
mod written;

use std::io::Read as _;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use cohaptic_files::MOST_BYTES;
use cohaptic_measure::fit::{self, Fitted, LossFit, LossModel, Measurements, captures};
use cohaptic_units::print::{Counted, Span};
use cohaptic_wan::FateRow;

use crate::arguments::FitArguments;
use crate::document_schema::{DocumentSchema, document};
use crate::failure::{EXPECTATION, Failure};
use crate::file::write_file;
use crate::{file, output};
use ends::Ends;
use written::{Delays, read_again};

/// Estimates a link.
pub(crate) fn fit(arguments: &FitArguments) -> Result<ExitCode, Failure> {
    let Source { measurements, matched, has_one_clock } = read(arguments)?;
    let named = |error: &dyn std::fmt::Display| Failure::Input(format!("{}: {error}", output::path(&arguments.file)));
    let (measurements, clocks, skew) = clocks::settled(arguments, &measurements, has_one_clock).map_err(|error| named(&error))?;
    let fitted = fit::fit(&measurements).map_err(|error| named(&clocks::explained(&error)))?;
    let out = arguments.out.as_deref().unwrap_or_else(|| Path::new("link.toml"));
    let delays = Delays { path: out.with_extension("delays.csv"), csv: fitted.delays_csv() };
    let scene = fitted.link.to_scene_toml(&delays.name());
    read_again(&scene, &fitted.link, out, &delays)?;
    let law_is_missing = arguments.require_law && delays.csv.is_some();
    let mut written: Vec<&Path> = Vec::new();
    if arguments.out.is_some() && !law_is_missing {
        if let Some(csv) = &delays.csv {
            write_file(&delays.path, csv)?;
            written.push(&delays.path);
        }
        write_file(out, &scene)?;
        written.push(out);
    }
    output::answer(
        arguments.json,
        DocumentSchema::FIT,
        &document! {
            #[serde(flatten)]
            fitted: &fitted,
            // The keys of a scene.
            scene: scene.as_str(),
            #[serde(flatten)]
            skew: skew.map(|skew| document! { skew: skew }),
            #[serde(flatten)]
            matched: matched.as_ref().map(|matched| document! { matched: matched }),
            clocks: &clocks,
        },
        || {
            describe(
                &fitted,
                &scene,
                &measurements,
                [matched.as_ref().map_or_else(Vec::new, Ends::describe), clocks::describe(&clocks, skew.as_ref())].concat(),
            )
        },
        written,
    )?;
    Ok(if law_is_missing { ExitCode::from(EXPECTATION) } else { ExitCode::SUCCESS })
}

/// Measurements as they were read.
struct Source {
    measurements: Measurements,
    /// Counts of a pair of captures.
    matched: Option<Ends>,
    /// `true` if both ends have one clock, as in a log of fates.
    has_one_clock: bool,
}

fn read(arguments: &FitArguments) -> Result<Source, Failure> {
    let path = &arguments.file;
    if let Some(receiver) = &arguments.receiver {
        let matched = captures::between(file::open_large(path)?, file::open_large(receiver)?, arguments.port)
            .map_err(|error| Failure::Input(format!("{}, {}: {error}", output::path(path), output::path(receiver))))?;
        let (measurements, ends) = Ends::of(matched);
        return Ok(Source { measurements, matched: Some(ends), has_one_clock: false });
    }
    let unreadable = |error| Failure::File { verb: "read", path: path.clone(), error };
    let mut from = file::open_large(path)?;
    let mut bytes = Vec::new();
    from.by_ref().take(HEAD).read_to_end(&mut bytes).map_err(unreadable)?;
    let named = |error: &dyn std::fmt::Display| Failure::Input(format!("{}: {error}", output::path(path)));
    if captures::is_capture(&bytes) {
        return Err(named(
            &"found the capture of one end: expected two, since a delay is the time from the one to the other: cohaptic fit SENDER RECEIVER \
              (of what `cohaptic link` did, give the file of --fates instead)",
        ));
    }
    if bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&bytes).starts_with(FateRow::HEADER.as_bytes()) {
        let measurements = Measurements::from_fates(&file::read_fates(path, bytes.chain(from))?);
        return Ok(Source { measurements, matched: None, has_one_clock: true });
    }
    // Any other table is read as a whole.
    from.limited_to(MOST_BYTES).and_then(|mut rest| rest.read_to_end(&mut bytes)).map_err(unreadable)?;
    let text = file::text_of(bytes, path)?;
    let measurements = Measurements::from_csv(&text).map_err(|error| named(&error))?;
    Ok(Source { measurements, matched: None, has_one_clock: false })
}

/// The first bytes of a file, which show of which kind it is.
const HEAD: u64 = 256;
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// `notes`: lines about what was read and about the clocks.
fn describe(fitted: &Fitted, scene: &str, measurements: &Measurements, notes: Vec<String>) -> String {
    let goodness = &fitted.goodness;
    let mut text = format!("{scene}\n");
    let mut line = |line: String| text.push_str(&format!("{line}\n"));
    let instants = measurements.instants();
    // The spacing is that of bursts where most gaps are zero.
    let are_bursts = 2 * instants <= goodness.packets;
    let (bursts, burst) = if are_bursts { (format!(" in {}", Counted(instants, "burst")), " burst") } else { (String::new(), "") };
    let spaced = if goodness.evenly_spaced { "evenly" } else { "unevenly" };
    line(format!(
        "{}{bursts}, {} arrived, one{burst} every {} ({spaced}); they say as much as {:.0} independent ones",
        Counted(goodness.packets, "packet"),
        goodness.received,
        milliseconds(goodness.spacing_s),
        goodness.effective
    ));
    notes.into_iter().for_each(&mut line);
    let error = goodness.mean_se_s.map_or_else(String::new, |error| format!(" +- {}", milliseconds(error)));
    line(format!(
        "mean {}{error}, standard deviation {} +- {}, least {}, in steps of {}",
        milliseconds(goodness.mean_s),
        milliseconds(goodness.sd_s),
        milliseconds(goodness.sd_se_s),
        milliseconds(goodness.least_s),
        step(goodness.resolution_s)
    ));
    line(format!("\n  {:<12}{:>14}{:>14}{:>14}{:>16}{:>12}{:>12}", "law", "mean", "sd", "floor", "AIC - best", "Kolmogorov", "p-value"));
    let best = goodness.laws.iter().map(|law| law.aic).fold(f64::INFINITY, f64::min);
    for law in &goodness.laws {
        let floor = law.floor_s.map_or_else(|| "-".to_owned(), milliseconds);
        let [mean, sd] = [law.mean_s, law.sd_s].map(milliseconds);
        let (name, aic) = (law.distribution.name(), law.aic - best);
        let mark = if law.fits { "" } else { "  *" };
        line(format!("  {name:<12}{mean:>14}{sd:>14}{floor:>14}{aic:>16.1}{:>12.5}{:>12.5}{mark}", law.kolmogorov, law.p_value));
    }
    if goodness.laws.iter().any(|law| !law.fits) {
        line(format!("  * does not fit: its distance from the delays (Kolmogorov) is above {:.5}", goodness.kolmogorov_limit));
    }
    if goodness.laws.first().is_none_or(|law| !law.fits) {
        line("no law fits: the link draws from the measured delays, a file that --out writes beside the link".to_owned());
    }
    match goodness.correlation {
        None => line("\ndelays are as good as independent".to_owned()),
        Some(correlation) => {
            let [time, lag] = [correlation.time_se_s.map(milliseconds), correlation.lag_one_se.map(|error| format!("{error:.5}"))]
                .map(|error| error.map_or_else(String::new, |error| format!(" +- {error}")));
            line(format!(
                "\ncorrelation time {}{time}, normal scores of neighbours {:.5}{lag}",
                milliseconds(correlation.time_s),
                correlation.lag_one
            ));
        }
    }
    line(format!("\n  {:<60}{:>12}{:>14}", "loss", "mean", "BIC - best"));
    let best = goodness.losses.first().map_or(0.0, |loss| loss.bic);
    for loss in &goodness.losses {
        line(format!("  {:<60}{:>10.5} %{:>14.1}", model(loss), loss.mean_loss * 100.0, loss.bic - best));
    }
    text
}

fn model(loss: &LossFit) -> String {
    match loss.model {
        LossModel::None => "none".to_owned(),
        LossModel::Independent { .. } => "independent".to_owned(),
        LossModel::GilbertElliott { p, r, h, k } => format!("Gilbert-Elliott p {p:.5} r {r:.5} h {h:.3} k {k:.5}"),
        LossModel::GilbertElliottInTime { mean_good_s, mean_bad_s } => format!("in time, good {mean_good_s:.4} s bad {mean_bad_s:.4} s"),
    }
}

/// A step of a clock: a round number, which a nanosecond may miss.
fn step(seconds: f64) -> Span {
    Span(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX))
}

fn milliseconds(seconds: f64) -> String {
    format!("{:.5} ms", seconds * 1e3)
}
