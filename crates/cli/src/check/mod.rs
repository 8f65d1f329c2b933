//! `cohaptic check`: checks scenes against their expectations, several scenes at a time.

mod page;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};

use cohaptic_answers::{Answered, OutcomeDocument, check as check_scene};
use cohaptic_harness::Model;
use cohaptic_scene::{Scene, SceneError, scene_files};
use rayon::prelude::*;
use serde::Serialize;

use crate::analysis_watch::Interruptible;
use crate::arguments::CheckArguments;
use crate::document_schema::{DocumentSchema, document};
use crate::failure::{self, EXPECTATION, Failure, INTERRUPTED, scene_status};
use crate::file::write_file;
use crate::progress::Progress;
use crate::{input, interrupt, output};

#[derive(Clone, Serialize)]
struct Checked {
    file: String,
    passed: bool,
    failures: Vec<String>,
    /// Outcome of each expectation. Empty if the scene could not be checked.
    expectations: Vec<OutcomeDocument>,
    /// Notes on results: more computing time would make these results stronger or more exact.
    notes: Vec<String>,
    /// `true` if the scene has an `[expect]` table.
    expects: bool,
    /// Exit status of the command if this scene were the only scene.
    #[serde(skip)]
    status: u8,
}

/// Checks every scene and prints a line per scene. Failed and unreadable scenes do not end the check.
pub(crate) fn check(arguments: &CheckArguments) -> Result<ExitCode, Failure> {
    let mut files: Vec<Result<PathBuf, Checked>> = Vec::new();
    let mut first_error = None;
    for path in &arguments.scenes {
        match files_of(path) {
            Ok(found) => files.extend(found.into_iter().map(Ok)),
            Err(error) => {
                files.push(Err(Checked::unreadable(path, &error)));
                first_error.get_or_insert(error);
            }
        }
    }
    // If no path could be read, nothing was checked: the first error is then the failure of the command.
    if let Some(error) = first_error.filter(|_| files.iter().all(Result::is_err)) {
        return Err(error.into());
    }
    let progress = Progress::new(files.len() as u64, "checking scenes {bar:30} {pos}/{len}");
    let model = if arguments.general { Model::General } else { Model::Least };
    // Each slot begins as "interrupted", so that a list printed by a signal names the unfinished scenes.
    let begun = files.iter().map(|file| file.as_ref().map_or_else(Clone::clone, |file| Checked::interrupted(file))).collect();
    let known: Arc<Mutex<Vec<Checked>>> = Arc::new(Mutex::new(begun));
    let (keeper, json) = (Arc::clone(&known), arguments.json);
    interrupt::keep(move || {
        let scenes = keeper.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let said = finished(&scenes);
        // If standard output cannot be written to, only the message on standard error remains.
        if print(scenes, json).is_ok() { said } else { format!("{said}, and cannot be printed") }
    });
    let check = |(place, file): (usize, Result<PathBuf, Checked>)| {
        let checked = file.map_or_else(|unreadable| unreadable, |file| check_one(&file, &arguments.overrides.set, model));
        if let Some(slot) = known.lock().unwrap_or_else(PoisonError::into_inner).get_mut(place) {
            *slot = checked.clone();
        }
        progress.one_more();
        checked
    };
    let threads = usize::from(arguments.threads.unwrap_or(0));
    let scenes: Vec<Checked> = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(|| files.into_par_iter().enumerate().map(check).collect()),
        // If the system refuses the threads, the scenes are checked one after another.
        Err(_) => files.into_iter().enumerate().map(check).collect(),
    };
    interrupt::has_results();
    progress.clear();
    let (status, finished) = (scenes.iter().map(|scene| scene.status).max().unwrap_or(0), finished(&scenes));
    // The error of the page is reported only after the results are printed, so that a full disk does not lose the results.
    let written = arguments.page.as_ref().map_or(Ok(()), |file| write_file(file, page::html(&scenes, &arguments.overrides.set)));
    print(scenes, arguments.json)?;
    written?;
    if !arguments.json {
        output::wrote(&arguments.page);
    }
    if interrupt::requested() { Err(Failure::Interrupted(finished)) } else { Ok(ExitCode::from(status)) }
}

/// Describes how many scenes were checked before the end.
fn finished(scenes: &[Checked]) -> String {
    let finished = scenes.iter().filter(|scene| !scene.is_interrupted()).count();
    format!("{finished} of {} scenes were checked", scenes.len())
}

fn print(scenes: Vec<Checked>, json: bool) -> Result<(), Failure> {
    if json { output::json(DocumentSchema::CHECK, &document! { scenes: scenes }) } else { output::text(&describe(&scenes)) }
}

/// Returns the scene files of a path: the file, the scenes of a folder, or standard input (`-`).
fn files_of(path: &Path) -> Result<Vec<PathBuf>, SceneError> {
    if input::is_standard_input(path) { Ok(vec![path.to_path_buf()]) } else { scene_files(path) }
}

fn check_one(file: &Path, overrides: &[String], model: Model) -> Checked {
    if interrupt::requested() {
        return Checked::interrupted(file);
    }
    match input::with(file, |text, file| Scene::parse(text, file, overrides)) {
        Err(error) => Checked::unreadable(file, &error),
        Ok(scene) => {
            if let Some(error) = failure::too_large(&scene, overrides, model, true) {
                return Checked { expects: scene.expect.is_some(), ..Checked::unreadable(file, &error) };
            }
            let Answered { failures, expectations, notes } = check_scene(&scene, model, &Interruptible);
            if !failures.is_empty() && interrupt::requested() {
                // The interruption itself may be the cause of these failures.
                return Checked { expects: scene.expect.is_some(), ..Checked::interrupted(file) };
            }
            let status = if failures.is_empty() { 0 } else { EXPECTATION };
            let (file, expects) = (output::path(input::named(file)), !expectations.is_empty());
            Checked { file, passed: failures.is_empty(), failures, expectations, notes, expects, status }
        }
    }
}

impl Checked {
    fn unreadable(path: &Path, error: &SceneError) -> Self {
        Self::unchecked(path, error.to_string(), scene_status(error))
    }

    /// Returns the result of an unchecked scene: the user asked for the end before the check.
    fn interrupted(path: &Path) -> Self {
        Self::unchecked(path, "interrupted before it was checked".to_owned(), INTERRUPTED)
    }

    fn unchecked(path: &Path, reason: String, status: u8) -> Self {
        let (file, failures) = (output::path(input::named(path)), vec![reason]);
        Self { file, passed: false, failures, expectations: Vec::new(), notes: Vec::new(), expects: false, status }
    }

    const fn is_interrupted(&self) -> bool {
        self.status == INTERRUPTED
    }
}

fn describe(scenes: &[Checked]) -> String {
    let mut text = String::new();
    for scene in scenes {
        let file = &scene.file;
        if scene.passed && !scene.expects {
            text.push_str(&format!("ok    {file} (it has no [expect]: nothing was compared)\n"));
        } else if scene.passed {
            text.push_str(&format!("ok    {file}\n"));
        } else {
            text.push_str(&format!("FAIL  {file}\n"));
            for line in scene.failures.iter().flat_map(|failure| failure.lines()) {
                text.push_str(&format!("      {line}\n"));
            }
        }
        scene.notes.iter().for_each(|note| text.push_str(&format!("      note: {note}\n")));
    }
    let failed = scenes.iter().filter(|scene| !scene.passed).count();
    text.push_str(&format!("{} passed, {failed} failed\n", scenes.len() - failed));
    text
}
