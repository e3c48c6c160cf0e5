"""The two full-scale crash tests of the paper, and its truck against a rigid wall (Tables 1 to 3, section 3.2).

Table 3 gives the speed of the second test as 14.5 m/s, Table 2 that of the first as 13.36 m/s (the text rounds it to
13.4 m/s). The densities are those of the tables too: the text has 2652 kg/m^3 for Rockville White Granite and
2010 kg/m^3 for the soil.
"""

from __future__ import annotations

from boulder_sweep.crash_tests.rigid_wall import RigidWall
from boulder_sweep.settings import Sweep
from boulder_sweep.settings.model import SolverSettings

NAMES = {"abg": "American Black Granite", "rwg": "Rockville White Granite"}

_BOTH = {
    "soil_density_kg_m3": 1859.9,
    "friction_angle_deg": 43.2,
    "subgrade_reaction_MN_m3": 95.0,
    "strain_rate_factor": 1.0,
    "vehicle_spring_N_m": 3103.3e3,
    "vehicle_damper_N_s_m": 138.91e3,
    "hood_height_m": 1.4,
    "bed_offset_m": 2.9,
}
_BY_TEST = {
    "abg": {
        "boulder_length_m": 0.762,
        "boulder_width_m": 1.016,
        "boulder_height_m": 2.2,
        "boulder_density_kg_m3": 3074.0,
        "embedment_depth_m": 1.2,
        "impact_height_m": 0.754,
        "vehicle_mass_kg": 6795.0,
        "impact_speed_m_s": 13.36,
        "bumper_height_m": 0.508,
    },
    "rwg": {
        "boulder_length_m": 1.65,
        "boulder_width_m": 1.68,
        "boulder_height_m": 3.44,
        "boulder_density_kg_m3": 2596.0,
        "embedment_depth_m": 2.03,
        "impact_height_m": 0.938,
        "vehicle_mass_kg": 6722.0,
        "impact_speed_m_s": 14.5,
        "bumper_height_m": 0.5,
    },
}
HORIZON_S = 0.5
STEP_S = 0.0005
"""Simulated time, as long as the paper's figures, and a step far finer than any figure shows [s]."""


def crash_test(name: str) -> Sweep:
    """Return a crash test as a sweep of one design.

    Parameters
    ----------
    name
        ``abg`` or ``rwg``.
    """
    solver = SolverSettings(accuracy=None, step_s=STEP_S, horizon_s=HORIZON_S)
    return Sweep(name=name, path=None, axes=(), constants={**_BOTH, **_BY_TEST[name]}, solver=solver)


def rigid_wall_test() -> RigidWall:
    """Return the paper's truck at 13.4 m/s against a rigid wall, its Figure 10."""
    return RigidWall(6800.0, 13.4, _BOTH["vehicle_spring_N_m"], _BOTH["vehicle_damper_N_s_m"])
