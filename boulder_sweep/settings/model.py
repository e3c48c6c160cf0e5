"""The settings that are not columns: criterion, reading of the paper, soil representation, solver."""

from __future__ import annotations

from dataclasses import dataclass

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
    """

    readings: ReadingChoice = ReadingChoice()
    soil_elements: int = 0
    calibrated_crush_m: float = 1.0
    resistance: str = RESISTANCES[0]
    unloading: str = UNLOADINGS[0]

    @property
    def elements(self) -> int:
        """Number of soil elements that is computed with; 0 for the closed form, which soil that remembers has not."""
        remembers = self.unloading != UNLOADINGS[0]
        return REMEMBERING_ELEMENTS if remembers and self.soil_elements == 0 else self.soil_elements

    @property
    def preset(self) -> str:
        """``as_printed``, ``corrected`` or ``mixed``."""
        return self.readings.preset


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
