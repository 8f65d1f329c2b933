//! `cohaptic explain`: lists the program's models of a scene, and with `--cost` measures the cost of the methods.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use cohaptic_answers::{Kind, Measured, MeasuredMethod, MeasurementWatch, Method, cost_picture, error_in_words};
use cohaptic_harness::explain::{self as harness, Explanation};
use cohaptic_scene::{Diagnostic, Scene, SceneError};
use cohaptic_units::print::Span;

use crate::arguments::ExplainArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::file::{own_folder, write_into};
use crate::progress::Progress;
use crate::{input, interrupt, output};

/// Prints the models of a scene, and with `--cost` the measured cost of the methods.
pub(crate) fn explain(arguments: &ExplainArguments) -> Result<ExitCode, Failure> {
    let scene = read(arguments, &[])?;
    // The folder is taken before the long measurement, so that a refused folder costs no time.
    let _own = arguments.out.as_deref().map(own_folder).transpose()?;
    let explanation = harness::explain(&scene);
    let measured = arguments.cost.then(|| measured(arguments, &scene, &explanation));
    let file = match (&measured, &arguments.out) {
        (Some(measured), Some(folder)) => Some(draw(folder, arguments, &scene, measured)?),
        _ => None,
    };
    output::answer(
        arguments.scene.json,
        DocumentSchema::EXPLAIN,
        &cohaptic_answers::explanation_with_costs(&scene, &explanation, measured.as_ref()),
        || describe(&scene, &explanation) + &measured.as_ref().map(table).unwrap_or_default(),
        file,
    )?;
    Ok(ExitCode::SUCCESS)
}

fn read(arguments: &ExplainArguments, more: &[&str]) -> Result<Scene, SceneError> {
    let overrides: Vec<String> = arguments.scene.overrides.set.iter().map(String::as_str).chain(more.iter().copied()).map(str::to_owned).collect();
    input::with(&arguments.scene.scene, |text, file| Scene::parse(text, file, &overrides))
}

fn measured(arguments: &ExplainArguments, scene: &Scene, explanation: &Explanation) -> Measured {
    let refusal = |error: &SceneError| error.diagnostic().map_or_else(|| error.to_string(), |diagnostic| Diagnostic::message(diagnostic).to_owned());
    let methods = cohaptic_answers::methods(scene, explanation, &|more| read(arguments, more).map_err(|error| refusal(&error)));
    let bar = Progress::new(methods.len() as u64, "{bar:30} {pos}/{len} methods, {elapsed} passed: {msg}");
    let shown = Shown { bar, begun: Mutex::new(Instant::now()) };
    let measured = cohaptic_answers::measure(&methods, &processor_time, &shown);
    shown.bar.clear();
    measured
}

/// Longest time of a measured analysis. Needed because no estimate covers drifting clocks, with frames of minutes.
const LONG: Duration = Duration::from_secs(1);

/// Progress of a measurement: shows the name of the measured method, and ends the measurement when the user asks for the end.
struct Shown {
    bar: Progress,
    /// Instant at which the current method began.
    begun: Mutex<Instant>,
}

impl MeasurementWatch for Shown {
    fn begins(&self, method: &Method) {
        self.bar.one_more();
        self.bar.note(method.name.clone());
        *self.begun.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
    }

    fn is_late(&self) -> bool {
        self.begun.lock().unwrap_or_else(PoisonError::into_inner).elapsed() > LONG
    }

    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// Returns the processor time of all threads of the program so far.
#[cfg(target_os = "linux")]
fn processor_time() -> Duration {
    rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime).try_into().unwrap_or_default()
}

/// Returns the wall time since the first call: at least the processor time of a single thread.
#[cfg(not(target_os = "linux"))]
fn processor_time() -> Duration {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
}

fn draw(folder: &Path, arguments: &ExplainArguments, scene: &Scene, measured: &Measured) -> Result<String, Failure> {
    write_into(folder, "cost.svg", cost_picture(&scene.title, measured).size(arguments.pictures.size()).svg())
}

/// Formats the measured methods, grouped by kind.
fn table(measured: &Measured) -> String {
    let mut text = format!("\nMeasured on this machine, over {} of the scene, set-up included\n", Span(measured.span));
    for kind in Kind::ALL {
        let methods: Vec<&MeasuredMethod> = measured.methods.iter().filter(|method| method.kind == kind).collect();
        if !methods.is_empty() {
            text.push_str(&table_of(kind, &methods));
        }
    }
    if measured.interrupted {
        text.push_str("  INTERRUPTED: the kinds that are missing were not measured\n");
    }
    text
}

fn table_of(kind: Kind, methods: &[&MeasuredMethod]) -> String {
    let cost = |method: &MeasuredMethod| method.cost_ms.map_or_else(|| "–".to_owned(), |cost| format!("{cost:.3}"));
    let head = [kind.heading().to_owned(), kind.cost_unit().to_owned(), format!("error [{}]", kind.error_unit()), String::new()];
    let rows = methods.iter().map(|method| {
        let chosen = if method.chosen { " *" } else { "" };
        let words = [method.option.as_str(), method.note.as_str()].into_iter().filter(|words| !words.is_empty()).collect::<Vec<_>>();
        [format!("  {}{chosen}", method.name), cost(method), error_in_words(method.error), words.join("; ")]
    });
    let lines: Vec<[String; 4]> = std::iter::once(head).chain(rows).collect();
    // Widths are counted in characters, because `format!` pads by characters and units contain characters of several bytes.
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or_default();
    let [name, cost, error] = [width(0), width(1), width(2)];
    let mut text = String::new();
    for [a, b, c, words] in &lines {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{}", format!("  {a:<name$}  {b:>cost$}  {c:>error$}  {words}").trim_end());
    }
    let against: Vec<&str> = methods.iter().filter_map(|method| method.reference.as_deref()).collect();
    if let Some(reference) = against.first() {
        let _ = writeln!(text, "    *: of this scene; errors: of the {}, against \"{reference}\"", kind.error_of());
    }
    text
}

fn describe(scene: &Scene, explanation: &Explanation) -> String {
    let Explanation { models, left_out, dimensions, cost } = explanation;
    let mut text = format!("{}\n\nModelled\n", scene.title);
    for row in models {
        // Writing to a string does not fail.
        let _ = writeln!(text, "  {}: {}\n      because: {}", row.part, row.model, row.reason);
    }
    let _ = writeln!(text, "\nLeft out");
    for what in left_out {
        let _ = writeln!(text, "  {what}");
    }
    let _ = writeln!(
        text,
        "\nState\n  {} numbers in devices and copies, {} in samples held, about {} packets on the way",
        dimensions.plant, dimensions.held, dimensions.in_flight
    );
    let _ = writeln!(
        text,
        "\nCost\n  {:.0} control ticks and {:.0} packets per simulated second: about {:.0} times real time with nothing recorded\n  \
         records (--out): about {:.1} MB per simulated second",
        cost.peer_ticks_per_s,
        cost.packets_per_s,
        cost.realtime_factor,
        cost.record_bytes_per_s / 1e6
    );
    text
}
