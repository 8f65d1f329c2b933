//! The documents of all commands and their keys.

mod analyses;
mod links;
mod real_time;
mod scenes;

/// Document of a command.
pub(super) struct Document {
    pub(super) command: &'static str,
    /// Lines for `sh` that print documents of this kind, one each, and in which every key occurs.
    pub(super) lines: &'static [&'static str],
    pub(super) rows: &'static [(&'static str, &'static str)],
}

/// Command that succeeds on machines on which the router can run: it needs namespaces and devices.
pub(super) const NAMESPACES: &str = "unshare --map-root-user --net --mount true && test -w /dev/net/tun && ip -V && python3 -V";

/// Documents in the order of the page.
pub(super) const DOCUMENTS: [&[Document]; 5] = [&scenes::SCENES, &analyses::ANALYSES, &real_time::REAL_TIME, &links::LINKS, &OTHERS];

/// Documents of other commands, and of errors of every command.
const OTHERS: [Document; 5] = [
    Document {
        command: "study run",
        lines: &["cohaptic study studies/pull/study.toml --dry-run --out dry --json"],
        rows: &[
            ("title, people, groups", "of the study; how many people in how many groups"),
            ("conditions, warnings", "labels of the conditions; what a reader must know before any number"),
            ("measures[].@Figures of a study", "of the first dry run"),
            ("times", "number of dry runs"),
            ("power[].measure, power[].condition, power[].mean", "each difference to the first condition; its mean over the dry runs"),
            (
                "power[].found.count, power[].found.of, power[].found.low, power[].found.high",
                "dry runs with p < 0.05, of how many, and the ends of the interval of the share",
            ),
            (
                "power[].found_after_holm.count, power[].found_after_holm.of, power[].found_after_holm.low, power[].found_after_holm.high",
                "the same after the correction of Holm",
            ),
            (
                "timed_out[].count, timed_out[].of, timed_out[].low, timed_out[].high",
                "trials of each condition that timed out, over all dry runs, with the interval of the share",
            ),
            ("files", "what was written"),
        ],
    },
    Document {
        command: "study report",
        lines: &["cohaptic study studies/pull/study.toml --dry-run --out dry > /dev/null && cohaptic study report dry --json"],
        rows: &[
            ("title, people, groups, conditions, warnings, files", "as of a dry run"),
            ("sessions_complete", "number of complete sessions"),
            ("measures[].@Figures of a study", "of the complete sessions"),
        ],
    },
    Document {
        command: "study verify",
        lines: &["cohaptic study studies/pull/study.toml --dry-run --out dry > /dev/null && cohaptic study verify dry --json"],
        rows: &[("trials, differences", "replayed trials; each difference to what is kept, in words")],
    },
    Document {
        command: "paper",
        lines: &["cohaptic paper --quick --json"],
        rows: &[
            (
                "claims[].id, claims[].claim, claims[].paper, claims[].says, claims[].ours, claims[].verdict",
                "the claim, its place in the paper, what the paper says there, what was computed, and the verdict",
            ),
            (
                "claims[].tables[].title, claims[].tables[].groups[].name, claims[].tables[].groups[].columns, claims[].tables[].head, claims[].tables[].rows",
                "tables of the computed numbers: title, groups of columns with their names and numbers of columns, names of the columns, and cells; ✗ marks where the claim fails",
            ),
            ("claims[].why", "why paper and result differ, as far as it is known; empty if they do not"),
            ("claims[].scene, claims[].how, claims[].commands", "text of a scene that shows the result, and commands for it with what they show"),
            ("figures[].id, figures[].file, figures[].title", "`file` is `null` without `--out`"),
            ("wall_s", "the time it took"),
        ],
    },
    Document {
        command: "Errors",
        lines: &["cohaptic run scenarios/network/ideal.toml --set link.dlay=8ms --json 2> said"],
        rows: &[
            ("status, message", "the exit status; the message as on standard error, without `error:`"),
            ("place", "where a text is refused, else `null`"),
            ("place.file, place.argument", "the file (`null` for an option), and the argument, such as `--set link.dlay=8ms` (`null` for a file)"),
            ("place.line, place.column, place.key", "from 1; the dotted path or `null`"),
            ("place.fault", "fault and expected form"),
        ],
    },
];
