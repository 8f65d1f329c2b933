//! Small files written for these tests by the formats of the programs.

mod delays;
mod edited;
mod links;
mod rare;

use super::*;

fn delays(text: &str, direction: Option<Direction>) -> Delays {
    match read(text, direction) {
        Ok(Some(Content::Delays(delays))) => delays,
        other => panic!("{other:?}"),
    }
}

fn recording(text: &str) -> Recording {
    match read(text, None) {
        Ok(Some(Content::Link(recording))) => recording,
        other => panic!("{other:?}"),
    }
}

fn refused(text: &str) -> String {
    read(text, None).unwrap_err().to_string()
}

fn refused_way(text: &str, direction: Direction) -> String {
    read(text, Some(direction)).unwrap_err().to_string()
}
