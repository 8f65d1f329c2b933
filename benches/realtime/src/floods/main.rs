//! Writes `docs/measured-floods.md`: `cargo run --profile dist -p cohaptic-benches-realtime --bin floods-table > docs/measured-floods.md`. Takes a few minutes; a number of
//! seconds as argument replaces the five of each row of requests.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]

mod http;
mod visits;

use std::error::Error;
use std::time::Duration;

use cohaptic_benches_realtime::{hello_floods, machine};

/// Prints one section of the page; rows of requests have that length each.
type Section = fn(Duration) -> Result<(), Box<dyn Error>>;

/// The sections of the page, in order.
const SECTIONS: [Section; 2] = [http::section, hellos];

/// Honest peers of each row of [`hellos`].
const HONEST: u32 = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let seconds = std::env::args().nth(1).map_or(Ok(5), |text| text.parse())?;
    println!("# Floods\n");
    println!("Servers and sessions under more requests and datagrams than anybody honest sends. This page is written by\n");
    println!("    cargo run --profile dist -p cohaptic-benches-realtime --bin floods-table > docs/measured-floods.md\n");
    println!("and measured on: {}. All rows run one after the other in one process, with", machine::name());
    println!("the flood in it, on the same cores; a row of requests takes {seconds} s.\n");
    SECTIONS.into_iter().try_for_each(|section| section(Duration::from_secs(seconds)))
}

/// A row ends when the last honest peer has come in, or has given up.
fn hellos(_row: Duration) -> Result<(), Box<dyn Error>> {
    print!("{}", hello_floods::section(HONEST)?);
    Ok(())
}
