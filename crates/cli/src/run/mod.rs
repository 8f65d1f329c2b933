//! `cohaptic run`: simulates a scene, or a scene and a variant of the scene, or replays the inputs of a live session.

mod against;
pub(crate) mod answer;
mod motion;
pub(crate) mod page;
mod replayed;

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_answers::TEXT_PLOT_SPANS;
use cohaptic_files::write_whole;
use cohaptic_harness::check::{ExpectationWatch, Outcome};
use cohaptic_harness::live::{Inputs, replay};
use cohaptic_harness::measures::{MeasuredValue, Measures};
use cohaptic_harness::record::{Bands, RecordError, RecordedPicture, Recorder, links_csv};
use cohaptic_harness::task::TaskResult;
use cohaptic_harness::{Model, Observer, Simulation, Summary, TickRow, Ticks};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::arguments::RunArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{self, Failure, INTERRUPTED};
use crate::file::{own_folder, unwritten, write_file};
use crate::progress::Progress;
use crate::shell::CommandLine;
use crate::{input, interrupt, output};
use against::Shown;
use answer::describe;
use motion::Places;

/// Runs a scene, or a scene and a variant of the scene, and prints the results.
pub(crate) fn run(arguments: &RunArguments) -> Result<ExitCode, Failure> {
    let path = &arguments.scene.scene;
    let overrides = &overrides(arguments);
    let scene = match &arguments.inputs {
        None => input::with(path, |text, file| Scene::parse(text, file, overrides)),
        // The scene is read as the live session read it, because a replay has to begin with the same scene.
        Some(_) => input::with(path, |text, file| Scene::parse_live(text, file, overrides)),
    };
    let scene = scene.map_err(|error| failure::of_variant(error, "--measure", arguments.measure.override_text().as_slice()))?;
    if let Some(error) = failure::too_large(&scene, overrides, model(arguments), is_watched(arguments, &scene)) {
        return Err(error.into());
    }
    // Both scenes are read before either runs, so that a mistake in the second scene is not found only after a long first run.
    let variant = if arguments.against.is_empty() {
        None
    } else {
        let both: Vec<String> = overrides.iter().chain(&arguments.against).cloned().collect();
        let variant = input::with(path, |text, file| Scene::parse(text, file, &both));
        let mut variant = variant.map_err(|error| failure::of_variant(error, "--against", &arguments.against))?;
        if let Some(error) = failure::too_large(&variant, &both, model(arguments), is_watched(arguments, &variant)) {
            return Err(error.into());
        }
        variant.title = format!("{}, with {}", variant.title, arguments.against.join(", "));
        Some(variant)
    };
    let inputs = arguments.inputs.as_deref().map(|file| replayed::read(file, &scene, arguments, overrides)).transpose()?;
    let (inputs, replayed_otherwise) = inputs.unzip();
    let what = inputs.as_ref().map_or(What::Simulated, What::Replayed);
    let out = arguments.out.as_deref();
    let _own = out.map(own_folder).transpose()?;
    let mut first = run_one(arguments, &scene, what, out)?;
    let out_against = out.map(|out| out.join("against"));
    let second = match &variant {
        // An interrupted first run is printed alone: the variant would only delay the end.
        Some(variant) if !interrupt::requested() => {
            let own = out_against.as_deref().map(own_folder).transpose()?;
            Some((run_one(arguments, variant, What::Simulated, out_against.as_deref())?, own))
        }
        _ => None,
    };
    let (mut second, _own_against) = second.unzip();
    // The variant has the overrides of the scene, too, and its own on top.
    let both: Vec<String> = overrides.iter().chain(&arguments.against).cloned().collect();
    let of_variant = variant.as_ref().zip(second.as_ref()).and_then(|(variant, run)| run.shown(variant, &both));
    let page = first.shown(&scene, overrides).map(|shown| match of_variant {
        None => shown.page(arguments),
        Some(variant) => against::html(arguments, [shown, variant]),
    });
    let (page, page_of_variant) = (page.transpose()?, of_variant.map(|shown| shown.page(arguments)).transpose()?);
    // The pages come after both runs, because the page of a comparison shows both.
    first.write_page(out, page)?;
    if let Some(second) = &mut second {
        second.write_page(out_against.as_deref(), page_of_variant)?;
    }
    let drawn = arguments.motion.as_deref().map(|file| motion::draw(file, arguments, &scene, [Some(&first), second.as_ref()]));
    drawn.transpose()?;
    if arguments.scene.json {
        let against = variant.as_ref().zip(second.as_ref()).map(|(variant, run)| answer::of(variant, run, &[], None::<()>));
        output::json(DocumentSchema::RUN, &answer::of(&scene, &first, &replayed_otherwise.unwrap_or_default(), against))?;
    } else {
        let mut text = format!("{}\n{}", scene.title, describe(&scene, &first));
        if let Some((variant, run)) = variant.as_ref().zip(second.as_ref()) {
            let _ = write!(text, "\nAgainst {}:\n{}", arguments.against.join(", "), describe(variant, run));
        }
        output::text(&text)?;
        output::wrote([Some(&first), second.as_ref()].into_iter().flatten().flat_map(|run| &run.files).chain(&arguments.motion));
    }
    Ok(if interrupt::requested() { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

const fn model(arguments: &RunArguments) -> Model {
    if arguments.general { Model::General } else { Model::Least }
}

/// Returns whether the positions are drawn in the terminal.
const fn is_shown(arguments: &RunArguments) -> bool {
    !arguments.scene.json && !arguments.no_plot
}

/// Returns whether the run has an observer: the plot in the terminal, a record, a motion picture, a replay, measures or a task.
fn is_watched(arguments: &RunArguments, scene: &Scene) -> bool {
    is_shown(arguments) || arguments.out.is_some() || arguments.motion.is_some() || arguments.inputs.is_some() || Measures::of(scene).is_some()
}

/// Returns the overrides of the scene: all `--set`, then the seed and the measures.
fn overrides(arguments: &RunArguments) -> Vec<String> {
    let seed = arguments.seed.map(|seed| format!("scene.seed={seed}"));
    arguments.scene.overrides.set.iter().cloned().chain(seed).chain(arguments.measure.override_text()).collect()
}

/// Results of a run.
struct Run {
    summary: Summary,
    /// Values of the measures. Empty if the scene measures nothing.
    measured: Vec<MeasuredValue>,
    /// Result of the task; `None` for a scene without a task.
    task: Option<TaskResult>,
    wall_s: f64,
    positions: Option<Bands>,
    places: Option<Places>,
    files: Vec<PathBuf>,
    /// Parts of the page; `None` for a run without a page.
    page: Option<PageParts>,
}

/// Parts of a run for the page alone.
struct PageParts {
    /// Results of the scene's expectations.
    outcomes: Vec<Outcome>,
    pictures: Vec<RecordedPicture>,
}

impl Run {
    /// Returns the results for a page; `None` for a run without a page.
    fn shown<'a>(&'a self, scene: &'a Scene, overrides: &'a [String]) -> Option<Shown<'a>> {
        let (summary, measured, task) = (&self.summary, &self.measured, self.task.as_ref());
        self.page.as_ref().map(|PageParts { outcomes, pictures }| Shown { scene, overrides, summary, measured, task, outcomes, pictures })
    }

    /// Writes the page of the run into the folder, if the run has a page and a folder.
    fn write_page(&mut self, folder: Option<&Path>, page: Option<String>) -> Result<(), Failure> {
        if let Some((folder, page)) = folder.zip(page) {
            let file = folder.join("run.html");
            write_file(&file, page)?;
            self.files.push(file);
        }
        Ok(())
    }
}

/// Source of the motion of a run.
#[derive(Clone, Copy)]
enum What<'a> {
    Simulated,
    /// Simulation with the recorded inputs of a live session.
    Replayed(&'a Inputs),
}

fn run_one(arguments: &RunArguments, scene: &Scene, what: What<'_>, out: Option<&Path>) -> Result<Run, Failure> {
    let shown = is_shown(arguments);
    let paged = out.is_some() && !arguments.no_plot;
    let mut watch = Watch {
        progress: Progress::through_scene(&scene.title, scene.duration),
        positions: shown.then(|| Bands::new(scene.duration, TEXT_PLOT_SPANS, scene.peers.len())),
        places: arguments.motion.as_ref().map(|_| Places::new(scene.peers.len())),
    };
    let start = Clock::now();
    let measures = Measures::of(scene);
    // Only the wanted values are observed, because an observer of packets keeps the run from the fast ways of simulation.
    let (summary, measures, mut files, page) = match out {
        None => {
            let mut observer = (&mut watch, measures);
            let summary = execute(arguments, scene, what, &mut observer)?;
            (summary, observer.1, Vec::new(), None)
        }
        Some(folder) => {
            let recorder = Recorder::create(folder, scene)?.sized(arguments.pictures.size());
            let expectations = paged.then(|| ExpectationWatch::new(scene));
            let mut observer = ((recorder, &mut watch), (measures, expectations));
            let summary = execute(arguments, scene, what, &mut observer)?;
            let ((recorder, _), (measures, expectations)) = observer;
            let (files, pictures) = recorder.finish_with_pictures(&summary)?;
            let page = expectations.map(|expectations| PageParts { outcomes: expectations.outcomes(&summary), pictures });
            (summary, measures, files, page)
        }
    };
    let wall_s = start.elapsed().as_secs_f64();
    watch.progress.clear();
    if let Some(path) = &arguments.links {
        write_whole(path, |file| links_csv(&summary, |rows| file.write_all(rows))).map_err(unwritten(path))?;
        files.push(path.clone());
    }
    let measured = measures.as_ref().map(|measures| measures.values(summary.duration)).unwrap_or_default();
    let task = measures.and_then(|measures| measures.task(&summary));
    Ok(Run { summary, measured, task, wall_s, positions: watch.positions, places: watch.places, files, page })
}

fn execute<O: Observer>(arguments: &RunArguments, scene: &Scene, what: What<'_>, observer: &mut O) -> Result<Summary, O::Error> {
    let summary = match what {
        What::Simulated => {
            let threads = arguments.threads.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from);
            Simulation::new(scene, model(arguments)).on_threads(threads).run(observer)
        }
        What::Replayed(inputs) => replay(scene, inputs, observer),
    };
    // A short run may end without asking the observer. The summary of such a run is a result too.
    interrupt::has_results();
    summary
}

/// Observer of a run. Shows the progress, collects positions for the plot and the motion picture, and ends the run when the user asks for the end.
struct Watch {
    progress: Progress,
    positions: Option<Bands>,
    places: Option<Places>,
}

impl Observer for &mut Watch {
    type Error = RecordError;

    fn wants_ticks(&self) -> bool {
        self.positions.is_some() || self.places.is_some()
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), RecordError> {
        if let Some(positions) = &mut self.positions {
            positions.add(row.peer, row.at, row.object.position[0]);
        }
        if let Some(places) = &mut self.places {
            places.add(row);
        }
        Ok(())
    }

    fn on_ticks(&mut self, ticks: &Ticks<'_>) -> Result<(), RecordError> {
        if let Some(positions) = &mut self.positions {
            positions.add_positions(ticks, 0);
        }
        if let Some(places) = &mut self.places
            // Most ticks lie between two frames. Rows are built only for ticks at which a frame is due.
            && places.wants(ticks.at())
        {
            return ticks.each(|row| {
                places.add(row);
                Ok(())
            });
        }
        Ok(())
    }

    fn keep_going(&mut self, now: Instant) -> bool {
        self.progress.reach(now);
        // An interrupted run has results up to this instant. A signal therefore ends the run, and the command still prints and writes.
        interrupt::has_results();
        !interrupt::requested()
    }
}

/// Returns the command that repeats a run, as a line for a shell, with the options that affect the records.
fn command_line(arguments: &RunArguments) -> String {
    // `--motion`, `--links` and options of the terminal do not change the records and are left out.
    CommandLine::new("run", &arguments.scene.scene, &arguments.scene.overrides.set)
        .option("--seed", arguments.seed)
        .option("--against", &arguments.against)
        .option("--measure", arguments.measure.word())
        .option("--inputs", arguments.inputs.as_deref().map(output::path))
        .flag("--force", arguments.force)
        .flag("--general", arguments.general)
        .out()
        .option("--size", arguments.pictures.word())
        .text()
}
