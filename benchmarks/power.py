"""How often ``compare`` is right about speed, on synthetic timings with the noise of real machines.

The logarithm of a time is the sum of what its run takes, of a part that all runs of a campaign share
(the state of the machine on that day), of one that all runs of a round share, and of one of its own,
which is now and then much longer.
"""

from dataclasses import dataclass

import numpy as np

from mpmbench.commands.compare.ratio import BUSY, QUIET, Runs, judge

SAMPLES = 1000
REPEATS = (1, 2, 3, 5, 8, 12)
FACTORS = (1.1, 1.5, 3.0)


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the logarithms, and how often a time is disturbed.

    Attributes
    ----------
    campaign, round, own : float
    disturbed : float
        Probability of a disturbance, whose logarithm has an exponential distribution of mean 0.5.
    allowance : float
        The factor that ``compare`` allows, by the load that it finds recorded.
    """

    campaign: float
    round: float
    own: float
    disturbed: float
    allowance: float = QUIET


# The last two are measured. Caches shared: a virtual machine that was idle by its load, three
# campaigns of seven rounds of quickstart, whose runs of 10 to 100 ms took up to 1.7 times as long for
# seconds at a time, while a loop of pure arithmetic kept its speed within 3 %. Under load: eight
# processes, one after the other, with four rounds of eight runs of 12 to 18 ms each, beside other
# work on two processors.
NOISES = {
    "quiet": Noise(0.01, 0.01, 0.03, 0.02),
    "shared, load below 0.2": Noise(0.015, 0.02, 0.06, 0.05),
    "idle, caches shared": Noise(0.01, 0.10, 0.18, 0.0),
    "under load": Noise(0.29, 0.14, 0.20, 0.10, BUSY),
}
SHAPES = {"quickstart": (7, 3), "two runs": (1, 2)}  # groups, and runs of each


def timings(random: np.random.Generator, noise: Noise, runs: int, repeats: int) -> list[np.ndarray]:
    """Logarithms of the times of each run of a campaign."""
    shared = random.normal(0.0, noise.campaign) + random.normal(0.0, noise.round, repeats)
    own = random.normal(0.0, noise.own, (runs, repeats))
    longer = random.exponential(0.5, own.shape) * (random.random(own.shape) < noise.disturbed)
    return list(shared + own + longer)


def verdict(
    random: np.random.Generator,
    noise: Noise,
    shape: tuple[int, int],
    repeats: int,
    factor: float = 1.0,
    slower_groups: int | None = None,
) -> str:
    """What ``compare`` says of two campaigns; in the second, some groups or all take longer by a factor."""
    groups, size = shape
    before = timings(random, noise, groups * size, repeats)
    after = timings(random, noise, groups * size, repeats)
    found: dict[str, Runs] = {}
    for k, (a, b) in enumerate(zip(before, after, strict=True)):
        group = k // size
        slower = slower_groups is None or group < slower_groups
        found.setdefault(str(group), []).append((a, b + np.log(factor) if slower else b))
    return judge(found, noise.allowance)[2]


def shares(
    noise: Noise, shape: tuple[int, int], repeats: int, factor: float = 1.0, **how: int
) -> dict[str, float]:
    """How often each verdict was given."""
    random = np.random.default_rng(0)
    found = [verdict(random, noise, shape, repeats, factor, **how) for _ in range(SAMPLES)]
    return {word: found.count(word) / SAMPLES for word in ("same", "better", "worse", "undecided")}


def power() -> None:
    """False alarms of ``compare``, and how often it finds a slower program."""
    print(f"\ncompare on synthetic timings, percent of {SAMPLES} pairs of campaigns")
    slower = " ".join(f"{'x ' + format(factor, 'g'):>6}" for factor in FACTORS)
    print(
        f"{'campaign':11} {'machine':23} {'repeats':>7} | {'equal: same':>11} {'false alarm':>11} | "
        f"worse: {slower} {'one method x 1.5':>16}"
    )
    for name, shape in SHAPES.items():
        for machine, noise in NOISES.items():
            for repeats in REPEATS:
                equal = shares(noise, shape, repeats)
                alarm = equal["worse"] + equal["better"]
                found = [shares(noise, shape, repeats, factor)["worse"] for factor in FACTORS]
                one = shares(noise, shape, repeats, 1.5, slower_groups=1)["worse"]
                numbers = " ".join(f"{100 * share:6.1f}" for share in found)
                print(
                    f"{name:11} {machine:23} {repeats:7} | {100 * equal['same']:11.1f} "
                    f"{100 * alarm:11.1f} |        {numbers} {100 * one:16.1f}"
                )
