//! Reads the recorded inputs of a live session (`run --inputs`), and checks that the session had the same scene.

use std::io::{self, Write as _};
use std::path::Path;

use cohaptic_harness::live::{Inputs, InputsError, RecordedScene};
use cohaptic_scene::{Scene, link_keys_of_text, scene_content_of_text};
use cohaptic_units::visible_lines;

use crate::arguments::RunArguments;
use crate::failure::Failure;
use crate::{file, input, output};

/// Largest number of differences that a message lists.
const MOST: usize = 20;

/// Reads `inputs.csv` of a session. Returns the inputs, and the differences between `scene` and the scene of the session together with the missing parts of the
/// record.
///
/// # Errors
///
/// [`Failure::Input`] if the record is not valid. Without `--force` also if there is any difference, or if the record is cut short.
pub(super) fn read(file: &Path, scene: &Scene, arguments: &RunArguments, overrides: &[String]) -> Result<(Inputs, Vec<String>), Failure> {
    let path = &arguments.scene.scene;
    let text = file::read_text(file)?;
    let unreadable = |error: InputsError| Failure::Input(format!("{}: {error}", output::path(file)));
    let of_the_session = RecordedScene::read(&text).map_err(unreadable)?;
    let mut differences: Vec<String> = match of_the_session {
        Some(recorded) => {
            // The content of the scene is compared key by key, so that the message names the keys that differ.
            let now = RecordedScene::of(scene, input::with(path, |text, file| scene_content_of_text(text, file, overrides))?);
            recorded.differences(&now).iter().map(ToString::to_string).collect()
        }
        None => vec!["unknown: the record is of an older version, which did not keep the scene that it was made with".to_owned()],
    };
    if !differences.is_empty() {
        let said = listed(&differences);
        let (record, scene) = (output::path(file), output::path(input::named(path)));
        let message = format!("{record} is the record of a session with another scene than {scene} with these overrides. What differs:\n{said}");
        if !arguments.force {
            let way_out = "expected the scene and every --set of the session, which its summary ends with; --force replays it all the same";
            return Err(Failure::Input(format!("{message}{way_out}")));
        }
        // If standard error cannot be written to, the differences still stand in the document.
        let _ = write!(io::stderr(), "warning: {}", visible_lines(&message));
    }
    // The keys of any link serve, because all links have the modulators of the scene.
    let keys = input::with(path, |text, file| link_keys_of_text(text, file, overrides))?.into_values().next().unwrap_or_default();
    let (inputs, missing) = Inputs::read_cut(&text, scene, &keys).map_err(unreadable)?;
    if let Some(missing) = missing {
        let message = format!("{}: {missing}", output::path(file));
        if !arguments.force {
            let as_far = if matches!(missing, InputsError::Rows { .. }) { "the rows that are there" } else { "it up to its last whole line" };
            return Err(Failure::Input(format!("{message}; --force replays {as_far}")));
        }
        let _ = writeln!(io::stderr(), "warning: {}", visible_lines(&message));
        differences.push(missing.to_string());
    }
    Ok((inputs, differences))
}

/// Formats one line per difference, for at most [`MOST`] differences, and a last line with the number of the rest.
fn listed(differences: &[String]) -> String {
    let mut text: String = differences.iter().take(MOST).map(|difference| format!("  {difference}\n")).collect();
    if let Some(more) = differences.len().checked_sub(MOST).filter(|more| *more > 0) {
        text.push_str(&format!("  and {more} more\n"));
    }
    text
}
