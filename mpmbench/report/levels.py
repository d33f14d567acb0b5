"""At which value of its axis the runs of a study are looked at: the finest that most curves share."""

from mpmbench.report.series import Series, Study

MOST_PANELS = 12
MOST_PARTICLES = 20000  # of all panels together, for the choice of the resolution


def finest_runs(study: Study) -> tuple[float, list[tuple[Series, str]]]:
    """That value, and there the file of a finished run of each curve; of many curves the first dozen.

    Every method and basis comes before the second variant of any.
    """
    finest: dict[float, list[tuple[Series, str, float]]] = {}
    for one in study.series:
        for file, row in one.ok.drop_duplicates("axis_value").iterrows():
            particles = float(row.get("n_particles", 0.0))
            finest.setdefault(float(row.axis_value), []).append((one, str(file), particles))
    if not finest:
        return float("nan"), []
    affordable = {
        value: group
        for value, group in finest.items()
        if sum(number for *_, number in group if number == number) <= MOST_PARTICLES
    }
    choice = affordable or {min(finest): finest[min(finest)]}
    most = max(len(group) for group in choice.values())
    value = study.axis.finest(value for value, group in choice.items() if len(group) == most)
    shown: dict[tuple[str, str], int] = {}
    candidates: list[tuple[int, int, Series, str]] = []
    for one, file, _ in choice[value]:
        turn = shown[one.method, one.basis] = shown.get((one.method, one.basis), -1) + 1
        candidates.append((turn, len(candidates), one, file))
    first = sorted(candidates, key=lambda entry: entry[:2])[:MOST_PANELS]
    kept = sorted(first, key=lambda entry: entry[1])
    return value, [(one, file) for _, _, one, file in kept]
