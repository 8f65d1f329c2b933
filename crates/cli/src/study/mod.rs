//! `cohaptic study`: sessions with people, dry runs, reports, verification, and persons who are forgotten.

mod answer;
#[cfg(target_os = "linux")]
mod serve;

use std::path::Path;
use std::process::ExitCode;

use cohaptic_study::{Analysis, Power, Study, StudyError, StudyFolder, Verified, Watch, power_lines, timed_out_lines};
use cohaptic_units::print::Counted;

use crate::arguments::{StudyArguments, StudyCommand, StudyFolderArguments, StudyForgetArguments, StudyRunArguments};
use crate::campaign::{PROGRAM, pool};
use crate::document_schema::DocumentSchema;
use crate::failure::{EXPECTATION, Failure};
use crate::progress::Progress;
use crate::{interrupt, output};

/// Largest number of printed differences of a verification.
const MOST_DIFFERENCES: usize = 50;

/// Does what a command on a study asks for.
pub(crate) fn study(arguments: &StudyArguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        StudyCommand::Run(arguments) if arguments.dry_run => dry_run(arguments),
        StudyCommand::Run(arguments) => with_people(arguments),
        StudyCommand::Report(arguments) => report(arguments),
        StudyCommand::Verify(arguments) => verify(arguments),
        StudyCommand::Forget(arguments) => forget(arguments),
    }
}

/// Lets people play the study, and serves their pages.
#[cfg(target_os = "linux")]
fn with_people(arguments: &StudyRunArguments) -> Result<ExitCode, Failure> {
    let study = Study::read(&arguments.study)?;
    serve::serve(arguments, StudyFolder::open(study, &arguments.out, PROGRAM).map_err(failure)?)
}

#[cfg(not(target_os = "linux"))]
fn with_people(_: &StudyRunArguments) -> Result<ExitCode, Failure> {
    Err(Failure::System("cohaptic study with people needs Linux: its clocks are those of Linux. --dry-run runs everywhere".to_owned()))
}

/// Lets modelled persons play the study, and prints the means and the power.
fn dry_run(arguments: &StudyRunArguments) -> Result<ExitCode, Failure> {
    let study = Study::read(&arguments.study)?;
    let mut folder = StudyFolder::open_dry(study, &arguments.out, PROGRAM).map_err(failure)?;
    // Each trial is whole on the disk before the next begins, so that the command can be ended at any time.
    interrupt::has_results();
    let trials = folder.study().trials_in_all() as u64;
    let shown = Shown(Progress::through_runs(trials + arguments.times - 1, folder.trials() as u64));
    let out = output::path(&arguments.out);
    let go_on = || Failure::Interrupted(format!("what is done is kept in {out}; repeat the command to go on from there"));
    let done = pool(arguments.threads, || {
        if !folder.play_dry(&shown)? {
            return Ok(None);
        }
        folder.power(arguments.times, &shown)
    })?;
    shown.0.clear();
    let power = done.map_err(failure)?.ok_or_else(go_on)?;
    let analysis = folder.analysis().map_err(failure)?;
    let files = tables(&arguments.out);
    output::answer(
        arguments.json,
        DocumentSchema::STUDY_DRY_RUN,
        &answer::dry_run(folder.study(), &analysis, &power, &files),
        || words(folder.study(), &analysis, &power),
        &files,
    )?;
    Ok(ExitCode::SUCCESS)
}

/// Names of the written files.
const TABLES: [&str; 5] = ["trials.csv", "trials.parquet", "answers.csv", "answers.parquet", "report.html"];

/// Returns the paths of the written files.
fn tables(folder: &Path) -> Vec<String> {
    TABLES.iter().map(|name| output::path(&folder.join(name))).collect()
}

/// Returns the answer of a dry run in words.
fn words(study: &Study, analysis: &Analysis, power: &Power) -> String {
    let mut text = format!(
        "{}: {} in {}, {} each, played by modelled persons\n",
        study.title,
        Counted(study.participants(), "person"),
        Counted(study.groups, "group"),
        Counted(study.conditions.len(), "condition"),
    );
    for warning in analysis.warnings(study) {
        text.push_str(&format!("note: {warning}\n"));
    }
    let lines = |lines: Vec<String>| lines.into_iter().map(|line| format!("  {line}\n")).collect::<String>();
    text.push_str(&format!("\nMeans and timeouts of the first dry run:\n{}", lines(analysis.mean_lines(study))));
    let runs = Counted(power.times, "dry run");
    text.push_str(&format!("\nHow often the differences are found, in {runs}:\n{}", lines(power_lines(study, power))));
    let timed_out = timed_out_lines(study, power);
    // A single run has its timeouts beside its means.
    if power.times > 1 && !timed_out.is_empty() {
        text.push_str(&format!("\nHow often trials timed out, in {runs}:\n{}", lines(timed_out)));
    }
    text
}

/// Writes the tables and the report again.
fn report(arguments: &StudyFolderArguments) -> Result<ExitCode, Failure> {
    let folder = open(&arguments.folder)?;
    folder.write_tables().map_err(failure)?;
    let (study, complete, files) = (folder.study(), folder.complete(), tables(&arguments.folder));
    let analysis = folder.analysis().map_err(failure)?;
    output::answer(
        arguments.json,
        DocumentSchema::STUDY_REPORT,
        &answer::report(study, &analysis, complete, &files),
        || format!("{complete} of {} are complete\n", Counted(study.groups, "session")),
        &files,
    )?;
    Ok(ExitCode::SUCCESS)
}

/// Replays every trial. Differences give the status of a failed expectation.
fn verify(arguments: &StudyFolderArguments) -> Result<ExitCode, Failure> {
    let verified = open(&arguments.folder)?.verify().map_err(failure)?;
    let words = || verified_words(&verified);
    output::answer(arguments.json, DocumentSchema::STUDY_VERIFY, &answer::verify(&verified), words, output::NO_FILES)?;
    Ok(if verified.differences.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(EXPECTATION) })
}

fn verified_words(verified: &Verified) -> String {
    let trials = Counted(verified.trials, "trial");
    if verified.differences.is_empty() {
        return format!("{trials} replayed: every measure, every scene and every table is as it is kept\n");
    }
    let mut text = format!("{trials} replayed, with {}:\n", Counted(verified.differences.len(), "difference"));
    for difference in verified.differences.iter().take(MOST_DIFFERENCES) {
        text.push_str(&format!("  {difference}\n"));
    }
    let more = verified.differences.len().saturating_sub(MOST_DIFFERENCES);
    if more > 0 {
        text.push_str(&format!("  and {more} more\n"));
    }
    text
}

/// Removes the answers of a person and all trials of the person's group.
fn forget(arguments: &StudyForgetArguments) -> Result<ExitCode, Failure> {
    let mut folder = open(&arguments.folder)?;
    folder.forget(arguments.person).map_err(failure)?;
    let (group, _) = arguments.person.group_and_seat(folder.study().group_size());
    let words = format!(
        "{} is forgotten: the trials of {group} are removed, because nobody moved alone in them, and the answers of {}. The row of {group} is given again\n",
        arguments.person, arguments.person
    );
    output::text(&words)?;
    output::wrote(TABLES.map(|name| arguments.folder.join(name)));
    Ok(ExitCode::SUCCESS)
}

fn open(folder: &Path) -> Result<StudyFolder, Failure> {
    StudyFolder::of_folder(folder, PROGRAM).map_err(failure)
}

/// Converts the error of a study to the failure of the command, which has the exit status.
fn failure(error: StudyError) -> Failure {
    match error {
        StudyError::Study(error) => Failure::Scene(error),
        StudyError::File { verb, path, error } => Failure::File { verb, path, error },
        error @ (StudyError::Busy { .. } | StudyError::Damaged { .. }) => Failure::System(error.to_string()),
        error @ (StudyError::Refused(_)
        | StudyError::Other { .. }
        | StudyError::Foreign { .. }
        | StudyError::NoStudy { .. }
        | StudyError::Nobody { .. }) => Failure::Input(error.to_string()),
    }
}

/// Progress of a dry run: a step per kept trial, and per further run.
struct Shown(Progress);

impl Watch for Shown {
    fn keep_going(&self) -> bool {
        !interrupt::requested()
    }

    fn kept(&self) {
        self.0.one_more();
    }

    fn ran(&self) {
        self.0.one_more();
    }
}
