"""Figures of power by simulation: shares of detected effects against the exact power, and the intervals around them."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from palpate.analysis.power.curve import Point, power_curve, wilson
from palpate.analysis.power.request import PowerRequest
from palpate.analysis.power.simulated_tracks import Measurement, measure
from palpate.protocols.bench import Case
from palpate.protocols.files import write_texts
from palpate.studies.catalogue import SHIPPED

AREA = "power"
PEOPLE, NOISE, APART = 12, 1.0, 1.0
"""Participants, the SD of one answer and the difference between two stimuli, in one unit."""
STUDY = f"""\
study: two_stimuli
task: slider_rating
stimuli: stimuli.csv
attributes: [[Low, High]]
scale: {{from: -1000, to: 1000, step: 0.001, start: unset}}
order: {{design: williams}}
simulation:
  latents: {{Low: {{level: {APART / 2}}}}}
  gain_sd: 0
  bias_sd: 2
  noise_sd: {NOISE}
"""
STIMULI = "id,level\na,0\nb,1\n"
PLAN = "study: two_stimuli\nexclusions: []\ntests:\n  - {name: stimuli, test: anova, within: [stimulus]}\n"
Interval = Callable[[int, int], tuple[float, float]]


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of two stimuli one SD apart and 12 people, for which p follows a noncentral F(1, 11) exactly."""
    with tempfile.TemporaryDirectory() as folder:
        files = {"two_stimuli/study.yaml": STUDY, "two_stimuli/stimuli.csv": STIMULI, "two_stimuli/analysis.yaml": PLAN}
        write_texts(Path(folder), files)
        for effect in (0.0, 1.0):
            for runs in (50,) if quick else (50, 200, 800):
                yield Case(
                    AREA, "power: share of simulated studies", f"palpate, {runs} runs",
                    f"effect {effect:g}, exact power {exact_power(effect):.4f}", runs, "share off the exact power",
                    partial(simulated, Path(folder), effect, runs), partial(power_error, effect),
                    seconds=lambda answer: answer[1],
                )  # fmt: skip
    yield from _thresholds(PEOPLE // 4 if quick else PEOPLE)
    yield from _intervals()


def _thresholds(people: int) -> Iterator[Case]:
    """Yield one simulated study of thresholds: two QUEST+ tracks of up to 60 trials for each of so many people."""
    place = SHIPPED / "vibration_threshold"
    for method, trials in (("palpate, 60 trials", (60,)), ("palpate, 24 to 60 trials", (24, 32, 48, 60))):
        request = PowerRequest(place / "study.yaml", place / "analysis.yaml", place, "thresholds")
        yield Case(
            AREA, "power: one simulated study of thresholds", method, f"{people} people, two tracks", people,
            "error of a person's threshold, dB, RMS", partial(measured, request, trials, people), threshold_error, 1,
        )  # fmt: skip


def measured(request: PowerRequest, trials: tuple[int, ...], people: int) -> list[Measurement]:
    """Return what is measured of each person and track with the largest number of trials."""
    return [one for number in range(1, people + 1) for one in measure((request, trials, number))[trials[-1]]]


def threshold_error(answer: Sequence[Measurement]) -> float:
    """Return the root mean square error over the tracks that have a threshold."""
    squares = [one.error**2 for one in answer if one.value is not None]
    return math.sqrt(math.fsum(squares) / len(squares))


def simulated(folder: Path, effect: float, runs: int) -> tuple[Sequence[Point], float]:
    """Return the product's power curve at one size, and its seconds."""
    place = folder / "two_stimuli"
    request = PowerRequest(place / "study.yaml", place / "analysis.yaml", folder, "stimuli", effect=effect)
    start = time.perf_counter()
    return power_curve(request, [PEOPLE], runs), time.perf_counter() - start


def exact_power(effect: float, alpha: float = 0.05) -> float:
    """Return the probability of p <= alpha; differences of two answers of a person are normal with the SD sqrt(2)."""
    from scipy.stats import f, ncf

    shift = PEOPLE * (effect * APART) ** 2 / (2 * NOISE**2)
    critical = f.isf(alpha, 1, PEOPLE - 1)
    return float(ncf.sf(critical, 1, PEOPLE - 1, shift)) if shift else alpha


def power_error(effect: float, answer: tuple[Sequence[Point], float]) -> float:
    """Return how far the share lies from the exact power."""
    return abs(answer[0][0].power - exact_power(effect))


def _intervals() -> Iterator[Case]:
    intervals: dict[str, Interval] = {"palpate, Wilson": wilson, "Wald": wald, "Clopper-Pearson": clopper_pearson}
    for power in (0.05, 0.8, 0.95):
        for runs in (50, 200, 1_000):
            for method, interval in intervals.items():
                yield Case(AREA, "power: interval of a share", method, f"power {power:g}, {runs} runs", runs,
                           "coverage off 0.95; exact binomial", partial(all_intervals, interval, runs),
                           partial(coverage_error, power), 3)  # fmt: skip


def all_intervals(interval: Interval, runs: int) -> list[tuple[float, float]]:
    """Return the interval for every possible number of significant studies."""
    return [interval(significant, runs) for significant in range(runs + 1)]


def coverage_error(power: float, intervals: Sequence[tuple[float, float]]) -> float:
    """Return how far the intervals' coverage of the power lies from 0.95, over the binomial distribution."""
    from scipy.stats import binom

    runs = len(intervals) - 1
    covering = [significant for significant, (low, high) in enumerate(intervals) if low <= power <= high]
    return abs(math.fsum(binom.pmf(significant, runs, power) for significant in covering) - 0.95)


def wald(significant: int, runs: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """Return the share plus and minus `z` standard errors, a common choice."""
    share = significant / runs
    half = z * math.sqrt(share * (1 - share) / runs)
    return share - half, share + half


def clopper_pearson(significant: int, runs: int) -> tuple[float, float]:
    """Return the exact interval, whose coverage is always 95 % or more (Clopper and Pearson 1934)."""
    from scipy.stats import beta

    low = float(beta.ppf(0.025, significant, runs - significant + 1)) if significant else 0.0
    high = float(beta.ppf(0.975, significant + 1, runs - significant)) if significant < runs else 1.0
    return low, high
