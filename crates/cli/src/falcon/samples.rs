//! Exchanges as rows of a table.

use std::io::{self, Write as _};
use std::path::Path;
use std::time::Duration;

use cohaptic_falcon::driver::Status;
use cohaptic_files::WholeFile;

use super::answer::buttons;
use crate::failure::Failure;
use crate::file::unwritten;
use crate::output;

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
pub(super) fn print(row: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    writeln!(out, "{row}").and_then(|()| out.flush()).map_err(Failure::StandardOutput)
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
