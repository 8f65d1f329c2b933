//! Documents of links and of measurements of links.

use super::Document;

pub(super) const LINKS: [Document; 3] = [
    Document {
        command: "link",
        lines: &[
            "cohaptic link delay 20ms 2ms distribution normal loss 1% 25% duplicate 1% corrupt 1% rate 1mbit --packets 20000 --json",
            "cohaptic link rate=12Mbit 'cross-traffic={ poisson = { rate = \"6Mbit\" } }' --packets 1000 --json",
        ],
        rows: &[
            ("asked.spec", "as written"),
            (
                "asked.NAME",
                "what follows from the laws: `mean_s`, `sd_s`, `least_s`, `quantiles_s`, `autocorrelation` (lags 1 to 10), `loss`, `loss_run_mean`, `loss_autocorrelation`, `duplicated`, `damaged`, `rate_bit_s`; what does not follow is left out",
            ),
            ("achieved.NAME", "what was measured, with standard errors (`_se`) and intervals of 95 %, as defined by the RFCs; copies count"),
            ("compared[].name, compared[].asked, compared[].achieved, compared[].standard_error, compared[].outside", "the rows of the table"),
            ("fates.@Counters but mean_delay_s", "what became of the packets"),
            (
                "cross_traffic.offered, cross_traffic.dropped",
                "packets of the [cross-traffic](emulator-stages.md#cross-traffic) up to the last packet at the queue; absent where there were none",
            ),
            (
                "packets_per_s, measured_packets, interrupted, files",
                "how fast; of how many packets figures are, the first; whether cut short; what was written",
            ),
        ],
    },
    Document {
        command: "link --list, link --show",
        lines: &["cohaptic link --list --json"],
        rows: &[
            (
                "profiles[].name, profiles[].version, profiles[].grade",
                "the name without version, the version, and the worst grade of delay, rate and loss: A, B, C or preset",
            ),
            (
                "profiles[].what, profiles[].place, profiles[].when, profiles[].method, profiles[].not_modelled",
                "what is modelled, where and when it was measured, how the numbers were made, and what is missing",
            ),
            ("profiles[].down.keys.NAME, profiles[].up.keys.NAME", "the keys of the link in either direction, as TOML"),
            (
                "profiles[].down.reasons.NAME, profiles[].up.reasons.NAME",
                "of each key `grade`, the names of its `sources`, and `how` it follows from them",
            ),
            ("profiles[].down.between.NAME, profiles[].up.between.NAME", "how links of this kind differ, from the 10th to the 90th percentile"),
            ("profiles[].modulators", "the modulators of both directions, as TOML"),
            ("profiles[].sources.NAME", "of each source `cite`, how it was `read`, and the `licence` of its data"),
        ],
    },
    Document {
        command: "fit",
        lines: &[
            "python3 programs/captures.py && cohaptic fit sender.pcap receiver.pcap --skew --least 20ms --json",
            "python3 programs/measured.py && cohaptic fit line.json --direction up --json",
            "python3 programs/measured.py && cohaptic fit line.txt --split even --hold-out 50% --json",
            "python3 programs/measured.py && cohaptic fit rate.json --walk --json",
        ],
        rows: &[
            ("link.NAME", "the link that fits best; `link.jitter.distribution` is `empirical` where no law fits"),
            (
                "goodness.NAME",
                "what was measured, and how well each law and each model of loss fits: `resolution_s` of the clock, `effective` number of delays; of each law \
                 `kolmogorov`, its `p_value`, and whether it `fits`, with a distance of at most `kolmogorov_limit`; \
                 the `correlation` of the delays: its `time_s`, the `share` of the variation that has this memory, and the correlation `lag_one` of neighbours, each with its error; \
                 `independence` of the delays, or of what the correlation time does not explain: rank correlation of `neighbours`, and the `statistic` of several `lags` \
                 with its `p_value`",
            ),
            ("scene", "the `[link]` table as text"),
            (
                "skew.seconds_per_second, skew.standard_error, skew.interval_99, skew.significant, skew.location, skew.blocks",
                "with `--skew`: the [drift](commands-network.md#fit)",
            ),
            ("matched.unmatched_sent, matched.unmatched_arrived, matched.ambiguous", "of two captures: packets in one alone, or indistinguishable"),
            ("matched.left_out", "packets of the sender at its beginning and at its end that the other capture could not show"),
            ("matched.sender.@Contents of a capture, matched.receiver.@Contents of a capture", "what each file holds"),
            (
                "measured_by.program, measured_by.direction",
                "of a [file of another program](commands-network.md#files-of-other-programs): which one, and the way of the packets",
            ),
            (
                "measured_by.either_way, measured_by.other_way, measured_by.copies",
                "packets that are not counted: lost on a way that the file does not name, lost on the other way, answered again",
            ),
            ("measured_by.share", "with `--split`: the share of the round trip that is the delay"),
            ("measured_by.notes", "what was assumed, as sentences"),
            (
                "recorded.program, recorded.rate.NAME, recorded.notes",
                "of a file without delays of packets, in place of `link`, `goodness` and `clocks`: which program wrote it; of a measured rate `intervals`, `seconds`, \
                 `mean_bps`, `between_bps` (10 % and 90 % of the intervals), `loss`, and whether it `is_lower_bound`; what the link lacks",
            ),
            (
                "recorded.walk.NAME",
                "with `--walk`: measured `seconds`, `rates_bps` (means of the fifths), `sojourn_s` in an inner state (half of that at both ends), the autocorrelations of the \
                 rate after 1, 5 and 10 s (`measured`, and those of the `walk`), and why the walk is `refused`",
            ),
            (
                "hold_out.fitted, hold_out.held_out, hold_out.refused",
                "with `--hold-out`: packets of both parts, and why the [held-out packets](commands-network.md#packets-that-the-fit-has-not-seen) refuse the link",
            ),
            (
                "hold_out.measured.NAME, hold_out.best.NAME, hold_out.independent.NAME, hold_out.gilbert.NAME, hold_out.replay.NAME",
                "figures of the held-out packets, of this link, of independent packets, of Gilbert–Elliott losses with independent delays, and of the first part: \
                 `mean_s`, `quantiles_s` (95 %, 99 %), `wasserstein_s` (W₁ from the held-out delays), `autocorrelation` (1, 10 and 100 packets apart), `loss`, \
                 `mean_run`, `longer_runs` (shares of the runs of two or more and of three or more losses)",
            ),
            (
                "hold_out.transfer_s.measured, hold_out.transfer_s.best, hold_out.transfer_s.independent, hold_out.transfer_s.gilbert, hold_out.transfer_s.replay",
                "time in which a server that accepts a connection sends 10⁶ bytes over TCP, in both ways over the same link: median of 101 connections, `null` if \
                 half of the connections end before",
            ),
            ("clocks.added_s", "with `--offset` or `--least`, or where an offset is assumed: what was added to every delay"),
            ("clocks.is_assumed", "`true` where the offset is assumed: the least delays of both ways are then equal"),
            (
                "clocks.steps",
                "[steps](commands-network.md#clocks-that-are-apart) of the least delay: `at_s`, `by_s`, and the number of the first `packet` after it",
            ),
            ("clocks.fitted.first, clocks.fitted.packets", "the packets that were fitted, the first one counted from 0"),
        ],
    },
];
