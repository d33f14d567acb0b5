"""A bar made in Python: one end is held, a wave runs along it, and the energy stays."""

from mpmbench import Body, Box, Particles, make, seed_cells, simulate

rubber = make("material", "neo_hookean", young_modulus=1e4, density=10.0)
bar = Box((0.0,), (1.0,), (16,))
X, V0 = seed_cells(bar, 4)
particles = Particles.at_rest(X, V0, rubber.density)
particles.v[:] = 0.1 * X
body = Body(bar, particles, fixed=lambda x: x < 1e-9, velocity=lambda x: 0.1 * x)
splines = make("basis", "bspline", degree=2)
for method in ("unified", make("method", "mpm", mass="consistent", nodes="moving")):
    result = simulate(body, splines, rubber, method, time_step=1e-4, end_time=0.02)
    print(result.status, float(result.energy_drift), result.displacement[-1, -1].values)
