"""Dormand and Prince's coefficients: sums, order conditions, and equality with SciPy's."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import RK45

from boulder_kernels import dormand_prince as tableau

A = np.array(tableau.A)
AA = np.array(tableau.AA)
B = A[6]
C = np.array(tableau.C)
FOURTH = B - np.array(tableau.ERROR)


def test_rows_sum_to_their_nodes() -> None:
    assert A.sum(axis=1) == pytest.approx(C, abs=1e-15)
    assert np.all(np.triu(A) == 0.0)


def test_weights_of_the_displacements() -> None:
    """Of x' = v, v' = a: the accelerations enter the displacement by A A."""
    assert pytest.approx(A @ A, abs=1e-14) == AA
    assert AA.sum(axis=1) == pytest.approx(A @ C, abs=1e-14)
    assert AA[6].sum() == pytest.approx(0.5, abs=1e-15)


TREES = {
    # rooted tree (Butcher): its order, elementary weight as a function of (A, c), density
    "tau": (1, lambda A, c: np.ones(7), 1),
    "[tau]": (2, lambda A, c: c, 2),
    "[tau2]": (3, lambda A, c: c**2, 3),
    "[[tau]]": (3, lambda A, c: A @ c, 6),
    "[tau3]": (4, lambda A, c: c**3, 4),
    "[tau[tau]]": (4, lambda A, c: c * (A @ c), 8),
    "[[tau2]]": (4, lambda A, c: A @ c**2, 12),
    "[[[tau]]]": (4, lambda A, c: A @ (A @ c), 24),
    "[tau4]": (5, lambda A, c: c**4, 5),
    "[tau2[tau]]": (5, lambda A, c: c**2 * (A @ c), 10),
    "[[tau][tau]]": (5, lambda A, c: (A @ c) ** 2, 20),
    "[tau[tau2]]": (5, lambda A, c: c * (A @ c**2), 15),
    "[[tau3]]": (5, lambda A, c: A @ c**3, 20),
    "[tau[[tau]]]": (5, lambda A, c: c * (A @ (A @ c)), 30),
    "[[tau[tau]]]": (5, lambda A, c: A @ (c * (A @ c)), 40),
    "[[[tau2]]]": (5, lambda A, c: A @ (A @ c**2), 60),
    "[[[[tau]]]]": (5, lambda A, c: A @ (A @ (A @ c)), 120),
}


@pytest.mark.parametrize("tree", TREES)
def test_order_conditions(tree: str) -> None:
    """All 17 conditions of order five for the solution, and the eight of order four for the embedded one."""
    order, weight, density = TREES[tree]
    assert B @ weight(A, C) == pytest.approx(1 / density, abs=1e-14)
    if order <= 4:
        assert FOURTH @ weight(A, C) == pytest.approx(1 / density, abs=1e-14)
    elif tree == "[tau4]":
        assert abs(FOURTH @ weight(A, C) - 1 / density) > 1e-4


def test_no_condition_is_missing() -> None:
    """There are 1, 1, 2, 4, 9 rooted trees of one to five vertices."""
    assert [sum(order == n for order, _, _ in TREES.values()) for n in range(1, 6)] == [1, 1, 2, 4, 9]


def test_same_numbers_as_scipy() -> None:
    assert A[:6, :5] == pytest.approx(RK45.A, abs=1e-15)
    assert B[:6] == pytest.approx(RK45.B, abs=1e-15)
    assert np.abs(B - FOURTH) == pytest.approx(np.abs(RK45.E), abs=1e-15)
    assert C[:6] == pytest.approx(RK45.C, abs=1e-15)


@pytest.mark.parametrize(("i", "j"), [(i, j) for i in range(1, 7) for j in range(i)])
def test_a_mistyped_coefficient_is_refused(i: int, j: int) -> None:
    """A method checks itself when it is made: one digit wrong and the module does not come up."""
    nodes, rows, lower, orders = tableau.METHOD
    wrong = [row.split() for row in rows]
    wrong[i][j] = str(Fraction(wrong[i][j]) + Fraction(1, 10**6))
    with pytest.raises(AssertionError):
        tableau.tableau(nodes, tuple(map(" ".join, wrong)), lower, orders)
