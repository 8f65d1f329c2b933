//! The protocol over bad networks: the planted bug is found, shrunk, and is what it is said to be.

mod finds;
mod only_then;
mod transfer;
