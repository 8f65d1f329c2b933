//! `trajectory.csv`.

use std::path::Path;

use cohaptic_scene::Axes;
use cohaptic_units::print::Seconds;

use super::file::{RecordFile, push_display, push_f64};
use crate::TickRow;
use crate::record::RecordError;

/// Columns `t,peer,xh,vh,xo,vo,xd,vd,fc,ft`; with more axes, `yh,vyh,yo,vyo,yd,vyd,fcy,fty` and the same with z behind them.
#[derive(Debug)]
pub(crate) struct Trajectory {
    file: RecordFile,
    names: Vec<String>,
    line: Vec<u8>,
}

impl Trajectory {
    pub(crate) fn create(folder: &Path, names: Vec<String>, axes: Axes) -> Result<Self, RecordError> {
        let mut file = RecordFile::create(folder.join("trajectory.csv"))?;
        file.write(b"t,peer,xh,vh,xo,vo,xd,vd,fc,ft")?;
        for axis in ["y", "z"].into_iter().take(axes.count() - 1) {
            file.write(format!(",{axis}h,v{axis}h,{axis}o,v{axis}o,{axis}d,v{axis}d,fc{axis},ft{axis}").as_bytes())?;
        }
        file.write(b"\n")?;
        Ok(Self { file, names, line: Vec::new() })
    }

    pub(crate) fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), RecordError> {
        let line = &mut self.line;
        line.clear();
        push_display(line, Seconds(row.at));
        line.push(b',');
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
        line.push(b'\n');
        self.file.write(line)
    }

    pub(crate) fn finish(self) -> Result<std::path::PathBuf, RecordError> {
        self.file.finish()
    }
}
