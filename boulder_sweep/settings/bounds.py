"""What values are admitted at all, and what values are realistic.

The admitted box is wide: at least a million times either side of what is normal wherever a material or
mechanical constant is concerned, and every design in it ends in an answer. Beyond it a value is a slip of
the pen and refused. Outside the realistic ranges a value is computed as given, with a remark.
"""

from __future__ import annotations

from typing import NamedTuple


class Bound(NamedTuple):
    """Smallest and largest value admitted, ends included, and why there is an end."""

    low: float
    high: float
    reason: str


class Realistic(NamedTuple):
    """Range met in practice, and what to think of when a value lies outside."""

    low: float
    high: float
    remark: str


_SIZE = "the model is for boulders between a pebble and a house"
_DENSITY = "a million times lighter or heavier than rock or soil"
_CONSTANT = "a million times softer or harder than a truck or soil"

# By the name of the column (or axis), in its unit.
ADMITTED: dict[str, Bound] = {
    "boulder_length_m": Bound(0.01, 20.0, _SIZE),
    "boulder_width_m": Bound(0.01, 20.0, _SIZE),
    "boulder_height_m": Bound(0.01, 20.0, _SIZE),
    "boulder_density_kg_m3": Bound(1e-3, 1e10, _DENSITY),
    "embedment_ratio": Bound(1e-6, 1.0, "the part of the boulder's height that is buried, 0.55 or 55 %"),
    "embedment_depth_m": Bound(1e-6, 20.0, "a boulder that is not embedded is outside the model"),
    "impact_height_m": Bound(0.0, 20.0, "counted upwards from the soil line"),
    "soil_density_kg_m3": Bound(1e-3, 1e10, _DENSITY),
    "friction_angle_deg": Bound(1.0, 60.0, "no soil has less or more, and the passive coefficient diverges at 90"),
    "subgrade_reaction_MN_m3": Bound(1e-6, 1e9, _CONSTANT),
    "strain_rate_factor": Bound(0.1, 10.0, "1.0 means no gain of strength under rapid loading"),
    "vehicle_mass_kg": Bound(1e-3, 1e10, "a million times lighter or heavier than a truck"),
    "impact_speed_m_s": Bound(0.0, 100.0, "up to 360 km/h"),
    "vehicle_spring_N_m": Bound(1.0, 1e13, _CONSTANT),
    "vehicle_damper_N_s_m": Bound(0.1, 1e12, _CONSTANT),
    "bumper_height_m": Bound(0.0, 20.0, "counted upwards from the ground"),
    "hood_height_m": Bound(0.0, 20.0, "counted upwards from the ground"),
    "bed_offset_m": Bound(0.0, 30.0, "counted backwards from the front bumper"),
    "max_rotation_deg": Bound(0.01, 90.0, "the model holds up to about 20 deg"),
    "horizon_s": Bound(1e-4, 100.0, "an impact is over within a second or so"),
    "step_s": Bound(1e-7, 1.0, "a step of some milliseconds is usual"),
    "accuracy_deg": Bound(1e-9, 10.0, "error of the rotation that is admitted"),
}

MAX_ELEMENTS = 1_000_000
"""Most soil elements per design."""

REALISTIC: dict[str, Realistic] = {
    "boulder_length_m": Realistic(0.6, 2.0, "usual boulders"),
    "boulder_width_m": Realistic(0.8, 2.5, "usual boulders"),
    "boulder_height_m": Realistic(1.5, 4.0, "usual boulders"),
    "boulder_density_kg_m3": Realistic(2400.0, 3074.0, "rock; a bare number is in kg/m^3, not in t/m^3 or pcf"),
    "embedment_ratio": Realistic(0.35, 0.75, "usual embedments"),
    "soil_density_kg_m3": Realistic(1520.0, 2240.0, "sand and gravel; a bare number is in kg/m^3, not in t/m^3 or pcf"),
    "friction_angle_deg": Realistic(27.0, 49.0, "loose sand to very dense gravel; a bare number is in degrees"),
    "subgrade_reaction_MN_m3": Realistic(2.0, 110.0, "loose to very dense sand; a bare number is in MN/m^3"),
    "strain_rate_factor": Realistic(1.0, 1.2, "rapid loading of sand"),
    "vehicle_mass_kg": Realistic(1000.0, 30000.0, "car to heavy truck; a bare number is in kg, not in lb"),
    "impact_speed_m_s": Realistic(4.0, 25.0, "15 to 90 km/h; a bare number is in m/s, not in mph or km/h"),
    "vehicle_spring_N_m": Realistic(2e5, 5e7, "truck fronts; a bare number is in N/m, not in kN/m"),
    "vehicle_damper_N_s_m": Realistic(1e4, 2e6, "truck fronts; a bare number is in N*s/m, not in kN*s/m"),
    "bumper_height_m": Realistic(0.4, 0.7, "underside of a truck's bumper"),
    "hood_height_m": Realistic(1.3, 1.6, "medium-duty trucks"),
    "bed_offset_m": Realistic(
        2.5, 3.2, "front bumper to leading edge of the cargo bed; penetration is counted from that edge"
    ),
    "max_rotation_deg": Realistic(1.0, 20.0, "beyond 20 deg the model no longer holds and a truck may ramp up"),
}
