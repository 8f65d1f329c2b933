//! Detection of scenes that are too large for a simulation.

use std::fs;

use cohaptic_scene::{FromScene, Scene};
use cohaptic_wan::MOST_NODES;

use crate::arrays::Shape;
use crate::plan::{Model, Plan};

/// Number of peers up to which the memory is not checked: such scenes take some hundred megabytes, more only with many packets in flight.
const SMALL: usize = 500;

/// Measured least memory of a run for each peer \[bytes\], rounded down.
const A_PEER: u64 = 1300;
/// Measured least memory of a run in arrays for each link \[bytes\], rounded down.
const A_LINK_IN_ARRAYS: u64 = 250;
/// Measured least memory of a run with events for each link \[bytes\], rounded down.
const A_LINK_WITH_EVENTS: u64 = 1000;

/// Reason why a scene is too large for a simulation.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TooLarge {
    /// Index of the first excess peer, or of the last peer of the scene if the memory is too small.
    pub peer: usize,
    /// Text with the part that is too large, and a cure.
    pub reason: String,
}

/// Way of running a scene, as far as its memory is concerned.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Way {
    /// In arrays, with one constant delay of all links, so links take no memory.
    Broadcast,
    /// In arrays, with numbers for each link.
    Packets,
    /// With events; each link is a state machine.
    Events,
}

/// Returns why a simulation of the scene does not fit into this program or into the free memory reported by the system; `None` if the scene may fit.
///
/// `watched`: whether an observer uses anything but [`crate::Observer::keep_going`]. The memory is a lower bound: jitter, queues or many packets in flight take
/// more. Scenes of up to 500 peers are not checked.
///
/// Runs with events have at most 23,170 peers, or 65,535 on a topology. Runs in arrays have at most 65,535 peers, and any number if all links have one constant
/// delay and lead from every peer to all others.
#[must_use]
pub fn too_large(scene: &Scene, model: Model, watched: bool) -> Option<TooLarge> {
    if scene.peers.len() <= SMALL { None } else { too_large_for(scene, Way::of(scene, model, watched), free_memory()) }
}

fn too_large_for(scene: &Scene, way: Way, free: Option<u64>) -> Option<TooLarge> {
    let peers = scene.peers.len();
    let links = scene.link_count();
    let needed = way.bytes(peers, links);
    // Nodes of a full mesh are limited by the index of a link, nodes of a topology by the index of a node.
    let most = if scene.topology.is_some() { usize::from(u16::MAX) } else { MOST_NODES };
    let (peer, what) = if way == Way::Events && peers > most {
        (most, format!("too many to be simulated with events, which takes at most {most} peers"))
    } else {
        let free = free.filter(|free| *free < needed)?;
        (
            peers - 1,
            format!("too many to be simulated in the memory that is free: {} of at least {} that it takes", Megabytes(free), Megabytes(needed)),
        )
    };
    // The message names the cheapest way to run this scene, if that way is cheaper.
    let least = Way::of(scene, Model::Least, false);
    let cure = if least.bytes(peers, links) < needed {
        let needed = Megabytes(least.bytes(peers, links));
        format!("to look at nothing but counters, without plot, records and measures, which takes {needed} or a little more")
    } else {
        "one constant delay for all links at all times, one tick for all peers and no access lines, without plot, records and measures".to_owned()
    };
    Some(TooLarge { peer, reason: format!("{peers} peers with {links} links between them are {what}: expected fewer peers, or {cure}") })
}

impl Way {
    fn of(scene: &Scene, model: Model, watched: bool) -> Self {
        let in_arrays = if watched || model != Model::Least { None } else { Shape::of(scene, &Plan::new(scene, model, false), &FromScene).ok() };
        match in_arrays {
            Some((shape, _)) if shape.is_broadcast() => Self::Broadcast,
            Some(_) => Self::Packets,
            None => Self::Events,
        }
    }

    fn bytes(self, peers: usize, links: u64) -> u64 {
        let a_link = match self {
            Self::Broadcast => 0,
            Self::Packets => A_LINK_IN_ARRAYS,
            Self::Events => A_LINK_WITH_EVENTS,
        };
        (peers as u64).saturating_mul(A_PEER).saturating_add(links.saturating_mul(a_link))
    }
}

/// Returns the memory that the system and the control group leave to this process \[bytes\]; `None` if the system does not report it.
fn free_memory() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let kibibytes = text.lines().find_map(|line| line.strip_prefix("MemAvailable:")?.trim().strip_suffix("kB")?.trim().parse::<u64>().ok())?;
    let of_group = |name: &str| fs::read_to_string(format!("/sys/fs/cgroup/memory.{name}")).ok()?.trim().parse::<u64>().ok();
    // Without a control group, or with the limit `max`, only the system's number counts.
    let in_group = of_group("max").zip(of_group("current")).map_or(u64::MAX, |(most, now)| most.saturating_sub(now));
    Some(kibibytes.saturating_mul(1024).min(in_group))
}

/// Bytes, printed in megabytes.
struct Megabytes(u64);

impl std::fmt::Display for Megabytes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} MB", self.0 / 1_000_000)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use cohaptic_peer::Drift;
    use cohaptic_scene::Topology;

    use super::*;

    fn scene(peers: usize, link: &str) -> Scene {
        let text = format!(
            "scene = {{ duration = \"8ms\", count = {peers} }}\nobject.mass = 1\nlink = {{ {link} }}\n\
             coordination = {{ strategy = \"average-position\", stiffness = 1, update = \"8ms\" }}\npeer = {{ contact = \"none\", device.mass = 1 }}\n"
        );
        Scene::parse(&text, Path::new("many.toml"), &[]).unwrap()
    }

    #[test]
    fn each_way_has_its_limit_and_says_what_would_fit() {
        let constant = scene(30_000, "delay = \"24ms\"");
        let refused = |scene: &Scene, watched: bool, free: u64| {
            too_large_for(scene, Way::of(scene, Model::Least, watched), Some(free)).map(|TooLarge { peer, reason }| (peer, reason))
        };
        assert_eq!(refused(&constant, false, 39_000_000), None);
        let (peer, reason) = refused(&constant, false, 38_999_999).unwrap();
        assert_eq!(peer, 29_999);
        assert!(reason.contains("30000 peers with 899970000 links between them are too many"), "{reason}");
        assert!(reason.contains("free: 38 MB of at least 39 MB") && reason.contains("expected fewer peers, or one constant delay"), "{reason}");
        let (peer, reason) = refused(&constant, true, u64::MAX).unwrap();
        assert_eq!(peer, 23_170);
        assert!(reason.contains("at most 23170 peers: expected fewer peers, or to look at nothing but counters"), "{reason}");
        assert!(reason.contains("takes 39 MB"), "{reason}");
        // Drifting clocks need events.
        let mut drifting = constant.clone();
        drifting.peers.iter_mut().for_each(|peer| peer.clock.drift = Drift::from_fraction(1e-5).unwrap());
        assert_eq!(refused(&drifting, false, u64::MAX).map(|(peer, _)| peer), Some(23_170));
        // A shared access line needs events.
        let mut sharing = constant.clone();
        sharing.peers[0].uplink = Some(Arc::clone(&sharing.links.configs()[0]));
        assert_eq!(refused(&sharing, false, u64::MAX).map(|(peer, _)| peer), Some(23_170));
        let ring = Scene { topology: Topology::ring(70_000, 2).map(Arc::new), ..scene(70_000, "delay = \"24ms\"") };
        assert!(
            refused(&ring, true, u64::MAX).unwrap().1.contains("70000 peers with 140000 links between them are too many to be simulated with events")
        );
        let jitter = scene(1000, "delay = \"24ms\", jitter = \"2ms\"");
        let [with_events, in_arrays] = [Way::Events, Way::Packets].map(|way| way.bytes(1000, 999_000));
        assert!((refused(&jitter, true, with_events).is_none(), refused(&jitter, false, in_arrays).is_none()) == (true, true));
        assert!(refused(&jitter, true, with_events - 1).unwrap().1.contains("to look at nothing but counters"));
        assert!(refused(&jitter, false, in_arrays - 1).unwrap().1.contains("one constant delay for all links"));
    }
}
