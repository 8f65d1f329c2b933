//! `cohaptic inverse3 watch`: reads a device continuously, and optionally applies a constant force or a spring to the hand.

use std::fmt::Write as _;
use std::io::{self, IsTerminal as _};
use std::process::ExitCode;
use std::time::Duration;

use cohaptic_inverse3::client::{Phase, Snapshot};
use serde::Serialize;

use super::answer::{self, Exchanges, Identity, Seen};
use super::bench::{self, End, PERIOD, Task};
use crate::arguments::Inverse3WatchArguments;
use crate::device_text::{SamplesFile, Triple, block, length, place, print_row, ruler};
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INPUT_OUTPUT, INTERRUPTED};
use crate::output;
use crate::progress::Progress;
use crate::push::Push;
use crate::realtime::say;

/// Time between two rows on standard output, or between two updates of the lines on a terminal.
const READABLE: Duration = Duration::from_millis(100);

#[derive(Serialize)]
struct WatchDocument {
    #[serde(flatten)]
    identity: Identity,
    ending: &'static str,
    /// Time at which the device first was armed \[s\]; `None` if the device never was.
    active_after_s: Option<f64>,
    #[serde(flatten)]
    seen: Option<Seen>,
    lowest_m: Option<Triple>,
    highest_m: Option<Triple>,
    fastest_m_s: f64,
    exchanges: Exchanges,
    files: Vec<String>,
}

/// Watches a device until the time limit passes or the user interrupts the command, and writes the answer.
pub(super) fn watch(arguments: &Inverse3WatchArguments) -> Result<ExitCode, Failure> {
    let push = Push::of(arguments.force, arguments.spring, arguments.damping, arguments.limit)?;
    let mut watching = Watching::new(push, arguments)?;
    let ran = bench::run(&arguments.which, arguments.limit, arguments.length, &mut watching);
    // The lines are cleared before any failure is printed, and the rows written up to a failure are kept.
    watching.line.clear();
    let files: Vec<String> = watching.file.take().map(SamplesFile::finish).transpose()?.into_iter().collect();
    let (end, summary) = ran?;
    let document = WatchDocument {
        identity: Identity::of(&summary, arguments.which.simulated),
        ending: end.name(),
        active_after_s: watching.active_after.map(|after| after.as_secs_f64()),
        seen: watching.last.as_ref().map(Seen::of),
        lowest_m: watching.range.map(|(lowest, _)| lowest),
        highest_m: watching.range.map(|(_, highest)| highest),
        fastest_m_s: watching.fastest,
        exchanges: Exchanges::of(&summary.report, PERIOD),
        files,
    };
    // Rows on standard output leave no room for the answer: a program that reads rows would not understand words.
    if arguments.which.json {
        output::json(DocumentSchema::INVERSE3_WATCH, &document)?;
    } else {
        if !watching.prints_rows {
            output::text(&document.describe(watching.last.as_ref()))?;
        }
        output::wrote(&document.files);
    }
    Ok(ExitCode::from(match end {
        End::Interrupted => INTERRUPTED,
        End::Over => 0,
        End::Failed => INPUT_OUTPUT,
    }))
}

impl WatchDocument {
    fn describe(&self, last: Option<&Snapshot>) -> String {
        let mut lines = self.identity.lines();
        lines.extend(last.into_iter().flat_map(answer::seen));
        if let (Some(lowest), Some(highest)) = (self.lowest_m, self.highest_m) {
            lines.push(format!("it was between {} and {}; at most {:.3} m/s fast", place(lowest), place(highest), self.fastest_m_s));
        }
        lines.extend(self.exchanges.lines());
        block(&self.identity.name(), &lines)
    }
}

/// The task of `watch`: applies the push, writes the rows, and collects the values of the answer.
struct Watching {
    push: Push,
    line: Progress,
    file: Option<SamplesFile>,
    /// `true` if rows go to standard output: standard output is no terminal, and no JSON document is asked for.
    prints_rows: bool,
    /// Time of the next row on standard output, or of the next update of the terminal's lines.
    next_look: Duration,
    last: Option<Snapshot>,
    /// Phase said last.
    said: Option<Phase>,
    active_after: Option<Duration>,
    /// Lowest and highest position on each axis \[m\]; `None` before the first reading.
    range: Option<(Triple, Triple)>,
    /// Largest speed of the cursor \[m/s\].
    fastest: f64,
}

impl Watching {
    fn new(push: Push, arguments: &Inverse3WatchArguments) -> Result<Self, Failure> {
        let prints_rows = !arguments.which.json && !io::stdout().is_terminal();
        // The header is printed before the device is read, so that a reader of the rows sees the columns at once.
        if prints_rows {
            print_row(HEADER)?;
        }
        Ok(Self {
            push,
            line: Progress::new(0, "{msg}"),
            file: arguments.csv.as_deref().map(|path| SamplesFile::create(path, HEADER)).transpose()?,
            prints_rows,
            next_look: Duration::ZERO,
            last: None,
            said: None,
            active_after: None,
            range: None,
            fastest: 0.0,
        })
    }

    /// Takes the state at `at` into the values of the answer.
    fn note(&mut self, at: Duration, snapshot: &Snapshot) {
        self.last = Some(*snapshot);
        if snapshot.phase == Phase::Active {
            self.active_after.get_or_insert(at);
        }
        if self.said != Some(snapshot.phase) {
            self.said = Some(snapshot.phase);
            let (phase, hint) = (snapshot.phase.name(), snapshot.phase.hint());
            self.line.aside(|| say(&if hint.is_empty() { phase.to_owned() } else { format!("{phase}: {hint}") }));
        }
        if let Some((reading, _)) = snapshot.reading {
            let (lowest, highest) = self.range.get_or_insert((reading.position, reading.position));
            for (axis, part) in reading.position.into_iter().enumerate() {
                (lowest[axis], highest[axis]) = (lowest[axis].min(part), highest[axis].max(part));
            }
            self.fastest = self.fastest.max(length(reading.velocity));
        }
    }
}

impl Task for Watching {
    fn wants(&self, snapshot: &Snapshot) -> Option<Triple> {
        self.push.wants(snapshot.for_peer().map(|reading| (reading.position, reading.velocity)))
    }

    fn look(&mut self, at: Duration, snapshot: &Snapshot) -> Result<(), Failure> {
        self.note(at, snapshot);
        if let Some(file) = &mut self.file {
            file.write(&row(at, snapshot))?;
        }
        if at >= self.next_look {
            // Counted from the present turn, not from the last due time: no burst of rows follows a pause.
            self.next_look = at + READABLE;
            if self.prints_rows {
                print_row(&row(at, snapshot))?;
            } else if self.line.is_seen() {
                self.line.show(shown(at, snapshot));
            }
        }
        Ok(())
    }
}

/// Returns the state of the device for a terminal: a line about the device, and a line per axis with the place of the cursor.
fn shown(at: Duration, snapshot: &Snapshot) -> String {
    let mut text = format!("{:.1} s, {}", at.as_secs_f64(), snapshot.phase.name());
    let Some((reading, _)) = snapshot.reading else { return text };
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        // Rounded here, because -0.04 would be shown as -0.0.
        let place = (1e4 * reading.position[axis]).round() / 10.0 + 0.0;
        let _ = write!(text, "\n  {name} [{}] {place:>6.1} mm  force {:>5.2} N", ruler(place), snapshot.force[axis]);
    }
    let _ = write!(text, "\n  speed {:.3} m/s", length(reading.velocity));
    text
}

/// Header of the CSV rows. Times are in s, positions in m, velocities in m/s, forces in N. Unknown values are empty.
const HEADER: &str = "t,phase,x,y,z,vx,vy,vz,fx,fy,fz";

/// Returns the CSV row of the state at `at`, without a line break.
fn row(at: Duration, snapshot: &Snapshot) -> String {
    let place = snapshot.reading.map_or_else(
        || ",,,,,".to_owned(),
        |(reading, _)| {
            let [[x, y, z], [vx, vy, vz]] = [reading.position, reading.velocity];
            format!("{x},{y},{z},{vx},{vy},{vz}")
        },
    );
    let [fx, fy, fz] = snapshot.force;
    format!("{:.6},{},{place},{fx},{fy},{fz}", at.as_secs_f64(), snapshot.phase.name())
}

#[cfg(test)]
mod tests {
    use cohaptic_device::Reading;
    use cohaptic_units::Instant;

    use super::*;

    #[test]
    fn people_see_where_the_cursor_is_and_files_have_rows() {
        let unknown = Snapshot::default();
        assert_eq!(shown(Duration::ZERO, &unknown), "0.0 s, connecting");
        assert_eq!(row(Duration::ZERO, &unknown), "0.000000,connecting,,,,,,,0,0,0");
        let reading = Reading { position: [-0.000_04, -0.02, 0.0305], velocity: [0.0, 0.0, 0.5] };
        let known = Snapshot { phase: Phase::Active, reading: Some((reading, Instant::ZERO)), force: [0.0, 0.0, -0.3], ..unknown };
        let text = shown(Duration::from_millis(2500), &known);
        assert!(text.starts_with("2.5 s, active\n  x [---------------o---------------]    0.0 mm  force  0.00 N\n"), "{text}");
        assert!(text.ends_with("  z [---------------|-------o-------]   30.5 mm  force -0.30 N\n  speed 0.500 m/s"), "{text}");
        assert_eq!(row(Duration::from_millis(2500), &known), "2.500000,active,-0.00004,-0.02,0.0305,0,0,0.5,0,0,-0.3");
        assert_eq!(row(Duration::ZERO, &known).matches(',').count(), HEADER.matches(',').count());
    }
}
