"""From what Hydra composed to the plain, checked configuration of one run."""

from typing import Any

from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from mpmbench.settings.schema import (
    GROUPS,
    PROBLEM_DEFAULTS,
    BadInput,
    check_types,
    experiments,
    read_yaml,
)


def resolve(composed: DictConfig, hydra: Any) -> tuple[dict[str, Any], str]:
    """Plain configuration with the problem's defaults filled in, and the reason why it does not apply, if so.

    Parameters
    ----------
    composed : DictConfig
        The configuration without its ``hydra`` part.
    hydra : DictConfig
        That part.

    Raises
    ------
    BadInput
        As `check_types`.
    """
    experiment = hydra.runtime.choices.get("experiments")
    overrides: Any = OmegaConf.to_container(hydra.overrides.task, resolve=False)
    given = [text.partition("=")[0] for text in overrides]
    body = read_yaml(experiments()[experiment]) if experiment in experiments() else {}
    try:
        plain = OmegaConf.to_container(composed, resolve=True)
    except OmegaConfBaseException as error:
        raise BadInput(" ".join(str(error).split())) from None
    assert isinstance(plain, dict)
    return fill(
        {str(key): value for key, value in plain.items()}, {*given, *dotted(body)}, experiment
    )


def fill(
    plain: dict[str, Any], given: set[str], experiment: str | None
) -> tuple[dict[str, Any], str]:
    """Apply the problem's ``method_defaults``, ``basis_defaults`` and ``material_defaults``, then check types.

    Those of methods and bases are listed by name; a key that was given keeps its value.
    """
    config = {
        key: dict(value) if key in GROUPS else value
        for key, value in plain.items()
        if key != "cases"
    }
    by_method, by_basis, for_material = (
        config["problem"].pop(key, None) or {} for key in PROBLEM_DEFAULTS
    )
    for group, defaults in (
        ("method", by_method.get(config["method"]["name"], {})),
        ("basis", by_basis.get(config["basis"]["name"], {})),
        ("material", for_material),
    ):
        for key, value in defaults.items():
            if key in config[group] and f"{group}.{key}" not in given:
                config[group][key] = value
    config.pop("experiments", None)
    if config.get("campaign") is None:
        config["campaign"] = experiment or "default"
    return check_types(config)


def dotted(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested dictionary as one with dotted keys."""
    flat: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            flat |= dotted(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat
