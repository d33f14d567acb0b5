"""Keys that came after results were stored: hashes stay, and older files are read as having them."""

import json

from mpmbench.results.bookkeeping import LATER, LATER_OF_LOOPS, with_later
from mpmbench.results.campaign import flat_settings
from mpmbench.results.identity import config_hash
from mpmbench.runs.hydra.compose import compose_many
from mpmbench.settings.schema import declared

DISK = ["method=gmm", "basis=mls", "problem=rolling_disk"]


def test_a_key_that_came_later_leaves_the_hash_of_before():
    more = ([], ["basis.mixed_terms=false"], ["basis.mixed_terms=true"])
    plain, given, other = (config for config, _ in compose_many([[*DISK, *one] for one in more]))
    assert plain["basis"]["mixed_terms"] is False
    before = plain | {"basis": dict(plain["basis"])}
    del before["basis"]["mixed_terms"]
    assert config_hash(before) == config_hash(plain) == config_hash(given) != config_hash(other)
    settings = flat_settings({"config": json.dumps(before)})
    assert settings["basis.mixed_terms"] is False
    assert with_later(other) == other
    linear = {"basis": {"name": "linear"}}
    assert with_later(linear) == linear


def test_keys_of_explicit_loops_that_came_later():
    more = ([], ["method.transfer_order=2"], ["method.transfer_order=3"])
    plain, given, other = (config for config, _ in compose_many(more))
    before = plain | {"method": dict(plain["method"])}
    del before["method"]["transfer_order"], before["method"]["gradient"]
    assert config_hash(before) == config_hash(plain) == config_hash(given) != config_hash(other)
    assert with_later(before) == plain and with_later(other) == other
    (implicit, _), *_ = compose_many([["method=implicit_mpm", "problem=cantilever_self_weight"]])
    assert with_later(implicit)["method"] == implicit["method"]


def test_a_group_that_came_later_leaves_the_hash_of_before():
    plain, penalty = (
        compose_many([["problem=two_squares", "basis=lme", "method=otm", f"contact={rule}"]])[0][0]
        for rule in ("shared", "penalty")
    )
    before = {key: value for key, value in plain.items() if key != "contact"}
    assert config_hash(before) == config_hash(plain) != config_hash(penalty)
    assert with_later(before)["contact"] == plain["contact"] == {"name": "shared"}


def test_a_key_that_came_later_can_still_have_the_value_of_before():
    for (group, name), keys in LATER.items():
        settings = declared(group, name)
        for key, value in keys.items():
            assert value == settings[key].default or value in settings[key].options
    explicit, implicit = ("mpm", "otm", "unified", "linear_fem"), ("implicit_mpm", "gmm", "fem")
    for marked, loops in {"mass_cutoff": explicit, "step_halvings": implicit}.items():
        keys = LATER_OF_LOOPS[marked]
        for loop in loops:
            settings = declared("method", loop)
            assert marked in settings
            assert all(value == settings[key].default for key, value in keys.items())
