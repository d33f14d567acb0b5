"""The command ``warmup``: compile the kernels of a choice of runs, so that later ones only load them."""

from mpmbench.settings.schema import options


def main(arguments: list[str]) -> int:
    """``warmup [KEY=VALUE...]``: without a method or basis, all that apply to the problem."""
    from mpmbench.runs.process import isolation
    from mpmbench.runs.sweep import execute, launchers
    from mpmbench.settings import arguments as command_line

    _, pairs = command_line.split(arguments, [])
    isolation.processes.warm_up()
    from mpmbench.runs.hydra.compose import compose_many

    given = {pair.partition("=")[0] for pair in pairs}
    methods = [[]] if "method" in given else [[f"method={name}"] for name in options("method")]
    bases = [[]] if "basis" in given else [[f"basis={name}"] for name in options("basis")]
    small = [] if "resolution" in given else ["resolution=4"]
    cells = compose_many(
        [[*pairs, *method, *basis, *small] for method in methods for basis in bases]
    )
    failed = False
    for (config, reason), answer in zip(cells, execute.check(cells), strict=True):
        name = f"{config['method']['name']}, {config['basis']['name']}"
        if reason or answer["not_applicable"]:
            continue
        done = launchers.compile_kernels(config)
        failed = failed or done != "ok"
        print(f"{name}: {'ready' if done == 'ok' else done}", flush=True)
    return 1 if failed else 0
