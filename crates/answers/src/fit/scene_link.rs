//! Reads a fitted link back, as a scene reads a link.

use std::io;
use std::path::Path;
use std::time::Duration;

use cohaptic_linkfile::document::Sources;
use cohaptic_linkfile::link::{read_link, read_modulators};
use cohaptic_linkfile::reading::{FileReader, parse_with};
use cohaptic_measure::fit::FittedLink;
use cohaptic_wan::{LinkConfig, LinkModel};

use super::{Beside, FitFailure};

/// Reads the link as a scene does before anything is written, and compares the moments of its delay with the fitted moments; `None` if nothing was fitted.
/// Returns the fitted link as a scene reads it. `file`: path of the file with the link. `beside`: the file that the link names, if it names one.
///
/// # Errors
///
/// [`FitFailure::Scene`] if a scene refuses the link, [`FitFailure::Unheld`] if a scene reads another mean or standard deviation.
pub(super) fn read_again(scene: &str, link: Option<&FittedLink>, file: &Path, beside: Option<&Beside>) -> Result<Option<LinkConfig>, FitFailure> {
    // The file named by the link does not exist yet, so its content is given here.
    let named = |_: &Path| beside.map(|beside| beside.content.as_bytes().to_vec()).ok_or_else(|| io::Error::from(io::ErrorKind::NotFound));
    let read = parse_with(Sources { file, text: scene, overrides: &[] }, FileReader(&named), |document, context| {
        let table = document.as_table()?;
        let modulators = read_modulators(table.get("modulators").map(|entry| &*entry.node), context)?;
        read_link(&table.get("link")?.node, context.with_modulators(Some(&modulators)))
    });
    let read = read.map_err(|error| FitFailure::Scene(Box::new(error)))?;
    let config = match read.whole {
        LinkModel::Fixed(config) => config,
        // Only recorded links are read as these models, and nothing was fitted of them, so this default is never returned.
        LinkModel::Modulated(_) | LinkModel::Replay(_) | LinkModel::Kernel(_) => LinkConfig::default(),
    };
    let Some(link) = link else { return Ok(None) };
    let delay = &config.delay;
    let read = [delay.mean(), delay.jitter().map_or(Duration::ZERO, |jitter| jitter.sd)].map(|span| span.as_secs_f64());
    for (what, found, read) in [("mean", link.delay_s, read[0]), ("standard deviation", link.jitter.sd_s, read[1])] {
        // The scene rounds to nanoseconds; the relative part allows for the rounding of `f64`.
        if (found - read).abs() > ROUNDING_S + 1e-12 * found {
            return Err(FitFailure::Unheld(format!(
                "the {what} of the delays is {found} s, and {read} s in a scene: expected one that a scene can hold"
            )));
        }
    }
    Ok(Some(config))
}

/// Resolution of the times in a scene \[s\].
const ROUNDING_S: f64 = 1e-9;
