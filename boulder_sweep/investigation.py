"""Sand by what an investigation measures: blow counts, cone resistance, relative density, in plain numbers.

Published correlations for clean sand. Several are in wide use and differ by up to 6 deg: every one of the tables
`BY_BLOW_COUNT` and `BY_CONE` is worked out, and the one with the weakest soil counts. Where a source leaves a choice,
the weaker soil is taken, too: a reading is normalized by the stress in dense soil without water where no
density is measured, the normalization is limited to 1.7 (Youd et al. 2001), rods count as no longer than the depth
(Skempton 1986), the excess pore pressure behind a cone is left out, and nothing is extrapolated. `docs/references.md`
marks the sources that were not seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from boulder_sweep import elementary

G = 9.80665
ATMOSPHERE_KPA = 101.325
LARGEST_FACTOR = 1.7
"""Largest normalization of a blow count or a cone resistance by the stress: Youd et al. (2001)."""
RODS = ((4.0, 0.75), (6.0, 0.85), (10.0, 0.95), (math.inf, 1.0))
"""Lengths of the rods [m] up to which each factor on blow counts holds: Skempton (1986)."""
HAMMERS = 0.78
"""Energy ratio of the hammers in Hatanaka and Uchida (1996), by UFC 3-220-10, Eq 8-6."""
PCF = 16.018463373960142
"""One pound per cubic foot [kg/m^3]."""


class OutsideError(ValueError):
    """A reading lies outside of what a correlation holds for; the message says so."""


class AboveError(OutsideError):
    """A reading lies above what a correlation holds for: the soil is at least as strong as at the end of the range."""


class Range(NamedTuple):
    """What a correlation admits, ends included."""

    low: float
    high: float

    def check(self, value: float, what: str, unit: str = "") -> None:
        """Raise `OutsideError` where a value is outside by more than rounding, or is NaN; `AboveError` above."""
        if not self.low * (1.0 - 1e-9) <= value <= self.high * (1.0 + 1e-9):
            ends = f"{self.low:.4g} to {self.high:.4g}{unit}"
            kind = AboveError if value > self.high else OutsideError
            raise kind(f"{what} is {value:.4g}{unit}; the correlation holds from {ends}")


BLOW_COUNTS = Range(3.5 * HAMMERS / 0.6, 30.0 * HAMMERS / 0.6)
"""(N1)60 that blow counts are taken for: N1 from 3.5 to 30 with the hammers of Hatanaka and Uchida. Peck, Hanson and
Thornburn's curve goes on to about 60; there, the two cannot be compared."""
CONE_ANGLES = Range(30.0, 46.0)
"""Friction angles [deg] that cones are taken for."""
RELATIVE_DENSITIES = Range(0.15, 0.85)
"""Where the table of EM 1110-2-2504 gives both ends of the friction angle."""
SPT_SD_DEG, CPT_SD_DEG, DENSITY_SD_DEG = 3.0, 2.8, 2.0
"""Scatter of the friction angle about a correlation [deg], as a standard deviation: Hatanaka and Uchida's, taken
for Wolff's, too; Kulhawy and Mayne's, with which Phoon and Kulhawy (1999) calculate, taken for Robertson and
Campanella's, too; Bowles (1996), Table 3-4."""

# Constant of horizontal subgrade reaction [MN/m^3] over friction angle [deg] of the two families in use.
API_ANGLES, _API = np.array([30.0, 43.0]), np.array([10.5, 110.0])
_TERZAGHI_ANGLES, _TERZAGHI = np.array([30.0, 35.0, 40.0]), np.array([2.2, 6.6, 17.6])

FAMILY_FACTOR = 2.0
"""How far a pair of soil constants may be off the nearer family of data."""


class SandState(NamedTuple):
    """A state of sand in the table of EM 1110-2-2504 (Table 3-1, after Teng 1962)."""

    name: str
    relative_density: float
    """Upper end of the relative density [-]."""
    friction_angle_deg: float
    """Friction angle at the upper end of the relative density."""
    lightest_pcf: float
    heaviest_pcf: float
    """Bounds of the moist unit weight."""


STATES = (
    SandState("loose", 0.35, 30.0, 95.0, 125.0),
    SandState("medium", 0.65, 36.0, 110.0, 130.0),
    SandState("dense", 0.85, 41.0, 110.0, 140.0),
)
LOOSEST = (0.15, 28.0)
"""Relative density and friction angle [deg] where the first of them begins."""


def vertical_stress(depth_m: float, density_kg_m3: float | None) -> float:
    """Return the vertical stress at a depth [kPa], in dense soil where no density is known; water is left out.

    Both make it larger, and so the friction angle smaller.
    """
    density = STATES[-1].heaviest_pcf * PCF if density_kg_m3 is None else density_kg_m3
    return density * G * depth_m / 1e3


def stress_factor(stress_kPa: float) -> float:
    """Return C_N = sqrt(p_a / sigma'), at most 1.7 (Liao and Whitman 1986; Youd et al. 2001); also for cones."""
    return min(math.sqrt(ATMOSPHERE_KPA / stress_kPa), LARGEST_FACTOR) if stress_kPa > 0.0 else LARGEST_FACTOR


def rod_factor(length_m: float) -> float:
    """Return the factor on a blow count for rods of a length [m], which lose energy where they are short."""
    return next(factor for longest, factor in RODS if length_m <= longest)


def normalized_blow_count(n: float, energy_ratio: float, depth_m: float, stress_kPa: float) -> float:
    """Return (N1)60 = N (ER / 0.6) C_R C_N of a raw blow count, of the last 300 mm (1 ft) as logged.

    The energy ratio is the fraction of the hammer's energy that reaches the rods; the depth of the reading [m] counts
    as the length of the rods; the stress there is the effective vertical one [kPa].
    """
    return n * energy_ratio / 0.6 * rod_factor(depth_m) * stress_factor(stress_kPa)


def hatanaka_uchida(n1_60: float) -> float:
    """Return the friction angle [deg] by (N1)60, sqrt(15.4 (N1)60) + 20 (1996; UFC 3-220-10, Eq 8-6)."""
    return math.sqrt(15.4 * n1_60) + 20.0


def wolff(n1_60: float) -> float:
    """Return the friction angle [deg] by (N1)60, 27.1 + 0.30 (N1)60 - 0.00054 (N1)60^2 (1989; UFC 3-220-10, Eq 8-5).

    Wolff's fit to the curve of Peck, Hanson and Thornburn (1974).
    """
    return 27.1 + 0.30 * n1_60 - 0.00054 * n1_60**2


def kulhawy_mayne(resistance_MPa: float, stress_kPa: float) -> float:
    """Return the friction angle [deg] by a cone, 17.6 + 11 lg(q_c / p_a sqrt(p_a / sigma')) (1990).

    The square root is limited as for blow counts. UFC 3-220-10, Eq 8-7, prints the stress without the root, which would
    give larger angles below one atmosphere.
    """
    return 17.6 + 11.0 * math.log10(1e3 * resistance_MPa / ATMOSPHERE_KPA * stress_factor(stress_kPa))


def robertson_campanella(resistance_MPa: float, stress_kPa: float) -> float:
    """Return the friction angle [deg] by a cone, tan(phi') = (lg(q_c / sigma') + 0.29) / 2.68 (1983).

    The stress is limited as for blow counts: near the surface it counts as p_a / 1.7^2 = 35 kPa.
    """
    ratio = 1e3 * resistance_MPa / ATMOSPHERE_KPA * stress_factor(stress_kPa) ** 2
    return math.degrees(math.atan((math.log10(ratio) + 0.29) / 2.68))


BY_BLOW_COUNT: dict[str, Callable[[float], float]] = {
    "Hatanaka and Uchida 1996": hatanaka_uchida,
    "Wolff 1989": wolff,
}
"""Friction angle [deg] over (N1)60 by each correlation, under its source."""
BY_CONE: dict[str, Callable[[float, float], float]] = {
    "Kulhawy and Mayne 1990": kulhawy_mayne,
    "Robertson and Campanella 1983": robertson_campanella,
}
"""Friction angle [deg] over the resistance of the cone [MPa] and the vertical stress [kPa], likewise."""


def angles_by_blow_count(n1_60: float) -> dict[str, float]:
    """Return the friction angle [deg] by each of `BY_BLOW_COUNT`; raise `OutsideError` outside `BLOW_COUNTS`."""
    BLOW_COUNTS.check(n1_60, "(N1)60")
    return {source: angle(n1_60) for source, angle in BY_BLOW_COUNT.items()}


def angles_by_cone(resistance_MPa: float, stress_kPa: float) -> dict[str, float]:
    """Return the friction angle [deg] by each of `BY_CONE`.

    Raise `OutsideError` where the lowest angle is outside `CONE_ANGLES`, or nothing resists the cone.
    """
    if resistance_MPa <= 0.0:
        raise OutsideError(f"the resistance of the cone is {resistance_MPa:g} MPa; the correlation needs more than 0")
    angles = {source: angle(resistance_MPa, stress_kPa) for source, angle in BY_CONE.items()}
    CONE_ANGLES.check(min(angles.values()), f"the friction angle by {resistance_MPa:g} MPa", " deg")
    return angles


STRONGEST = {
    "spt": angles_by_blow_count(BLOW_COUNTS.high),
    "cpt": dict.fromkeys(BY_CONE, CONE_ANGLES.high),
}
"""Friction angles [deg] at the upper end of the range of each kind of test, by their sources."""


def angle_by_relative_density(ratio: float) -> float:
    """Return the friction angle [deg] by EM 1110-2-2504, Table 3-1, linear between the ends of its states.

    Raise `OutsideError` outside `RELATIVE_DENSITIES`.
    """
    RELATIVE_DENSITIES.check(ratio, "the relative density")
    ends = [LOOSEST, *((state.relative_density, state.friction_angle_deg) for state in STATES)]
    return float(np.interp(ratio, *np.transpose(ends)))


def densities(angle_deg: float) -> tuple[float, float]:
    """Return the least and largest moist density [kg/m^3] of sand with a friction angle, by EM 1110-2-2504, Table 3-1.

    Beyond the table the density of dense sand counts, which is less than the density of very dense sand.
    """
    state = next((state for state in STATES if angle_deg <= state.friction_angle_deg), STATES[-1])
    return state.lightest_pcf * PCF, state.heaviest_pcf * PCF


def api_curve(angle: np.ndarray) -> np.ndarray:
    """Constant of horizontal subgrade reaction [MN/m^3] by the API curve, over the friction angle [deg]."""
    return _log_line(angle, API_ANGLES, _API)


def terzaghi_curve(angle: np.ndarray) -> np.ndarray:
    """Constant of horizontal subgrade reaction [MN/m^3] by Terzaghi's values, over the friction angle [deg]."""
    return _log_line(angle, _TERZAGHI_ANGLES, _TERZAGHI)


def _log_line(angle: np.ndarray, angles: np.ndarray, values: np.ndarray) -> np.ndarray:
    return elementary.exp(np.interp(angle, angles, elementary.log(values)))


def off_families(angle: np.ndarray, reaction: np.ndarray) -> np.ndarray:
    """Return which pairs of friction angle [deg] and subgrade reaction [MN/m^3] are of neither family of data."""
    least, most = family_bounds(angle)
    return (reaction < least) | (reaction > most)


def family_bounds(angle: np.ndarray) -> np.ndarray:
    """Return least and largest constant of subgrade reaction [MN/m^3] that go with friction angles [deg], (2, n)."""
    return np.stack([terzaghi_curve(angle) / FAMILY_FACTOR, FAMILY_FACTOR * api_curve(angle)])
