"""What the chapters and claims on Li 2009 share: names of its methods, and the exact shock."""

import numpy as np

VELOCITY, DENSITY = "error_velocity_l2_max", "error_density_l1_max"
LUMPED = {"mass": "lumped", "method__transfer": "nodal"}
CONSISTENT = {"mass": "consistent", "method__transfer": "position_difference"}
FIELDS = ("position_initial", "position", "velocity", "displacement", "volume", "snapshot_time")
OTM = {"method": "otm", "basis": "lme"}
SHOCK = {"rho": 1.0, "K": 1.0, "eta": 0.0025, "ahead": 1.0, "behind": 0.1}  # Table 4.1


def exact_shock(X: np.ndarray, t: float) -> dict[str, np.ndarray]:
    """Displacement, velocity, density and acceleration of Li 2009, Eq. 4.23, with + log 2 [SI]."""
    K, rho, ahead, behind = SHOCK["K"], SHOCK["rho"], SHOCK["ahead"], SHOCK["behind"]
    C = np.sqrt(0.5 * K / rho * (1.0 + 1.0 / (ahead * behind)))
    L = 8.0 * SHOCK["eta"] * C * ahead * behind / (3.0 * K * (ahead - behind))
    s = (X - C * t) / (2.0 * L)
    J = 0.5 * (ahead + behind) + 0.5 * (ahead - behind) * np.tanh(s)
    log_2cosh = np.abs(s) + np.log1p(np.exp(-2.0 * np.abs(s)))
    return {
        "displacement": (0.5 * (ahead + behind) - 1.0) * (X - C * t)
        + L * (ahead - behind) * log_2cosh,
        "velocity": C * (1.0 - J),
        "density": rho / J,
        "acceleration": C
        * C
        * 0.25
        * (ahead - behind)
        / L
        / np.cosh(np.clip(s, -300.0, 300.0)) ** 2,
    }
