"""Coefficients of the Dormand-Prince 5(4) pair, as data that check themselves.

Source: J. R. Dormand and P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980),
19-26, method RK5(4)7M.

Every motion here is of the form x' = v, v' = a(x, v). Stage displacements then need the stage accelerations only,

    v_i = v + h sum_j A_ij a_j
    x_i = x + h C_i v + h^2 sum_j AA_ij a_j      AA = A A

which is the same method on the same system with fewer numbers to keep.
"""

from __future__ import annotations

from fractions import Fraction

_A = (
    (),
    (Fraction(1, 5),),
    (Fraction(3, 40), Fraction(9, 40)),
    (Fraction(44, 45), Fraction(-56, 15), Fraction(32, 9)),
    (Fraction(19372, 6561), Fraction(-25360, 2187), Fraction(64448, 6561), Fraction(-212, 729)),
    (Fraction(9017, 3168), Fraction(-355, 33), Fraction(46732, 5247), Fraction(49, 176), Fraction(-5103, 18656)),
    (Fraction(35, 384), Fraction(0), Fraction(500, 1113), Fraction(125, 192), Fraction(-2187, 6784), Fraction(11, 84)),
)
_C = (Fraction(0), Fraction(1, 5), Fraction(3, 10), Fraction(4, 5), Fraction(8, 9), Fraction(1), Fraction(1))
_B_FOURTH = (
    Fraction(5179, 57600),
    Fraction(0),
    Fraction(7571, 16695),
    Fraction(393, 640),
    Fraction(-92097, 339200),
    Fraction(187, 2100),
    Fraction(1, 40),
)
STAGES = 7


def _entry(i: int, j: int) -> Fraction:
    return _A[i][j] if j < len(_A[i]) else Fraction(0)


def _check() -> None:
    """Refuse to import with a mistyped coefficient: row sums and quadrature conditions."""
    for i in range(STAGES):
        assert sum(_A[i], Fraction(0)) == _C[i], f"row {i} of the tableau does not sum to its node"
    for weights in ((*_A[6], Fraction(0)), _B_FOURTH):
        for power in range(4):
            quadrature = sum(w * c**power for w, c in zip(weights, _C, strict=True))
            assert quadrature == Fraction(1, power + 1), "the weights miss a quadrature condition"


_check()

C = tuple(float(c) for c in _C)
"""Nodes, shape (7,)."""
A = tuple(tuple(float(_entry(i, j)) for j in range(STAGES)) for i in range(STAGES))
"""Stage weights, shape (7, 7); the last row is the fifth-order solution."""
AA = tuple(
    tuple(float(sum((_entry(i, m) * _entry(m, j) for m in range(STAGES)), Fraction(0))) for j in range(STAGES))
    for i in range(STAGES)
)
"""Weights of the accelerations in the stage displacements, A A, shape (7, 7)."""
