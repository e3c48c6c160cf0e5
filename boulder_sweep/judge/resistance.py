"""The ultimate resistance of the soil by three laws.

All grow in proportion to depth, sigma_u = K rho_s g alpha K_epsilon, and differ in the coefficient K alone. So another
law than the paper's is the factor K / K_p^2 on K_epsilon (Eq 27), and everything made for the paper's law holds: the
closed form, the energy ledger, the proofs. The page ``docs/soil.md`` says where the coefficients come from.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from boulder_kernels import DesignTable


def passive_coefficient(phi: np.ndarray) -> np.ndarray:
    """Return Rankine's coefficient K_p of passive earth pressure for angles phi [rad] (with Eq 27)."""
    return np.tan(0.25 * np.pi + 0.5 * phi) ** 2


def kp_squared(table: DesignTable) -> np.ndarray:
    """Return K = K_p^2 of n designs, shape (n,): the paper's law for slender piles (Eq 27)."""
    return passive_coefficient(table.phi) ** 2


def broms(table: DesignTable) -> np.ndarray:
    """Return K = 3 K_p of n designs, shape (n,): Broms (1964), for short rigid piles (Eq 101)."""
    return 3.0 * passive_coefficient(table.phi)


def width_capped(table: DesignTable) -> np.ndarray:
    """Return K_p^2, or K_p R where this is less, of n designs, shape (n,) (Eq 102).

    R = 1 + 1.6 (K_p - K_a)^0.67 / (1 + 5 W/d) is the increase of the passive pressure on a wall of limited width by the
    soil beside it, after Ovesen and Brinch Hansen, for a wall that stands alone and reaches the surface.
    """
    K_p = passive_coefficient(table.phi)
    R = 1.0 + 1.6 * (K_p - 1.0 / K_p) ** 0.67 / (1.0 + 5.0 * table.W / table.d)
    return np.minimum(K_p**2, K_p * R)


LAWS: dict[str, Callable[[DesignTable], np.ndarray]] = {
    "kp_squared": kp_squared,
    "broms": broms,
    "width_capped": width_capped,
}
"""By the names of `boulder_sweep.settings.model.RESISTANCES`."""


def with_law(table: DesignTable, law: str, present: str = "kp_squared") -> DesignTable:
    """Return n designs with the ultimate resistance of another law.

    Parameters
    ----------
    table
        The designs, SI.
    law
        A name of `LAWS`.
    present
        The law that the designs have.

    Returns
    -------
    DesignTable
        The designs themselves where the law is the present one.
    """
    if law == present:
        return table
    return table._replace(K_epsilon=table.K_epsilon * (LAWS[law](table) / LAWS[present](table)))
