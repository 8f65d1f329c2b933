//! `cohaptic campaign`: many runs into one table. Each is compared with `cohaptic run` of the same scene and seed, and a campaign that was interrupted, killed
//! or found no room with one that was not, byte by byte.

use std::fs;

use crate::integration::desk::Desk;
use crate::integration::scenes::{RANDOM, TWO};

/// Six runs.
const SIX: &str = "campaign random.toml --vary coordination.stiffness=500..1500/2 --runs 3";

fn desk() -> Desk {
    Desk::with("random.toml", RANDOM)
}

/// Returns the header and the rows of a CSV table.
fn table(desk: &Desk, file: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(desk.path(file)).unwrap();
    let header = reader.headers().unwrap().iter().map(str::to_owned).collect();
    (header, reader.records().map(|record| record.unwrap().iter().map(str::to_owned).collect()).collect())
}

/// The number that stands behind a key for the first time in the text of a document, read back to the last bit.
fn number(text: &str, key: &str) -> f64 {
    let rest = text.split_once(&format!("\"{key}\": ")).unwrap_or_else(|| panic!("no {key} in {text}")).1;
    rest.split([',', '\n']).next().unwrap().parse().unwrap()
}

/// The columns of measures are the keys of `measures` in the document of the run alone, with the same digits.
#[test]
fn measures_of_a_campaign_are_those_of_the_runs_alone() {
    let desk = desk();
    desk.json(&format!("{SIX} --measure all --set measure.probe.peer=left --format csv --out out --json"));
    let (header, rows) = table(&desk, "out/runs.csv");
    for row in &rows {
        let cell = |name: &str| row[header.iter().position(|found| found == name).unwrap_or_else(|| panic!("no {name}"))].clone();
        let set = format!("--set coordination.stiffness={} --seed {}", cell("coordination.stiffness"), cell("seed"));
        let alone = desk.text(&format!("run random.toml --json --measure all --set measure.probe.peer=left {set}"));
        let measures = crate::integration::desk::parse(&alone)["measures"].as_object().unwrap().clone();
        assert_eq!(measures.len(), 23, "twenty of the run and one of each peer");
        for (name, value) in &measures {
            let column = cell(name);
            match value.is_null() {
                true => assert_eq!(column, "", "{name}"),
                false => assert_eq!(column.parse::<f64>().unwrap(), number(&alone, name), "{name} of {set}"),
            }
        }
        assert!(measures["viscosity_n_s_m"].is_f64() && measures["peers.third.energy_j"].is_f64());
    }
    // The message names the option of the user, not the `--set` that stands for it.
    for line in [format!("{SIX} --measure energy --format csv --out other"), "run random.toml --measure energy".to_owned()] {
        desk.cohaptic(&line).assert_refused(2, &["error: --measure measure.names=", "unknown measure \"energy\""]);
    }
    assert!(!desk.json("run random.toml --json").as_object().unwrap().contains_key("measures"), "nothing is measured that is not asked for");
}

#[test]
fn a_run_of_a_campaign_is_the_run_that_a_user_would_do_alone() {
    let desk = desk();
    let document = desk.json(&format!("{SIX} --format csv --out out --json"));
    assert_eq!((document["runs"].as_u64(), document["runs_computed"].as_u64(), &document["out"]), (Some(6), Some(6), &"out".into()));
    assert!(document["wall_s"].as_f64() > Some(0.0) && document["runs_per_s"].as_f64() > Some(0.0));
    assert_eq!((&document["file"], &document["diverged"], &document["title"]), (&"out/runs.csv".into(), &0.into(), &"Three users, far apart".into()));
    assert_eq!(desk.files("out"), ["campaign.html", "campaign.json", "discrepancy.svg", "runs.csv"]);
    let (header, rows) = table(&desk, "out/runs.csv");
    for (number_of_run, row) in rows.iter().enumerate() {
        let cell = |name: &str| row[header.iter().position(|found| found == name).unwrap_or_else(|| panic!("no {name}"))].clone();
        let float = |name: &str| cell(name).parse::<f64>().unwrap();
        assert_eq!((cell("run"), cell("seed")), (number_of_run.to_string(), (3 + number_of_run % 3).to_string()));
        let set = format!("--set coordination.stiffness={} --set scene.seed={}", cell("coordination.stiffness"), cell("seed"));
        let alone = desk.text(&format!("run random.toml --json {set}"));
        assert_eq!(float("max_discrepancy_m"), number(&alone, "max_discrepancy_m"), "{set}");
        for peer in ["left", "right", "third"] {
            let its = alone.split_once(&format!("\"name\": \"{peer}\"")).unwrap().1;
            assert_eq!(float(&format!("peers.{peer}.position_x_m")), number(its, "position_m"));
            assert_eq!(float(&format!("peers.{peer}.velocity_x_m_s")), number(its, "velocity_m_s"));
        }
        let alone = crate::integration::desk::parse(&alone);
        let sum = |list: &str, key: &str| {
            let count = |link: &serde_json::Value| key.split('.').fold(link, |value, key| &value[key]).as_u64().unwrap();
            alone[list].as_array().unwrap().iter().map(count).sum::<u64>().to_string()
        };
        for (list, columns) in [("links", "links"), ("access_lines", "access")] {
            for (key, column) in [
                ("offered", "offered"),
                ("delivered", "delivered"),
                ("in_flight", "in_flight"),
                ("dropped.loss", "dropped_loss"),
                ("dropped.outage", "dropped_outage"),
                ("dropped.queue-full", "dropped_queue_full"),
            ] {
                assert_eq!(cell(&format!("{columns}.{column}")), sum(list, key), "{columns}.{column}");
            }
        }
        assert_eq!((cell("ending"), float("ended_at_s"), cell("ticks")), ("complete".to_owned(), 0.6, "600".to_owned()));
    }
    let combination = &document["combinations"][1];
    assert_eq!(
        (&combination["vary"][0], &combination["runs"], &combination["diverged"]),
        (&"coordination.stiffness=1500".into(), &3.into(), &0.into())
    );
}

#[test]
fn people_are_told_what_came_out() {
    let desk = desk();
    let text = desk.text(&format!("{SIX} --vary link.loss=0%..40%/11 --out out"));
    for part in [
        "Three users, far apart\n  66 runs of 22 combinations, 3 of each\n",
        " per second\n",
        "  0 diverged; the largest discrepancy is ",
        "  coordination.stiffness  link.loss  diverged  mean discrepancy",
        "\n                     500         0%         0",
        "  ... and 2 more combinations\n",
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    let diverged = desk.text("campaign random.toml --vary coordination.stiffness=1e12 --set scene.duration=5s --out diverged");
    assert!(diverged.contains("1 run of 1 combination, 1 of each") && diverged.contains("all 1 diverged"), "{diverged}");
}

#[test]
fn a_campaign_that_is_finished_is_left_as_it_is() {
    let desk = desk();
    desk.text(&format!("{SIX} --out out"));
    let before = fs::read(desk.path("out/runs.parquet")).unwrap();
    let again = desk.text(&format!("{SIX} --out out --threads 1"));
    assert!(again.contains("all results were in the folder already: nothing was run") && again.contains("6 runs of 2 combinations"), "{again}");
    let document = desk.json(&format!("{SIX} --out out --json"));
    assert_eq!((document["runs"].as_u64(), document["runs_computed"].as_u64()), (Some(6), Some(0)));
    assert_eq!(
        (fs::read(desk.path("out/runs.parquet")).unwrap(), desk.files("out")),
        (before, ["campaign.html", "campaign.json", "discrepancy.svg", "runs.parquet"].map(str::to_owned).to_vec())
    );
}

#[test]
fn threads_change_nothing() {
    let desk = desk();
    for format in ["parquet", "csv"] {
        for threads in ["1", "2", "5"] {
            desk.text(&format!("{SIX} --runs 20 --out {format}{threads} --format {format} --threads {threads} --part 16").replace("--runs 3 ", ""));
            let read = |threads: &str| fs::read(desk.path(&format!("{format}{threads}/runs.{format}"))).unwrap();
            assert_eq!(read(threads), read("1"));
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused_and_nothing_is_written() {
    let desk = desk();
    for (rest, parts) in [
        ("--vary coordination.stifness=0..1/3", &["--vary coordination.stifness=0", "unknown key", "stiffness", "^"][..]),
        ("--vary peers.nobody.contact=none,grasp", &["--vary peers.nobody.contact=none", "left, right"]),
        ("--vary coordination.stiffness=0..1", &["--vary: the number of values is missing", "/13"]),
        ("--vary coordination.stiffness=5..5/3", &["--vary: the range of", "is empty"]),
        ("--vary coordination.stiffness=5..1/3", &["--vary: the range of", "is empty"]),
        ("--vary coordination.stiffness=1..5/0", &["--vary: a range of 0"]),
        ("--vary coordination.stiffness", &["--vary: no key"]),
        ("--vary coordination.stiffness=-5..1/3", &["--vary coordination.stiffness=-5", "^", "note: in the combination coordination.stiffness=-5"]),
        ("--vary object.mass=1,2 --vary link.delay=8ms,8", &["--vary link.delay=8:", "^", "note: in the combination object.mass=1, link.delay=8"]),
        ("--vary peer.tick=1ms,3ms", &["--vary peer.tick=3ms: ", "coordination.update", "^", "note: in the combination peer.tick=3ms"]),
        ("--vary object.mass=1,2 --set link.delay=8", &["--set link.delay=8", "^"]),
        ("--vary object.mass=1,2 --vary object.mass=3", &["--vary: object.mass is varied twice"]),
        ("--vary scene.seed=1,2 --runs 2", &["--runs: scene.seed is varied"]),
        ("--runs 0", &["0 runs"]),
        ("--runs x", &["--runs"]),
        ("--threads 0", &["--threads", "from 1 to 1024"]),
        ("--threads 100000", &["--threads", "from 1 to 1024"]),
        ("--part 0", &["--part"]),
        ("--format xlsx", &["parquet, csv"]),
    ] {
        let outcome = desk.cohaptic(&format!("campaign random.toml {rest} --out out --json"));
        outcome.assert_refused(2, parts);
        assert_eq!((desk.files(""), desk.path("out").exists()), (vec!["random.toml".to_owned()], false), "{rest}");
    }
    desk.cohaptic("campaign random.toml").assert_refused(2, &["--out"]);
    desk.cohaptic("campaign gone.toml --out out").assert_refused(3, &["gone.toml: cannot be read"]);
    desk.cohaptic("campaign random.toml --vary peers.right.hand.file=gone.csv --out out")
        .assert_refused(3, &["gone.csv", "note: in the combination"]);
    desk.write("file", "mine");
    desk.cohaptic("campaign random.toml --out file").assert_refused(2, &["--out: file is not a folder"]);
    desk.write("thesis/chapter.tex", "mine");
    desk.cohaptic("campaign random.toml --out thesis").assert_refused(2, &["--out: thesis holds files, chapter.tex among them"]);
    assert_eq!((desk.read("file"), desk.files("thesis")), ("mine".to_owned(), vec!["chapter.tex".to_owned()]));
}

#[test]
fn another_campaign_is_refused_and_it_is_said_what_differs() {
    let desk = desk();
    desk.text(&format!("{SIX} --out out"));
    let before = (fs::read(desk.path("out/runs.parquet")).unwrap(), desk.read("out/campaign.json"));
    desk.write("other.toml", RANDOM.replace("0.45", "0.5"));
    for (line, part) in [
        (SIX.replace("--runs 3", "--runs 4"), "--runs is 3 there and 4 here"),
        (SIX.replace("..1500", "..1501"), "--vary is coordination.stiffness=500..1500/2 there and coordination.stiffness=500..1501/2 here"),
        (SIX.replace("random", "other"), "of the scene is `mass = 0.45` there and `mass = 0.5` here"),
        (format!("{SIX} --set object.damping=1"), "--set is not given there and object.damping=1 here"),
        (format!("{SIX} --format csv"), "--format is parquet there and csv here"),
    ] {
        desk.cohaptic(&format!("{line} --out out")).assert_refused(2, &["--out: out holds another campaign", part, "folder of its own"]);
        assert_eq!((fs::read(desk.path("out/runs.parquet")).unwrap(), desk.read("out/campaign.json")), before);
    }
    // The same scene by another name is the same.
    desk.write("copy.toml", RANDOM);
    assert!(desk.text(&format!("{} --out out", SIX.replace("random", "copy"))).contains("nothing was run"));
}

#[cfg(unix)]
pub(crate) mod interrupted {
    use std::collections::BTreeSet;
    use std::process::{Command, Stdio};
    use std::thread::sleep;
    use std::time::Duration;

    use super::*;
    use crate::integration::desk::Outcome;
    use crate::integration::interrupt::interrupted;

    /// About two seconds of work for one thread, in 40 parts.
    const LONG: &str = "campaign two.toml --vary link.delay=8ms..24ms/4 --runs 5000 --part 500 --threads 1 --set link.jitter=1ms";

    /// Returns the number of kept parts. A process that is killed between a digest and its part leaves the digest alone, which does not count.
    fn parts(desk: &Desk) -> usize {
        fs::read_dir(desk.path("out")).map_or(0, |files| {
            let names: BTreeSet<_> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
            names.iter().filter(|name| name.strip_suffix(".sha256").is_some_and(|part| names.contains(part))).count()
        })
    }

    /// Goes on to the end, and compares with a campaign that nothing disturbed.
    fn assert_goes_on(desk: &Desk, line: &str, format: &str) {
        let kept = parts(desk) as u64;
        let document = desk.json(&format!("{line} --out out --json").replace("--threads 1", "--threads 2"));
        assert_eq!((document["runs"].as_u64(), document["runs_computed"].as_u64()), (Some(20_000), Some(20_000 - 500 * kept)));
        desk.text(&format!("{line} --out whole").replace("--threads 1", "--threads 3"));
        assert_eq!(desk.files("out"), ["campaign.html", "campaign.json", "discrepancy.svg", &format!("runs.{format}")]);
        let [out, whole] = ["out", "whole"].map(|folder| fs::read(desk.path(&format!("{folder}/runs.{format}"))).unwrap());
        assert!(out == whole, "other bytes");
        assert_eq!(desk.read("out/campaign.json"), desk.read("whole/campaign.json"));
    }

    #[test]
    fn the_same_command_goes_on_and_ends_with_the_same_bytes() {
        let desk = Desk::with("two.toml", TWO);
        let line = format!("{LONG} --out out");
        let outcome = interrupted(&desk, &line, |_| parts(&desk) > 2);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(130), ""));
        let kept = parts(&desk) * 500;
        for part in ["interrupted: ".to_owned(), format!("{kept} of 20000 runs are kept in out; repeat the command to go on from there")] {
            assert!(outcome.stderr.contains(&part), "no {part:?} in {}", outcome.stderr);
        }
        assert!(desk.files("out").iter().all(|name| name == "campaign.json" || name.starts_with("part-")), "{:?}", desk.files("out"));
        let refused = desk.cohaptic(&line.replace("--runs 5000", "--runs 5001"));
        refused.assert_refused(2, &["--runs is 5000 there and 5001 here"]);
        assert_eq!(parts(&desk) * 500, kept);
        assert_goes_on(&desk, LONG, "parquet");
    }

    #[test]
    fn a_kill_costs_no_more_than_the_part_at_hand() {
        let desk = Desk::with("two.toml", TWO);
        let line = format!("{LONG} --format csv");
        let mut child = desk.command(&format!("{line} --out out")).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while parts(&desk) < 3 {
            assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
            sleep(Duration::from_millis(2));
        }
        // While it runs, nobody else may. It is stopped meanwhile, or it might be at its end before the second process has begun.
        assert!(Command::new("kill").args(["-STOP", &child.id().to_string()]).status().unwrap().success());
        desk.cohaptic(&format!("{line} --out out")).assert_refused(3, &["another process works on the campaign in out"]);
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(desk.path("out/cohaptic.lock").exists(), "nobody tidied up");
        assert_goes_on(&desk, &line, "csv");
    }

    /// The command with no file allowed to grow beyond so many blocks of 512 bytes (1024 in some shells): writes then fail as on a full disk.
    pub(crate) fn cramped(desk: &Desk, blocks: u32, line: &str) -> Outcome {
        let command = desk.command(line);
        let mut shell = Command::new("sh");
        shell.args(["-c", "trap '' XFSZ; ulimit -f \"$1\"; shift; exec \"$@\"", "sh", &blocks.to_string()]);
        shell.arg(command.get_program()).args(command.get_args()).current_dir(desk.path("")).stdin(Stdio::null());
        Outcome::of(shell.output().unwrap())
    }

    #[test]
    fn a_disk_that_fills_is_said_and_leaves_nothing_half_written() {
        let desk = Desk::with("random.toml", RANDOM);
        let line = "campaign random.toml --vary link.loss=0%,10% --runs 100 --format csv --part";
        // A row has some 300 bytes, so 16 of them fit into 16 blocks, whichever size these have, and 100 or 200 do not.
        let outcome = cramped(&desk, 16, &format!("{line} 100 --out parts"));
        outcome.assert_refused(3, &["cannot write parts/part-0000", "File too large", "0 of 200 runs are kept", "repeat the command to go on"]);
        assert_eq!(desk.files("parts"), ["campaign.json"]);
        let outcome = cramped(&desk, 16, &format!("{line} 16 --out table"));
        outcome.assert_refused(3, &["cannot write table/runs.csv", "200 of 200 runs are kept"]);
        assert_eq!(desk.files("table").len(), 1 + 2 * 13, "{:?}", desk.files("table"));
        for (folder, part) in [("parts", "100"), ("table", "16")] {
            desk.text(&format!("{line} {part} --out {folder}"));
            desk.text(&format!("{line} {part} --out whole-{folder}"));
            assert_eq!(desk.read(&format!("{folder}/runs.csv")), desk.read(&format!("whole-{folder}/runs.csv")));
        }
        // Not even room for what says which campaign it is: nothing is left at all.
        let outcome = cramped(&desk, 0, &format!("{line} 16 --out nothing"));
        outcome.assert_refused(3, &["cannot write nothing/campaign.json"]);
        assert!(!desk.path("nothing").exists());
    }

    #[test]
    fn a_parquet_file_that_finds_no_room_leaves_nothing_either() {
        let desk = Desk::with("random.toml", RANDOM);
        let line = "campaign random.toml --vary link.loss=0%,10% --runs 100 --part 8";
        // A part has about 7 kB, the table 25 times as much but for what stands at the end of each.
        let outcome = cramped(&desk, 96, &format!("{line} --out table"));
        outcome.assert_refused(3, &["cannot write table/runs.parquet", "File too large", "200 of 200 runs are kept"]);
        assert_eq!(desk.files("table").len(), 1 + 2 * 25);
        assert_eq!(desk.json(&format!("{line} --out table --json"))["runs_computed"].as_u64(), Some(0));
        desk.text(&format!("{line} --out whole"));
        assert!(fs::read(desk.path("table/runs.parquet")).unwrap() == fs::read(desk.path("whole/runs.parquet")).unwrap());
    }
}
