//! The tests are copied from the sources of tokio: see `run`.
