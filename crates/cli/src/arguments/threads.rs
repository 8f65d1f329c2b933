//! How many threads a command takes.

use clap::builder::RangedI64ValueParser;

/// Of `--threads`, which is called `--jobs` too. Tens of thousands of threads, which is what a slip of the finger asks for, keep a machine busy with them alone.
pub(crate) fn threads() -> RangedI64ValueParser<u16> {
    clap::value_parser!(u16).range(1..=1024)
}
