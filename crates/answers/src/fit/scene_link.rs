//! Reads a fitted link back, as a scene reads a link.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_linkfile::document::Sources;
use cohaptic_linkfile::link::read_link;
use cohaptic_linkfile::reading::{FileReader, parse_with};
use cohaptic_measure::fit::FittedLink;
use cohaptic_wan::{Delay, LinkModel};

use super::FitFailure;

/// Reads the link as a scene does before anything is written, and compares the moments of its delay with the fitted moments. `file`: name of the file with the
/// link. `delays`: content of the file named by the link, if the link names a file.
///
/// # Errors
///
/// [`FitFailure::Scene`] if a scene refuses the link, [`FitFailure::Unheld`] if a scene reads another mean or standard deviation.
pub(super) fn read_again(scene: &str, link: &FittedLink, file: &Path, delays: Option<&str>) -> Result<(), FitFailure> {
    // The file named by the link does not exist yet, so its content is given here.
    let named = |_: &Path| delays.map(|csv| csv.as_bytes().to_vec()).ok_or_else(|| io::Error::from(io::ErrorKind::NotFound));
    let modulators = Arc::default();
    let read = parse_with(Sources { file, text: scene, overrides: &[] }, FileReader(&named), |document, context| {
        let link = document.as_table().and_then(|table| table.get("link"))?;
        read_link(&link.node, context.with_modulators(Some(&modulators)))
    });
    let delay = match read.map_err(|error| FitFailure::Scene(Box::new(error)))?.whole {
        LinkModel::Fixed(config) => config.delay,
        LinkModel::Modulated(_) | LinkModel::Replay(_) | LinkModel::Kernel(_) => Delay::default(),
    };
    let read = [delay.mean(), delay.jitter().map_or(Duration::ZERO, |jitter| jitter.sd)].map(|span| span.as_secs_f64());
    for (what, found, read) in [("mean", link.delay_s, read[0]), ("standard deviation", link.jitter.sd_s, read[1])] {
        // The scene rounds to nanoseconds; the relative part allows for the rounding of `f64`.
        if (found - read).abs() > ROUNDING_S + 1e-12 * found {
            return Err(FitFailure::Unheld(format!(
                "the {what} of the delays is {found} s, and {read} s in a scene: expected one that a scene can hold"
            )));
        }
    }
    Ok(())
}

/// Resolution of the times in a scene \[s\].
const ROUNDING_S: f64 = 1e-9;
