"""One row of a result, computed again from the result alone.

A result says in its metadata what it was computed with. That, and the inputs in the row, are enough to compute the row
once more, to compare it bit for bit, and to show what happened over time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_kernels import Control, Readings
from boulder_sweep.columns import BY_NAME, INPUT_COLUMNS, OPTIONAL_COLUMNS, OUTCOMES, OutcomeColumn
from boulder_sweep.designs import embedment_of_ratio
from boulder_sweep.impact.simulation import history_of
from boulder_sweep.judge.accuracy import goes_in_lanes, reported_step_s
from boulder_sweep.judge.evaluation import Evaluation
from boulder_sweep.judge.judged import worst_of
from boulder_sweep.judge.robustness import can_be_asked
from boulder_sweep.judge.verdict import limits_of
from boulder_sweep.locations import Location, location_of
from boulder_sweep.settings import Sweep
from boulder_sweep.settings.model import Criterion, Ground, Model, ReadingChoice, Shape, SolverSettings
from boulder_sweep.settings.sweep import DesignList, allowed_in, units_in
from boulder_sweep.settings.units import shown_settings
from boulder_sweep.store.part import part_table
from boulder_sweep.store.provenance import differences, identity, judged_by
from boulder_sweep.store.reading import FinishedRows

if TYPE_CHECKING:
    from boulder_sweep.impact.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Recomputation:
    """A row of a result, and what it is now."""

    design_id: int
    designs: int
    """Number of the row, and how many the result has."""
    sweep: Sweep
    """The one design, with the model and the step that its row was computed with."""
    inputs: dict[str, float | None]
    """Its inputs by the names of the table's columns."""
    stored: dict[str, Any]
    recomputed: dict[str, Any]
    """Its outcomes, as the table has them and as they come out now; None stands for null."""
    changed: tuple[str, ...]
    """What is different now from when the table was computed: versions, kernels, rules. Empty where nothing is."""
    trajectory: Trajectory | None
    """The impact over time; None where the design cannot be computed."""
    judged_by: str
    """Whose rules judged the row; empty where this version's did."""

    @property
    def unequal(self) -> tuple[str, ...]:
        """Outcomes that are not the same to the last bit."""
        return tuple(name for name, value in self.recomputed.items() if not _same(value, self.stored[name]))

    def compared(self, units: str = "si") -> dict[str, Any]:
        """Return how the row comes out now as plain data, in ``si`` or ``us`` units."""
        were, are = (
            shown_settings({name: outcomes[name] for name in self.unequal}, units)
            for outcomes in (self.stored, self.recomputed)
        )
        return {
            "same_bits": not self.unequal,
            "unequal": {name: [were[name], are[name]] for name in were},
            "changed_since": list(self.changed),
            "judged_by": self.judged_by,
        }


def recompute(out: str | Location, design_id: int) -> Recomputation:
    """Compute one row of the result in a folder again, from the result alone; the row must be in a finished part.

    Raise `StoreError` where there is no result in the folder, or it is damaged, and IndexError where the table has no
    such row, or not yet.
    """
    folder = location_of(out)
    finished = FinishedRows(folder)
    there = finished.identity
    row = finished.row(design_id)
    values = row.to_pylist()[0]
    inputs = {name: values[name] for name in (*INPUT_COLUMNS, *OPTIONAL_COLUMNS) if name in values}
    control, readings = Control(**there["control"]), Readings(**there["readings"])
    name = there["settings"]["name"]
    called = name if finished.rows == 1 else f"{name} #{design_id}"
    sweep = one_design(
        there["settings"] | {"name": called}, inputs, control, values["step_s"] or reported_step_s(control)
    )
    stated = (there["settings"], there["readings"], there["control"], there.get("accuracy"))
    limits = limits_of(sweep)._replace(rotation=control.theta_limit)
    block = sweep.block(0, 1)
    laws = sweep.model.second_opinion if can_be_asked(sweep) else ()
    many = goes_in_lanes(2, there["settings"]["n_designs"])
    evaluation = Evaluation(readings, control, limits, model=sweep.model, second_opinion=laws, barrels_in_lanes=many)
    cases = evaluation.by_case(block)
    again = part_table(block, worst_of(cases), {}).to_pylist()[0]
    return Recomputation(
        design_id=design_id,
        designs=finished.rows,
        sweep=sweep,
        inputs=inputs,
        stored={name: value for name, value in values.items() if isinstance(BY_NAME.get(name), OutcomeColumn)},
        recomputed={spec.name: again[spec.name] for spec in OUTCOMES},
        changed=tuple(differences(there, identity(*stated))),
        trajectory=None if block.reasons[0] else history_of(sweep, 0, evaluation, cases),
        judged_by=judged_by(there),
    )


def one_design(settings: dict[str, Any], inputs: dict[str, float | None], control: Control, step_s: float) -> Sweep:
    """Return a sweep of the one design, with the model and the step its row was computed with, and its cases.

    Raise LookupError where the table does not list the values of its uncertain inputs, because there are too many.
    """
    at = [_in_case(case, settings["inputs"], inputs) for case in settings.get("judged_at", ())]
    cases = tuple(one_design(settings | {"judged_at": ()}, case, control, step_s) for case in at)
    given = {name: float(value) for name, value in inputs.items() if value is not None}
    is_listed = settings["order"] == "table"
    return Sweep(
        cases=cases,
        name=settings["name"],
        path=None,
        axes=(),
        constants={} if is_listed else given,
        table=DesignList("", {name: np.array([value]) for name, value in given.items()}) if is_listed else None,
        criterion=Criterion(**settings["criterion"]),
        model=model_of(settings, control),
        solver=SolverSettings(accuracy=None, step_s=step_s, horizon_s=control.horizon),
        units=units_in(settings),
        allowed=allowed_in(settings),
    )


def _in_case(case: dict[str, Any], given: dict[str, Any], inputs: dict[str, float | None]) -> dict[str, float | None]:
    """Return the inputs of a row in a case, by the place of its own values among the values of the settings.

    A case has what was taken in it, and the values of these inputs by column name: a number, or a list. `given` are all
    inputs of the table by the same names, `inputs` the row's.
    """
    height = inputs["boulder_height_m"]
    own = inputs | {"embedment_ratio": inputs["embedment_depth_m"]}  # of a list of ratios the depths are compared
    found = dict(inputs)
    if isinstance(given["impact_height_m"], str):
        del found["impact_height_m"]  # it follows from what may be uncertain
    for name in case["taken_at"]:
        values, taken = case[name], given[name]
        ratio = name == "embedment_ratio"
        if isinstance(values, list):
            places = embedment_of_ratio(np.array(taken), np.array(height)).tolist() if ratio else taken
            values = values[places.index(own[name])]
        elif not isinstance(values, float):
            raise LookupError("the table does not list the values of its uncertain inputs")
        found[name] = values
        if ratio:
            del found["embedment_depth_m"]
    return found


def model_of(settings: dict[str, Any], control: Control) -> Model:
    """Return the model of a table by its settings."""
    model = settings["model"]
    return Model(
        ReadingChoice(**model["readings"]),
        control.elements,
        model["calibrated_crush_m"],
        model["resistance"],
        second_opinion=tuple(model.get("second_opinion", ())),
        foot=model["foot"],
        profile=Shape.of_model(model).points,
        rock_assumed=model.get("rock_assumed", False),
        **Ground.of_dict(model.get("ground", {})).fields(),
    )


def _same(a: Any, b: Any) -> bool:
    """Whether two values are the same to the last bit."""
    if isinstance(a, float) and isinstance(b, float):
        return np.float64(a).tobytes() == np.float64(b).tobytes()
    return a == b
