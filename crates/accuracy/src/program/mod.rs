//! The program: measures in one thread, while the main thread waits for rows and for Ctrl-C.
//!
//! A row can take many seconds, during which no thread asks whether to go on. Rows and signals therefore come through one channel: at a signal the rows received so
//! far are written at once, and the end of the process ends the measurement.

mod about;
mod arguments;
mod conclusion;
mod failure;

use std::io::{self, IsTerminal as _, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;
use std::time::{Duration, Instant};

use cohaptic_accuracy::{About, AccuracyError, Row, Watch, measure};
use cohaptic_files::OwnFolder;
use cohaptic_units::visible_lines;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

pub(crate) use self::arguments::Arguments;
use self::conclusion::Conclusion;
use self::failure::{Failure, INTERRUPTED};

/// Message to the waiting thread.
enum Event {
    Row(Box<Row>),
    /// The measurement has ended by itself.
    Ended(Result<(), AccuracyError>),
    /// The user asks for the end.
    Interrupted,
}

/// End of a measurement.
enum Ending {
    Whole,
    Interrupted,
    Fault(AccuracyError),
}

/// Measures, writes and prints, and returns the exit status.
pub(crate) fn run(arguments: &Arguments) -> ExitCode {
    measured(arguments).unwrap_or_else(|failure| report(&failure))
}

/// Prints help, the version, or the fault of the arguments, and returns the exit status.
pub(crate) fn usage(error: &clap::Error) -> ExitCode {
    // On a terminal clap prints the message itself, with colours.
    if error.use_stderr() || io::stdout().is_terminal() {
        error.exit();
    }
    conclusion::print(error.render().to_string().as_bytes()).map_or_else(|failure| report(&failure), |()| ExitCode::SUCCESS)
}

fn report(failure: &Failure) -> ExitCode {
    if !failure.is_closed_pipe() {
        // If standard error cannot be written to either, the exit status is all that is left.
        let _ = writeln!(io::stderr(), "{}", visible_lines(&format!("error: {}", failure.message())));
    }
    ExitCode::from(failure.status())
}

fn measured(arguments: &Arguments) -> Result<ExitCode, Failure> {
    // Before the measurement: a folder without access must not cost ten minutes of measuring.
    let own = |folder: &PathBuf| OwnFolder::take(folder).map_err(|error| Failure::File { verb: "write", path: folder.clone(), error });
    let _own = arguments.out.as_ref().map(own).transpose()?;
    let start = Instant::now();
    let (sender, events) = mpsc::channel();
    let to_interrupt = sender.clone();
    // Where no handler can be installed, signals end the program as they always do.
    let _ = ctrlc::set_handler(move || {
        // After the end of the other thread a second signal finds nobody to tell and ends the program: a pipe that nobody reads would keep it for ever.
        if to_interrupt.send(Event::Interrupted).is_err() {
            std::process::exit(i32::from(INTERRUPTED));
        }
    });
    let (subjects, options) = (arguments.subjects().to_vec(), arguments.options());
    thread::spawn(move || {
        let ended = measure(&subjects, options, &Reporter(sender.clone())).map(drop);
        // Nobody listens after an interruption.
        let _ = sender.send(Event::Ended(ended));
    });
    let (rows, ending) = wait(events);
    let about = About { line: about::line(&arguments.command()), partial: !matches!(ending, Ending::Whole) };
    let wall_s = start.elapsed().as_secs_f64();
    Conclusion { rows: &rows, about, out: arguments.out.as_deref(), json: arguments.json, size: arguments.size(), wall_s }.tell()?;
    match ending {
        Ending::Whole => Ok(ExitCode::SUCCESS),
        Ending::Interrupted => Ok(ExitCode::from(INTERRUPTED)),
        Ending::Fault(error) => Err(Failure::Measurement(error)),
    }
}

/// Collects rows until the measurement ends or the user asks for the end. Takes the channel, so that a later signal finds it closed.
#[expect(clippy::needless_pass_by_value, reason = "the end of the function closes the channel")]
fn wait(events: Receiver<Event>) -> (Vec<Row>, Ending) {
    let bar = progress();
    let mut rows = Vec::new();
    let ending = loop {
        match events.recv() {
            Ok(Event::Row(row)) => {
                bar.inc(1);
                bar.set_message(format!("{}, {}", row.subject.name(), row.case));
                rows.push(*row);
            }
            Ok(Event::Ended(Ok(()))) => break Ending::Whole,
            Ok(Event::Ended(Err(error))) => break Ending::Fault(error),
            Ok(Event::Interrupted) | Err(mpsc::RecvError) => break Ending::Interrupted,
        }
    };
    bar.finish_and_clear();
    (rows, ending)
}

/// Returns a line on standard error with the number of rows; hidden unless standard error is a terminal.
fn progress() -> ProgressBar {
    let target = if io::stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let style = ProgressStyle::with_template("{spinner} {pos} rows measured, {elapsed} passed: {msg}");
    let bar = ProgressBar::with_draw_target(None, target).with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
    if !bar.is_hidden() {
        bar.enable_steady_tick(Duration::from_millis(500));
    }
    bar
}

/// Sends each row to the thread that waits.
struct Reporter(Sender<Event>);

impl Watch for Reporter {
    fn row(&self, row: &Row) {
        // After an interruption nobody listens, and the process ends.
        let _ = self.0.send(Event::Row(Box::new(row.clone())));
    }

    fn stops(&self) -> bool {
        false
    }
}
