"""Boulders that are no boxes, for tests."""

import numpy as np

import boulder_kernels as bk
from boulder_kernels.dynamics import constants_in, profile_of
from boulder_kernels.pieces import PiecewiseTable, uniform_layers
from tests.kernels.samples import table_of
from tests.outlines.oracle import Stone


def box(design: bk.Design) -> np.ndarray:
    half = 0.5 * design.L
    return np.array([[0.0, design.W, half, half], [design.H, design.W, half, half]])


def taper(design: bk.Design, foot: float = 1.3, top: float = 0.7) -> np.ndarray:
    """Return the outline of a taper; sides of foot and top as ratios of the design's sides."""
    return box(design) * np.array([[1.0, foot, foot, foot], [1.0, top, top, top]])


def superellipsoid(design: bk.Design, n: float = 4.0, pieces: int = 16) -> np.ndarray:
    """Sections of |x/a|^n + |z/c|^n = 1, so with a rounded foot and top."""
    z = np.linspace(-1.0, 1.0, pieces + 1)
    share = (1.0 - np.abs(z) ** n) ** (1.0 / n)
    half = 0.5 * design.L * share
    return np.stack([0.5 * design.H * (1.0 + z), design.W * share, half, half], axis=1)


def crooked(design: bk.Design) -> np.ndarray:
    """A boulder that leans, widest at the soil line, with its centre before the middle of its foot."""
    heights = np.array([0.0, 0.3, 0.62, 0.8, 1.0]) * design.H
    near = np.array([0.5, 0.6, 0.55, 0.5, 0.3]) * design.L
    far = np.array([0.5, 0.45, 0.4, 0.3, 0.25]) * design.L
    return np.stack([heights, np.array([0.8, 1.1, 1.2, 0.9, 0.4]) * design.W, near, far], axis=1)


SHAPES = {
    "widens downwards": taper,
    "widens upwards": lambda design: taper(design, 0.7, 1.3),
    "superellipsoid": superellipsoid,
    "crooked": crooked,
}


def stone_of(outline: np.ndarray) -> Stone:
    return Stone(*outline.T)


def constants(design: bk.Design, outline: np.ndarray, elements: int, readings=None, layers=None):
    layers = uniform_layers(design) if layers is None else layers
    return constants_in(design, readings or bk.corrected(), elements, profile_of(layers, elements, outline))


def outlined(design: bk.Design, outline: np.ndarray, layers: np.ndarray | None = None) -> PiecewiseTable:
    layers = uniform_layers(design) if layers is None else layers
    return PiecewiseTable(*table_of([design]), layers[None], outline[None])
