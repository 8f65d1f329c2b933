//! Shards: whatever they are, in whatever order they are done, and however a worker ends, the files are those of one process, to the byte.

use std::fs::{self, OpenOptions};
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::Duration;

use crate::integration::campaign::interrupted::cramped;
use crate::integration::desk::{Desk, Outcome, parse};
use crate::integration::interrupt::interrupted;
use crate::integration::scenes::{RANDOM, TWO};

/// 24 runs in eight parts of three.
const CAMPAIGN: &str = "campaign random.toml --vary coordination.stiffness=500..1500/2 --runs 12 --part 3 --format csv";
const PROVEN_MAP: &str = "stability map two.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..50 --prove 4";
const PROVEN_LINE: &str = "stability boundary two.toml --along coordination.stiffness=100..6000 --prove --tolerance 0.01";
/// Long enough to be killed on its way: some seconds in 40 parts.
const LONG: &str = "campaign two.toml --vary link.delay=8ms..24ms/4 --runs 5000 --part 500 --threads 1 --set link.jitter=1ms --no-plot";

fn desk() -> Desk {
    let desk = Desk::with("random.toml", RANDOM);
    desk.write("two.toml", TWO);
    desk
}

/// The files of both folders are the same.
fn assert_same(desk: &Desk, folder: &str, whole: &str) {
    assert_eq!(desk.files(folder), desk.files(whole));
    for name in desk.files(whole) {
        let [found, expected] = [folder, whole].map(|folder| fs::read(desk.path(&format!("{folder}/{name}"))).unwrap());
        assert!(found == expected, "{name} has other bytes");
    }
}

/// Does the shards in this order, puts them together, and compares with one process.
fn assert_shards_are_one(desk: &Desk, line: &str, order: &[u64]) {
    let count = order.len();
    desk.text(&format!("{line} --out whole"));
    for index in order {
        let said = desk.text(&format!("{line} --out shards --shard {index}/{count}"));
        assert!(said.starts_with(&format!("shard {index}/{count} in shards: ")), "{said}");
    }
    let whole = desk.text(&format!("{line} --out whole"));
    let merged = desk.text(&format!("{line} --merge shards"));
    // The second command on a finished campaign computes nothing either. A map says how fast it was, a proof how long it took.
    let is_time = |line: &str| line.contains(" computed in ") || line.trim().strip_suffix(" s").is_some_and(|span| span.parse::<f64>().is_ok());
    let timeless = |text: &str| text.lines().filter(|line| !is_time(line)).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(timeless(&merged), timeless(&whole.replace("whole", "shards")));
    assert_same(desk, "shards", "whole");
}

#[test]
fn shards_of_everything_that_is_shared_give_the_files_of_one_process() {
    let desk = desk();
    for line in [
        format!("{CAMPAIGN} --verdicts"),
        CAMPAIGN.replace("--format csv", "--format parquet"),
        "compare random.toml --strategies average-position,wave --vary link.delay=8ms,24ms --runs 4 --part 2".to_owned(),
        "stability map two.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..50 --grid 5x7 --curve scene.axes=1".to_owned(),
        "stability boundary two.toml --along coordination.stiffness=100..6000 --samples 30".to_owned(),
        format!("{PROVEN_MAP} --curve scene.axes=1"),
        PROVEN_LINE.to_owned(),
    ] {
        assert_shards_are_one(&desk, &line, &[3, 1, 2]);
        for folder in ["shards", "whole"] {
            fs::remove_dir_all(desk.path(folder)).unwrap();
        }
    }
}

/// The folder of a campaign has the text of the scene, the path of its file, from which the files named in the scene are found, and the options. So a worker
/// can run in any working folder.
#[test]
fn a_folder_knows_its_campaign() {
    let desk = desk();
    desk.write("scenes/hand.csv", "t,fx\n0,0.5\n0.3,1.5\n");
    desk.write("scenes/two.toml", TWO.replace("hand = { force = 1.5 }", "hand = { file = \"hand.csv\" }"));
    for (scene, out) in [("two.toml", "here"), ("scenes/two.toml", "deep/there")] {
        let line = format!("campaign {scene} --vary link.delay=8ms,24ms --runs 6 --part 4 --verdicts --format csv");
        desk.text(&format!("{line} --out {out}-whole"));
        for index in [2, 1] {
            desk.text(&format!("{line} --out {out} --shard {index}/2"));
        }
        let status = desk.text(&format!("campaign --status {out}"));
        assert_eq!(status, desk.text(&format!("{line} --status {out}")));
        assert!(status.ends_with("all is done: put it together with --merge\n"), "{status}");
        let merged = desk.text(&format!("campaign --merge {out}"));
        assert!(merged.contains("12 runs of 2 combinations"), "{merged}");
        assert_same(&desk, out, &format!("{out}-whole"));
    }
    desk.cohaptic("campaign --merge here --vary link.delay=8ms,24ms").assert_refused(2, &["expected the scene too"]);
    desk.cohaptic("campaign --merge nowhere").assert_refused(2, &["nowhere holds no campaign"]);
    desk.cohaptic("campaign --out here").assert_refused(2, &["<SCENE>"]);
}

#[test]
fn while_anything_is_missing_a_merge_says_what_and_by_which_shard_it_is_done() {
    let desk = desk();
    for (line, piece) in [
        (CAMPAIGN, "part"),
        ("stability map two.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..50 --grid 2x8", "row"),
        ("stability boundary two.toml --along coordination.stiffness=100..6000 --samples 65", "block"),
    ] {
        let out = piece;
        desk.text(&format!("{line} --out {out} --shard 2/4"));
        let before = desk.files(out);
        let refused = desk.cohaptic(&format!("{line} --merge {out}"));
        let missing =
            format!("{out} is not complete: 6 of 8 {piece}s are missing, counted from 0: 0, 2 to 4, 6 to 7; of 4 shards, these do them: 1, 3 to 4");
        refused.assert_refused(3, &[&missing, "Run them with --shard"]);
        assert_eq!(desk.files(out), before);
        let status = desk.text(&format!("{line} --status {out}"));
        for part in [&format!("{out}: 2 of 8 {piece}s are done, "), "  2/4   done", "nobody works on these: 6 of 8"] {
            assert!(status.contains(part), "no {part:?} in {status}");
        }
        let document = parse(&desk.text(&format!("{line} --status {out} --json")));
        assert_eq!((&document["pieces"], &document["pieces_done"], &document["pieces_unassigned"]), (&8.into(), &2.into(), &6.into()));
        assert_eq!((&document["workers"][0]["shard"], &document["workers"][0]["state"]), (&"2/4".into(), &"done".into()));
        // One process may do the rest, and tidies up.
        desk.text(&format!("{line} --out {out}"));
        // A merge of merged work would do nothing, so that the status does not advise it.
        let status = desk.text(&format!("{line} --status {out}"));
        assert!(status.starts_with(&format!("{out}: 8 of 8 {piece}s are done, ")), "{status}");
        assert!(status.ends_with("all is done and put together\n"), "{status}");
        // The result of another scene is no result of this scene.
        if piece != "part" {
            let status = desk.text(&format!("{line} --set link.delay=3ms --status {out}"));
            assert!(status.starts_with(&format!("{out}: 0 of 8 {piece}s are done, ")), "{status}");
        }
        assert!(desk.files(out).iter().all(|name| !name.contains("worker") && !name.contains("partial")), "{:?}", desk.files(out));
    }
}

/// The pieces of a proof that a worker found before it was killed are not looked at again, and the command without shards does the others.
#[test]
fn a_proof_that_lacks_blocks_is_refused_and_goes_on_with_what_there_is() {
    let desk = desk();
    desk.text(&format!("{PROVEN_MAP} --out out --shard 2/3"));
    let refused = desk.cohaptic(&format!("{PROVEN_MAP} --merge out"));
    refused.assert_refused(3, &["out is not complete: ", " of 64 blocks are missing", "Run them with --shard"]);
    let document = parse(&desk.text(&format!("{PROVEN_MAP} --status out --json")));
    let worker = &document["workers"][0];
    assert_eq!((&document["pieces"], &worker["state"], &worker["pieces"]), (&64.into(), &"done".into(), &21.into()));
    // Of larger pieces that are decided all blocks are done.
    assert!((21..64).contains(&document["pieces_done"].as_u64().unwrap()), "{document}");
    // The machine lost its power in the middle of a line.
    let rows = desk.files("out").into_iter().find(|name| name.starts_with("proof.rows.")).unwrap();
    let text = desk.read(&format!("out/{rows}"));
    desk.write(&format!("out/{rows}"), &text[..text.len() - 40]);
    let again = desk.text(&format!("{PROVEN_MAP} --out out --shard 2/3"));
    assert!(again.contains("21 blocks of 21 ranges") && again.contains("there already"), "{again}");
    desk.text(&format!("{PROVEN_MAP} --out out"));
    desk.text(&format!("{PROVEN_MAP} --out whole"));
    assert_same(&desk, "out", "whole");
}

/// Begins a shard, and waits until it has kept something.
fn begun(desk: &Desk, line: &str) -> Child {
    let mut child = desk.command(line).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !logs(desk).contains("piece ") {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        sleep(Duration::from_millis(2));
    }
    child
}

/// Returns the text of all logs of workers.
fn logs(desk: &Desk) -> String {
    if !desk.path("out").exists() {
        return String::new();
    }
    let logs = desk.files("out").into_iter().filter(|name| name.starts_with("worker-"));
    logs.map(|name| desk.read(&format!("out/{name}"))).collect()
}

#[test]
fn a_worker_that_is_killed_is_done_again_by_whichever_split_and_the_table_is_the_same() {
    let desk = desk();
    let mut child = begun(&desk, &format!("{LONG} --out out --shard 1/2"));
    let status = desk.text(&format!("{LONG} --status out"));
    assert!(status.contains("  1/2  working") && status.contains("nobody works on these"), "{status}");
    desk.cohaptic(&format!("{LONG} --out out")).assert_refused(3, &["works on the campaign in out, shard 1/2"]);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(desk.path("out/shard-1-of-2.lock").exists(), "nobody tidied up");
    let status = desk.text(&format!("{LONG} --status out"));
    assert!(status.contains("  1/2  killed"), "{status}");
    let kept = logs(&desk).matches("piece ").count();
    assert!((1..20).contains(&kept), "{kept} of 20 parts");
    // The process was on this machine and is no more: nobody waits.
    let again = desk.text(&format!("{LONG} --out out --shard 1/2"));
    assert!(again.contains("there already"), "{again}");
    for index in [3, 1, 2] {
        desk.text(&format!("{LONG} --out out --shard {index}/3 --threads 2").replace("--threads 1 ", ""));
    }
    desk.text(&format!("{LONG} --merge out"));
    desk.text(&format!("{LONG} --out whole"));
    assert_same(&desk, "out", "whole");
}

#[test]
fn of_two_workers_with_the_same_shard_the_second_is_refused() {
    let desk = desk();
    let line = format!("{LONG} --out out --shard 1/2").replace("--runs 5000", "--runs 500000");
    let mut child = begun(&desk, &line);
    let second = desk.cohaptic(&line);
    let process = format!("process {} of ", child.id());
    second.assert_refused(3, &["waiting until it is heard of again", &process, "works on shard 1/2 in out: wait until it has ended"]);
    child.kill().unwrap();
    child.wait().unwrap();
    // It is ended in good order too.
    let outcome = interrupted(&desk, &line, |_| logs(&desk).matches("shard 1/2").count() > 1 && logs(&desk).ends_with('\n'));
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("repeat the command to go on from there") && logs(&desk).contains("end interrupted"), "{}", outcome.stderr);
    assert!(!desk.path("out/shard-1-of-2.lock").exists());
}

/// The machine of a worker lost its power a while ago.
#[test]
fn a_lock_of_another_machine_that_is_not_renewed_is_taken_over() {
    let desk = desk();
    desk.text(&format!("{CAMPAIGN} --out out --shard 2/2"));
    desk.write("out/shard-1-of-2.lock", "elsewhere 12 pid1 34\n5\n");
    let refused = desk.cohaptic(&format!("{CAMPAIGN} --out out"));
    refused.assert_refused(3, &["process 12 of elsewhere works on the campaign in out, shard 1/2"]);
    let file = OpenOptions::new().write(true).open(desk.path("out/shard-1-of-2.lock")).unwrap();
    file.set_modified(file.metadata().unwrap().modified().unwrap() - Duration::from_secs(91)).unwrap();
    desk.text(&format!("{CAMPAIGN} --out out --shard 1/2"));
    desk.text(&format!("{CAMPAIGN} --merge out"));
    desk.text(&format!("{CAMPAIGN} --out whole"));
    assert_same(&desk, "out", "whole");
}

#[test]
fn a_disk_that_fills_is_said_and_the_same_shard_goes_on() {
    let desk = desk();
    let line = "campaign random.toml --vary link.loss=0%,10% --runs 100 --format csv --part 100";
    let outcome = cramped(&desk, 16, &format!("{line} --out out --shard 1/1"));
    outcome.assert_refused(3, &["cannot write out/part-0000", "File too large", "Parts that are whole are kept", "repeat the command to go on"]);
    assert!(desk.files("out").iter().all(|name| name == "campaign.json" || name.starts_with("worker-")), "{:?}", desk.files("out"));
    assert!(logs(&desk).contains("end failed"));
    desk.text(&format!("{line} --out out --shard 1/1"));
    desk.text(&format!("{line} --merge out"));
    desk.text(&format!("{line} --out whole"));
    assert_same(&desk, "out", "whole");
}

#[test]
fn more_shards_than_parts_are_done_too() {
    let desk = desk();
    let said = desk.text(&format!("{CAMPAIGN} --out out --shard 9/9"));
    assert_eq!(said, "shard 9/9 in out: there are fewer parts than shards, so this shard has nothing to do\n");
    let document = desk.json(&format!("{CAMPAIGN} --out out --shard 8/9 --json"));
    assert_eq!((&document["schema"], &document["units"], &document["units_computed"]), (&"cohaptic/shard".into(), &3.into(), &3.into()));
}

/// Runs a command with these environment variables.
fn with(desk: &Desk, variables: &[(&str, &str)], line: &str) -> Outcome {
    Outcome::of(desk.command(line).envs(variables.iter().copied()).output().unwrap())
}

#[test]
fn a_scheduler_says_which_shard_it_is() {
    let desk = desk();
    for (variables, shard, means) in [
        (&[("OMPI_COMM_WORLD_RANK", "0"), ("OMPI_COMM_WORLD_SIZE", "3")][..], "auto", "1/3"),
        (&[("JOB_COMPLETION_INDEX", "1")], "auto/3", "2/3"),
        (&[("PBS_ARRAY_INDEX", "3")], "auto/3", "3/3"),
    ] {
        let outcome = with(&desk, variables, &format!("{CAMPAIGN} --out out --shard {shard}"));
        assert!(outcome.status == Some(0) && outcome.stdout.starts_with(&format!("shard {means} in out: ")), "{outcome:?}");
    }
    desk.text(&format!("{CAMPAIGN} --merge out"));
    let refused = |shard: &str, parts: &[&str]| desk.cohaptic(&format!("{CAMPAIGN} --out new --shard {shard}")).assert_refused(2, parts);
    refused("auto", &["--shard auto: no scheduler says which shard this is", "JOB_COMPLETION_INDEX"]);
    refused("4/3", &["\"4/3\" names no shard: expected I/N, with I from 1 to N", "or auto"]);
    refused("auto/x", &["expected auto/N"]);
    assert!(!desk.path("new").exists());
}

#[test]
fn what_makes_no_sense_together_is_refused() {
    let desk = desk();
    let campaign = |options: &str| desk.cohaptic(&format!("campaign random.toml {options}"));
    campaign("").assert_refused(2, &["--out <DIR>"]);
    campaign("--shard 1/2").assert_refused(2, &["--out <DIR>"]);
    campaign("--merge out --out out").assert_refused(2, &["cannot be used with"]);
    campaign("--merge out --shard 1/2").assert_refused(2, &["cannot be used with"]);
    campaign("--merge out").assert_refused(2, &["out holds no campaign: expected a folder in which shards were run"]);
    campaign("--status out").assert_refused(2, &["out holds no campaign"]);
    // A merge takes what its shards are of, and no other proof.
    desk.text(&format!("{PROVEN_MAP} --out proof --shard 1/1"));
    desk.cohaptic(&format!("{PROVEN_MAP} --merge proof").replace("--prove 4", "--prove 5")).assert_refused(2, &["halved 4 times", "halved 5 times"]);
    assert!(!desk.path("out").exists());
}
