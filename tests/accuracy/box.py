"""Designs from the whole admitted box, drawn as the settings admit them: wide ranges by their logarithm."""

from __future__ import annotations

import numpy as np

from boulder_kernels import Control, DesignTable, Readings
from boulder_sweep.settings.fields import INPUTS

ADMITTED = {field.name: field.admitted for field in INPUTS}
LIMIT = float(np.radians(20.0))
PRESETS = {"corrected": Readings(*(True,) * 5), "as_printed": Readings(*(False,) * 5)}


def box_table(count: int, seed: int) -> DesignTable:
    """Draw designs; those whose face the truck meets come four times as often as chance would have it."""
    rng = np.random.default_rng(seed)

    def wide(name: str) -> np.ndarray:
        bound = ADMITTED[name]
        return np.exp(rng.uniform(np.log(bound.low), np.log(bound.high), count))

    def plain(name: str) -> np.ndarray:
        return rng.uniform(ADMITTED[name].low, ADMITTED[name].high, count)

    H = wide("boulder_height_m")
    ratio = np.where(rng.random(count) < 0.5, wide("embedment_ratio"), rng.uniform(0.0, 1.0, count))
    d = np.clip(H * ratio, 1e-6, H * (1.0 - 1e-9))
    exposed = H - d
    bumper = np.where(rng.random(count) < 0.8, exposed * rng.uniform(0.0, 1.0, count), plain("bumper_height_m"))
    hood = bumper + rng.uniform(0.0, 2.0, count)
    by_rule = 0.5 * (np.minimum(exposed, hood) + bumper)
    e = np.where(rng.random(count) < 0.5, by_rule, exposed * rng.uniform(0.0, 1.0, count))
    return DesignTable(
        L=wide("boulder_length_m"),
        W=wide("boulder_width_m"),
        H=H,
        rho_b=wide("boulder_density_kg_m3"),
        d=d,
        e=e,
        rho_s=wide("soil_density_kg_m3"),
        phi=np.radians(plain("friction_angle_deg")),
        beta=wide("subgrade_reaction_MN_m3"),
        K_epsilon=wide("strain_rate_factor"),
        m_v=wide("vehicle_mass_kg"),
        v_0=plain("impact_speed_m_s"),
        k_v=wide("vehicle_spring_N_m"),
        c_v=wide("vehicle_damper_N_s_m"),
        e_bumper=bumper,
    )


def rows(table: DesignTable, which: np.ndarray | slice) -> DesignTable:
    """Return some rows of a table."""
    return DesignTable(*(np.ascontiguousarray(column[which]) for column in table))


def how(step_s: float = 0.008, *, estimate: bool = False, horizon_s: float = 1.0, elements: int = 0) -> Control:
    """How the tests simulate, if nothing else matters."""
    return Control(step_s, horizon_s, LIMIT, elements, estimate)
