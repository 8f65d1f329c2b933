//! `study`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use cohaptic_study::PersonCode;

use super::RealTimeArguments;
use super::examples::{self, after};
use super::numbers::{integer, threads};

#[derive(Debug, Args)]
#[command(after_help = after(examples::STUDY))]
pub(crate) struct StudyArguments {
    #[command(subcommand)]
    pub(crate) command: StudyCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum StudyCommand {
    /// Runs a study; cohaptic study FILE is short for this
    Run(StudyRunArguments),
    /// Writes the tables and the report again, from the kept trials and answers
    Report(StudyFolderArguments),
    /// Replays every trial, and names each difference to the kept measures, scenes and tables
    Verify(StudyFolderArguments),
    /// Removes the answers of a person and all trials of the person's group, and writes the tables again
    Forget(StudyForgetArguments),
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::STUDY_RUN))]
pub(crate) struct StudyRunArguments {
    /// The study, a TOML file
    pub(crate) study: PathBuf,
    /// Let modelled persons play in place of people, through the same orders, trials and tables
    #[arg(long, conflicts_with = "RealTimeArguments")]
    pub(crate) dry_run: bool,
    /// Number of dry runs, each with other persons. The output tells how often each difference is found
    #[arg(long, value_name = "N", default_value_t = 1, requires = "dry_run", allow_negative_numbers = true, value_parser = integer::<u64>(1, 99_999))]
    pub(crate) times: u64,
    /// Print one JSON document and nothing else, about a dry run
    #[arg(long, requires = "dry_run")]
    pub(crate) json: bool,
    /// Folder of the study: trials, answers, tables and report.html. Repeat the command to go on from there
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Number of trials of dry runs made at the same time [default: one per core]. Results do not depend on it
    #[arg(long, value_name = "N", visible_alias = "jobs", requires = "dry_run", allow_negative_numbers = true, value_parser = threads)]
    pub(crate) threads: Option<u16>,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArguments,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::STUDY_FOLDER))]
pub(crate) struct StudyFolderArguments {
    /// Folder of the study
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::STUDY_FORGET))]
pub(crate) struct StudyForgetArguments {
    /// Code of the person, such as P07
    #[arg(value_name = "CODE")]
    pub(crate) person: PersonCode,
    /// Folder of the study
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
}
