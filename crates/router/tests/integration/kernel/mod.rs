//! Real traffic: two hosts in network namespaces of their own, with the router between them. The tests create all namespaces and devices, without root if the
//! system lets users create namespaces; otherwise the tests say so and are skipped.
//!
//! No assertion depends on the speed of the machine: a packet is never earlier than its link says, however late the packet may be, and the tests look only at
//! fates that do not depend on time.

mod ethernet;
mod hosts;
mod measure;
mod sandbox;
mod throughput;
mod tun;
