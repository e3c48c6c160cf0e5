"""What an impact is described by, and which reading of each doubtful formula is meant."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf

GRAVITY = 9.80665  # standard acceleration of gravity g [m/s^2], Eqs 27 and 37


@dataclass(frozen=True)
class Layer:
    """One layer of soil from its upper boundary `top` [m] down: density, friction angle, subgrade reaction as of
    `Inputs`, and cohesion [Pa]."""

    top: float
    rho_s: float
    phi: float
    beta: float
    cohesion: float = 0.0


@dataclass(frozen=True)
class Ground:
    """Layers from the soil line down, depth of the water table [m], angle at which the ground falls behind [rad]."""

    layers: tuple[Layer, ...]
    water: float = inf
    slope: float = 0.0


def layer_at(ground: Ground, alpha: float) -> Layer:
    """Return the layer at a depth [m]."""
    return [layer for layer in ground.layers if layer.top <= alpha][-1]


@dataclass(frozen=True)
class Inputs:
    """One impact, with the symbols of the paper, in SI units, except beta in MN/m^3 as in Eq 24.

    Attributes
    ----------
    L, W, H : float
        Length (along the impact), width and height of the boulder [m].
    rho_b : float
        Density of the boulder [kg/m^3], Eq 15.
    d : float
        Embedment depth [m].
    e : float
        Height of the blow over the soil line [m], Eq 9.
    rho_s : float
        Density of the soil [kg/m^3], Eq 2.
    phi : float
        Angle of internal friction of the soil [rad], Eq 1.
    beta : float
        Constant of horizontal subgrade reaction [MN/m^3], Eq 24.
    m_v, v_0 : float
        Mass [kg] and impact speed [m/s] of the vehicle.
    k_v, c_v : float
        Spring [N/m] and damper [N s/m] of the vehicle's Maxwell element, Eqs 40 and 41.
    K_epsilon : float
        Strain-rate factor on the ultimate soil pressure, Eq 27.
    resistance : {'kp_squared', 'broms', 'width_capped'}
        Law of the ultimate soil pressure: Eq 27, or one of the two that are not the paper's.
    ground : Ground, optional
        The soil where it is not the same at every depth; rho_s, phi and beta are those of `Inputs` without it.
    """

    L: float
    W: float
    H: float
    rho_b: float
    d: float
    e: float
    rho_s: float
    phi: float
    beta: float
    m_v: float
    v_0: float
    k_v: float
    c_v: float
    K_epsilon: float = 1.0
    resistance: str = "kp_squared"
    ground: Ground | None = None


CORRECTED_NAMES = {
    "inertia": "box",
    "impact_arm": "geometric",
    "contact": "left_face",
    "restoring": "gravity",
    "separation": "released",
}


@dataclass(frozen=True)
class Readings:
    """The reading of the five formulas that are wrong or doubtful as printed; each 'printed' or corrected.

    Attributes
    ----------
    inertia : {'printed', 'box'}
        Own moment of inertia of the boulder in Eq 16.
    impact_arm : {'printed', 'geometric'}
        Height of the blow over the centre of mass, the ``e + d_1`` of Eqs 5 and 6.
    contact : {'printed', 'left_face'}
        On which side of the centre of mass the struck face lies: the sign of gamma_v in Eqs 45, 48, 52.
    restoring : {'printed', 'gravity'}
        Restoring moment, Eqs 37 to 39.
    separation : {'printed', 'released'}
        What the vehicle does once the crush force has fallen to zero, Eq 47.

    Raises
    ------
    ValueError
        If a reading has any other value.
    """

    inertia: str = "box"
    impact_arm: str = "geometric"
    contact: str = "left_face"
    restoring: str = "gravity"
    separation: str = "released"

    def __post_init__(self) -> None:
        for field in fields(self):
            allowed = ("printed", CORRECTED_NAMES[field.name])
            if getattr(self, field.name) not in allowed:
                raise ValueError(f"{field.name}: {getattr(self, field.name)!r} is none of {allowed}")


AS_PRINTED = Readings("printed", "printed", "printed", "printed", "printed")
CORRECTED = Readings()
