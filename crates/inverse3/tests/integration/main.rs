//! Tests of client and simulated service together.

mod faults;
