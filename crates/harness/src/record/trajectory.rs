//! `trajectory.csv`: states and forces at each tick of each peer.

use std::path::Path;

use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::{Axes, Scene};
use cohaptic_units::Instant;

use super::file::{RecordFile, create_folder, push_f64, push_seconds};
use crate::TickRow;
use crate::record::RecordError;

/// Rotating bodies of a scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Turns {
    Nothing,
    /// Copies of the object.
    Copies,
    /// Copies of the object, and at least one device.
    Devices,
}

impl Turns {
    pub(crate) fn of(scene: &Scene) -> Self {
        match &scene.rotation {
            None => Self::Nothing,
            Some(rotation) if rotation.peers.iter().all(|peer| peer.device.is_none()) => Self::Copies,
            Some(_) => Self::Devices,
        }
    }
}

fn push_attitude(line: &mut Vec<u8>, attitude: &Attitude) {
    for number in attitude.orientation.iter().chain(&attitude.rate) {
        line.push(b',');
        push_f64(line, *number);
    }
}

/// Writes the columns `t,peer,xh,vh,xo,vo,xd,vd,fc,ft`. A second axis adds `yh,vyh,yo,vyo,yd,vyd,fcy,fty`, and a third axis the same columns with z. If the
/// object turns, the attitude of the copy and the torques follow. If any device turns, the attitude of the device follows, empty for devices that do not turn.
#[derive(Debug)]
pub struct Trajectory {
    file: RecordFile,
    names: Vec<String>,
    turn: Turns,
    /// Instant of the latest row.
    at: Option<Instant>,
    /// Text of `at` with a comma: the beginning of all rows of this instant.
    beginning: Vec<u8>,
    line: Vec<u8>,
}

impl Trajectory {
    /// Creates the folder if needed and begins `trajectory.csv` for peers of the scene.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the folder or the file cannot be created.
    pub fn of_scene(folder: &Path, scene: &Scene) -> Result<Self, RecordError> {
        create_folder(folder)?;
        Self::create(folder, scene.peers.iter().map(|peer| peer.name.clone()).collect(), scene.axes, Turns::of(scene))
    }

    fn create(folder: &Path, names: Vec<String>, axes: Axes, turn: Turns) -> Result<Self, RecordError> {
        // Columns of the first axis have no axis in their names, so records of one axis stay as they are.
        let mut file = RecordFile::create(folder.join("trajectory.csv"))?;
        file.write(b"t,peer,xh,vh,xo,vo,xd,vd,fc,ft")?;
        for axis in ["y", "z"].into_iter().take(axes.count() - 1) {
            file.write(format!(",{axis}h,v{axis}h,{axis}o,v{axis}o,{axis}d,v{axis}d,fc{axis},ft{axis}").as_bytes())?;
        }
        if turn != Turns::Nothing {
            file.write(b",qw,qx,qy,qz,wx,wy,wz,tcx,tcy,tcz,ttx,tty,ttz")?;
        }
        if turn == Turns::Devices {
            file.write(b",qhw,qhx,qhy,qhz,whx,why,whz")?;
        }
        file.write(b"\n")?;
        Ok(Self { file, names, turn, at: None, beginning: Vec::new(), line: Vec::new() })
    }

    /// Writes the row of a tick. Rows must come in the order of time.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the row cannot be written.
    pub fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), RecordError> {
        let line = &mut self.line;
        line.clear();
        // All rows of an instant begin with the same text, which is formatted once.
        if self.at != Some(row.at) {
            self.at = Some(row.at);
            self.beginning.clear();
            push_seconds(&mut self.beginning, row.at);
            self.beginning.push(b',');
        }
        line.extend_from_slice(&self.beginning);
        line.extend_from_slice(self.names[row.peer].as_bytes());
        for axis in 0..row.coupling_force.len() {
            for body in [row.device, row.object, row.target] {
                for value in [body.position[axis], body.velocity[axis]] {
                    line.push(b',');
                    push_f64(line, value);
                }
            }
            for force in [row.coupling_force[axis], row.coordination_force[axis]] {
                line.push(b',');
                push_f64(line, force);
            }
        }
        if let Some(turn) = &row.turn {
            push_attitude(line, turn.object);
            for torque in turn.coupling_torque.iter().chain(turn.coordination_torque) {
                line.push(b',');
                push_f64(line, *torque);
            }
            match turn.device {
                Some(device) => push_attitude(line, device),
                // Seven empty cells keep the columns of a device that does not turn.
                None if self.turn == Turns::Devices => line.extend_from_slice(b",,,,,,,"),
                None => {}
            }
        }
        line.push(b'\n');
        self.file.write(line)
    }

    /// Gives the file its name, and returns the name.
    ///
    /// # Errors
    ///
    /// [`RecordError`] if the rest cannot be written or the file cannot be renamed.
    pub fn finish(self) -> Result<std::path::PathBuf, RecordError> {
        self.file.finish()
    }
}
