//! Records of a run: CSV files and plots. CSV rows are written during the run and curves are kept in bounded memory, so a long run needs no more memory.
//!
//! | file | holds |
//! | --- | --- |
//! | `trajectory.csv` | one row a peer and tick: the state at t and the forces computed at t |
//! | `packets.csv` | one row a packet, in the order of arrival or drop |
//! | `links.csv` | one row a link or access line: its counters at the end |
//! | `task.csv`, `task-events.csv` | of a scene with a task: one row a judged instant: target, error; one row an event |
//! | `inputs.csv` | of a live session: one row a thing that came in from outside |
//! | `positions.svg`, `forces.svg` | plots over time; the targets of a task stand in the positions |
//! | `orientations.svg`, `views.svg` | of an object that turns: rotation vectors over time; the copies from three sides |
//! | `network.svg` | delays, losses and the distribution of the delay of up to six links |
//!
//! A file is written under the name `….partial` and gets its final name when complete. Numbers have the fewest digits from which the same `f64` is read back.

mod band;
mod file;
mod inputs;
mod links;
mod network;
mod packets;
mod pictures;
mod plot;
mod recorder;
mod targets;
mod task;
mod trajectory;
mod views;

pub use band::Bands;
pub use file::{RecordError, RecordFile};
pub use inputs::InputRecorder;
pub use links::links_csv;
pub use pictures::{Pictures, RecordedPicture};
pub use plot::SANE_POSITION;
pub use recorder::Recorder;
pub use trajectory::Trajectory;
