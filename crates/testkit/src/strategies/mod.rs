//! Strategies of proptest: links and networks that shrink to the least impaired one.
mod admits;
mod any;
mod bounds;
mod draw;
mod forms;
mod grid;
mod link;
mod network;
mod numbers;
mod shrink;
mod space;
mod stage;

pub use any::{LinkTree, Links, NetworkTree, Networks, any_link, any_network, links_like, networks_like};
pub use bounds::{BoundsError, LinkBounds, LossModel};
pub use link::{ImpairedLink, LinkError};
pub use network::{ImpairedNetwork, NetworkTextError};
pub use stage::Stage;
