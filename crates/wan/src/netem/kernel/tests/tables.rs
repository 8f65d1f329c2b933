//! Tests of the built-in tables and of files.

use crate::laws::delay::DistTableError;
use crate::netem::kernel::correlated::distributed;
use crate::netem::kernel::tests::{deviation, mean};
use crate::netem::kernel::{Prng, Table};

/// Returns the hash of Fowler, Noll and Vo (FNV-1a, 64 bits) of the entries as decimal numbers, one per line.
fn hash(table: &Table) -> u64 {
    let text: String = table.entries().iter().map(|entry| format!("{entry}\n")).collect();
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

fn values(table: &Table) -> Vec<f64> {
    table.entries().iter().map(|&entry| f64::from(entry) / 8192.0).collect()
}

const NORMAL: u64 = 0x18ed_0e78_e18a_b760;
const PARETO: u64 = 0x83bc_dab8_5f71_9569;
const PARETO_NORMAL: u64 = 0x297e_427b_1dcf_ae14;

/// The hashes were computed from the files normal.dist, pareto.dist and paretonormal.dist of iproute2 6.1.
#[test]
fn the_tables_are_those_that_iproute2_ships() {
    assert_eq!(hash(&Table::normal()), NORMAL);
    assert_eq!(hash(&Table::pareto()), PARETO);
    assert_eq!(hash(&Table::pareto_normal()), PARETO_NORMAL);
}

/// Published: mean, deviation and support of each table, to the digits given.
#[test]
fn the_tables_have_the_moments_that_were_published() {
    let published = [
        (Table::normal(), (-0.0008, 1.0001), (-4.00, 3.52)),
        (Table::pareto(), (-0.033, 0.820), (-0.667, 4.00)),
        (Table::pareto_normal(), (-0.025, 0.834), (-1.50, 3.88)),
    ];
    for (table, (mean_published, deviation_published), (least, most)) in published {
        let values = values(&table);
        assert_eq!(values.len(), 4096);
        assert!((mean(&values) - mean_published).abs() < 0.0005);
        assert!((deviation(&values) - deviation_published).abs() < 0.0005);
        assert!((values.iter().copied().fold(f64::INFINITY, f64::min) - least).abs() < 0.005);
        assert!((values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - most).abs() < 0.005);
    }
}

#[test]
fn a_file_is_read_as_tc_reads_it() {
    let table = Table::parse("# a comment\n\n 1 -2\t0x10\n#3\n-010 32767 -32768\r\n").unwrap();
    assert_eq!(table.entries(), [1, -2, 16, -8, 32_767, -32_768]);
}

#[test]
fn what_is_no_table_is_refused_with_its_place() {
    assert_eq!(Table::parse("# nothing\n\n"), Err(DistTableError::Empty));
    assert_eq!(Table::parse("1 2\n# x\n3 four\n"), Err(DistTableError::NotAnInteger { line: 3, column: 3, word: "four".into() }));
    assert_eq!(Table::parse("32768"), Err(DistTableError::OutOfRange { line: 1, column: 1, word: "32768".into() }));
    let full = "1\n".repeat(16_384);
    assert_eq!(Table::parse(&full).unwrap().entries().len(), 16_384);
    assert_eq!(Table::parse(&format!("{full}1\n")), Err(DistTableError::TooMany { line: 16_385, column: 1 }));
}

/// The value mean + sigma·entry/8192 is computed in two parts: the remainder of sigma by 8192 is rounded half away from zero, the rest is exact.
#[test]
fn a_table_scales_by_parts() {
    let one = Table::parse("5000").unwrap();
    let minus = Table::parse("-5000").unwrap();
    for (sigma, expected) in [(1, 1), (8192, 5000), (8193, 5001), (10_000_000, 6_103_516), (0, 0)] {
        assert_eq!(distributed(7, sigma, || 0, Some(&one)), 7 + expected, "{sigma}");
        assert_eq!(distributed(7, sigma, || 0, Some(&minus)), 7 - expected, "{sigma}");
    }
}

/// Published: uniform jitter of ±σ has the deviation σ/√3 (577 ms for 1 s), but the remainder of 2³² by 2·10⁹ makes it 598 ms. A table multiplies the
/// deviation by 1.73 as well.
#[test]
fn jitter_is_a_half_width_without_and_a_deviation_with_a_table() {
    let draws = |sigma: i32, table: Option<&Table>| {
        let mut prng = Prng::new(1);
        let values: Vec<f64> = (0..1_000_000).map(|_| distributed(0, sigma, || prng.next_u32(), table) as f64 / f64::from(sigma)).collect();
        deviation(&values)
    };
    // The standard error of a deviation from 10⁶ draws is below 0.0011 for all these laws. The tolerance is five of these and half a digit.
    let uniform = draws(10_000_000, None);
    assert!((uniform - 1.0 / 3.0_f64.sqrt()).abs() < 0.0055, "{uniform}");
    assert!((draws(1_000_000_000, None) - 0.598).abs() < 0.0055);
    let normal = draws(10_000_000, Some(&Table::normal()));
    assert!((normal - 1.0001).abs() < 0.0055);
    assert!((normal / uniform - 1.73).abs() < 0.015);
    assert!((draws(10_000_000, Some(&Table::pareto())) - 0.820).abs() < 0.0055);
}
