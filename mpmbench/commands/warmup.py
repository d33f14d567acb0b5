"""The command ``warmup``: compile the kernels of a choice of runs, so that later ones only load them."""

from mpmbench.say import say
from mpmbench.settings.schema import options


def main(arguments: list[str]) -> int:
    """``warmup [KEY=VALUE...]``: without a method or basis, all that apply to the problem."""
    from mpmbench.runs.sweep import execute, launchers
    from mpmbench.settings.arguments import split

    _, pairs = split(arguments, [])
    given = {pair.partition("=")[0] for pair in pairs}
    methods = [[]] if "method" in given else [[f"method={name}"] for name in options("method")]
    bases = [[]] if "basis" in given else [[f"basis={name}"] for name in options("basis")]
    small = [] if "resolution" in given else ["resolution=4"]
    combinations = [[*pairs, *method, *basis, *small] for method in methods for basis in bases]
    failed = False
    for config, reason in execute.applying(combinations):
        if not reason:
            done = launchers.compile_kernels(config)
            failed = failed or done != "ok"
            name = f"{config['method']['name']}, {config['basis']['name']}"
            say(f"{name}: {'ready' if done == 'ok' else done}")
    return 1 if failed else 0
