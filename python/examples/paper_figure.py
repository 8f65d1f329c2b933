"""A figure of two panels for a paper, two columns wide: a map of stability and a campaign over the delay.

Run it with `python paper_figure.py SCENE FIGURE.pdf`; it needs `pip install matplotlib`.
"""

from __future__ import annotations

import sys

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import cohaptic

LAWS = {"average-position": ("AP", "#1f6fb4"), "proportional-derivative": ("PD", "#c8541e")}


def regions(axes: Axes, scene: cohaptic.Scene) -> None:
    """Draws the outline of the stable gains of each law, and shades those of the first one."""
    for strategy, (name, colour) in LAWS.items():
        of_law = scene.set("coordination.strategy", strategy)
        region = of_law.map(x="coordination.stiffness=100..6000", y="coordination.damping=0..60", grid=(120, 80))
        if name == "AP":
            axes.contourf(region.x, region.y, region.stable, levels=[0.5, 1.0], colors=[colour], alpha=0.2)
        for k, line in enumerate(region.contours):
            axes.plot(line[:, 0], line[:, 1], color=colour, label=None if k else f"{name}, {region.stable.mean():.0%}")
    axes.set(xlabel="coordination stiffness $K_T$ [N/m]", ylabel="coordination damping $B_T$ [N·s/m]")
    axes.set_title("a) stable gains")
    axes.legend(title="law, share of cells", loc="upper right")


def discrepancies(axes: Axes, scene: cohaptic.Scene) -> None:
    """Draws the median of the largest distance of two copies over the delay, with a band of 90 % of the runs."""
    delays = ["8ms", "16ms", "24ms", "32ms", "40ms"]
    for strategy, (name, colour) in LAWS.items():
        lossy = scene.set({"coordination.strategy": strategy, "link.loss": "10%", "link.jitter": "2ms"})
        table = cohaptic.campaign(lossy, vary={"link.delay": delays}, runs=100)
        millimetres = 1e3 * table["max_discrepancy_m"].reshape(len(delays), -1)
        low, middle, high = np.quantile(millimetres, [0.05, 0.5, 0.95], axis=1)
        milliseconds = [float(delay.removesuffix("ms")) for delay in delays]
        axes.fill_between(milliseconds, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.plot(milliseconds, middle, color=colour, marker="o", markersize=3, label=name)
    axes.set(xlabel="delay of each link [ms]", ylabel="largest discrepancy [mm]", title="b) 10 % loss, 100 runs each")
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper left")


def draw(scene: cohaptic.Scene, path: str) -> None:
    """Writes the figure, as PDF, SVG or PNG by the end of its name."""
    # A figure that is 175 mm wide has its texts of 8 points on the page. With font type 42 texts stay texts in a PDF, as publishers ask.
    with mpl.rc_context({"font.size": 8, "axes.linewidth": 0.6, "lines.linewidth": 1.2, "pdf.fonttype": 42}):
        figure, (left, right) = plt.subplots(1, 2, figsize=(175 / 25.4, 70 / 25.4), layout="constrained")
        regions(left, scene)
        discrepancies(right, scene)
        figure.savefig(path)
        plt.close(figure)


if __name__ == "__main__":
    draw(cohaptic.Scene(sys.argv[1]), sys.argv[2])
