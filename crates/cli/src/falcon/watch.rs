//! `cohaptic falcon watch`: reads a device continuously, and optionally applies a constant force or a spring to the grip.

use std::io::{self, IsTerminal as _};
use std::process::ExitCode;
use std::time::Duration;

use cohaptic_falcon::driver::{DriverConfig, Phase, Reading, Status};
use cohaptic_falcon::kinematics::Triple;
use cohaptic_falcon::safety::Limits;
use serde::Serialize;

use super::answer::{self, Forces, Identity, Seen, Traffic, buttons};
use super::bench::{Bench, End, Go, Task};
use super::home::Guide;
use super::reach;
use crate::arguments::WatchArguments;
use crate::device_text::{SamplesFile, print_row, ruler};
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::output;
use crate::progress::Progress;
use crate::push::Push;

/// Time between two rows on standard output, or between two updates of the line on a terminal.
const READABLE: Duration = Duration::from_millis(100);

#[derive(Serialize)]
struct WatchDocument {
    #[serde(flatten)]
    identity: Identity,
    firmware: &'static str,
    ending: &'static str,
    /// Time at which the device first was active \[s\]; `None` if the device never was active.
    active_after_s: Option<f64>,
    #[serde(flatten)]
    traffic: Traffic,
    #[serde(flatten)]
    seen: Seen,
    lowest_m: Option<[f64; 3]>,
    highest_m: Option<[f64; 3]>,
    fastest_m_s: f64,
    forces: Forces,
    files: Vec<String>,
}

/// Watches a device until the time limit passes or the user interrupts the command, and writes the answer.
pub(super) fn watch(arguments: &WatchArguments) -> Result<ExitCode, Failure> {
    let which = &arguments.which;
    let push = Push::of(arguments.force, arguments.spring, arguments.damping, arguments.limit)?;
    let firmware = reach::read_firmware(which.firmware.as_deref())?;
    let target = reach::target(which)?;
    let mut way = target.open().map_err(|error| Failure::System(error.to_string()))?;
    let state = reach::make_ready(&mut way, firmware.as_ref()).map_err(Failure::System)?;
    let config = DriverConfig { limits: Limits { force: arguments.limit, ..Limits::DEFAULT }, ..DriverConfig::DEFAULT };
    let mut bench = Bench::open(way, config).map_err(|error| Failure::System(error.to_string()))?;
    let mut watching = Watching::new(push, arguments, *bench.status())?;
    let end = bench.run(arguments.length, &mut watching);
    // The line is cleared before any failure is printed.
    watching.line.clear();
    // The file is finished before an error of the loop is returned, so that the rows written up to the error are kept.
    let files = watching.file.take().map(SamplesFile::finish).transpose()?.into_iter().collect();
    let end = end?;
    let document = WatchDocument {
        identity: Identity::of(&target),
        firmware: state.name(),
        ending: end.name(),
        active_after_s: watching.active_after.map(|after| after.as_secs_f64()),
        traffic: Traffic::of(&bench, watching.until),
        seen: Seen::of(&watching.last),
        lowest_m: watching.range.map(|(lowest, _)| lowest),
        highest_m: watching.range.map(|(_, highest)| highest),
        fastest_m_s: watching.fastest,
        forces: Forces::of(&bench, arguments.limit, watching.largest_force),
        files,
    };
    // Rows on standard output leave no room for the answer: a reader of rows would stumble over words.
    if which.json {
        output::json(DocumentSchema::FALCON_WATCH, &document)?;
    } else if !watching.prints_rows {
        output::text(&document.describe(&target.name()))?;
    }
    if !which.json {
        output::wrote(&document.files);
    }
    match end {
        End::Enough | End::Over => Ok(ExitCode::SUCCESS),
        End::Interrupted => Ok(ExitCode::from(INTERRUPTED)),
        End::Failed(error) => Err(Failure::System(error.to_string())),
    }
}

impl WatchDocument {
    fn describe(&self, name: &str) -> String {
        let mut lines = Vec::new();
        lines.extend(answer::traffic(&self.traffic));
        lines.extend(self.seen.position_m.map(|position| format!("the grip is at {} from the origin", answer::place(position))));
        if let (Some(lowest), Some(highest)) = (self.lowest_m, self.highest_m) {
            lines.push(format!("it was between {} and {}; at most {:.3} m/s fast", answer::place(lowest), answer::place(highest), self.fastest_m_s));
        }
        lines.extend(answer::seen(&self.seen));
        lines.push(answer::forces(&self.forces));
        answer::block(name, &lines)
    }
}

/// The task of `watch`: applies the push, writes the rows, and collects the values of the answer.
struct Watching {
    push: Push,
    guide: Guide,
    line: Progress,
    file: Option<SamplesFile>,
    /// `true` if rows go to standard output: standard output is no terminal, and no JSON document is asked for.
    prints_rows: bool,
    /// Time of the next row on standard output, or of the next update of the terminal's line.
    next_look: Duration,
    /// Status after the last exchange.
    last: Status,
    /// Time from the first exchange to the end of the last.
    until: Duration,
    /// Time at which the device first was active.
    active_after: Option<Duration>,
    /// Lowest and highest position on each axis \[m\]; `None` before the first reading.
    range: Option<(Triple, Triple)>,
    /// Largest speed of the grip \[m/s\].
    fastest: f64,
    /// Length of the largest force that the driver sent \[N\].
    largest_force: f64,
}

impl Watching {
    fn new(push: Push, arguments: &WatchArguments, last: Status) -> Result<Self, Failure> {
        let prints_rows = !arguments.which.json && !io::stdout().is_terminal();
        // The header is printed before the device is read, so that a reader of the rows sees the columns at once.
        if prints_rows {
            print_row(HEADER)?;
        }
        Ok(Self {
            push,
            guide: Guide::new(push != Push::Nothing),
            line: Progress::new(0, "{msg}"),
            file: arguments.csv.as_deref().map(|path| SamplesFile::create(path, HEADER)).transpose()?,
            prints_rows,
            next_look: Duration::ZERO,
            last,
            until: Duration::ZERO,
            active_after: None,
            range: None,
            fastest: 0.0,
            largest_force: 0.0,
        })
    }

    /// Takes the status at `at` into the values of the answer.
    fn note(&mut self, at: Duration, status: &Status) {
        (self.last, self.until) = (*status, at);
        if status.phase == Phase::Active {
            self.active_after.get_or_insert(at);
        }
        self.largest_force = self.largest_force.max(answer::length(status.force));
        if let Some(reading) = status.reading {
            // The first reading begins the range: before homing no position is known.
            let (lowest, highest) = self.range.get_or_insert((reading.position, reading.position));
            for (axis, part) in reading.position.into_iter().enumerate() {
                (lowest[axis], highest[axis]) = (lowest[axis].min(part), highest[axis].max(part));
            }
            self.fastest = self.fastest.max(answer::length(reading.velocity));
        }
    }
}

impl Task for Watching {
    fn wants(&mut self, _at: Duration, status: &Status) -> Option<Triple> {
        self.push.wants(status.reading.map(|reading| (reading.position, reading.velocity)))
    }

    fn look(&mut self, at: Duration, status: &Status) -> Result<Go, Failure> {
        self.note(at, status);
        self.guide.look(status, &self.line);
        if let Some(file) = &mut self.file {
            file.write(&row(at, status))?;
        }
        if at >= self.next_look {
            // Counted from the present exchange, not from the last due time: no burst of rows follows a pause.
            self.next_look = at + READABLE;
            if self.prints_rows {
                print_row(&row(at, &rounded(status)))?;
            } else if self.line.is_seen() {
                self.line.show(shown(at, status));
            }
        }
        Ok(Go::On)
    }
}

/// Returns the state of the device for a terminal: a line about the device, and a line per axis with the place of the grip. Encoders stand in for an unknown
/// position.
fn shown(at: Duration, status: &Status) -> String {
    let seen = Seen::of(status);
    let pressed = if seen.buttons.is_empty() { "none".to_owned() } else { seen.buttons.join(", ") };
    let mut text = format!("{:.1} s, {}, {} light, buttons pressed: {pressed}", at.as_secs_f64(), seen.phase, seen.light);
    let (Some(position), Some(velocity)) = (seen.position_m, seen.velocity_m_s) else {
        let [top, right, left] = seen.encoders;
        return format!("{text}\n  encoders: top {top}, right {right}, left {left}; the position is known once the device is homed");
    };
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        // Rounded here, because -0.04 would be shown as -0.0.
        let place = (1e4 * position[axis]).round() / 10.0 + 0.0;
        text.push_str(&format!("\n  {name} [{}] {place:>6.1} mm  force {:>5.2} N", ruler(place), seen.force_n[axis]));
    }
    format!("{text}\n  speed {:.3} m/s", answer::length(velocity))
}

/// Header of the CSV rows. Times are in s, positions in m, velocities in m/s, forces in N. Unknown values are empty.
pub(super) const HEADER: &str = "t,phase,homed,encoder1,encoder2,encoder3,x,y,z,vx,vy,vz,fx,fy,fz,buttons";

/// Returns the CSV row of the status at `at`, without a line break.
pub(super) fn row(at: Duration, status: &Status) -> String {
    let Status { phase, homed, encoders: [top, right, left], reading, force, .. } = status;
    let homed: String = homed.map(|homed| if homed { '1' } else { '0' }).iter().collect();
    let place = reading.map_or_else(
        || ",,,,,".to_owned(),
        |reading| {
            let [[x, y, z], [vx, vy, vz]] = [reading.position, reading.velocity];
            format!("{x},{y},{z},{vx},{vy},{vz}")
        },
    );
    let [fx, fy, fz] = force;
    let pressed = buttons(status.buttons).join(" ");
    format!("{:.6},{},{homed},{top},{right},{left},{place},{fx},{fy},{fz},{pressed}", at.as_secs_f64(), phase.name())
}

/// Returns the status for a row that people may read too: position to 1 µm, velocity to 1 µm/s, force to 1 µN. The device is coarser: an encoder count is at
/// least 20 µm. Without the rounding an axis at rest shows the rounding errors of the kinematics, such as -0.00000000000000000043.
fn rounded(status: &Status) -> Status {
    // -0.0 + 0.0 is 0.0, so that no cell is a negative zero.
    let millionths = |values: Triple| values.map(|value| (1e6 * value).round() / 1e6 + 0.0);
    let reading = status.reading.map(|reading| Reading { position: millionths(reading.position), velocity: millionths(reading.velocity), ..reading });
    Status { reading, force: millionths(status.force), ..*status }
}

#[cfg(test)]
mod tests {
    use cohaptic_falcon::driver::{Driver, DriverConfig};
    use cohaptic_falcon::simulator::{SimulatedTransport, Simulator, SimulatorConfig, StillHand};
    use cohaptic_units::Instant;

    use super::*;

    #[test]
    fn people_see_where_the_grip_is() {
        let simulator = Simulator::new(SimulatorConfig { running: true, ..SimulatorConfig::default() }, StillHand);
        let driver = Driver::open(SimulatedTransport::in_virtual_time(simulator), DriverConfig::DEFAULT).unwrap();
        let unknown = shown(Duration::ZERO, driver.status());
        assert_eq!(
            unknown,
            "0.0 s, silent, red light, buttons pressed: none\n  encoders: top 0, right 0, left 0; the position is known once the device is homed"
        );
        let reading = Reading { at: Instant::ZERO, position: [-0.000_04, -0.02, 0.0305], velocity: [0.0, 0.0, 0.5] };
        // Less than half of the last decimal to the left of the origin is no negative zero.
        let known = shown(Duration::from_millis(2500), &Status { reading: Some(reading), force: [0.0, 0.0, -0.3], ..*driver.status() });
        assert_eq!(
            known.lines().skip(1).collect::<Vec<_>>(),
            [
                "  x [---------------o---------------]    0.0 mm  force  0.00 N",
                "  y [----------o----|---------------]  -20.0 mm  force  0.00 N",
                "  z [---------------|-------o-------]   30.5 mm  force -0.30 N",
                "  speed 0.500 m/s"
            ]
        );
    }

    #[test]
    fn rows_for_people_lose_the_digits_that_the_file_keeps() {
        let simulator = Simulator::new(SimulatorConfig { running: true, ..SimulatorConfig::default() }, StillHand);
        let driver = Driver::open(SimulatedTransport::in_virtual_time(simulator), DriverConfig::DEFAULT).unwrap();
        let reading = Reading { at: Instant::ZERO, position: [-4.3e-19, 0.049_242_688, -2e-7], velocity: [-1.2e-18, 0.0, 0.071_598_6] };
        let status = Status { reading: Some(reading), force: [4.4e-18, -0.25, -0.5], ..*driver.status() };
        let [kept, shown] = [row(Duration::ZERO, &status), row(Duration::ZERO, &rounded(&status))];
        assert!(kept.contains("0.049242688,-0.0000002,") && kept.contains(",0.0715986,"), "{kept}");
        assert!(shown.ends_with(",0,0.049243,0,0,0,0.071599,0,-0.25,-0.5,"), "{shown}");
    }

    #[test]
    fn what_is_not_known_is_empty_and_every_row_has_all_columns() {
        let simulator = Simulator::new(SimulatorConfig { running: true, ..SimulatorConfig::default() }, StillHand);
        let mut driver = Driver::open(SimulatedTransport::in_virtual_time(simulator), DriverConfig::DEFAULT).unwrap();
        let before = row(Duration::ZERO, driver.status());
        assert_eq!(before, "0.000000,silent,000,0,0,0,,,,,,,0,0,0,");
        let status = driver.exchange(None).unwrap();
        let after = row(Duration::from_millis(1), status);
        assert!(after.starts_with("0.001000,homing,000,"), "{after}");
        assert_eq!((before.matches(',').count(), after.matches(',').count()), (15, 15));
        assert_eq!(HEADER.matches(',').count(), 15);
    }
}
