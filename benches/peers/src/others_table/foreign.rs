//! Programs in other languages: each reads a scene, and answers with a line of JSON.

use std::path::Path;
use std::process::Command;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::scripts;

/// The status of a script that finds what it needs not installed.
const SKIPPED: i32 = 77;

/// A program that runs the mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Foreign {
    /// ns-3's events alone.
    Ns3Scheduler,
    /// ns-3's point-to-point links and UDP sockets.
    Ns3Sockets,
    /// SimPy.
    SimPy,
}

/// What it says.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub struct Answer {
    /// Its name and version.
    pub program: String,
    /// The processor time that it took.
    pub seconds: f64,
    /// The packets that have arrived by the last tick.
    pub delivered: u64,
    /// The place of each copy after it \[m\].
    pub positions: Vec<f64>,
    /// What it does not model.
    pub lacks: String,
}

/// What came of running it.
#[derive(Clone, PartialEq, Debug)]
pub enum Ran<T> {
    /// It is not installed here: why.
    Skipped(String),
    /// It did.
    Answered(T),
}

impl Foreign {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Ns3Scheduler, Self::Ns3Sockets, Self::SimPy];

    /// What it is called where it is skipped.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ns3Scheduler => "ns-3, events alone",
            Self::Ns3Sockets => "ns-3, UDP over point-to-point links",
            Self::SimPy => "SimPy",
        }
    }

    /// Runs it on the scene in that file.
    #[must_use]
    pub fn run(self, scene: &Path) -> Ran<Answer> {
        let mut command = match self {
            Self::Ns3Scheduler | Self::Ns3Sockets => {
                let mut command = Command::new(scripts().join("ns3.sh"));
                command.arg("mesh");
                command
            }
            Self::SimPy => python("simpy_mesh.py"),
        };
        command.arg(scene);
        match self {
            Self::Ns3Scheduler => command.arg("scheduler"),
            Self::Ns3Sockets => command.arg("sockets"),
            Self::SimPy => &mut command,
        };
        answer(command)
    }
}

/// Python on one of the scripts: that of `$PYTHON`, or `python3`.
#[must_use]
pub fn python(script: &str) -> Command {
    let mut command = Command::new(std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into()));
    // Nothing is left beside the scripts.
    command.arg("-B").arg(scripts().join(script));
    command
}

/// Runs it, and reads its answer.
///
/// # Panics
///
/// If it fails, or answers what cannot be read.
#[must_use]
pub fn answer<T: DeserializeOwned>(mut command: Command) -> Ran<T> {
    let output = match command.output() {
        Ok(output) => output,
        Err(error) => return Ran::Skipped(format!("{}: {error}", command.get_program().display())),
    };
    let errors = String::from_utf8_lossy(&output.stderr);
    if output.status.code() == Some(SKIPPED) {
        return Ran::Skipped(errors.trim().to_owned());
    }
    assert!(output.status.success(), "{command:?}: {}: {errors}", output.status);
    Ran::Answered(serde_json::from_slice(&output.stdout).expect("a line of JSON"))
}

#[cfg(test)]
mod tests {
    use cohaptic_benches_peers::mesh::{Mesh, on_cohaptic};

    use super::*;
    use crate::scene_file;

    /// A program that is not installed is skipped here too, with the message of its script.
    #[test]
    fn those_that_are_installed_end_in_the_same_state() {
        let folder = std::env::temp_dir().join(format!("cohaptic-others-test-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for impaired in [false, true] {
            let mesh = Mesh { peers: 3, impaired };
            let path = folder.join("scene");
            scene_file::write(&path, mesh, 400);
            let expected = on_cohaptic::run(&on_cohaptic::scene(mesh, 400)).positions;
            for foreign in Foreign::ALL {
                match foreign.run(&path) {
                    Ran::Skipped(why) => eprintln!("{}: skipped. {why}", foreign.name()),
                    Ran::Answered(answer) => assert!(crate::compare(&answer.positions, &expected) < crate::SAME, "{answer:?} is not {expected:?}"),
                }
            }
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_script_that_lacks_something_is_skipped_with_its_message() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo nothing here >&2; exit 77"]);
        assert_eq!(answer::<Answer>(command), Ran::Skipped("nothing here".into()));
        assert!(matches!(answer::<Answer>(Command::new("/no/such/program")), Ran::Skipped(_)));
    }
}
