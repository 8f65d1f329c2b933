//! Stages in which packets queue: the bottleneck, and the token bucket.

pub(crate) mod bottleneck;
mod codel;
pub(crate) mod cross_traffic;
mod delivery_trace;
mod dualpi2;
mod equal_packets;
mod fifo;
mod fq_codel;
mod framing;
pub(crate) mod limit;
mod load;
mod pie;
mod red;
pub(crate) mod token_bucket;

pub use bottleneck::{Bottleneck, Discipline, Service};
pub use codel::CoDel;
pub use cross_traffic::{CrossRecording, CrossRecordingError, CrossTraffic, CrossTrafficError, OnOff, Poisson};
pub use delivery_trace::{DeliveryTrace, DeliveryTraceError, MAHIMAHI_BYTES};
pub use dualpi2::DualPi2;
pub use fq_codel::FqCoDel;
pub use framing::{Cells, Framing};
pub use limit::QueueLimit;
pub use load::Load;
pub use pie::Pie;
pub use red::{Red, RedError};
pub use token_bucket::{Peak, TokenBucket};

pub(crate) use bottleneck::{BottleneckStage, Queued, giga_bits};
pub(crate) use cross_traffic::CrossStage;
pub(crate) use equal_packets::{EqualPackets, nanos};
pub(crate) use fifo::{Fifo, Rules};
pub(crate) use token_bucket::TokenBucketStage;
