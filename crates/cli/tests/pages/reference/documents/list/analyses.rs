//! Documents of analyses: stability and admittance.

use super::Document;

pub(super) const ANALYSES: [Document; 6] = [
    Document {
        command: "stability point",
        lines: &[
            "cohaptic stability point scenarios/network/loss-independent.toml --json",
            "cohaptic stability point scenarios/paper/5-1-pd-1000.toml --losses-in-a-row 1 --json",
            "cohaptic stability point scenarios/network/push-contact.toml --switching --json",
            "cohaptic stability point scenarios/counterexamples/two-fingers.toml --switching --json",
            "cohaptic stability point scenarios/network/rate-and-queue.toml --every-number --certificate proof.json --json",
        ],
        rows: &[
            ("title", "of the scene"),
            ("verdict", "`stable`, `marginal`, `overflow` or `unstable`"),
            (
                "judged",
                "the question that it answers: `spectral-radius`; with random links `mean-square`, or `nominal` where that cannot be followed",
            ),
            ("left_out", "of a nominal verdict, the random parts of the links that it leaves out, such as `random loss`; else empty"),
            ("spectral_radius, error_bound", "with nothing left to chance; the true radius is within the bound"),
            ("mean_square_radius, mean_square_error_bound", "with random links whose second moment can be followed"),
            ("rigid_modes, dimension", "how many were removed; how many states are left"),
            ("method", "`reduced`, `determinant` or `full`"),
            ("frame_s", "the span that the radius is over"),
            (
                "per_second, time_constant_s",
                "the factor of the slowest disturbance in a second; after how long it is smaller by e, negative where it grows. `null` where the bounds of the radius leave more than a percent open",
            ),
            ("time_constant_bounds_s", "least and most, by the bounds of the radius; `null` where growth cannot be told"),
            ("parts[].@Parts of a scene", "of the worst combination of contacts"),
            (
                "modes[].contacts, modes[].verdict, modes[].spectral_radius, modes[].error_bound, modes[].parts[].@Parts of a scene",
                "each combination of contacts, in words (empty: as they are)",
            ),
            ("worst_case.verdict", "if asked for: `stable`, `undecided` or `unstable`"),
            (
                "worst_case.lower, worst_case.upper, worst_case.open, worst_case.certificate",
                "bounds of the growth in `worst_case.step_s`, and whether over 1 % apart",
            ),
            ("worst_case.links, worst_case.step_s, worst_case.dimension, worst_case.products, worst_case.notes", "what was searched, and how far"),
            ("worst_case.sequence, worst_case.period", "the pattern that grows as the lower bound"),
            ("switching.verdict, switching.notes", "if asked for: `stable`, `unstable` or `undecided`, and what it takes for granted"),
            ("switching.motions[].motion, switching.motions[].verdict", "each motion that has contacts, in words (empty: the only one)"),
            ("switching.motions[].rate", "the factor by which a norm is proven to shrink in a frame; `null` unless stable"),
            (
                "switching.motions[].growth, switching.motions[].frames, switching.motions[].changes",
                "of a motion found: its growth in a frame, its frames and changes of contacts; `null` unless unstable",
            ),
            ("every_number.peer", "the first of the equal peers"),
            (
                "every_number.spans[].from, every_number.spans[].to, every_number.spans[].verdict, every_number.spans[].reason",
                "numbers with one verdict; `to` is `null` without end; why, if undecided",
            ),
            ("every_number.mean_square, every_number.without_limit", "whether in the mean square; what has no limit as N grows, or `null`"),
            (
                "every_number.certificates, every_number.interrupted, every_number.file, every_number.uncertified[].from, every_number.uncertified[].to",
                "counts; whether numbers were left; the file of `--certificate`; decided numbers without",
            ),
            ("notes", "what the verdict leaves out; where there are two radii, each note names its own"),
        ],
    },
    Document {
        command: "stability map",
        lines: &[
            "cohaptic stability map scenarios/coordination/n3.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..60 --grid 3x3 --curve object.mass=1 --out map --json",
            "cohaptic stability map scenarios/network/loss-independent.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..60 --grid 2x2 --curve object.mass=1 --out lossy --json",
        ],
        rows: &[
            ("title, files, notes", "of the scene; the files written; the parts left out"),
            ("x_key, x_unit, x, y_key, y_unit, y", "the two keys and their values"),
            ("criterion", "`spectral-radius` or `mean-square`"),
            ("spectral_radius, mean_square_radius", "one of both: a row for each y; `null` where it is not finite"),
            ("nominal", "in the mean square: which cells leave out chance, a row for each y"),
            ("nominal_cells, stable_fraction", "how many these are; the share of stable cells, whatever question their verdicts answer"),
            (
                "verdicts[].judged, verdicts[].count, verdicts[].stable_fraction",
                "cells by that question, `spectral-radius`, `mean-square` or `nominal`: how many there are, and the share of them that is stable",
            ),
            ("left_out", "the random parts of the links that nominal cells leave out; empty where there are none"),
            ("curves[].name, curves[].overrides, curves[].file", "of each `--curve`"),
            (
                "curves[].criterion, curves[].spectral_radius, curves[].mean_square_radius, curves[].nominal, curves[].nominal_cells, curves[].stable_fraction",
                "as above",
            ),
            ("curves[].verdicts[].judged, curves[].verdicts[].count, curves[].verdicts[].stable_fraction, curves[].left_out", "as above"),
            ("wall_s, cells_per_s, cells_computed", "of this time; kept cells are not counted"),
        ],
    },
    Document {
        command: "stability map --prove",
        lines: &[
            "cohaptic stability map scenarios/coordination/n3.toml --set object.split-mass=false --x coordination.stiffness=100..6000 --y coordination.damping=0..60 --prove 2 --every-number 3..4 --certificate --out proof --json",
        ],
        rows: &[
            ("title, x_key, x_unit, x_range, y_key, y_unit, y_range, files, wall_s", "as of a map"),
            ("halvings", "of a range at most"),
            ("every_number.from, every_number.to", "with `--every-number`"),
            ("regions[].name, regions[].overrides, regions[].file", "the scene, then each `--curve`"),
            ("regions[].stable, regions[].unstable, regions[].undecided", "shares of the area"),
            ("regions[].lines.stable, regions[].lines.unstable, regions[].lines.undecided", "boxes of a single delay, without area"),
            ("regions[].boxes, regions[].certificates, regions[].uncertified, regions[].interrupted", "counts; whether boxes were left"),
            ("regions[].stable_alone, regions[].unstable_alone", "the share proven so here, and proven otherwise for the first"),
        ],
    },
    Document {
        command: "stability boundary",
        lines: &["cohaptic stability boundary scenarios/paper/5-1-ap-2100.toml --along coordination.stiffness=100..6000 --tolerance 0.1 --json"],
        rows: &[
            ("title, key, unit, low, high", "of the scene; of the key"),
            ("criterion", "`spectral-radius` or `mean-square`"),
            ("first", "the verdict at `low`"),
            ("crossings[].value, crossings[].from, crossings[].to", "where the verdict changes, and how"),
            ("marginal", "stretches that cannot be told from 1, each with `low` and `high`"),
            ("tolerance, samples, finest, coarsest", "how exact a crossing is; how many values, and their least and greatest distance"),
            ("settled", "`false` if it ended after 100000 values"),
            ("nominal, left_out", "at how many values chance is left out, and which parts of it"),
            ("verdicts[].judged, verdicts[].count, verdicts[].stable_fraction", "the values looked at, as the cells of a map"),
            ("notes, files", "the parts left out; the files written"),
        ],
    },
    Document {
        command: "stability boundary --prove",
        lines: &[
            "cohaptic stability boundary scenarios/paper/5-1-ap-2100.toml --along coordination.stiffness=100..6000 --prove --certificate --out proof --json",
        ],
        rows: &[
            ("title, key, unit, low, high, files", "as of a boundary"),
            ("stretches[].low, stretches[].high, stretches[].verdict", "crossings lie in `undecided` ones"),
            ("tolerance, certificates, uncertified, interrupted", "length of an undecided stretch; counts; whether stretches were left"),
        ],
    },
    Document {
        command: "admittance",
        lines: &[
            "cohaptic admittance scenarios/coordination/n3.toml --peer left --at 0.1 --curve object.mass=1 --json",
            "cohaptic admittance scenarios/network/loss-independent.toml --peer left --at 0.1 --json",
        ],
        rows: &[
            ("title, peer", "of the scene; which peer was pushed"),
            ("@Curve of an admittance", "of the scene as it stands"),
            ("mean_square.verdict, mean_square.radius, mean_square.error_bound", "of the second moment, where chance can be followed"),
            ("curves[].name, curves[].overrides, curves[].@Curve of an admittance", "of each `--curve`"),
            ("files, interrupted", "what was written; whether frequencies are missing"),
        ],
    },
];
