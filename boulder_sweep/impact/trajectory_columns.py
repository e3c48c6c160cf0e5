"""Every column of a time history: name, type, unit, meaning. The one register of trajectories and their ledger."""

from __future__ import annotations

from boulder_sweep.columns import ColumnSpec


def _number(name: str, unit: str, meaning: str) -> ColumnSpec:
    return ColumnSpec(name, "float64", unit, meaning)


HISTORY: tuple[ColumnSpec, ...] = (
    _number("time_s", "s", "time since the first touch"),
    _number("boulder_displacement_m", "m", "displacement x_b of the common centre of mass of boulder and soil wedge"),
    _number(
        "boulder_centre_displacement_m",
        "m",
        "displacement of the boulder's own centre of mass, as a camera tracks it (Eqs 53 to 55, corrected)",
    ),
    _number("boulder_velocity_m_s", "m/s", "velocity of the common centre of mass"),
    _number("rotation_rad", "rad", "rotation theta_b of the boulder, positive with its top away from the vehicle"),
    _number("angular_velocity_rad_s", "rad/s", "angular velocity of the boulder"),
    _number("vehicle_displacement_m", "m", "displacement x_v of the vehicle"),
    _number("vehicle_velocity_m_s", "m/s", "velocity of the vehicle"),
    _number("vehicle_acceleration_m_s2", "m/s^2", "acceleration of the vehicle"),
    _number("contact_force_N", "N", "force F_v of the vehicle on the boulder (Eq 47)"),
    _number("contact_moment_N_m", "N*m", "its moment M_v about the common centre of mass (Eq 48)"),
    _number("soil_force_N", "N", "sum of the soil's forces on the boulder (Eq 19)"),
    _number("soil_moment_N_m", "N*m", "sum of the soil's moments about the common centre of mass (Eq 20)"),
    _number("restoring_moment_N_m", "N*m", "restoring moment M_R of the boulder's weight (Eqs 37 to 39)"),
    ColumnSpec("rotation_mode", "dictionary", "", "seated, turning, held, limited or free"),
    ColumnSpec("in_contact", "dictionary", "", "touching or coasting"),
)

ENERGY: tuple[ColumnSpec, ...] = (
    _number("energy_vehicle_kinetic_J", "J", "kinetic energy of the vehicle"),
    _number("energy_crush_spring_J", "J", "stored in the spring of the vehicle's front"),
    _number("energy_crush_damper_J", "J", "dissipated in the damper of the vehicle's front: permanent crush"),
    _number("energy_boulder_linear_J", "J", "kinetic energy of boulder and soil wedge in translation"),
    _number("energy_boulder_angular_J", "J", "kinetic energy of boulder and soil wedge in rotation"),
    _number("energy_soil_elastic_J", "J", "stored in the springs of the soil"),
    _number("energy_soil_plastic_J", "J", "plastic work of the soil; 0 in elastic soil"),
    _number("energy_soil_drag_J", "J", "dissipated by the drag of the soil"),
    _number(
        "energy_gravity_J",
        "J",
        "done against the boulder's weight: potential energy of the gravity couple; as printed the work of M_R",
    ),
    _number(
        "energy_pull_J",
        "J",
        "printed separation only: work of the pull on the vehicle that nothing on the boulder answers, negative "
        "where energy appears from nowhere",
    ),
    _number("energy_residual_J", "J", "sum of all parts minus the vehicle's energy at first touch"),
)

SPENT = _number(
    "energy_crush_spent_J", "J", "spent where the second spring of the vehicle's front took over: permanent crush"
)
"""Of vehicles with a second spring only."""

BY_NAME: dict[str, ColumnSpec] = {spec.name: spec for spec in (*HISTORY, *ENERGY, SPENT)}
