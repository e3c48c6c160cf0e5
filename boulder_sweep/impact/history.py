"""Forces and energies along a recorded motion, from the same kernels that integrated it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from boulder_kernels import Constants, Control, Design, Outcome, Readings, Record
from boulder_kernels import dynamics as modes
from boulder_kernels.design import Body, body_with
from boulder_kernels.outcomes import StoredEnergies, evaluate_samples
from boulder_kernels.pieces import ManyPieces, Piece
from boulder_kernels.soil import soil_kinematics

MODE_NAMES = {
    modes.SEATED: "seated",
    modes.TURNING_FORWARD: "turning",
    modes.TURNING_BACK: "turning",
    modes.HELD: "held",
    modes.LIMITED_FORWARD: "limited",
    modes.LIMITED_BACK: "limited",
    modes.FREE: "free",
}
"""Mode of rotation in words: gravity reading ``seated`` or ``turning``; printed reading ``held`` (the restoring
moment equals the net moment), ``limited`` (it is at its limit), ``free`` (there is none)."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Input and output of the kernels, in their own units."""

    design: Design
    readings: Readings
    constants: Constants
    control: Control
    record: Record
    outcome: Outcome
    """Outcome of the whole recorded motion, beyond the limit."""
    given_outline: np.ndarray
    """Outline of the boulder, shape (P, 4), see `boulder_kernels.design`; P = 0 of a box."""

    @property
    def body(self) -> Body:
        """The boulder as a rigid body."""
        return body_with(self.design, self.given_outline)

    @property
    def outline(self) -> np.ndarray:
        """Outline of the boulder, shape (P, 4), see `boulder_kernels.design`; a box has its own."""
        if len(self.given_outline):
            return self.given_outline
        half = 0.5 * self.design.L
        return np.array([[z, self.design.W, half, half] for z in (0.0, self.design.H)])


@dataclass(frozen=True, eq=False)
class EnergyLedger:
    """Where the vehicle's energy is at every sample [J], arrays of shape (n,).

    `boulder_sweep.impact.trajectory.ENERGY` says what each is. Under the gravity reading `gravity_J` is a potential
    energy; as printed it is the work done against the restoring moment, which has no potential (negative where it
    drives the boulder on). `pull_J` is, with the printed separation only, minus the work of the pull on the vehicle
    that nothing on the boulder answers.
    """

    time_s: np.ndarray
    vehicle_kinetic_J: np.ndarray
    crush_spring_J: np.ndarray
    crush_damper_J: np.ndarray
    boulder_linear_J: np.ndarray
    boulder_angular_J: np.ndarray
    soil_elastic_J: np.ndarray
    soil_drag_J: np.ndarray
    gravity_J: np.ndarray
    pull_J: np.ndarray
    residual_J: np.ndarray

    @property
    def initial(self) -> float:
        """Energy of the vehicle at first touch [J]; NaN without samples."""
        return float(self.vehicle_kinetic_J[0]) if len(self.time_s) else float("nan")

    @property
    def largest_residual(self) -> float:
        """Largest residual as a fraction of the energy at first touch; NaN without samples."""
        if len(self.time_s) == 0:
            return float("nan")
        largest = float(np.abs(self.residual_J).max())
        return largest / self.initial if largest > 0.0 else 0.0


def forces_along(motion: Motion) -> dict[str, np.ndarray]:
    """Return the forces at the n samples of a record, arrays of shape (n,) by the names of the trajectory's columns."""
    (a_b, alpha_b, a_v, M), _ = _evaluated(motion)
    c, theta = motion.constants, motion.record.states[:, 2]
    # As printed the truck is pulled back by a force that the boulder does not feel: only contact counts here.
    F_v = np.where(motion.record.touching, -motion.design.m_v * a_v, 0.0)
    M_v = F_v * (c.h * np.cos(theta) + c.g_x * np.sin(theta))
    return {
        "vehicle_acceleration_m_s2": a_v,
        "contact_force_N": F_v,
        "contact_moment_N_m": M_v,
        "soil_force_N": c.m_eff * a_b - F_v,
        "soil_moment_N_m": M - M_v,
        "restoring_moment_N_m": c.J_eff * alpha_b - M,
    }


def ledger_of(motion: Motion) -> EnergyLedger:
    """Draw up the energy ledger at the n samples of a record that has the energies exchanged."""
    _, stored = _evaluated(motion)
    truck, linear, angular, elastic, spring, potential = stored
    drag, damper, restoring, pull = motion.record.exchanged.T
    parts = {
        "vehicle_kinetic_J": truck,
        "crush_spring_J": spring,
        "crush_damper_J": damper.copy(),
        "boulder_linear_J": linear,
        "boulder_angular_J": angular,
        "soil_elastic_J": elastic,
        "soil_drag_J": drag.copy(),
        "gravity_J": potential if motion.readings.restoring_gravity else restoring.copy(),
        "pull_J": -pull,
    }
    at_first_touch = truck[0] if len(truck) else 0.0
    residual = np.sum(list(parts.values()), axis=0) - at_first_touch
    return EnergyLedger(time_s=motion.record.times, **parts, residual_J=residual)


def _evaluated(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Return rates and stored energies at the samples of a record, see `evaluate_samples`."""
    record, c, m_v = motion.record, motion.constants, motion.design.m_v
    n = len(record.times)
    rates, stored = np.empty((len(modes.Acceleration._fields), n)), np.empty((len(StoredEnergies._fields), n))
    if n:
        evaluate_samples(record, c, m_v, motion.readings, rates, stored)
    return rates, stored


def soil_profile(motion: Motion, sample: int, slices: int) -> tuple[np.ndarray, np.ndarray]:
    """Cut the soil along the buried face into slices of equal height at one sample, from the soil line down.

    Return the depth of the middle of each slice [m], and its force on the boulder [N], spring and drag (Eq 19), by the
    soil element in its middle; shape (slices,).
    """
    c = motion.constants
    x_b, v_b, theta, omega, _, _ = (float(value) for value in motion.record.states[sample])
    versine = 2.0 * np.sin(0.5 * theta) ** 2
    k = soil_kinematics(x_b, v_b, omega, float(np.sin(theta)), float(versine), c)
    ratio = (np.arange(slices) + 0.5) / slices
    pressed = _pressed_at(ratio, k.A - k.slope_x * ratio, k.B - k.slope_v * ratio, c)
    return ratio * c.d, -pressed / slices


def _pressed_at(ratio: np.ndarray, displacement: np.ndarray, velocity: np.ndarray, c: Any) -> np.ndarray:
    """What the soil presses with at ratios of the depth, per ratio [N]; of elements, those they lie in."""
    if isinstance(c, Constants):
        spring, drag = c.K_soil * ratio, np.full_like(ratio, c.R_soil)
        ultimate = spring * c.x_yield
    elif isinstance(soil := c.soil, ManyPieces):
        p = Piece(*soil.pieces[np.searchsorted(soil.pieces[:, Piece._fields.index("to")], ratio)].T)
        width = np.asarray(p.w_0 + p.w_1 * ratio)
        spring, ultimate, drag = p.K * ratio * width, (p.P_0 + p.P_1 * ratio) * width, p.R * width
    else:
        elements = len(soil.ratio)
        at = np.minimum((ratio * elements).astype(int), elements - 1)
        spring, ultimate, drag = (elements * values[at] for values in (soil.stiffness, soil.ultimate, soil.drag))
    return np.clip(spring * displacement, -ultimate, ultimate) + drag * velocity * np.abs(velocity)
