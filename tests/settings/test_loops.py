"""The settings of a method are those of its time loop, also when another loop is chosen."""

from mpmbench.runs.hydra.compose import compose_many


def test_a_loop_without_a_setting_drops_it_unless_it_was_given() -> None:
    """The problem takes Newmark's method for a static loop, which has no parameters of Newmark's."""
    words = ["problem=patch_test", "method=gmm"]
    ((config, reason),) = compose_many([words])
    assert config["method"]["time"] == "static" and not reason
    assert not {key for key in config["method"] if key.startswith("newmark")}
    assert config["method"]["residual_tolerance"] == 1e-8
    ((_, reason),) = compose_many([[*words, "method.newmark_velocity=0.6"]])
    assert reason == "method.time=static has no newmark_velocity"
