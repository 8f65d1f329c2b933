//! Compares the table with the table of the library's own writer, which keeps the index of all row groups in memory.

use std::fs::File;
use std::path::{Path, PathBuf};

use cohaptic_files::{WholeFile, write_whole};
use parquet::file::reader::{FileReader as _, SerializedFileReader};

use super::*;
use crate::table::content::{Gist, OpenPart};

fn columns() -> Vec<Column> {
    let column = |name: &str, kind: Kind, optional: bool| Column { name: name.to_owned(), kind, optional };
    vec![
        column("run", Kind::Integer, false),
        column("ending", Kind::Text, false),
        column("max_discrepancy_m", Kind::Number, false),
        column("mean", Kind::Number, true),
    ]
}

/// Returns the row of a run. Every third run diverges, and every second run has no mean.
fn row(run: u32) -> Row {
    let ending = if run % 3 == 1 { "diverged" } else { "complete" };
    let mean = if run.is_multiple_of(2) { Value::Absent } else { Value::Number(f64::from(run).sqrt()) };
    vec![Value::Integer(i64::from(run)), Value::Text(ending.into()), Value::Number(1.0 / f64::from(run + 1)), mean]
}

/// Writes parts with one row, two, three, one and so on.
fn parts(folder: &Path, head: Head<'_>, count: u32) -> Vec<(PathBuf, u64)> {
    let mut run = 0;
    let part = |number: u32| {
        let rows: Vec<Row> = (run..=run + number % 3).map(row).collect();
        run += number % 3 + 1;
        let path = folder.join(format!("part-{number:05}.parquet"));
        write_whole(&path, |file| write(file, head, &rows)).unwrap();
        (path, rows.len() as u64)
    };
    (0..count).map(part).collect()
}

fn merged(table: &Path, head: Head<'_>, parts: &[(PathBuf, u64)]) -> Vec<u8> {
    write_whole(table, |file: &mut WholeFile| merge(file, head, parts.iter().map(opened))).unwrap();
    std::fs::read(table).unwrap()
}

fn opened((path, rows): &(PathBuf, u64)) -> Result<OpenPart, TableError> {
    Ok(OpenPart { path: path.clone(), file: File::open(path)?, rows: *rows })
}

/// Writes the same parts by the library alone.
fn by_the_library(head: Head<'_>, parts: &[(PathBuf, u64)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema(head.columns).unwrap(), properties(head)).unwrap();
    for (path, _) in parts {
        let part = File::open(path).unwrap();
        let reader = SerializedFileReader::new(part.try_clone().unwrap()).unwrap();
        for group in reader.metadata().row_groups() {
            let mut to = writer.next_row_group().unwrap();
            merge::append(&mut to, &part, group).unwrap();
            to.close().unwrap();
        }
    }
    writer.close().unwrap();
    bytes
}

/// Lists have another header from 15 elements on, and numbers have another length from 64, 8192 and so on.
#[test]
fn the_bytes_are_those_of_the_library_and_nothing_else_stays_in_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns();
    let head = Head { columns: &columns, about: ("cohaptic.campaign", "{}"), program: "a program" };
    let all = parts(folder.path(), head, 300);
    let table = folder.path().join("runs.parquet");
    for count in [0, 1, 14, 15, 16, 300] {
        assert!(merged(&table, head, &all[..count]) == by_the_library(head, &all[..count]), "{count} parts");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 301);
    }
}

/// From 32,768 row groups on, no row group states its index, for which the format has 16 bits.
#[test]
fn they_are_so_with_more_row_groups_than_have_a_place() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns();
    let head = Head { columns: &columns[..1], about: ("cohaptic.campaign", "{}"), program: "a program" };
    let path = folder.path().join("part-00000.parquet");
    write_whole(&path, |file| write(file, head, &[row(0)[..1].to_vec()])).unwrap();
    let parts = vec![(path, 1); 32_768];
    // The longest test of this crate. The two tables are written at the same time.
    let (table, expected) = std::thread::scope(|scope| {
        let expected = scope.spawn(|| by_the_library(head, &parts));
        (merged(&folder.path().join("runs.parquet"), head, &parts), expected.join().unwrap())
    });
    assert!(table == expected);
}

#[test]
fn a_row_group_at_a_time_says_what_the_library_reads() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns();
    let head = Head { columns: &columns, about: ("cohaptic.campaign", "{}"), program: "a program" };
    let all = parts(folder.path(), head, 40);
    let table = folder.path().join("runs.parquet");
    merged(&table, head, &all);
    let file = File::open(&table).unwrap();
    let library = SerializedFileReader::new(file.try_clone().unwrap()).unwrap();
    let mut index = index::IndexReader::open(&file).unwrap();
    for expected in library.metadata().row_groups() {
        assert_eq!(index.next_group().unwrap().as_ref(), Some(expected));
    }
    assert_eq!(index.next_group().unwrap(), None);
    let mut gists = Vec::new();
    read_gists(file.try_clone().unwrap(), &mut |gist| gists.push(gist)).unwrap();
    let runs: u64 = all.iter().map(|(_, rows)| rows).sum();
    let expected = |run: u32| Gist { diverged: run % 3 == 1, max_discrepancy: 1.0 / f64::from(run + 1) };
    assert_eq!(gists, (0..u32::try_from(runs).unwrap()).map(expected).collect::<Vec<_>>());
    let read = read_columns(file, &["mean", "run"]).unwrap();
    assert_eq!(read.complete, (0..gists.len()).map(|run| run % 3 != 1).collect::<Vec<_>>());
    assert!(read.columns[0][8].is_nan());
    assert_eq!(read.columns.iter().map(|column| column[9].to_bits()).collect::<Vec<_>>(), [3.0_f64, 9.0].map(f64::to_bits));
}

/// The end of the table is cut off, or has other bytes.
#[test]
fn a_table_that_is_not_as_it_was_written_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let columns = columns();
    let head = Head { columns: &columns, about: ("cohaptic.campaign", "{}"), program: "a program" };
    let all = parts(folder.path(), head, 3);
    let table = folder.path().join("runs.parquet");
    let whole = merged(&table, head, &all);
    let end = whole.len() - 8;
    let length = usize::try_from(u32::from_le_bytes(whole[end..end + 4].try_into().unwrap())).unwrap();
    let begin = end - length;
    let with = |place: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[place] = byte;
        bytes
    };
    let read = |bytes: &[u8]| {
        std::fs::write(&table, bytes).unwrap();
        let mut rows = 0;
        read_gists(File::open(&table).unwrap(), &mut |_| rows += 1).map(|()| rows)
    };
    assert_eq!(read(&whole).unwrap(), 6);
    // Shorter than an end, without the last byte, of another format, with an index longer than the file, and with another first field.
    for bytes in [vec![], whole[..7].to_vec(), whole[..whole.len() - 1].to_vec(), with(end + 7, b'E'), with(end + 3, 0x7f), with(begin, 0x25)] {
        assert!(matches!(read(&bytes), Err(TableError::Content(_))), "{}", bytes.len());
    }
}

/// Environment variable with the number of parts for a child process of this test.
#[cfg(target_os = "linux")]
const PARTS: &str = "COHAPTIC_TEST_PARTS";

/// Returns the peak memory of a merge \[kB\]. The merge runs in a process of its own: this test, called again.
#[cfg(target_os = "linux")]
fn peak(parts: usize) -> u64 {
    let mut command = std::process::Command::new(std::env::current_exe().unwrap());
    let name = "table::parquet_file::tests::no_more_memory_is_taken_by_more_parts";
    let output = command.args([name, "--exact", "--nocapture"]).env(PARTS, parts.to_string()).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let peak = said.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
    peak.unwrap_or_else(|| panic!("{said}"))
}

/// An index in memory would take a kilobyte per column and part: 60 MB here.
#[cfg(target_os = "linux")]
#[test]
fn no_more_memory_is_taken_by_more_parts() {
    let Ok(parts) = std::env::var(PARTS) else {
        let (few, many) = (peak(10), peak(1000));
        assert!(many < few + 2000, "{few} kB and {many} kB");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let columns: Vec<Column> = std::iter::repeat_n(columns(), 13).flatten().collect();
    let head = Head { columns: &columns, about: ("cohaptic.campaign", "{}"), program: "a program" };
    let path = folder.path().join("part-00000.parquet");
    let row: Row = std::iter::repeat_n(row(0), 13).flatten().collect();
    write_whole(&path, |file| write(file, head, &[row])).unwrap();
    let table = folder.path().join("runs.parquet");
    let parts = vec![(path, 1); parts.parse().unwrap()];
    write_whole(&table, |file: &mut WholeFile| merge(file, head, parts.iter().map(opened))).unwrap();
    let mut rows = 0;
    read_gists(File::open(&table).unwrap(), &mut |_| rows += 1).unwrap();
    assert_eq!(rows, parts.len());
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    // The line begins with a line feed, because the test harness may have printed a part of a line.
    let peak = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    writeln!(io::stdout(), "\n{peak}").unwrap();
}
