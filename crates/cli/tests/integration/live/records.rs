//! The records of a session, as numbers.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::integration::desk::Desk;

/// A row of `packets.csv`; times in nanoseconds.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Packet {
    pub(super) link: String,
    pub(super) sequence: u64,
    pub(super) sent: u64,
    pub(super) arrived: Option<u64>,
    pub(super) fate: String,
}

/// A row of `inputs.csv`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Input {
    pub(super) at: u64,
    pub(super) kind: String,
    pub(super) peer: String,
    pub(super) value: String,
}

/// A row of `trajectory.csv`, of one axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Tick {
    pub(super) at: u64,
    pub(super) xo: f64,
    pub(super) vo: f64,
    pub(super) ft: f64,
}

/// A decimal number of seconds, exactly.
pub(super) fn nanos(seconds: &str) -> u64 {
    let (whole, part) = seconds.split_once('.').unwrap_or((seconds, ""));
    assert!(part.len() <= 9, "{seconds} has more digits than nanoseconds");
    whole.parse::<u64>().unwrap() * 1_000_000_000 + format!("{part:0<9}").parse::<u64>().unwrap()
}

fn rows(desk: &Desk, file: &str) -> Vec<csv::StringRecord> {
    let text = desk.read(file);
    assert!(text.ends_with('\n'), "{file} is whole");
    csv::Reader::from_reader(text.as_bytes()).records().map(Result::unwrap).collect()
}

pub(super) fn packets(desk: &Desk, folder: &str) -> Vec<Packet> {
    let read = |row: csv::StringRecord| Packet {
        link: row[0].to_owned(),
        sequence: row[1].parse().unwrap(),
        sent: nanos(&row[2]),
        arrived: (!row[3].is_empty()).then(|| nanos(&row[3])),
        fate: row[4].to_owned(),
    };
    rows(desk, &format!("{folder}/packets.csv")).into_iter().map(read).collect()
}

pub(super) fn inputs(desk: &Desk, folder: &str) -> Vec<Input> {
    let read =
        |row: csv::StringRecord| Input { at: row[0].parse().unwrap(), kind: row[1].to_owned(), peer: row[2].to_owned(), value: row[4].to_owned() };
    let mut rows = rows(desk, &format!("{folder}/inputs.csv"));
    let closing = rows.pop().unwrap();
    assert_eq!((&closing[1], closing[4].parse()), ("closed", Ok(rows.len())), "the record is closed");
    let rows = rows.into_iter().map(read);
    // Those about the scene are looked at in `replays.rs`.
    rows.filter(|row| !["program", "scene", "file", "key"].contains(&row.kind.as_str())).collect()
}

/// The ticks of each peer.
pub(super) fn trajectory(desk: &Desk, folder: &str) -> BTreeMap<String, Vec<Tick>> {
    let mut peers: BTreeMap<String, Vec<Tick>> = BTreeMap::new();
    for row in rows(desk, &format!("{folder}/trajectory.csv")) {
        let number = |column: usize| row[column].parse().unwrap();
        peers.entry(row[1].to_owned()).or_default().push(Tick { at: nanos(&row[0]), xo: number(4), vo: number(5), ft: number(9) });
    }
    peers
}

/// Returns the rows of `releases.csv`: receiver, due instant \[ns\], and lateness \[µs\].
pub(super) fn releases(desk: &Desk, folder: &str) -> Vec<(String, u64, f64)> {
    rows(desk, &format!("{folder}/releases.csv")).into_iter().map(|row| (row[0].to_owned(), nanos(&row[1]), row[2].parse().unwrap())).collect()
}

/// Files that a session writes in addition to the files of a run.
const OF_A_SESSION: [&str; 4] = ["inputs.csv", "lateness.csv", "live.html", "releases.csv"];

/// Checks that a replay of the record in `out` in virtual time writes the same record.
pub(super) fn assert_replays(desk: &Desk, scene: &str, set: &str) {
    desk.text(&format!("run {scene} {set} --inputs out/inputs.csv --out again"));
    assert_same(desk, "out", "again");
}

/// Two folders have the same records, byte for byte.
pub(super) fn assert_same(desk: &Desk, session: &str, run: &str) {
    // The page of a run names the command, which a session has not.
    let mut expected: Vec<String> = desk.files(run).into_iter().filter(|file| file != "run.html").collect();
    let of_the_run = expected.clone();
    expected.extend(OF_A_SESSION.map(str::to_owned));
    expected.sort();
    assert_eq!(desk.files(session), expected);
    for file in of_the_run {
        let [left, right] = [session, run].map(|folder| desk.read(&format!("{folder}/{file}")));
        if left != right {
            let line = left.lines().zip(right.lines()).position(|(left, right)| left != right);
            panic!("{file} of {session} and of {run} differ, first in line {line:?} counted from 0");
        }
    }
}

/// Returns whether the balance holds that every socket has: each datagram that was handled has one outcome.
pub(super) fn assert_counted(door: &Value) {
    let count = |key: &str| door[key].as_u64().unwrap();
    let refused: u64 = door["refused"].as_object().unwrap().values().map(|count| count.as_u64().unwrap()).sum();
    assert_eq!(count("handled"), count("admitted") + count("welcomed") + refused, "{door:#}");
}
