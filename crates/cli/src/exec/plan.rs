//! Plans of `cohaptic exec`: of a single command, and of a file.

use std::path::Path;
use std::sync::Arc;

use cohaptic_exec::{GATEWAY, GatewayPlan, HostPlan, NAMES, Output, PREFIX, Plan, Setup, host};
use cohaptic_linkfile::router::Network;
use cohaptic_linkfile::{ExecFile, LinkTable};
use cohaptic_realtime::Tolerance;
use cohaptic_wan::LinkModel;

use super::lost;
use crate::arguments::ExecArguments;
use crate::failure::Failure;
use crate::input;
use crate::link::link_and_keys;

/// Name of the host of a single command, in the names of links and files.
const COMMAND: &str = "command";
/// Name of the real world beyond the link of a single command.
const WORLD: &str = "world";
/// Name that stands for the loopback interface of the real machine.
const MACHINE: &str = "host";

/// Returns the plan of the arguments.
pub(super) fn plan(arguments: &ExecArguments) -> Result<Plan, Failure> {
    let plan = match (arguments.command.is_empty(), arguments.spec.as_slice()) {
        (false, _) => of_command(arguments)?,
        (true, [file]) if is_file(file) => of_file(arguments, Path::new(file))?,
        (true, spec) => {
            return Err(Failure::Input(format!(
                "{:?} is not a file: expected a file of hosts, or a command after two dashes: cohaptic exec 'delay 50ms loss 1%' -- curl http://host:8000/",
                spec.join(" ")
            )));
        }
    };
    if arguments.lose.is_empty() {
        return Ok(plan);
    }
    let lost = lost::read(&arguments.lose, &plan.nodes(), |from, to| plan.has_link(from, to))?;
    Ok(plan.losing(&lost))
}

/// Returns whether a spec names a file of hosts.
fn is_file(spec: &str) -> bool {
    Path::new(spec).exists() || input::is_standard_input(Path::new(spec))
}

/// Returns the plan of a single command, with the link between the command and the real world, and the same link between the command and its loopback.
fn of_command(arguments: &ExecArguments) -> Result<Plan, Failure> {
    // A file may have the name of a link, such as starlink. So a spec is taken for a file only if the spec is no link.
    let there = link(&arguments.spec).map_err(|failure| match arguments.spec.as_slice() {
        [file] if is_file(file) => Failure::Input(format!(
            "{file} is a file, whose hosts have commands of their own: expected no command after two dashes. A host's command is its key command under [[hosts]]"
        )),
        _ => failure,
    })?;
    let back = arguments.back.as_ref().map_or_else(|| Ok(there.clone()), |words| link(std::slice::from_ref(words)))?;
    let gateway = GatewayPlan { listen: arguments.listen.clone(), ..gateway(arguments, WORLD) };
    let command = HostPlan {
        name: COMMAND.to_owned(),
        setup: Setup { loopback: arguments.loopback, ..setup(0, None, Vec::new(), Some(&gateway)) },
        command: arguments.command.clone(),
        is_main: true,
        ready: None,
        output: if arguments.json { Output::ToError } else { Output::Shared },
    };
    let (nodes, back) = (2 + usize::from(arguments.loopback), Arc::new(back));
    let links = LinkTable::new(nodes, Arc::new(there), (1..nodes).map(|other| ((other, 0), Arc::clone(&back))));
    Ok(whole(arguments, vec![command], Some(gateway), links))
}

/// Returns the plan of a file.
fn of_file(arguments: &ExecArguments, path: &Path) -> Result<Plan, Failure> {
    if arguments.back.is_some() {
        return Err(Failure::Input(format!(
            "--back is the way back to a command after two dashes. The file {} has its own links: expected [[links]] with from and to there, or --set links.FROM.TO.delay=20ms",
            path.display()
        )));
    }
    if !arguments.listen.is_empty() {
        return Err(Failure::Input(format!(
            "--listen leads to a command after two dashes. Hosts of the file {} are reached by each other: expected a client as a further host, whose command is its key command under [[hosts]]",
            path.display()
        )));
    }
    if arguments.loopback {
        return Err(Failure::Input(format!(
            "--loopback is for a command after two dashes. Packets between the hosts of the file {} pass its links: expected a server as a further host, whose command is its key command under [[hosts]]",
            path.display()
        )));
    }
    let file = input::with(path, |text, name| ExecFile::parse(text, name, &arguments.set))?;
    let gateway = file.world.as_ref().map(|name| gateway(arguments, name));
    let hosts = file.hosts.iter().enumerate().map(|(place, of)| {
        let others = file.hosts.iter().enumerate().filter(|(other, _)| *other != place);
        let others = others.map(|(other, host)| (index(other), host.name.clone())).collect();
        HostPlan {
            name: of.name.clone(),
            setup: setup(index(place), Some(&of.name), others, gateway.as_ref()),
            command: of.command.iter().map(Into::into).collect(),
            is_main: of.is_main,
            ready: of.ready.clone(),
            output: Output::Lines,
        }
    });
    let hosts = hosts.collect();
    let plan = whole(arguments, hosts, gateway, file.links);
    Ok(Plan { seed: arguments.seed.unwrap_or(file.seed), tolerance: Tolerance { limit: arguments.pace.tolerance.unwrap_or(file.tolerance) }, ..plan })
}

/// Returns the index of a host as a part of its address. A file has few hosts.
fn index(place: usize) -> u8 {
    u8::try_from(place).unwrap_or(u8::MAX)
}

/// Returns the network and the names that a host sees.
fn setup(place: u8, name: Option<&str>, others: Vec<(u8, String)>, gateway: Option<&GatewayPlan>) -> Setup {
    let network = |(address, prefix)| Network::new(address, prefix);
    let machine = gateway.map(|_| (GATEWAY[0], MACHINE.to_owned()));
    Setup {
        name: name.map(str::to_owned),
        addresses: host(place).into_iter().zip(PREFIX).filter_map(network).collect(),
        hosts: machine.into_iter().chain(others.into_iter().map(|(other, name)| (host(other)[0], name))).collect(),
        name_server: gateway.and_then(|gateway| gateway.name_server).map(|_| NAMES[0]),
        loopback: false,
    }
}

fn gateway(arguments: &ExecArguments, name: &str) -> GatewayPlan {
    GatewayPlan { name: name.to_owned(), name_server: arguments.dns.or_else(cohaptic_exec::name_server), listen: Vec::new() }
}

/// Returns the plan with the options that a single command and a file share.
fn whole(arguments: &ExecArguments, hosts: Vec<HostPlan>, gateway: Option<GatewayPlan>, links: LinkTable) -> Plan {
    Plan {
        seed: arguments.seed.unwrap_or(0),
        hosts,
        gateway,
        links,
        pacing: arguments.pace.pacing(),
        wishes: arguments.pace.wishes(),
        tolerance: arguments.pace.tolerance(),
        captures: arguments.out.clone(),
    }
}

/// Returns the link in words or keys. Words may come in one argument or in several: `'delay 50ms loss 1%'`.
fn link(spec: &[String]) -> Result<LinkModel, Failure> {
    // A key has an equals sign, and its value may have spaces.
    let words =
        spec.iter().flat_map(|text| if text.contains('=') { vec![text.clone()] } else { text.split_whitespace().map(str::to_owned).collect() });
    let words: Vec<String> = words.collect();
    if words.is_empty() {
        // Most often a variable of a script that is not set. An ideal network in its place would hide the mistake.
        return Err(Failure::Input(
            "an empty text is no link: expected words such as 'delay 50ms loss 1%', a link such as starlink, or 'delay 0ms' for an ideal link"
                .to_owned(),
        ));
    }
    link_and_keys(&words).map(|(model, _)| model)
}
