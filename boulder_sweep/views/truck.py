"""A medium-duty truck from the side, with its front crushed as in the model. Only its three heights are data."""

from __future__ import annotations

from typing import TYPE_CHECKING

from boulder_sweep.views.shapes import Shape

if TYPE_CHECKING:
    from boulder_sweep.impact.trajectory import Trajectory

CRUSH_ZONE_M = 1.7
"""Length of the front that is drawn shorter when it is crushed."""
LEAST_LEFT = 0.25
"""Fraction of the zone that always remains visible."""
WHEEL_RADIUS_M = 0.42
BED_LENGTH_M = 6.0


def truck_shapes(trajectory: Trajectory, sample: int) -> list[Shape]:
    """Return the truck at one sample.

    The damper's crush m_v (v_0 - v)/c_v stays, the spring's comes and goes with the force; together they are how far
    the front is pushed in. Behind the crush zone everything moves with the vehicle.
    """
    design, inputs = trajectory.motion.design, trajectory.inputs
    x_v = float(trajectory.vehicle_displacement_m[sample])
    lost = design.v_0 - float(trajectory.vehicle_velocity_m_s[sample])
    crush = design.m_v / design.c_v * lost + float(trajectory.contact_force_N[sample]) / design.k_v
    bumper, hood, offset = (inputs[f"{name}_m"] for name in ("bumper_height", "hood_height", "bed_offset"))
    zone = min(max(CRUSH_ZONE_M, crush / (1.0 - LEAST_LEFT)), offset)

    def at(behind: float, height: float) -> tuple[float, float]:
        """Location of a point given by its distance behind the undamaged front."""
        left = min(behind / zone, 1.0)
        return x_v - behind - min(crush, (1.0 - LEAST_LEFT) * zone) * (1.0 - left), height

    roof = max(hood + 0.85, 2.2)
    cab_back = max(offset - 0.25, zone)
    cab = (
        at(0.0, bumper),
        at(0.0, hood - 0.25),
        at(0.15, hood),
        at(0.38 * cab_back, hood + 0.05),
        at(0.55 * cab_back, roof),
        at(cab_back, roof),
        at(cab_back, bumper),
    )
    window = (
        at(0.44 * cab_back, hood + 0.1),
        at(0.57 * cab_back, roof - 0.15),
        at(0.85 * cab_back, roof - 0.15),
        at(0.85 * cab_back, hood + 0.1),
    )
    bed = (
        at(offset, 1.05),
        at(offset, 2.3),
        at(offset + BED_LENGTH_M, 2.3),
        at(offset + BED_LENGTH_M, 1.05),
    )
    frame = (at(cab_back, 0.7), at(cab_back, 1.05), at(offset + BED_LENGTH_M, 1.05), at(offset + BED_LENGTH_M, 0.7))
    wheels = [
        Shape("circle", "wheel", (at(behind, WHEEL_RADIUS_M),), radius=WHEEL_RADIUS_M)
        for behind in (0.36 * cab_back, offset + 3.2)
    ]
    return [
        Shape("polygon", "truck", frame),
        Shape("polygon", "bed", bed),
        Shape("polygon", "truck", cab),
        Shape("polygon", "window", window),
        Shape("line", "bed_edge", (at(offset, 0.75), at(offset, 2.45))),
        *wheels,
    ]
