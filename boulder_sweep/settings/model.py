"""The settings that are not columns: what an attribute declares with `setting` is read and documented by it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep.columns import RATINGS
from boulder_sweep.settings.problems import Position
from boulder_sweep.settings.units import rounded
from boulder_sweep.stones.rock import ROCKS, is_flat

PRESETS = ("as_printed", "corrected")

SWITCHES: dict[str, str] = {
    "inertia": "box",
    "impact_arm": "geometric",
    "contact": "left_face",
    "restoring": "gravity",
    "separation": "released",
}
"""The five readings of the paper, in the order of the kernels, each with the name of its corrected form."""

PRINTED = "printed"
ACCURACIES = ("fast", "balanced", "fine")
CLOSED_FORM = "closed_form"
WATER_KG_M3 = 1000.0
RESISTANCES = ("kp_squared", "broms", "width_capped")
"""Laws of the ultimate resistance of the soil; the first is the paper's."""
SECOND_OPINIONS = RESISTANCES[1:]
USUAL_OPINION = SECOND_OPINIONS[-1:]
"""The law that is asked where nothing else is said: the one that decides."""
NO_OPINION = "none"
"""Stands in a file for no second opinion."""

FEET = ("flat", "rounded")
"""Shapes of the underside of a boulder; only the first is modelled."""
FOOT_WORDS = {
    "flat": "foot: flat (boulder.foot); a rounded one is not modelled",
    "rounded": "foot: rounded (boulder.foot), which is not modelled",
}
"""Note on the foot in every answer."""

BOUNDED = ("uniform", "triangular", "beta")
"""Kinds that reach from one end to the other; others are truncated at theirs."""
KINDS = ("normal", "lognormal", *BOUNDED)
ENOUGH_ELEMENTS = 200
"""Soil elements that come near their limit; a note says what fewer cost."""


class Bound(NamedTuple):
    """Smallest and largest value admitted, ends included, and why there is an end."""

    low: float
    high: float
    reason: str


class Usual(NamedTuple):
    """Range met in practice, and what to think of when a value lies outside."""

    low: float
    high: float
    remark: str


@dataclass(frozen=True, slots=True)
class Field:
    """One entry of the file, ``section: {key: ...}``."""

    section: str
    key: str
    name: str  # its column; of other inputs the axis, of settings the attribute that holds it
    unit: str  # of a bare number, and of the column; empty for words
    meaning: str
    admitted: Bound | None = None
    usual: Usual | None = None
    default: float | None = None  # of an input; settings have the defaults of the attributes that declare them
    also: tuple[str, ...] = ()  # other words people try, for "did you mean"
    optional: bool = False  # whether a file may be complete without it
    choices: tuple[str, ...] = ()  # words of which it is one
    kind: str = ""  # what such a word is, as in "P9 is not a penetration rating"
    shown_default: float | str | None = None  # what holds without it, as a file has it: a number in `unit`, or a word
    held: bool = False
    """Whether a value far outside the usual range is refused unless the file allows it: a slip of the unit decides more
    about a mass than about a length."""

    @property
    def path(self) -> str:
        """Dotted key in the settings file."""
        return f"{self.section}.{self.key}"


def setting(path: str, meaning: str, default: Any = MISSING, *, unit: str = "", **more: Any) -> Any:
    """Declare an attribute of a dataclass as an entry of the file, which must give it where there is no default.

    `more` are further attributes of `Field`; a default that is a number or a word is shown as it is.
    """
    section, _, key = path.rpartition(".")
    if isinstance(default, float | str):
        more.setdefault("shown_default", default)
    return field(default=default, metadata={"entry": Field(section, key, "", unit, meaning, **more)})


def entries_of(part: type[Any]) -> list[Field]:
    """Return the entries that the attributes of a dataclass declare, in their order."""
    declared = ((attribute.name, attribute.metadata.get("entry")) for attribute in fields(part))
    return [replace(entry, name=name) for name, entry in declared if entry is not None]


@dataclass(frozen=True, slots=True)
class ProfilePoint:
    """One point of a profile, as shares of the height, the width and the length of the boulder.

    It reaches `near` towards the vehicle and `far` away from it, from the middle of its foot.
    """

    height: float
    width: float
    near: float
    far: float


BOX = (ProfilePoint(0.0, 1.0, 0.5, 0.5), ProfilePoint(1.0, 1.0, 0.5, 0.5))


@dataclass(frozen=True, slots=True)
class Shape:
    """The shape of the boulders of a file: points from the foot to the top, linear between them; none for a box."""

    points: tuple[ProfilePoint, ...] = ()

    @property
    def is_box(self) -> bool:
        """Whether width and faces are the same at every height."""
        return len({(point.width, point.near, point.far) for point in self.points}) <= 1

    @property
    def taper(self) -> float | None:
        """Width and length of the top over width and length of the foot, if that says it all; 1 for a box."""
        if self.is_box:
            return 1.0
        both = all(point.near == point.far == 0.5 * point.width for point in self.points)
        return self.points[-1].width / self.points[0].width if both and len(self.points) == 2 else None

    @property
    def stands_flat(self) -> bool:
        """Whether the foot is at least half as wide and as long as the largest section."""
        if not self.points:
            return True
        foot, longest = self.points[0], max(point.near + point.far for point in self.points)
        return is_flat(foot.width, 1.0) and is_flat(foot.near + foot.far, longest)

    @property
    def filled(self) -> float:
        """Volume over the box's of height, width and length: the integral of w l, by Simpson's rule exactly."""
        return self._integral(lambda near, far: near + far)

    @property
    def centre(self) -> float:
        """Centre of mass before the middle of the foot, away from the vehicle, as a share of the length."""
        return self._integral(lambda near, far: 0.5 * (far * far - near * near)) / self.filled

    @property
    def stands_up(self) -> bool:
        """Whether the centre of mass lies over the foot."""
        foot = (self.points or BOX)[0]
        return -foot.near < self.centre < foot.far

    def _integral(self, of_length: Any) -> float:
        """Integral over the height of the width times something of the reaches, at most of second degree."""
        total = 0.0
        for low, high in pairwise(self.points or BOX):
            middle = (0.5 * (getattr(low, name) + getattr(high, name)) for name in ("width", "near", "far"))
            ends = ((one.width, one.near, one.far) for one in (low, high))
            values = [w * of_length(near, far) for w, near, far in (*ends, tuple(middle))]
            total += (high.height - low.height) / 6.0 * (values[0] + values[1] + 4.0 * values[2])
        return total

    @classmethod
    def of_model(cls, model: Mapping[str, Any]) -> Shape:
        """Return the shape in the part `model` of resolved settings; a box where that has none."""
        return cls(tuple(ProfilePoint(**point) for point in model.get("profile", [])))

    @property
    def words(self) -> str:
        """What it is; empty for a box."""
        if self.is_box:
            return ""
        foot, top = self.points[0], self.points[-1]
        if len(self.points) == 2 and foot.near == foot.far and top.near == top.far:
            return f"boulder tapered, its top {top.width / foot.width:.3g} times as wide as its foot"
        return f"boulder by a profile of {len(self.points)} points"


@dataclass(frozen=True, slots=True)
class Scan:
    """The scan from which the shape of the boulder comes, and how the boulder stands."""

    file: str  # as it is named in the settings
    sha256: str  # of its content
    up: str  # the end of the boulder that is up
    facing: str  # the end that faces the vehicle
    cut_m: float  # what is cut off below for a flat foot [m]


def tapered(ratio: float) -> Shape:
    """Return the shape of a boulder whose top is `ratio` times as wide and as long as its foot."""
    if ratio == 1.0:
        return Shape()
    foot, top = (1.0, ratio) if ratio < 1.0 else (1.0 / ratio, 1.0)
    return Shape((ProfilePoint(0.0, foot, 0.5 * foot, 0.5 * foot), ProfilePoint(1.0, top, 0.5 * top, 0.5 * top)))


@dataclass(frozen=True, slots=True)
class Distribution:
    """Spread of one input about its mean, in the unit of its column.

    The mean is not in here: it is the value of the constant or axis of the same name in the sweep, so a grid may have
    several means with one spread. Normal and lognormal distributions are truncated at the ends, and have their mean and
    deviation before truncation; the others reach from one end to the other.
    """

    kind: str  # one of `KINDS`
    low: float  # the admitted range where the file names no ends
    high: float
    sd: float | None = None  # None where `cov` stands for it, or the ends decide (uniform, triangular)
    cov: float | None = None  # coefficient of variation, the standard deviation as a fraction of the mean
    mode: float | None = None  # most likely value; triangular only
    position: Position = field(default_factory=lambda: Position(""), compare=False)

    def deviation(self, mean: np.ndarray) -> np.ndarray:
        """Return the standard deviation before truncation for some means; uniform and triangular have their own."""
        mean = np.asarray(mean, dtype=np.float64)
        if self.kind == "uniform":
            return np.full(mean.shape, (self.high - self.low) / math.sqrt(12.0))
        if self.kind == "triangular":
            a, b, c = self.low, self.high, self.own_mode
            return np.full(mean.shape, math.sqrt((a * a + b * b + c * c - a * b - a * c - b * c) / 18.0))
        return np.full(mean.shape, self.sd) if self.cov is None else self.cov * mean

    @property
    def own_mode(self) -> float:
        """The most likely value of a triangular distribution."""
        assert self.mode is not None
        return self.mode

    def words(self, unit: str, size: float = 1.0) -> str:
        """Return kind and spread in words, in a unit of which one is `size` in the unit of the column."""
        unit = "" if unit == "1" else f" {unit}"
        sd, mode = (None if value is None else f"{rounded(value / size)}{unit}" for value in (self.sd, self.mode))
        spread = f"sd {sd}" if self.cov is None else f"cov {rounded(100.0 * self.cov)} %"
        ends = f"{rounded(self.low / size)} to {rounded(self.high / size)}{unit}"
        return {
            "uniform": f"uniform, {ends}",
            "triangular": f"triangular, {ends}, most likely {mode}",
            "beta": f"beta, {spread}, {ends}",
        }.get(self.kind, f"{self.kind}, {spread}")

    def to_dict(self) -> dict[str, float | str]:
        """Return what is given as plain data."""
        named = {"kind": self.kind, "sd": self.sd, "cov": self.cov, "low": self.low, "high": self.high}
        return {name: value for name, value in {**named, "mode": self.mode}.items() if value is not None}


@dataclass(frozen=True, slots=True)
class SetDistributions:
    """Spread of one input of named soils or vehicles, each its own."""

    section: str  # ``soil`` or ``vehicle``; under this name a row carries the index of its set
    each: tuple[Distribution | None, ...]  # in the order of the sets; None where a set gives a value

    def words(self, unit: str, size: float = 1.0) -> str:
        """Return kind and spread of each in words; see `Distribution.words`."""
        return "; ".join("certain" if spread is None else spread.words(unit, size) for spread in self.each)

    def to_dict(self) -> dict[str, Any]:
        """Return what is given as plain data."""
        return {"sets": [None if spread is None else spread.to_dict() for spread in self.each]}


@dataclass(frozen=True, slots=True)
class Criterion:
    """What a design must hold."""

    max_rotation_deg: float = setting(
        "criterion.max_rotation",
        "rotation at which the boulder counts as overturned",
        20.0,
        unit="deg",
        admitted=Bound(0.01, 90.0, "the model holds up to about 20 deg"),
        usual=Usual(1.0, 20.0, "beyond 20 deg the model no longer holds and a truck may ramp up"),
    )
    rating: str = setting(
        "criterion.rating", "penetration rating required", "P1", choices=RATINGS, kind="a penetration rating"
    )
    min_overlap_m: float = setting(
        "criterion.min_overlap",
        "least height of the boulder's top over the underside of the bumper; with less the truck may ride over",
        0.25,
        unit="m",
        admitted=Bound(0.0, 20.0, "counted upwards from the underside of the bumper"),
        also=("overlap", "engagement"),
    )


@dataclass(frozen=True, slots=True)
class ReadingChoice:
    """How each equation that is misprinted in the paper is read: ``printed`` or the corrected form's name."""

    inertia: str = SWITCHES["inertia"]
    impact_arm: str = SWITCHES["impact_arm"]
    contact: str = SWITCHES["contact"]
    restoring: str = SWITCHES["restoring"]
    separation: str = SWITCHES["separation"]

    @classmethod
    def of_preset(cls, preset: str) -> ReadingChoice:
        """Return all five readings of ``as_printed`` or ``corrected``."""
        return cls() if preset == "corrected" else cls(**dict.fromkeys(SWITCHES, PRINTED))

    @property
    def preset(self) -> str:
        """``as_printed``, ``corrected``, or ``mixed`` where the switches are neither."""
        return next((preset for preset in PRESETS if self == self.of_preset(preset)), "mixed")

    @property
    def corrected(self) -> tuple[bool, ...]:
        """Which readings are corrected, in the order of the kernels."""
        return tuple(reading != PRINTED for reading in asdict(self).values())


@dataclass(frozen=True, slots=True)
class Layer:
    """One layer of soil below the uppermost, down to the next; `from_m` is the depth of its upper boundary."""

    from_m: float
    density_kg_m3: float
    friction_angle_deg: float
    subgrade_reaction_MN_m3: float
    cohesion_kPa: float = 0.0


@dataclass(frozen=True, slots=True)
class Ground:
    """In what the soil differs from a dry, level one without cohesion that is the same at every depth."""

    layers: tuple[Layer, ...] = ()  # from the top down, below the uppermost, which the inputs describe
    cohesion_kPa: float = 0.0  # effective cohesion of the uppermost
    water_table_m: float | None = None  # depth below the soil line; None where it is out of reach
    slope_deg: float = 0.0  # angle at which the ground falls away behind the boulder

    @property
    def is_usual(self) -> bool:
        """Whether the ground is dry, level, uniform and cohesionless."""
        return self == Ground()

    @property
    def is_proportional(self) -> bool:
        """Whether the resistance grows in proportion to depth, as in the paper's soil."""
        return not self.layers and self.cohesion_kPa == 0.0 and self.water_table_m in (None, 0.0)

    def words_in(self, length: tuple[str, float], pressure: tuple[str, float]) -> str:
        """Return what there is of it, in units with their sizes in m and kPa; empty where there is nothing."""
        cohesions = [self.cohesion_kPa, *(layer.cohesion_kPa for layer in self.layers)]
        shown = " / ".join(f"{cohesion / pressure[1]:.4g}" for cohesion in cohesions)
        water = self.water_table_m
        parts = (
            f"{len(self.layers) + 1} layers of soil" if self.layers else "",
            f"cohesion {shown} {pressure[0]}" if any(cohesions) else "",
            "" if water is None else f"water table {water / length[1]:.4g} {length[0]} down",
            f"ground falling by {self.slope_deg:g}° behind the boulder" if self.slope_deg else "",
        )
        return ", ".join(part for part in parts if part)

    def fields(self) -> dict[str, Any]:
        """Return everything by name, the layers as they are."""
        return {attribute.name: getattr(self, attribute.name) for attribute in fields(self)}

    @classmethod
    def of_dict(cls, given: dict[str, Any]) -> Ground:
        """Return the ground of plain data, see `asdict`; the usual one of none."""
        return cls(**given | {"layers": tuple(Layer(**layer) for layer in given.get("layers", ()))})


@dataclass(frozen=True, slots=True)
class Model:
    """Which reading of the paper and which representation of the soil.

    The soil is what the inputs say; what it has beyond them is gathered in `Ground`.
    """

    readings: ReadingChoice = setting(
        "model.readings",
        "how the misprinted equations of the paper are read",
        ReadingChoice(),
        shown_default=PRESETS[1],
    )
    soil_elements: int = setting(
        "model.soil", "closed form of the soil, or a number of soil elements", 0, shown_default=CLOSED_FORM
    )
    """0 means the closed form, the limit of infinitely many."""
    calibrated_crush_m: float = setting(
        "vehicle.calibrated_crush",
        "crush up to which spring and damper describe the vehicle's front; a design with more is flagged",
        1.0,
        unit="m",
        admitted=Bound(0.0, 100.0, "the chassis stiffens at about 1 m of crush"),
        also=("crush", "max_crush"),
    )
    resistance: str = setting(
        "model.resistance",
        "soil model, which gives the ultimate resistance of the soil",
        RESISTANCES[0],
        choices=RESISTANCES,
        kind="a soil model",
    )
    second_opinion: tuple[str, ...] = setting(
        "model.second_opinion",
        "soil models under which passes are simulated again, with friction and vertical motion; "
        "width_capped alone decides, and broms is asked where that overturns a pass or resists more",
        USUAL_OPINION,
        kind="a soil model for a second opinion",
        shown_default=USUAL_OPINION[0],
    )
    layers: tuple[Layer, ...] = setting(
        "soil.layers", "layers below the uppermost, which the other entries describe", ()
    )
    cohesion_kPa: float = setting(
        "soil.cohesion",
        "effective cohesion of the uppermost layer",
        0.0,
        unit="kPa",
        admitted=Bound(0.0, 1000.0, "more is rock"),
        also=("c", "c'"),
    )
    water_table_m: float | None = setting(
        "soil.water_table",
        "depth of the water table below the soil line; densities below it are the saturated soil's",
        None,
        unit="m",
        admitted=Bound(0.0, 1000.0, "counted downwards from the soil line"),
        also=("water", "ground_water", "groundwater", "water_level"),
    )
    slope_deg: float = setting(
        "soil.slope",
        "angle at which the ground falls away behind the boulder",
        0.0,
        unit="deg",
        admitted=Bound(0.0, 60.0, "less than the friction angle, or the ground does not stand"),
        also=("ground_slope", "inclination"),
    )
    foot: str = setting(
        "boulder.foot",
        "shape of the boulder's underside; a rounded one is not modelled, and its boulders are undecided",
        FEET[0],
        choices=FEET,
        kind="a shape of the foot",
        also=("base", "underside", "bottom"),
    )
    profile: tuple[ProfilePoint, ...] = setting(
        "boulder.profile",
        "width and length of a boulder that is no box, over its height, from the foot up",
        (),
        also=("shape", "outline", "section", "sections"),
    )
    taper: float = setting(
        "boulder.taper",
        "width and length of the top over width and length of the foot; the larger end has the width and length given",
        1.0,
        unit="1",
        admitted=Bound(0.05, 20.0, "0.8 for a top of four fifths of the foot"),
        usual=Usual(0.5, 1.5, "usual boulders"),
        also=("tapering", "batter"),
    )
    scan: Scan | None = setting(
        "boulder.scan",
        "scan of the boulder, from which its profile and, with its mass, its density follow",
        None,
        also=("mesh", "stone"),
    )
    rock: str | None = setting(
        "boulder.rock",
        "kind of rock, in place of its density: an uncertain input by published ranges",
        None,
        choices=tuple(ROCKS),
        kind="a kind of rock",
    )
    rock_assumed: bool = False
    """Whether the density of the rock is `ROCK_KG_M3` because the file gives the mass of the boulders only."""

    @property
    def ground(self) -> Ground:
        """In what the soil differs from the paper's."""
        return Ground(self.layers, self.cohesion_kPa, self.water_table_m, self.slope_deg)

    @property
    def shape(self) -> Shape:
        """Shape of the boulders."""
        return Shape(self.profile) if self.profile else tapered(self.taper)

    @property
    def stands_flat(self) -> bool:
        """Whether the boulders stand on a foot that is modelled."""
        return self.foot == FEET[0] and self.shape.stands_flat

    @property
    def preset(self) -> str:
        """``as_printed``, ``corrected`` or ``mixed``."""
        return self.readings.preset


@dataclass(frozen=True, slots=True)
class SolverSettings:
    """How finely and how long a design is simulated: by an accuracy, or by a step where that is None."""

    accuracy: str | None = setting(
        "solver.accuracy", "how finely the motion is integrated", "balanced", choices=ACCURACIES, kind="an accuracy"
    )
    step_s: float | None = setting(
        "solver.step",
        "time step in place of an accuracy; errors are estimated but not confirmed, as by fast",
        None,
        unit="s",
        admitted=Bound(1e-7, 1.0, "a step of some milliseconds is usual"),
    )
    horizon_s: float = setting(
        "solver.horizon",
        "how long an impact is simulated",
        1.0,
        unit="s",
        admitted=Bound(1e-4, 100.0, "an impact is over within a second or so"),
    )
