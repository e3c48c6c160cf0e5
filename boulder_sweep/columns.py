"""Every column of the result table, in the order of the table: name, type, unit, meaning, and how it is computed.

This is the one register. The settings take the input columns from it, the judge computes the outcome columns
by it, the store takes its schema and field metadata from it, the command line and the documentation their
texts. Types are plain words that do not depend on any table library: ``int64``, ``float64`` or ``dictionary``
(a text column with few different values).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

ColumnType = Literal["int64", "float64", "dictionary"]
RowKind = Literal["all", "judged", "computed", "free", "rated", "overturned", "passing"]

VERDICTS = ("pass", "fail", "undecided", "error")
REASONS = (
    *("", "no_contact", "overturns", "penetration", "horizon", "error", "crush", "override", "foot", "shape"),
    *("slower_truck", "validity"),
)
"""The reasons of every verdict but ``error``, which has reasons of its own."""
WAY_OUT = {
    "foot": "soil that presses on a rounded foot also lifts, which is not modelled: bed it in concrete, cut it flat, "
    "or bury it deeper and test",
    "shape": "by its mass the boulder fills less than 40 % of the box of its length, width and height, and no shape is "
    "known that stands for it: check mass, density and sizes, or give its profile (boulder.profile or boulder.taper)",
    "validity": "the model does not hold beyond 20 deg of rotation, nor for a boulder less deep than 0.35 of its "
    "height that slides by more than 0.5 m: bury it deeper, or test it",
    "slower_truck": "a slower truck overturns it, which does not push it aside as far: bury it deeper",
}
"""What to do about a design for the reasons that more accuracy or a longer simulation does not resolve."""
GRADES = ("robust", "sensitive", "open")
"""What is known of a pass under other forms of the model."""
STANDINGS = ("paper", "paper;broms", "paper;width_capped", "paper;broms;width_capped")
"""Models that a pass stands under: the paper's motion, and second opinions by other soil models."""
SHAPES = ("narrower_downwards", "barrel", "narrower_upwards")
"""Shapes of which the worst stands for a boulder as taped and weighed (`boulder_sweep.stones.taped`), in the order in
which they are simulated: the one that most often fails first."""
RATINGS = ("P1", "P2", "P3")
"""Penetration ratings of ASTM F2656, the best first."""


@dataclass(frozen=True, slots=True)
class ColumnSpec:
    """One column of the table."""

    name: str
    """Name in the table; ends in its unit where it has one."""
    unit: str
    """Unit of the values, ``"1"`` for plain numbers, ``""`` for text and numbering."""
    meaning: str
    """One sentence for people who design barriers."""
    type: ColumnType = "float64"


@dataclass(frozen=True, slots=True)
class OutcomeColumn(ColumnSpec):
    """One column that a simulation fills."""

    value: Callable[[Any], np.ndarray] | None = None
    """From what the judge knows of n rows (`boulder_sweep.judge.verdict.Facts`) to the values of the column, shape
    (n,): numbers in `unit`, or codes. None of flags and grades, which take more than a formula."""
    rows: RowKind = "computed"
    """Which rows have a value; null elsewhere. *Judged* are all but errors, *computed* all that were simulated, *free*
    all simulated ones that were not stopped at the limit of the rotation, *rated* all whose penetration counts: neither
    overturned nor left undecided by anything but the numerical error. *Passing* rows have the verdict pass."""
    words: tuple[str, ...] = ()
    """What the codes of a dictionary column stand for; a row may add words of its own behind them. Code -1 is null."""


DESIGN_ID = ColumnSpec(
    "design_id", "", "number of the design: its position in the grid (last axis fastest), from 0", "int64"
)

INPUTS: tuple[ColumnSpec, ...] = (
    ColumnSpec("boulder_length_m", "m", "length L of the boulder along the direction of travel"),
    ColumnSpec("boulder_width_m", "m", "width W of the boulder across the direction of travel"),
    ColumnSpec("boulder_height_m", "m", "whole height H of the boulder, buried part included"),
    ColumnSpec("boulder_density_kg_m3", "kg/m^3", "density of the boulder"),
    ColumnSpec("embedment_depth_m", "m", "depth d of the boulder's foot below the soil line"),
    ColumnSpec("impact_height_m", "m", "height e of the impact above the soil line (Eq 9, or as given)"),
    ColumnSpec("soil_density_kg_m3", "kg/m^3", "density of the compacted soil"),
    ColumnSpec("friction_angle_deg", "deg", "effective friction angle of the soil"),
    ColumnSpec("subgrade_reaction_MN_m3", "MN/m^3", "constant of horizontal subgrade reaction of the soil"),
    ColumnSpec("strain_rate_factor", "1", "factor K_epsilon on the soil's strength under rapid loading"),
    ColumnSpec("vehicle_mass_kg", "kg", "mass of the vehicle with its ballast"),
    ColumnSpec("impact_speed_m_s", "m/s", "speed of the vehicle at first contact"),
    ColumnSpec("vehicle_spring_N_m", "N/m", "spring of the vehicle's front (Maxwell element)"),
    ColumnSpec("vehicle_damper_N_s_m", "N*s/m", "damper of the vehicle's front (Maxwell element)"),
    ColumnSpec("bumper_height_m", "m", "height of the underside of the vehicle's bumper over the ground"),
    ColumnSpec("hood_height_m", "m", "height of the top of the vehicle's hood over the ground"),
    ColumnSpec("bed_offset_m", "m", "distance from the front bumper to the leading edge of the cargo bed"),
)

OPTIONAL_INPUTS: tuple[ColumnSpec, ...] = (ColumnSpec("boulder_mass_kg", "kg", "mass of the boulder as weighed"),)
"""Inputs that a file may leave out without a default: their columns are in its tables only where it gives them."""


def _known(errors: np.ndarray) -> np.ndarray:
    """Return estimated errors, NaN where they are infinite: of two solutions only one overturned, or none agree."""
    return np.where(np.isfinite(errors), errors, np.nan)


OUTCOMES: tuple[OutcomeColumn, ...] = (
    OutcomeColumn(
        "verdict",
        "",
        "pass, fail, undecided or error",
        "dictionary",
        value=lambda facts: facts.verdict,
        rows="all",
        words=VERDICTS,
    ),
    OutcomeColumn(
        "reason",
        "",
        "why: empty for a pass; no_contact, overturns, penetration or slower_truck (it stops this truck, but a slower "
        "one overturns it) for a fail; horizon, error, crush, override, foot, shape or validity where undecided; or "
        "why the design could not be computed",
        "dictionary",
        value=lambda facts: facts.reason,
        rows="all",
        words=REASONS,
    ),
    OutcomeColumn(
        "margin",
        "1",
        "least distance to a limit as a fraction of that limit, positive where the design passes; "
        "null where it overturned, was not touched, fails by a slower truck, or is undecided for another reason than "
        "error",
        value=lambda facts: facts.margin,
        rows="rated",
    ),
    OutcomeColumn(
        "max_rotation_deg",
        "deg",
        "largest rotation of the boulder, in either direction, up to end_time_s",
        value=lambda facts: np.degrees(facts.outcomes.theta_max),
    ),
    OutcomeColumn(
        "max_displacement_m",
        "m",
        "largest displacement of the centre of mass of boulder and soil wedge, up to end_time_s",
        value=lambda facts: facts.outcomes.x_b_max,
    ),
    OutcomeColumn(
        "max_vehicle_displacement_m",
        "m",
        "largest displacement of the vehicle, up to end_time_s",
        value=lambda facts: facts.outcomes.x_v_max,
    ),
    OutcomeColumn(
        "peak_force_kN",
        "kN",
        "largest force between vehicle and boulder, up to end_time_s",
        value=lambda facts: facts.outcomes.F_v_max / 1000.0,
    ),
    OutcomeColumn(
        "penetration_m",
        "m",
        "how far the leading edge of the cargo bed gets beyond the far face of the boulder "
        "(negative: it stays short of it), up to end_time_s",
        value=lambda facts: facts.penetration,
    ),
    OutcomeColumn(
        "rating",
        "",
        "penetration rating reached (P1, P2, P3), by simulation, not by test; null beyond P3 and where margin is null",
        "dictionary",
        value=lambda facts: facts.rating,
        rows="rated",
        words=RATINGS,
    ),
    OutcomeColumn(
        "time_to_limit_s",
        "s",
        "time at which the rotation reached the limit; null where never",
        value=lambda facts: facts.outcomes.t_limit,
        rows="overturned",
    ),
    OutcomeColumn(
        "end_time_s",
        "s",
        "time simulated: until the rotation reached the limit, nothing could grow any more, or the horizon",
        value=lambda facts: facts.outcomes.t_end,
    ),
    OutcomeColumn(
        "rotation_error_deg",
        "deg",
        "estimated numerical error of max_rotation_deg; null where that is the limit itself, or where it is not known",
        value=lambda facts: np.degrees(_known(facts.outcomes.theta_error)),
        rows="free",
    ),
    OutcomeColumn(
        "displacement_error_m",
        "m",
        "estimated numerical error of the displacements; null where it is not known",
        value=lambda facts: _known(facts.outcomes.x_error),
    ),
    OutcomeColumn(
        "time_to_limit_error_s",
        "s",
        "estimated numerical error of time_to_limit_s: error of the displacements over the speed of impact",
        value=lambda facts: (
            _known(facts.outcomes.x_error) / np.where(facts.rows["overturned"], facts.designs.table.v_0, np.nan)
        ),
        rows="overturned",
    ),
    OutcomeColumn(
        "vehicle_crush_m",
        "m",
        "largest crush of the vehicle's front while it drives forward: displacement of the vehicle less the point of "
        "contact's",
        value=lambda facts: facts.outcomes.crush_max,
    ),
    OutcomeColumn(
        "overlap_m",
        "m",
        "height of the top of the boulder over the underside of the bumper",
        value=lambda facts: facts.overlap,
        rows="judged",
    ),
    OutcomeColumn(
        "solidity",
        "1",
        "volume of the boulder over the volume of the box of its length, width and height, by its mass and the density "
        "of its rock; 1 where no mass is given",
        value=lambda facts: facts.designs.solidity,
        rows="judged",
    ),
    OutcomeColumn(
        "shape",
        "",
        "of a boulder as taped and weighed, which fills less than 95 % of the box of its sizes: the shape that decides "
        "the verdict, the worst of those with its mass and sizes; null for any other",
        "dictionary",
        value=lambda facts: np.full(facts.designs.size, facts.designs.shape, dtype=np.int32),
        rows="judged",
        words=SHAPES,
    ),
    OutcomeColumn(
        "validity",
        "",
        "what lies outside what the model was tested on: flags joined by ; (docs/confidence.md), empty where nothing "
        "does; they do not change the verdict",
        "dictionary",
        rows="judged",
        words=("",),
    ),
    OutcomeColumn(
        "robustness",
        "",
        "of a pass: robust where it stands with friction and vertical motion under the weakest soil model, too, "
        "sensitive where it does not under a soil model that was asked, open where none was; null for no pass",
        "dictionary",
        rows="passing",
        words=GRADES,
    ),
    OutcomeColumn(
        "stands_under",
        "",
        "of a pass: of the models that were simulated, those it stands under, joined by ; (paper, broms, "
        "width_capped); null where there was no second opinion",
        "dictionary",
        value=lambda facts: np.full(facts.designs.size, -1, dtype=np.int32),  # before second opinions are asked
        rows="passing",
        words=STANDINGS,
    ),
    OutcomeColumn(
        "step_s",
        "s",
        "time step that decided the verdict, shortened further where stability asks for it",
        value=lambda facts: facts.outcomes.step,
    ),
)

TO_BUILD: tuple[ColumnSpec, ColumnSpec, ColumnSpec] = (
    ColumnSpec("height_above_ground_m", "m", "height of the top of the boulder above the ground"),
    ColumnSpec(
        "excavated_m3",
        "m^3",
        "soil to excavate: as wide as the boulder, on both sides as far as the wedge that the model relies on",
    ),
    ColumnSpec(
        "backfill_m3",
        "m^3",
        "compacted soil to put back: what is excavated less the buried part of the boulder",
    ),
)
"""What a design takes to build, beside the mass of the boulder; see `boulder_sweep.judge.quantities`.
In tables of answers and of `sweep export`; tables of runs have what they follow from."""

COLUMNS: tuple[ColumnSpec, ...] = (DESIGN_ID, *INPUTS, *OUTCOMES)
INPUT_COLUMNS: tuple[str, ...] = tuple(spec.name for spec in INPUTS)
OPTIONAL_COLUMNS: tuple[str, ...] = tuple(spec.name for spec in OPTIONAL_INPUTS)
BOULDER_MASS = "boulder_mass_kg"
"""Column of the mass of a weighed boulder."""
OUTCOME_COLUMNS: tuple[str, ...] = tuple(spec.name for spec in OUTCOMES)
BY_NAME: dict[str, ColumnSpec] = {spec.name: spec for spec in (*COLUMNS, *OPTIONAL_INPUTS, *TO_BUILD)}


def column_spec(name: str) -> ColumnSpec:
    """Return the register's entry of a column; any other column of a result is text from the settings file."""
    return BY_NAME.get(name) or ColumnSpec(name, "", "text that the settings file gives with the design", "dictionary")
