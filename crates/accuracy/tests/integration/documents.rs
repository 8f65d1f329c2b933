//! CSV, text and HTML.

use cohaptic_accuracy::{About, Row, csv, html, text};
use cohaptic_picture::Size;
use cohaptic_picture::testing::page_faults;

use crate::row;

fn awkward() -> Vec<Row> {
    let mut quoted = row("a, b \"c\" <d> & e", Some(1.0 / 3.0), Some(4.9e-324));
    quoted.note = "two\nlines, and a comma".to_owned();
    vec![quoted, row("none", None, None), row("zero", Some(1e300), Some(0.0)), row("ordinary", Some(12.3), Some(1e-9))]
}

#[test]
fn the_csv_reads_back_to_the_bit() {
    let rows = awkward();
    let text = csv(&rows);
    let mut reader = csv_crate(&text);
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(header, ["subject", "case", "method", "setting", "cost", "cost_unit", "error", "error_unit", "reference", "note"]);
    let records: Vec<::csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(records.len(), rows.len());
    for (record, row) in records.iter().zip(&rows) {
        let number = |field: &str| (!field.is_empty()).then(|| field.parse::<f64>().unwrap());
        assert_eq!((&record[0], &record[1], &record[2], &record[3]), ("motion", "a case", row.method.as_str(), "4 steps"));
        assert_eq!((number(&record[4]), number(&record[6])), (row.cost, row.error));
        assert_eq!((&record[5], &record[7], &record[8], &record[9]), (row.cost_unit, row.error_unit, row.reference, row.note.as_str()));
    }
}

fn csv_crate(text: &str) -> ::csv::Reader<&[u8]> {
    ::csv::Reader::from_reader(text.as_bytes())
}

#[test]
fn the_page_escapes_what_it_shows_and_closes_what_it_opens() {
    let page = html(&awkward(), &About { line: "a <machine>".to_owned(), partial: true }, Size::PAGE);
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    assert!(page.contains("a, b &quot;c&quot; &lt;d&gt; &amp; e") && page.contains("a &lt;machine&gt;") && page.contains("interrupted"));
    assert!(!html(&awkward(), &About::default(), Size::PAGE).contains("interrupted"));
    assert_eq!(page_faults(&page), [""; 0]);
}

#[test]
fn the_tables_say_every_row_once() {
    let tables = text(&awkward());
    assert!(tables.starts_with("motion, a case: position [m] against ns a tick\n  against: a formula\n"));
    for (method, cost, error) in [("none", "–", "–"), ("zero", "1.00e300", "0"), ("ordinary", "12.3", "1.00e-9")] {
        let line = tables.lines().find(|line| line.trim_start().starts_with(method)).unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(words[words.len() - 2..], [cost, error], "{line}");
    }
}

#[test]
fn nothing_measured_is_an_empty_page_and_a_header() {
    assert_eq!(csv(&[]).lines().count(), 1);
    assert_eq!(text(&[]), "");
    assert_eq!(page_faults(&html(&[], &About::default(), Size::PAGE)), [""; 0]);
}
