//! Reader of `[\[hosts\]]`.

use cohaptic_wan::parameters::{Form, Table, optional, required, usual};

use super::ExecHost;
use crate::document::{Node, Value, quote};
use crate::reading::{Context, Names, TableReader, values};

/// Hosts at most: each has a device, and two links to each other host.
const MOST_HOSTS: usize = 100;

/// Table of an entry `[\[hosts\]]`.
pub(super) static HOST: Table = Table::of(&[&[
    required("name", Form::Text, "Name of the host, by which the other hosts find it: letters, digits and hyphens").expecting("the name of the host"),
    required(
        "command",
        Form::AnyOf(&[Form::Text, Form::List(&Form::Text)]),
        "Command that runs on the host: a line for sh, or a list of the program and its arguments",
    )
    .expecting("a line for sh, or a list such as [\"python3\", \"server.py\"]"),
    usual("main", Form::Boolean, "false", "Whether the run ends with this command, and has its exit status"),
    optional("ready", Form::Text, "Text in a line of the command's output; hosts further down start only when it has come"),
]]);

/// Reads the hosts and their names, in the order of the file. Returns `None` if an entry was refused.
pub(super) fn read_hosts(node: &Node, context: Context<'_>) -> Option<(Names, Vec<ExecHost>)> {
    let entries = values::list(node, context, "entries [[hosts]]")?;
    if entries.len() > MOST_HOSTS {
        context.fault_at(node, format!("{} hosts: expected at most {MOST_HOSTS}", entries.len()));
        return None;
    }
    let mut names = Names::of("host");
    let mut main = None;
    // Collected as options first, so that each entry is read also after a refused entry.
    let hosts: Vec<Option<ExecHost>> = entries.iter().map(|entry| read_host(entry, &mut names, &mut main, context)).collect();
    Some((names, hosts.into_iter().collect::<Option<_>>()?))
}

/// Reads an entry, adds the name of the host to `names`, and notes the main host in `main`.
fn read_host(entry: &Node, names: &mut Names, main: &mut Option<String>, context: Context<'_>) -> Option<ExecHost> {
    let mut table = TableReader::new(entry, context, &HOST, "a table with name and command")?;
    let name = table.read("name", |node, context| {
        let name = read_name(node, context)?;
        if !names.push(&name) {
            context.fault_at(node, format!("there is a host {} already: expected another name", quote(&name)));
            return None;
        }
        Some(name)
    });
    let command = table.read("command", read_command);
    let main_node = table.get("main");
    let is_main: Option<bool> = table.value("main");
    let ready = table.maybe("ready", |node, context| {
        const EXPECTED: &str = "a text that the command writes when others may begin";
        let text = values::text(node, context, EXPECTED)?;
        if text.is_empty() {
            context.fault_at(node, format!("expected {EXPECTED}"));
            return None;
        }
        Some(text.to_owned())
    });
    table.finish();
    let (name, is_main) = (name?, is_main?);
    if is_main {
        if let (Some(other), Some(node)) = (&main, main_node) {
            context.fault_at(node, format!("host {} is the main one already: expected one main host at most", quote(other)));
            return None;
        }
        *main = Some(name.clone());
    }
    Some(ExecHost { name, command: command?, is_main, ready: ready? })
}

/// Reads the name of a host, which programs look up (RFC 1123, section 2.1).
pub(super) fn read_name(node: &Node, context: Context<'_>) -> Option<String> {
    const EXPECTED: &str =
        "letters, digits and hyphens, at most 63, beginning and ending with none of the last, and not \"all\", \"host\" or \"localhost\"";
    let text = values::text(node, context, EXPECTED)?;
    let is_name = !text.is_empty() && text.len() <= 63 && text.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '-');
    // `all` means all links, and the other two are names already.
    if !is_name || text.starts_with('-') || text.ends_with('-') || matches!(text, "all" | "host" | "localhost") {
        context.fault_at(node, format!("{} cannot be the name of a host: expected {EXPECTED}", quote(text)));
        return None;
    }
    Some(text.to_owned())
}

/// Reads a command. A line becomes the argument of `sh -c`.
fn read_command(node: &Node, context: Context<'_>) -> Option<Vec<String>> {
    const EXPECTED: &str = "a line for sh, or a list such as [\"python3\", \"server.py\"]";
    let command = if matches!(node.value, Value::List(_)) {
        let words = values::list(node, context, EXPECTED)?;
        words.into_iter().map(|word| values::text(word, context, "a word of the command").map(str::to_owned)).collect::<Option<Vec<_>>>()?
    } else {
        let line = values::text(node, context, EXPECTED)?;
        if line.trim().is_empty() { Vec::new() } else { ["sh", "-c", line].map(str::to_owned).to_vec() }
    };
    if command.first().is_none_or(String::is_empty) {
        context.fault_at(node, format!("there is no command: expected {EXPECTED}"));
        return None;
    }
    // The system ends each word at a zero byte.
    if command.iter().any(|word| word.contains('\0')) {
        context.fault_at(node, format!("a word of the command has a zero byte: expected {EXPECTED}"));
        return None;
    }
    Some(command)
}
