#!/usr/bin/env python3
"""Laws of delays on a coarse clock by SciPy, as a reference for `cohaptic fit`: writes fits.json beside this file.

For each sample: the mean, the standard deviation (n - 1) and its standard error; for each law the mean, the deviation and the floor that make the intervals
x - r/2 to x + r/2 most probable, among those whose mean and deviation lie within one standard error of the sample's; and the largest distance of the distribution
functions at ends of intervals. SciPy has its own distribution functions, and the optimiser begins at many floors.

Run: python3 fits.py (SciPy 1.17)
"""

import json
import pathlib

import numpy
from scipy import optimize, special, stats


def normal(mean, sd, _floor):
    return stats.norm(mean, sd)


def laplace(mean, sd, _floor):
    return stats.laplace(mean, sd / numpy.sqrt(2))


def lognormal(mean, sd, floor):
    log_sd = numpy.sqrt(numpy.log1p((sd / (mean - floor)) ** 2))
    return stats.lognorm(log_sd, floor, (mean - floor) * numpy.exp(-log_sd**2 / 2))


def gamma(mean, sd, floor):
    variation = sd / (mean - floor)
    return stats.gamma(variation**-2, floor, (mean - floor) * variation**2)


def weibull(mean, sd, floor):
    ratio = 1 + (sd / (mean - floor)) ** 2
    inverse = optimize.brentq(lambda t: special.gammaln(1 + 2 * t) - 2 * special.gammaln(1 + t) - numpy.log(ratio), 1e-6, 30)
    return stats.weibull_min(1 / inverse, floor, (mean - floor) / special.gamma(1 + inverse))


LAWS = {"normal": (normal, False), "laplace": (laplace, False), "lognormal": (lognormal, True), "gamma": (gamma, True), "weibull": (weibull, True)}


class Sample:
    def __init__(self, counts, resolution):
        self.values = numpy.array(sorted(counts), dtype=float)
        self.counts = numpy.array([counts[value] for value in sorted(counts)], dtype=float)
        self.resolution = resolution
        self.n = self.counts.sum()
        self.mean = (self.values * self.counts).sum() / self.n
        deviations = self.values - self.mean
        self.sd = numpy.sqrt((deviations**2 * self.counts).sum() / (self.n - 1))
        kurtosis = (deviations**4 * self.counts).sum() / self.n / self.sd**4
        self.mean_error = self.sd / numpy.sqrt(self.n)
        self.sd_error = self.sd * numpy.sqrt((kurtosis - 1) / (4 * self.n))

    def ends(self):
        return self.values - self.resolution / 2, self.values + self.resolution / 2

    def log_likelihood(self, law):
        low, high = self.ends()
        lower = law.cdf(high) - law.cdf(low)
        upper = law.sf(low) - law.sf(high)
        probability = numpy.where(law.cdf(low) < 0.5, lower, upper)
        return (self.counts * numpy.log(numpy.maximum(probability, 1e-300))).sum()

    def distance(self, law):
        low, high = self.ends()
        upto = numpy.cumsum(self.counts) / self.n
        before = upto - self.counts / self.n
        return max(abs(law.cdf(low) - before).max(), abs(law.cdf(high) - upto).max())

    def fit(self, name):
        make, has_floor = LAWS[name]
        top = self.values[0] + self.resolution / 2

        def parameters(at):
            mean = self.mean + self.mean_error * numpy.clip(at[0], -1, 1)
            sd = self.sd + self.sd_error * numpy.clip(at[1], -1, 1)
            return mean, sd, max(top - numpy.exp(at[2]), 0) if has_floor else 0.0

        starts = [[0, 0, start] for start in numpy.linspace(numpy.log(self.resolution / 20), numpy.log(top), 12)] if has_floor else [[0, 0]]
        options = {"xatol": 1e-9, "fatol": 1e-10, "maxiter": 20000, "maxfev": 20000}
        best = None
        for start in starts:
            found = start
            for _ in range(3):
                result = optimize.minimize(lambda at: -self.log_likelihood(make(*parameters(at))), found, method="Nelder-Mead", options=options)
                found = result.x
            if best is None or result.fun < best.fun:
                best = result
        mean, sd, floor = parameters(best.x)
        law = make(mean, sd, floor)
        return {"mean": mean, "sd": sd, "floor": floor, "log_likelihood": -best.fun, "kolmogorov": self.distance(law)}


def rounded(law, n, resolution):
    """n times the probability of each interval, in whole delays."""
    values = numpy.arange(0, 200, resolution)
    counts = numpy.round(n * (law.cdf(values + resolution / 2) - law.cdf(values - resolution / 2)))
    return {float(value): int(number) for value, number in zip(values, counts) if number > 0}


def samples():
    tied = {20.0: 22, 21.0: 61, 22.0: 53, 23.0: 31, 24.0: 17, 25.0: 9, 26.0: 4, 27.0: 3}
    law = stats.gamma(2, 20, 2)
    rare = rounded(law, 1980, 1)
    rare[1000.0] = 20
    # Milliseconds.
    return {
        "a clock of 1 ms": (tied, 1),
        "a clock of 1 ms, many": (rounded(law, 40000, 1), 1),
        "a clock of 2 ms": (rounded(law, 2000, 2), 2),
        "a clock of 1/64 s": (rounded(stats.norm(80, 20), 3000, 15.625), 15.625),
        "two modes": ({20.0: 4000, 21.0: 900, 22.0: 100, 40.0: 100, 41.0: 900, 42.0: 4000}, 1),
        "rare large values": (rare, 1),
    }


def main():
    document = []
    for name, (counts, resolution) in samples().items():
        sample = Sample(counts, resolution)
        laws = {law: sample.fit(law) for law in LAWS}
        document.append(
            {
                "name": name,
                "resolution": resolution,
                "counts": [[value, counts[value]] for value in sorted(counts)],
                "mean": sample.mean,
                "sd": sample.sd,
                "sd_error": sample.sd_error,
                "laws": laws,
            }
        )
    kolmogorov = [[x, float(stats.kstwobign.sf(x))] for x in (0.1, 0.3, 0.5, 1.0, 1.3581015157, 1.6276236115, 3.0)]
    text = json.dumps({"samples": document, "kolmogorov": kolmogorov}, indent=1)
    pathlib.Path(__file__).with_name("fits.json").write_text(text + "\n")


main()
