"""The settings that are not columns: criterion, reading of the paper, soil representation, solver."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

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
"""Density of water."""
RESISTANCES = ("kp_squared", "broms", "width_capped")
"""Laws of the ultimate resistance of the soil; the first is the paper's."""


UNLOADINGS = ("elastic", "plastic", "plastic_with_gap")
"""How the soil unloads, in the order of the kernels; the first is the paper's."""
REMEMBERING_ELEMENTS = 200
"""Soil elements where the soil remembers and no number is given."""


@dataclass(frozen=True, slots=True)
class Criterion:
    """What a design must hold.

    Attributes
    ----------
    max_rotation_deg : float
        Rotation at which the boulder counts as overturned [deg].
    rating : str
        Penetration rating required: P1, P2 or P3.
    min_overlap_m : float
        Least height of the boulder's top over the underside of the bumper [m].
    """

    max_rotation_deg: float = 20.0
    rating: str = "P1"
    min_overlap_m: float = 0.25


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
        for preset in PRESETS:
            if self == self.of_preset(preset):
                return preset
        return "mixed"

    @property
    def corrected(self) -> tuple[bool, bool, bool, bool, bool]:
        """Which readings are corrected, in the order of the kernels."""
        return (
            self.inertia != PRINTED,
            self.impact_arm != PRINTED,
            self.contact != PRINTED,
            self.restoring != PRINTED,
            self.separation != PRINTED,
        )

    def as_dict(self) -> dict[str, str]:
        """Return switch: value, in order."""
        return {name: getattr(self, name) for name in SWITCHES}


@dataclass(frozen=True, slots=True)
class Layer:
    """One layer of soil below the uppermost, down to the next.

    Attributes
    ----------
    from_m : float
        Depth of its upper boundary below the soil line [m].
    density_kg_m3, friction_angle_deg, subgrade_reaction_MN_m3, cohesion_kPa : float
        Its soil.
    """

    from_m: float
    density_kg_m3: float
    friction_angle_deg: float
    subgrade_reaction_MN_m3: float
    cohesion_kPa: float = 0.0


@dataclass(frozen=True, slots=True)
class Ground:
    """In what the soil differs from a dry, level one without cohesion that is the same at every depth.

    Attributes
    ----------
    layers : tuple of Layer
        Layers below the uppermost, from the top down; the uppermost is the soil that the inputs describe.
    cohesion_kPa : float
        Effective cohesion of the uppermost layer [kPa].
    water_table_m : float or None
        Depth of the water table below the soil line [m]; None where it is out of reach.
    slope_deg : float
        Angle at which the ground falls away behind the boulder [deg].
    """

    layers: tuple[Layer, ...] = ()
    cohesion_kPa: float = 0.0
    water_table_m: float | None = None
    slope_deg: float = 0.0

    @property
    def is_usual(self) -> bool:
        """Whether there is nothing of it."""
        return self == Ground()

    @property
    def is_proportional(self) -> bool:
        """Whether the resistance grows in proportion to depth, as in the paper's soil."""
        return not self.layers and self.cohesion_kPa == 0.0 and self.water_table_m in (None, 0.0)

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return asdict(self)

    @property
    def words(self) -> str:
        """What there is of it; empty where there is nothing."""
        cohesions = [self.cohesion_kPa, *(layer.cohesion_kPa for layer in self.layers)]
        parts = (
            f"{len(self.layers) + 1} layers of soil" if self.layers else "",
            f"cohesion {' / '.join(f'{cohesion:g}' for cohesion in cohesions)} kPa" if any(cohesions) else "",
            "" if self.water_table_m is None else f"water table {self.water_table_m:g} m down",
            f"ground falling by {self.slope_deg:g}° behind the boulder" if self.slope_deg else "",
        )
        return ", ".join(part for part in parts if part)

    def fields(self) -> dict[str, Any]:
        """Return everything by name, the layers as they are."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @classmethod
    def of_dict(cls, given: dict[str, Any]) -> Ground:
        """Return the ground that `as_dict` returned; the usual one of no data."""
        return cls(**given | {"layers": tuple(Layer(**layer) for layer in given.get("layers", ()))})


@dataclass(frozen=True, slots=True)
class Model:
    """Which reading of the paper and which representation of the soil.

    Attributes
    ----------
    readings : ReadingChoice
        The five readings.
    soil_elements : int
        Number of soil elements; 0 means the closed form, the limit of infinitely many.
    calibrated_crush_m : float
        Crush up to which spring and damper describe the vehicle's front [m].
    resistance : str
        Law of the ultimate resistance of the soil, one of `RESISTANCES`.
    unloading : str
        How the soil unloads, one of `UNLOADINGS`.
    layers, cohesion_kPa, water_table_m, slope_deg
        As of `Ground`.
    """

    readings: ReadingChoice = ReadingChoice()
    soil_elements: int = 0
    calibrated_crush_m: float = 1.0
    resistance: str = RESISTANCES[0]
    unloading: str = UNLOADINGS[0]
    layers: tuple[Layer, ...] = ()
    cohesion_kPa: float = 0.0
    water_table_m: float | None = None
    slope_deg: float = 0.0

    @property
    def elements(self) -> int:
        """Number of soil elements that is computed with; 0 for the closed form, which soil that remembers has not."""
        remembers = self.unloading != UNLOADINGS[0]
        return REMEMBERING_ELEMENTS if remembers and self.soil_elements == 0 else self.soil_elements

    @property
    def ground(self) -> Ground:
        """In what the soil differs from the paper's."""
        return Ground(self.layers, self.cohesion_kPa, self.water_table_m, self.slope_deg)

    @property
    def preset(self) -> str:
        """``as_printed``, ``corrected`` or ``mixed``."""
        return self.readings.preset


def completed(settings: dict[str, Any]) -> dict[str, Any]:
    """Return the resolved settings of a table with today's defaults for entries that are newer than it."""
    model = Model()
    more = {name: getattr(model, name) for name in ("calibrated_crush_m", "resistance", "unloading")}
    return settings | {
        "criterion": asdict(Criterion()) | settings["criterion"],
        "model": more | settings["model"],
        "solver": {"accuracy_deg": None} | settings["solver"],
    }


@dataclass(frozen=True, slots=True)
class SolverSettings:
    """How finely and how long a design is simulated.

    Attributes
    ----------
    accuracy : str, float or None
        ``fast``, ``balanced``, ``fine``, or the admitted error of the rotation [deg];
        None where a step is given.
    step_s : float or None
        Step [s]; None where an accuracy is given.
    horizon_s : float
        Longest time simulated [s].
    """

    accuracy: str | float | None = "balanced"
    step_s: float | None = None
    horizon_s: float = 1.0
