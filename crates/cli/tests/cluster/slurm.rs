//! Slurm with two nodes on this machine, each a `slurmd` of its own.

use std::fs;
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt as _;
use std::process::{Command, Stdio};

use crate::work::{SHARDS, Service, Work, has, kill, wait_for, words};

/// Daemons of a Slurm cluster, in the order in which they are ended.
pub(crate) struct Cluster<'a> {
    work: &'a Work,
    _nodes: Vec<Service>,
    _controller: Service,
    _munge: Service,
}

/// Returns three ports at which nothing listens at present.
fn ports() -> [u16; 3] {
    let listeners = [(); 3].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
    listeners.map(|listener| listener.local_addr().unwrap().port())
}

fn configuration(folder: &str, [controller, one, two]: [u16; 3]) -> String {
    let node = |name: &str, port: u16| format!("NodeName={name} NodeHostname=localhost NodeAddr=127.0.0.1 Port={port} CPUs=1 State=UNKNOWN\n");
    format!(
        "ClusterName=two\nSlurmctldHost=localhost(127.0.0.1)\nSlurmctldPort={controller}\nSlurmUser=root\nSlurmdUser=root\n\
         CommunicationParameters=NoInAddrAny,NoCtldInAddrAny\nAuthType=auth/munge\nAuthInfo=socket={folder}/munge.socket\nCredType=cred/munge\n\
         StateSaveLocation={folder}/state\nSlurmdSpoolDir={folder}/spool-%n\nSlurmctldPidFile={folder}/controller.pid\nSlurmdPidFile={folder}/%n.pid\n\
         SlurmctldLogFile={folder}/controller.log\nSlurmdLogFile={folder}/%n.log\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\n\
         JobAcctGatherType=jobacct_gather/none\nMpiDefault=none\nSwitchType=switch/none\nSelectType=select/cons_tres\nSelectTypeParameters=CR_Core\n\
         SchedulerParameters=sched_interval=1,bf_interval=1\nKillWait=1\n{}{}PartitionName=all Nodes=one,two Default=YES State=UP\n",
        node("one", one),
        node("two", two)
    )
}

impl<'a> Cluster<'a> {
    /// Starts the cluster in the folder of the work. Returns the reason if a cluster cannot be started on this machine.
    pub(crate) fn start(work: &'a Work) -> Result<Self, &'static str> {
        if !["munged", "slurmctld", "slurmd", "sbatch"].into_iter().all(has) {
            return Err("munge and Slurm are not installed");
        }
        if !fs::read_to_string("/proc/self/status").is_ok_and(|status| status.contains("\nUid:\t0\t")) {
            return Err("daemons of Slurm need root");
        }
        let folder = work.path("").display().to_string();
        let folder = folder.trim_end_matches('/');
        fs::create_dir(work.path("state")).unwrap();
        // Others may look into it: the socket is for all users of the machine.
        fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
        fs::write(work.path("munge.key"), [7; 1024]).unwrap();
        fs::set_permissions(work.path("munge.key"), fs::Permissions::from_mode(0o400)).unwrap();
        fs::write(work.path("slurm.conf"), configuration(folder, ports())).unwrap();
        let service = |program: &str, options: &[&str]| {
            let mut command = work.command(program);
            Service::start(command.args(options).env("SLURM_CONF", work.path("slurm.conf")).stdout(Stdio::null()).stderr(Stdio::null()))
        };
        let files = [
            ("key-file", "munge.key"),
            ("socket", "munge.socket"),
            ("pid-file", "munge.pid"),
            ("log-file", "munge.log"),
            ("seed-file", "munge.seed"),
        ];
        let files: Vec<String> = files.iter().map(|(option, name)| format!("--{option}={folder}/{name}")).collect();
        let munge = service("munged", &[&["--foreground"], &files.iter().map(String::as_str).collect::<Vec<_>>()[..]].concat());
        wait_for("munge", || work.path("munge.socket").exists().then_some(()));
        let controller = service("slurmctld", &["-D"]);
        let nodes = vec![service("slurmd", &["-D", "-N", "one"]), service("slurmd", &["-D", "-N", "two"])];
        let cluster = Self { work, _nodes: nodes, _controller: controller, _munge: munge };
        wait_for("two idle nodes", || (cluster.ask("sinfo", &["-h", "-o", "%D %t"]).trim() == "2 idle").then_some(()));
        for name in ["array.sh", "merge.sh"] {
            work.bring(name);
        }
        fs::write(work.path("work.sh"), format!("cohaptic {} \"$@\"\n", words().join(" ").replace(" --threads 1", ""))).unwrap();
        Ok(cluster)
    }

    fn command(&self, program: &str, words: &[&str]) -> Command {
        let mut command = self.work.command(program);
        command.args(words).env("SLURM_CONF", self.work.path("slurm.conf"));
        command
    }

    /// Returns the output of a command; empty if the command fails.
    fn ask(&self, program: &str, words: &[&str]) -> String {
        let output = self.command(program, words).output().unwrap();
        if output.status.success() { String::from_utf8(output.stdout).unwrap() } else { String::new() }
    }

    /// Submits a job, and returns its number.
    pub(crate) fn submit(&self, words: &[&str]) -> String {
        let output = self.command("sbatch", &[&["--parsable"], words].concat()).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    }

    /// Waits for the end of a job, and returns the final states of its tasks.
    pub(crate) fn end_of(&self, job: &str) -> Vec<String> {
        wait_for("the end of a job", || {
            let states: Vec<String> = self.ask("squeue", &["-h", "-t", "all", "-r", "-j", job, "-o", "%T"]).lines().map(str::to_owned).collect();
            let is_over = |state: &String| !["PENDING", "RUNNING", "COMPLETING", "CONFIGURING"].contains(&state.as_str());
            (!states.is_empty() && states.iter().all(is_over)).then_some(states)
        })
    }
}

#[test]
fn an_array_of_slurm_whose_task_was_killed_is_submitted_again_and_merged() {
    let work = Work::new();
    let cluster = match Cluster::start(&work) {
        Ok(cluster) => cluster,
        Err(reason) => {
            eprintln!("skipped: {reason}");
            return;
        }
    };
    let array = format!("--array=1-{SHARDS}");
    let shards = cluster.submit(&[&array, "array.sh"]);
    let merge = cluster.submit(&[&format!("--dependency=afterany:{shards}"), "merge.sh"]);
    let killed = work.kill_a_worker(kill);
    let states = cluster.end_of(&shards);
    assert_eq!((states.len(), states.iter().filter(|state| *state == "FAILED").count()), (SHARDS, 1), "{states:?}");
    // Both nodes took part.
    let nodes = cluster.ask("squeue", &["-h", "-t", "all", "-r", "-j", &shards, "-o", "%N"]);
    assert!(nodes.contains("one") && nodes.contains("two"), "{nodes}");
    assert_eq!(cluster.end_of(&merge), ["FAILED"]);
    let said = fs::read_to_string(work.path(&format!("slurm-{merge}.out"))).unwrap();
    assert!(said.contains("losses is not complete") && said.contains(&format!("of {SHARDS} shards, these do them: ")), "{said}");
    work.assert_killed(killed);
    // The same array again: tasks whose shards are done end at once.
    let shards = cluster.submit(&[&array, "array.sh"]);
    let merge = cluster.submit(&[&format!("--dependency=afterok:{shards}"), "merge.sh"]);
    assert_eq!(cluster.end_of(&merge), ["COMPLETED"]);
    assert_eq!(cluster.end_of(&shards), ["COMPLETED"; SHARDS]);
    work.assert_whole();
    // And as the tasks of one step.
    let output =
        cluster.command("srun", &[&["-n", "2", "cohaptic"], &words()[..], &["--out", "again", "--shard", "auto"]].concat()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("shard 1/2 in again") && said.contains("shard 2/2 in again"), "{said}");
    assert!(work.cohaptic("--merge again").output().unwrap().status.success());
    let [found, expected] = ["again", "whole"].map(|folder| fs::read(work.path(folder).join("runs.parquet")).unwrap());
    assert!(found == expected, "other bytes");
}
