//! `cohaptic falcon watch`: reads a device, and pushes it gently.

use std::io::{self, IsTerminal as _, Write as _};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use cohaptic_falcon::driver::{DriverConfig, Phase, Status};
use cohaptic_falcon::kinematics::Triple;
use cohaptic_falcon::safety::Limits;
use cohaptic_files::WholeFile;
use serde::Serialize;

use super::answer::{self, Forces, Identity, Seen, Traffic, buttons};
use super::bench::{Bench, End, Go, Task};
use super::homing_guide::Guide;
use super::reach;
use crate::arguments::{Force, WatchArguments};
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::file::unwritten;
use crate::output;
use crate::progress::Progress;

/// From one row on standard output to the next, or one look of a person to the next.
const READABLE: Duration = Duration::from_millis(100);

#[derive(Serialize)]
struct WatchDocument {
    #[serde(flatten)]
    identity: Identity,
    firmware: &'static str,
    ending: &'static str,
    /// When forces first could go out, if they could.
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

/// Watches a device until the time is over or the user has seen enough.
pub(super) fn watch(arguments: &WatchArguments) -> Result<ExitCode, Failure> {
    let which = &arguments.which;
    let push = Push::of(arguments)?;
    let firmware = reach::read_firmware(which.firmware.as_deref())?;
    let target = reach::target(which)?;
    let mut way = target.open().map_err(|error| Failure::System(error.to_string()))?;
    let state = reach::make_ready(&mut way, firmware.as_ref()).map_err(Failure::System)?;
    let config = DriverConfig { limits: Limits { force: arguments.limit, ..Limits::DEFAULT }, ..DriverConfig::DEFAULT };
    let mut bench = Bench::open(way, config).map_err(|error| Failure::System(error.to_string()))?;
    let mut watching = Watching::new(push, arguments, *bench.status())?;
    let end = bench.run(arguments.length, &mut watching);
    watching.line.clear();
    // Whole rows up to the end, whatever that was.
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

/// What the grip is pushed with.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Push {
    Nothing,
    Force(Triple),
    Spring { stiffness: f64, damping: f64 },
}

impl Push {
    fn of(arguments: &WatchArguments) -> Result<Self, Failure> {
        match (arguments.force, arguments.spring) {
            (Some(Force(force)), _) => {
                let length = answer::length(force);
                if length > arguments.limit {
                    return Err(Failure::Input(format!(
                        "the force of {length} N is above the limit of {} N: ask for less, or raise --limit (docs/falcon.md says what is uncertain about newtons)",
                        arguments.limit
                    )));
                }
                Ok(Self::Force(force))
            }
            (None, Some(stiffness)) => Ok(Self::Spring { stiffness, damping: arguments.damping }),
            (None, None) => Ok(Self::Nothing),
        }
    }

    fn wants(&self, status: &Status) -> Option<Triple> {
        match *self {
            Self::Nothing => None,
            Self::Force(force) => Some(force),
            Self::Spring { stiffness, damping } => {
                let reading = status.reading?;
                Some(std::array::from_fn(|axis| -stiffness * reading.position[axis] - damping * reading.velocity[axis]))
            }
        }
    }
}

struct Watching {
    push: Push,
    guide: Guide,
    line: Progress,
    file: Option<SamplesFile>,
    /// Rows go to standard output: it is no terminal, and nobody wants a document.
    prints_rows: bool,
    next_look: Duration,
    last: Status,
    until: Duration,
    active_after: Option<Duration>,
    range: Option<(Triple, Triple)>,
    fastest: f64,
    largest_force: f64,
}

impl Watching {
    fn new(push: Push, arguments: &WatchArguments, last: Status) -> Result<Self, Failure> {
        let prints_rows = !arguments.which.json && !io::stdout().is_terminal();
        if prints_rows {
            print_row(HEADER)?;
        }
        Ok(Self {
            push,
            guide: Guide::new(push != Push::Nothing),
            line: Progress::new(0, "{msg}"),
            file: arguments.csv.as_deref().map(SamplesFile::create).transpose()?,
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

    fn note(&mut self, at: Duration, status: &Status) {
        (self.last, self.until) = (*status, at);
        if status.phase == Phase::Active {
            self.active_after.get_or_insert(at);
        }
        self.largest_force = self.largest_force.max(answer::length(status.force));
        if let Some(reading) = status.reading {
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
        self.push.wants(status)
    }

    fn look(&mut self, at: Duration, status: &Status) -> Result<Go, Failure> {
        self.note(at, status);
        self.guide.look(status, &self.line);
        if let Some(file) = &mut self.file {
            file.write(&row(at, status))?;
        }
        if at >= self.next_look {
            // The device's clock: rows do not pile up after a pause.
            self.next_look = at + READABLE;
            if self.prints_rows {
                print_row(&row(at, status))?;
            } else if self.line.is_seen() {
                self.line.show(shown(at, status));
            }
        }
        Ok(Go::On)
    }
}

/// The device in one line.
fn shown(at: Duration, status: &Status) -> String {
    let seen = Seen::of(status);
    let place = match (seen.position_m, seen.velocity_m_s) {
        (Some(position), Some(velocity)) => format!("{}, {:.3} m/s", answer::place(position), answer::length(velocity)),
        _ => format!("encoders {:?}", seen.encoders),
    };
    let [x, y, z] = seen.force_n;
    format!("{:.1} s {} ({}): {place}; force {x:.2}, {y:.2}, {z:.2} N; buttons {}", at.as_secs_f64(), seen.phase, seen.light, seen.buttons.join(" "))
}

/// The columns. Unknown values are left empty.
pub(super) const HEADER: &str = "t,phase,homed,encoder1,encoder2,encoder3,x,y,z,vx,vy,vz,fx,fy,fz,buttons";

/// A row, without its line break.
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

/// A file of them.
pub(super) struct SamplesFile {
    file: WholeFile,
}

impl SamplesFile {
    pub(super) fn create(path: &Path) -> Result<Self, Failure> {
        let create = || {
            let mut file = WholeFile::create(path)?;
            writeln!(file, "{HEADER}")?;
            Ok(Self { file })
        };
        create().map_err(unwritten(path))
    }

    pub(super) fn write(&mut self, row: &str) -> Result<(), Failure> {
        let written = writeln!(self.file, "{row}");
        written.map_err(unwritten(self.file.path()))
    }

    /// Gives the file its name; says it.
    pub(super) fn finish(self) -> Result<String, Failure> {
        let path = self.file.path().to_path_buf();
        self.file.finish().map_err(unwritten(&path))?;
        Ok(output::path(&path))
    }
}

/// Rows on standard output, each as soon as it is there.
pub(super) fn print_row(row: &str) -> Result<(), Failure> {
    output::raw(format!("{row}\n").as_bytes())
}

#[cfg(test)]
mod tests {
    use cohaptic_falcon::driver::{Driver, DriverConfig};
    use cohaptic_falcon::simulator::{SimulatedTransport, Simulator, SimulatorConfig, StillHand};

    use super::*;

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
