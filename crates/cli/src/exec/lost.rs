//! Lost packets in words: `command -> world: 0, 3`.

use cohaptic_exec::{LostPacket, LostPackets};

use crate::failure::Failure;

/// Text of `--lose` for no packet.
pub(super) const NONE: &str = "none";

/// Reads the texts of `--lose`. `nodes` are the names of the hosts, of the real world and of the loopback. `has_link` says whether a node has a link to another
/// one.
pub(super) fn read(texts: &[String], nodes: &[&str], has_link: impl Fn(usize, usize) -> bool) -> Result<LostPackets, Failure> {
    let mut lost = Vec::new();
    for text in texts.iter().filter(|text| *text != NONE) {
        let refused = |fault: &str| {
            let [from, to] = [nodes[0], nodes[1]];
            Failure::Input(format!("--lose {text:?}: {fault}: expected a link and its packets, such as '{from} -> {to}: 0, 3', or {NONE}"))
        };
        let (link, numbers) = text.split_once(':').ok_or_else(|| refused("there is no colon"))?;
        let (from, to) = link.split_once("->").ok_or_else(|| refused("there is no arrow"))?;
        let node = |name: &str| {
            let place = nodes.iter().position(|node| *node == name.trim());
            place.ok_or_else(|| refused(&format!("there is no host {:?} among {}", name.trim(), nodes.join(", "))))
        };
        let (from, to) = (node(from)?, node(to)?);
        if from == to {
            return Err(refused("a host has no link to itself"));
        }
        if !has_link(from, to) {
            return Err(refused(&format!("there is no link from {} to {}", nodes[from], nodes[to])));
        }
        for number in numbers.split(',') {
            let number = number.trim().parse().map_err(|_| refused(&format!("{:?} is not the number of a packet", number.trim())))?;
            lost.push(LostPacket { from, to, number });
        }
    }
    Ok(lost.into_iter().collect())
}

/// Returns the texts of `--lose`, one for each link, or `none`.
pub(super) fn texts(lost: &LostPackets, nodes: &[&str]) -> Vec<String> {
    if lost.is_empty() {
        return vec![NONE.to_owned()];
    }
    let text = |((from, to), numbers): ((usize, usize), Vec<u64>)| {
        let numbers: Vec<String> = numbers.iter().map(u64::to_string).collect();
        format!("{} -> {}: {}", nodes[from], nodes[to], numbers.join(", "))
    };
    lost.by_link().into_iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let nodes = ["command", "world", "loopback"];
        let read = |texts: &[String], nodes: &[&str]| read(texts, nodes, |from, to| from == 0 || to == 0);
        let given = ["command -> world: 2, 6".to_owned(), "world->command:3,".to_owned()];
        let lost = read(&["world->command:3".to_owned(), given[0].clone()], &nodes).unwrap();
        assert_eq!(texts(&lost, &nodes), ["command -> world: 2, 6", "world -> command: 3"]);
        assert_eq!(read(&texts(&lost, &nodes), &nodes).unwrap(), lost);
        assert_eq!(
            (texts(&LostPackets::default(), &nodes), read(&[NONE.to_owned()], &nodes).unwrap()),
            (vec![NONE.to_owned()], LostPackets::default())
        );
        for (text, fault) in [
            (given[1].as_str(), "--lose \"world->command:3,\": \"\" is not the number of a packet"),
            ("0", "there is no colon: expected a link and its packets, such as 'command -> world: 0, 3', or none"),
            ("command: 0", "there is no arrow"),
            ("a -> world: 0", "there is no host \"a\" among command, world, loopback"),
            ("world -> loopback: 0", "there is no link from world to loopback"),
            ("world -> world: 0", "a host has no link to itself"),
            ("command -> world: -1", "\"-1\" is not the number of a packet"),
        ] {
            let message = read(&[text.to_owned()], &nodes).unwrap_err().message();
            assert!(message.contains(fault), "{text}: {message}");
        }
    }
}
