//! A Dask cluster of a scheduler and two worker processes.

use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::work::{SHARDS, Service, Work, wait_for, words};

/// The interpreter that has Dask, if there is one.
fn python() -> Option<PathBuf> {
    let named = std::env::var_os("COHAPTIC_DASK").map(PathBuf::from);
    let target = Path::new(env!("CARGO_BIN_EXE_cohaptic")).ancestors().nth(2)?;
    let python = named.unwrap_or_else(|| target.join("dask")).join("bin/python");
    let imports = Command::new(&python).args(["-c", "import dask.distributed"]).stderr(Stdio::null()).status();
    imports.is_ok_and(|status| status.success()).then_some(python)
}

/// Running scheduler of Dask, with its workers.
pub(crate) struct Dask<'a> {
    work: &'a Work,
    python: PathBuf,
    workers: [Service; 2],
    _scheduler: Service,
}

impl<'a> Dask<'a> {
    /// Starts a scheduler and two workers. Returns `None` if Dask is not installed.
    pub(crate) fn start(work: &'a Work) -> Option<Self> {
        let python = python()?;
        let start = |module: &str, options: &[&str]| {
            let mut command = work.command(&python);
            command.args(["-m", module, "--scheduler-file", "scheduler.json", "--host", "127.0.0.1"]).args(options);
            // Its child ends with it, as all processes of a machine do.
            command.process_group(0).stdout(Stdio::null()).stderr(Stdio::null());
            Service::start(&mut command)
        };
        let scheduler = start("distributed.cli.dask_scheduler", &["--port", "0", "--no-dashboard"]);
        wait_for("the scheduler", || work.path("scheduler.json").exists().then_some(()));
        let worker = || start("distributed.cli.dask_worker", &["--nthreads", "1", "--no-nanny", "--no-dashboard"]);
        let workers = [worker(), worker()];
        work.bring("dask_shards.py");
        Some(Self { work, python, workers, _scheduler: scheduler })
    }

    /// The script of the page, on this work.
    pub(crate) fn command(&self, folder: &str) -> Command {
        let mut command = self.work.command(&self.python);
        command.args(["dask_shards.py", "scheduler.json", &SHARDS.to_string(), folder, "cohaptic"]).args(words());
        command
    }
}

#[test]
fn dask_does_a_shard_again_whose_worker_was_killed() {
    let work = Work::new();
    let Some(dask) = Dask::start(&work) else {
        eprintln!("skipped: no virtual environment with distributed");
        return;
    };
    let child = dask.command("losses").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let killed = work.kill_a_worker(|process| {
        let parent = parent_of(process);
        let worker = dask.workers.iter().find(|worker| worker.id() == parent).unwrap();
        assert!(Command::new("kill").args(["-KILL", "--", &format!("-{}", worker.id())]).status().unwrap().success());
    });
    work.assert_killed(killed);
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(said.lines().filter(|line| line.starts_with("shard ")).count(), SHARDS, "{said}");
    work.assert_whole();
}

fn parent_of(process: u32) -> u32 {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    stat.rsplit_once(") ").unwrap().1.split(' ').nth(1).unwrap().parse().unwrap()
}
