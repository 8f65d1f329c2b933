//! Random scenes, as text.

use std::path::Path;

use cohaptic_scene::{LinkKeys, Scene, link_keys_of_text};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

/// Scene with its text, and the keys of its links for later changes.
#[derive(Debug)]
pub(crate) struct Written {
    pub(crate) scene: Scene,
    pub(crate) keys: LinkKeys,
    pub(crate) text: String,
}

pub(crate) fn read(text: String) -> Written {
    let file = Path::new("live.toml");
    let scene = Scene::parse_live(&text, file, &[]).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let keys = link_keys_of_text(&text, file, &[]).unwrap()[&(0, 1)].clone();
    Written { scene, keys, text }
}

/// Keys of a link: every sort of impairment that can change the order, the number or the bytes of packets.
pub(crate) const LINKS: [&str; 10] = [
    "",
    "delay = \"7ms\"",
    "delay = \"3ms\"\njitter = \"2ms\"\norder = \"in-order\"",
    "delay = \"1.3ms\"\njitter = { sd = \"2ms\", distribution = \"laplace\" }",
    "delay = \"2ms\"\nloss = \"30%\"",
    "delay = \"500us\"\nloss = { gilbert-elliott = { p = 0.1, r = 0.3 } }\nduplicate = \"10%\"",
    "delay = \"4ms\"\nrate = \"200kbit\"\nqueue = { limit = \"3 packets\" }",
    "delay = \"4ms\"\ncorrupt = { probability = 0.3, bits = 2, checksum = \"passes\" }",
    "netem = \"delay 4ms 2ms loss 10% reorder 20% 50% duplicate 5%\"",
    "delay = \"2ms\"\noutage = { random = { up = \"20ms\", down = \"10ms\" } }",
];

/// Returns a strategy for the links of [`LINKS`].
pub(crate) fn link() -> impl Strategy<Value = &'static str> {
    select(&LINKS[..])
}

fn inline(keys: &str) -> String {
    format!("{{ {} }}", keys.replace('\n', ", "))
}

/// Returns a strategy for scenes of two to four peers of the given kinds, with clocks, hands, access lines and changes of all sorts.
pub(crate) fn scene(kinds: &'static [&'static str]) -> impl Strategy<Value = String> {
    let header = (30..120_u64, any::<u32>(), 1..=3_usize, select(&["average-position", "proportional-derivative"][..]), any::<bool>());
    let peer = (
        select(kinds),
        (select(&["1ms", "500us", "2ms"][..]), option::weighted(0.3, 0..3000_u32), option::weighted(0.3, -500..500_i32)),
        select(&["\"grasp\"", "\"none\"", "{ push = \"+x\" }"][..]),
        -2.0..2.0_f64,
        (any::<bool>(), option::weighted(0.2, link()), option::weighted(0.2, link())),
    );
    let changes = vec((1..30_u64, link()), 0..4);
    (header, vec(peer, 2..=4), (link(), link()), changes, any::<bool>(), any::<bool>()).prop_map(|(header, peers, (usual, own), changes, regular, turns)| {
        let (duration, seed, axes, strategy, compute_delay) = header;
        // In space an object turns in half of the cases, and so does every other device.
        let turns = turns && axes == 3;
        let inertia = if turns { "inertia = [0.001, 0.002, 0.0025]\nangular-velocity = [1, 2, 0]\n" } else { "" };
        let mut text = format!(
            "[scene]\nduration = \"{duration}ms\"\nseed = {seed}\naxes = {axes}\n[object]\nmass = 0.6\ndamping = 0.5\n{inertia}\
             [coordination]\nstrategy = \"{strategy}\"\nstiffness = 700.0\ndamping = 4.0\nupdate = \"4ms\"\n\
             [peer]\ndevice = {{ mass = 0.1, damping = 5.0 }}\ncoupling = {{ stiffness = 900.0, damping = 3.0 }}\n\
             compute-delay = {}\nsilence = {{ after = \"9ms\", fade = \"6ms\" }}\n",
            u8::from(compute_delay)
        );
        for (number, (kind, (tick, offset, drift), contact, force, (moves, uplink, downlink))) in peers.into_iter().enumerate() {
            let force: Vec<f64> = (0..axes).map(|axis| if axis == 0 { force } else { -force }).collect();
            text += &format!("[[peers]]\nname = \"p{number}\"\nkind = \"{kind}\"\ncontact = {contact}\nhand = {{ force = {force:?} }}\n");
            if !regular {
                let (offset, drift) = (offset.unwrap_or(0), drift.unwrap_or(0));
                text += &format!("tick = \"{tick}\"\nclock = {{ offset = \"{offset}us\", drift = \"{drift}ppm\" }}\n");
            }
            if turns {
                text += &format!("grasp = [0.0{number}, 0.02, 0]\norientation = [1, 0.{number}, 0, 0.1]\n");
            }
            if turns && kind != "falcon" && number % 2 == 0 {
                text += "device = { inertia = 0.0002, rotational-damping = 0.001 }\ncoupling = { rotational-stiffness = 2, rotational-damping = 0.002 }\n";
            }
            if moves {
                text += &format!("velocity = 0.0{}\n", number + 1);
            }
            for (line, keys) in [("uplink", uplink), ("downlink", downlink)] {
                text += &keys.map_or_else(String::new, |keys| format!("{line} = {}\n", inline(keys)));
            }
        }
        let apart = if usual.contains("netem") && !own.contains("netem") { "netem = \"none\"\n" } else { "" };
        text += &format!("[link]\n{usual}\n[[links]]\nfrom = \"p1\"\nto = \"p0\"\n{apart}{own}\n");
        for (at, link) in changes {
            // Words of `tc` say everything: nothing is laid over them, and they are not laid over what is laid over.
            let set = if link.is_empty() || link.contains("netem") { "loss = 0.5" } else { link };
            let set = inline(&format!("netem = \"none\"\n{set}"));
            text += &format!("[[timeline]]\nat = \"{at}.25ms\"\nlink = {{ from = \"p0\", to = \"p1\" }}\nset = {set}\n");
        }
        text
    })
}
