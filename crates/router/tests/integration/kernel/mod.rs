//! Real traffic: two hosts in network namespaces of their own with the router between them. Everything is made by the tests themselves, without root where the
//! system lets a user have namespaces; where it does not they say so and are skipped.
//!
//! Nothing here depends on how fast the machine is: a packet is never earlier than its link says, however late it may be, and what becomes of a packet does
//! not depend on time where the test looks at it.

mod ethernet;
mod hosts;
mod measure;
mod sandbox;
mod throughput;
mod tun;
