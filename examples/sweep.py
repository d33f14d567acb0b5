"""Two methods at three resolutions, with the same mass: errors as a table, and one run in detail."""

import mpmbench

cube = mpmbench.sweep(
    method=["mpm", "otm"],
    basis="linear",
    method__mass="consistent",
    resolution=[4, 8, 16],
    campaign="example",
)
print(cube.error_displacement_rms.to_series().unstack("resolution"))

best = mpmbench.run(
    method="otm", basis="linear", method__mass="consistent", resolution=16, campaign="example"
)
print(best.status, float(best.energy_drift), best.position.sizes)
