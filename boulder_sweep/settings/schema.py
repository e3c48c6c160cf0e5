"""The typed settings: which blocks and keys there are and what each may hold.

pydantic walks the blocks and reports every mistake of a block at once; the leaves are read by `leaf`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, PlainValidator, ValidationError, ValidationInfo, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from boulder_sweep.settings.bounds import MAX_ELEMENTS
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.leaf import Leaf, LeafError, Mistake, read_leaf, read_single
from boulder_sweep.settings.model import ACCURACIES, CLOSED_FORM, PRESETS, PRINTED, RATINGS, SWITCHES, ReadingChoice
from boulder_sweep.settings.numbers import NumberError, read_count, split_number
from boulder_sweep.settings.problems import did_you_mean, shorten
from boulder_sweep.settings.tree import Mapping, Node, Scalar

T = TypeVar("T")


def _reader(read: Callable[[Node], T]) -> PlainValidator:
    """Return `read` as a validator of pydantic: all mistakes of an entry, each with its own place.

    What could be read is left in the validation context under the key's name, so that it can be compared with
    other entries even if its block holds a mistake elsewhere.
    """

    def validate(node: Any, info: ValidationInfo) -> T:
        try:
            value = read(node)
            if info.context is not None:
                info.context[info.field_name] = value
            return value
        except LeafError as error:
            lines = [
                InitErrorDetails(
                    type=PydanticCustomError("entry", "{message}", {"message": m.message, "place": m.place}),
                    loc=(),
                    input=None,
                )
                for m in error.mistakes
            ]
            raise ValidationError.from_exception_data("entry", lines) from None

    return PlainValidator(validate)


def _quantity(name: str) -> PlainValidator:
    field = BY_NAME[name]
    return _reader(lambda node: read_leaf(node, field))


def _wrong(node: Node, message: str) -> LeafError:
    return LeafError([Mistake(node.place, message)])


def _shown(node: Node) -> str:
    return f"'{shorten(node.text)}'" if isinstance(node, Scalar) else "this"


def _one_of(node: Node, choices: tuple[str, ...], what: str) -> str:
    """Return one of some words; capitals do not matter."""
    word = node.text.strip() if isinstance(node, Scalar) else ""
    for choice in choices:
        if word.lower() == choice.lower():
            return choice
    raise _wrong(node, f"{_shown(node)} is not {what}: {', '.join(choices)}{did_you_mean(word, choices)}")


def _read_readings(node: Node) -> ReadingChoice:
    """Read a preset, or single switches on top of one (``corrected`` where none is named)."""
    if not isinstance(node, Mapping):
        return ReadingChoice.of_preset(_one_of(node, PRESETS, "a reading of the paper"))
    mistakes: list[Mistake] = []
    preset, switches = "corrected", {}
    for entry in node:
        try:
            if entry.key == "preset":
                preset = _one_of(entry.value, PRESETS, "a reading of the paper")
            elif entry.key in SWITCHES:
                value = _one_of(entry.value, (PRINTED, SWITCHES[entry.key], "corrected"), f"a value of {entry.key}")
                switches[entry.key] = SWITCHES[entry.key] if value == "corrected" else value
            else:
                known = ("preset", *SWITCHES)
                hint = did_you_mean(entry.key, known)
                message = f"'{shorten(entry.key)}' is not a reading ({', '.join(known)}){hint}"
                mistakes.append(Mistake(entry.place, message))
        except LeafError as error:
            mistakes.extend(error.mistakes)
    if mistakes:
        raise LeafError(mistakes)
    return ReadingChoice(**{**ReadingChoice.of_preset(preset).as_dict(), **switches})


def _read_soil(node: Node) -> int:
    """Read ``closed_form`` (0) or ``{elements: N}`` (N)."""
    if isinstance(node, Mapping) and list(node.entries) == ["elements"]:
        count = node.entries["elements"].value
        try:
            return read_count(count, "the number of soil elements", MAX_ELEMENTS)
        except NumberError as error:
            raise _wrong(count, str(error)) from None
    if isinstance(node, Scalar) and node.text.strip() == CLOSED_FORM:
        return 0
    raise _wrong(node, f"{_shown(node)} is not a representation of the soil: closed_form, or {{elements: 5000}}")


def _read_accuracy(node: Node) -> str | float:
    """Read a name, or an admitted error of the rotation in degrees."""
    if isinstance(node, Scalar):
        word = node.text.strip()
        if word in ACCURACIES:
            return word
        try:
            split_number(node.text, "deg")
        except NumberError:
            choices = ", ".join(ACCURACIES)
            hint = did_you_mean(word, ACCURACIES)
            raise _wrong(node, f"{_shown(node)} is not {choices}, nor an angle such as 0.01 deg{hint}") from None
    return read_single(node, "accuracy_deg", "deg")


class Section(BaseModel):
    """One block of the file: known keys only."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True)

    @model_validator(mode="before")
    @classmethod
    def _open(cls, node: Any) -> Any:
        if isinstance(node, Mapping) and node.unit is None:
            return {entry.key: entry.value for entry in node}
        keys = ", ".join(cls.model_fields)
        raise PydanticCustomError(
            "entry", "{message}", {"message": f"must be a block of keys: {keys}", "place": node.place}
        )


class Boulder(Section):
    """The boulder, a box: its size and density."""

    length: Annotated[Leaf | None, _quantity("boulder_length_m")] = None
    width: Annotated[Leaf | None, _quantity("boulder_width_m")] = None
    height: Annotated[Leaf | None, _quantity("boulder_height_m")] = None
    density: Annotated[Leaf | None, _quantity("boulder_density_kg_m3")] = None


class Site(Section):
    """How it stands in the ground."""

    embedment_ratio: Annotated[Leaf | None, _quantity("embedment_ratio")] = None
    embedment_depth: Annotated[Leaf | None, _quantity("embedment_depth_m")] = None
    impact_height: Annotated[Leaf | None, _quantity("impact_height_m")] = None


class Soil(Section):
    """The soil around it."""

    density: Annotated[Leaf | None, _quantity("soil_density_kg_m3")] = None
    friction_angle: Annotated[Leaf | None, _quantity("friction_angle_deg")] = None
    subgrade_reaction: Annotated[Leaf | None, _quantity("subgrade_reaction_MN_m3")] = None
    strain_rate_factor: Annotated[Leaf | None, _quantity("strain_rate_factor")] = None


class Vehicle(Section):
    """The vehicle: mass, speed and the Maxwell element of its front."""

    mass: Annotated[Leaf | None, _quantity("vehicle_mass_kg")] = None
    speed: Annotated[Leaf | None, _quantity("impact_speed_m_s")] = None
    spring: Annotated[Leaf | None, _quantity("vehicle_spring_N_m")] = None
    damper: Annotated[Leaf | None, _quantity("vehicle_damper_N_s_m")] = None
    bumper_height: Annotated[Leaf | None, _quantity("bumper_height_m")] = None
    hood_height: Annotated[Leaf | None, _quantity("hood_height_m")] = None
    bed_offset: Annotated[Leaf | None, _quantity("bed_offset_m")] = None


class CriterionBlock(Section):
    """What a design must hold."""

    max_rotation: Annotated[float, _reader(lambda node: read_single(node, "max_rotation_deg", "deg"))] = 20.0
    rating: Annotated[str, _reader(lambda node: _one_of(node, RATINGS, "a penetration rating"))] = "P1"


class ModelBlock(Section):
    """Which reading of the paper, which representation of the soil."""

    readings: Annotated[ReadingChoice, _reader(_read_readings)] = ReadingChoice()
    soil: Annotated[int, _reader(_read_soil)] = 0


class SolverBlock(Section):
    """How finely and how long a design is simulated."""

    accuracy: Annotated[str | float | None, _reader(_read_accuracy)] = None
    step: Annotated[float | None, _reader(lambda node: read_single(node, "step_s", "s"))] = None
    horizon: Annotated[float, _reader(lambda node: read_single(node, "horizon_s", "s"))] = 1.0


BLOCKS: dict[str, type[Section]] = {
    "boulder": Boulder,
    "site": Site,
    "soil": Soil,
    "vehicle": Vehicle,
    "criterion": CriterionBlock,
    "model": ModelBlock,
    "solver": SolverBlock,
}
