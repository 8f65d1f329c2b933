//! Documents of runs of scenes: single runs, checks, campaigns and comparisons.

use super::Document;

pub(super) const SCENES: [Document; 7] = [
    Document {
        command: "run",
        lines: &[
            "cohaptic run scenarios/rigid/tray.toml --json",
            "cohaptic run scenarios/tasks/hold.toml --set task.radius=0.0001 --json",
            "cohaptic run scenarios/network/shared-access-line.toml --against scene.seed=2 --measure all --json --out out",
            "cohaptic live scenarios/live/two-and-a-program.toml --for 50ms --listen 127.0.0.1:0 --no-priority --out session > said && \
             cohaptic run scenarios/live/two-and-a-program.toml --inputs session/inputs.csv --force --json",
        ],
        rows: &[
            ("title", "of the scene"),
            ("duration_s", "how much was simulated: the scene's duration, unless numbers overflowed or the run was interrupted"),
            ("ticks", "of the peer that made the most"),
            ("ending", "`complete`, `diverged` (a position or a velocity was not finite, or two copies were more than 1 m apart) or `interrupted`"),
            ("wall_s, realtime_factor", "the time the run took, and `duration_s` divided by it. Only these differ from run to run"),
            (
                "peers[].name, peers[].position_m, peers[].velocity_m_s",
                "state of the copy at the peer's first tick at or after the end: a number with one axis, else a list",
            ),
            (
                "peers[].orientation, peers[].angular_velocity_rad_s",
                "where the object turns: quaternion w, x, y, z and angular velocity about the axes of the copy",
            ),
            ("peers[].stale_samples, peers[].refused_samples", "samples that came too late to be used, and that arrived damaged"),
            ("link_totals.links, link_totals.@Counters", "how many links there are between peers, and what all did together"),
            (
                "link_quantiles.delivered_fraction.NAME, link_quantiles.mean_delay_s.NAME",
                "over links, `min`, `p01`, `p50`, `p99` and `max`: of n values `p01` is the ⌈n/100⌉-th. Packets delivered, as a part of those offered, and mean delays; `null` where no link has any",
            ),
            (
                "links[].from, links[].to, links[].@Counters",
                "by sender, then receiver; `links` is `null` where there are more than 1,000: then `--links` writes them",
            ),
            ("access_lines[].peer, access_lines[].line, access_lines[].@Counters", "`line` is `uplink` or `downlink`"),
            ("max_discrepancy_m", "[discrepancy](model.md#discrepancy)"),
            ("max_rotation_discrepancy_rad", "where the object turns: the largest angle between two copies"),
            (
                "task.kind, task.outcome, task.time_s",
                "where the scene has a [task](tasks.md): its kind, its outcome, and the time from its start to the outcome",
            ),
            ("task.reached_s", "instants at which targets were reached"),
            ("task.failed_by, task.reason", "of a task that has failed: the name of a peer, and `dropped`, `left`, `tilted` or `gap`"),
            ("measures.NAME", "each [measure](#measures) that is asked for; `null` where it has no value"),
            ("files", "paths written by `--out` and `--links`"),
            ("replayed_otherwise", "with `--inputs --force`: what differs from the scene of the session, and what the record lacks"),
            ("against", "the document of the second run; absent without `--against`"),
        ],
    },
    Document {
        command: "check",
        lines: &["cohaptic check scenarios/paper/5-1-ap-2100.toml --json"],
        rows: &[
            ("scenes[].file, scenes[].passed, scenes[].failures", "in the order of the files; `failures` is a list of texts"),
            ("scenes[].expects", "whether the scene has an `[expect]`"),
            ("scenes[].notes", "what was judged in another way than with more time"),
            (
                "scenes[].expectations[].expectation",
                "`stable`, `discrepancy`, `position`, `travel`, `rotation-discrepancy`, `orientation`, `loss`, `delay` or `measures`",
            ),
            (
                "scenes[].expectations[].name, scenes[].expectations[].expected, scenes[].expectations[].found",
                "the quantity, the expected value and the outcome, in words",
            ),
            ("scenes[].expectations[].passed", "whether that is as expected"),
            ("scenes[].expectations[].unit", "of the next three; empty for ratios"),
            (
                "scenes[].expectations[].low, scenes[].expectations[].high",
                "the limits or `null`. A stable scene has a radius of at most 1, an unstable one of at least 1",
            ),
            ("scenes[].expectations[].measured", "what came out; `null` if that is not a number"),
        ],
    },
    Document {
        command: "explain",
        lines: &["cohaptic explain scenarios/network/ideal.toml --json", "cohaptic explain scenarios/network/ideal.toml --cost --json"],
        rows: &[
            ("title", "of the scene"),
            ("models[].part, models[].model, models[].reason", "a part of the scene, its model, and the reason"),
            ("left_out", "list of texts"),
            ("dimensions.plant", "positions and velocities of devices and copies"),
            ("dimensions.held", "numbers in the samples held"),
            ("dimensions.in_flight", "packets on the way at once, about"),
            ("cost.peer_ticks_per_s, cost.packets_per_s", "in a simulated second"),
            ("cost.realtime_factor", "estimated simulated seconds per second with nothing recorded"),
            ("cost.record_bytes_per_s", "what `--out` writes in a simulated second, about"),
            ("cost_measured[].kind", "with `--cost`: `engine`, `axes`, `integrator`, `sampling` or `analysis`; methods of one kind do the same work"),
            (
                "cost_measured[].method, cost_measured[].option, cost_measured[].chosen",
                "its name, the words that choose it, and whether the scene does",
            ),
            (
                "cost_measured[].cost_ms, cost_measured[].cost_of",
                "processor time in milliseconds, and what it is for; `null` if the method does not apply",
            ),
            (
                "cost_measured[].error, cost_measured[].error_of, cost_measured[].error_unit",
                "the largest difference from the reference, of what, and its unit",
            ),
            ("cost_measured[].reference, cost_measured[].note", "the method that the error is against; why a number is `null`, or a remark"),
            ("cost_span_s", "the simulated time of the runs measured"),
            ("interrupted", "whether kinds are missing"),
        ],
    },
    Document {
        command: "campaign",
        lines: &["cohaptic campaign scenarios/network/loss-independent.toml --runs 2 --verdicts --out few --json"],
        rows: &[
            ("title", "of the scene of the first combination"),
            ("runs, runs_computed", "in the table; done this time"),
            ("wall_s, runs_per_s", "of this time"),
            ("out, file, files", "the folder; the table; the table, verdicts and pictures"),
            ("diverged", "how many runs"),
            ("combinations[].vary, combinations[].runs, combinations[].diverged", "`vary` is a list of `KEY=VALUE`"),
            (
                "combinations[].mean_discrepancy_m, combinations[].largest_discrepancy_m, combinations[].worst_run",
                "over the runs that did not diverge; the number of the run with the largest. `null` where all diverged",
            ),
            (
                "combinations[].verdict, combinations[].judged, combinations[].radius, combinations[].error_bound, combinations[].reason",
                "with `--verdicts`: [verdicts](campaign.md#verdicts)",
            ),
            ("notes", "parts that verdicts leave out, and pictures that are not drawn"),
        ],
    },
    Document {
        command: "campaign --shard",
        lines: &["cohaptic campaign scenarios/network/loss-independent.toml --runs 2 --out shards --shard 1/1 --json"],
        rows: &[
            ("shard, out", "as `I/N`; the folder"),
            ("piece, unit", "`part` of `run`, `row` of `cell`, `block` of `sample` or `range`"),
            ("pieces, units, units_computed", "of the shard; computed this time"),
            ("wall_s", "of this time"),
        ],
    },
    Document {
        command: "campaign --status",
        lines: &["cohaptic campaign scenarios/network/loss-independent.toml --runs 2 --out shards --shard 1/1 > said && \
                  cohaptic campaign scenarios/network/loss-independent.toml --runs 2 --status shards --json"],
        rows: &[
            ("out, piece, unit", "as of [a shard](#campaign---shard)"),
            ("pieces, pieces_done, units, units_done", "of the whole work"),
            ("pieces_unassigned", "missing, and done by no worker now"),
            ("ends_in_s", "`null` if not known"),
            ("workers[].shard, workers[].host, workers[].process", "each process that did a shard"),
            ("workers[].state", "`working`, `done`, `interrupted`, `failed` or `killed`"),
            ("workers[].pieces, workers[].units, workers[].units_per_s", "its work until now"),
            ("workers[].units_left, workers[].ends_in_s", "of its shard; `null` if not known"),
        ],
    },
    Document {
        command: "compare",
        lines: &[
            "cohaptic compare scenarios/network/loss-independent.toml --strategies average-position,local-damping,extrapolated --vary link.delay=8ms,24ms --runs 2 \
             --out compared --json",
            "cohaptic compare scenarios/tasks/reach.toml --strategies average-position,extrapolated --runs 2 --out tasks --json",
        ],
        rows: &[
            ("title", "of the scene of the first combination that runs"),
            ("runs, runs_computed", "in the table; done this time"),
            ("wall_s", "of this time"),
            ("out, files", "the folder; the table of runs, verdicts, the table of figures, the page"),
            (
                "strategies[].name, strategies[].set",
                "as it is written; what it puts into the scene, a list of `KEY=VALUE`. The first is the baseline",
            ),
            ("measures[].name, measures[].unit, measures[].about", "the measures that any run has"),
            ("combinations[].strategy, combinations[].vary", "`vary` is a list of `KEY=VALUE` without the strategy"),
            ("combinations[].refused", "why the strategy does not run here; `null` where it does"),
            ("combinations[].runs", "how many runs there are"),
            (
                "combinations[].diverged.count, combinations[].diverged.share, combinations[].diverged.low, combinations[].diverged.high",
                "runs that diverged, with Wilson's interval of 95 %; `diverged` is `null` where nothing runs",
            ),
            (
                "combinations[].done.count, combinations[].done.share, combinations[].done.low, combinations[].done.high",
                "where the scene has a [task](tasks.md): runs in which the task was done, with the same interval",
            ),
            (
                "combinations[].verdict, combinations[].judged, combinations[].radius",
                "`stable`, `unstable`, `marginal`, `overflow` or `undecided`; by `spectral-radius`, `mean-square` or `two-runs`, which have no radius. `null` where nothing runs",
            ),
            ("combinations[].measures[].name, combinations[].measures[].count", "a measure; runs that did neither and have it"),
            (
                "combinations[].measures[].mean.value, combinations[].measures[].mean.low, combinations[].measures[].mean.high",
                "their mean with Student's interval of 95 %, whose ends are `null` of one run; `mean` is `null` of none",
            ),
            (
                "combinations[].measures[].difference.count, combinations[].measures[].difference.value, combinations[].measures[].difference.low, \
                 combinations[].measures[].difference.high",
                "the difference to the baseline over the seeds of which both runs have the measure; `null` of the baseline and of no seed",
            ),
        ],
    },
];
