"""Coefficients of the Dormand-Prince 5(4) pair, as data that check themselves.

Source: J. R. Dormand and P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980),
19-26, method RK5(4)7M.

Every motion here is of the form x' = v, v' = a(x, v). Stage displacements then need the stage accelerations only,

    v_i = v + h sum_j A_ij a_j
    x_i = x + h C_i v + h^2 sum_j AA_ij a_j      AA = A A

which is the same method on the same system with fewer numbers to keep.
"""

from __future__ import annotations

from fractions import Fraction as F

_A = (
    (),
    (F(1, 5),),
    (F(3, 40), F(9, 40)),
    (F(44, 45), F(-56, 15), F(32, 9)),
    (F(19372, 6561), F(-25360, 2187), F(64448, 6561), F(-212, 729)),
    (F(9017, 3168), F(-355, 33), F(46732, 5247), F(49, 176), F(-5103, 18656)),
    (F(35, 384), F(0), F(500, 1113), F(125, 192), F(-2187, 6784), F(11, 84)),
)
_C = (F(0), F(1, 5), F(3, 10), F(4, 5), F(8, 9), F(1), F(1))
_B_FOURTH = (
    F(5179, 57600),
    F(0),
    F(7571, 16695),
    F(393, 640),
    F(-92097, 339200),
    F(187, 2100),
    F(1, 40),
)
STAGES = 7


def _entry(i: int, j: int) -> F:
    return _A[i][j] if j < len(_A[i]) else F(0)


def _check() -> None:
    """Refuse to import with a mistyped coefficient: row sums and quadrature conditions."""
    for i in range(STAGES):
        assert sum(_A[i], F(0)) == _C[i], f"row {i} of the tableau does not sum to its node"
    for weights in ((*_A[6], F(0)), _B_FOURTH):
        for power in range(4):
            quadrature = sum(w * c**power for w, c in zip(weights, _C, strict=True))
            assert quadrature == F(1, power + 1), "the weights miss a quadrature condition"


_check()

C = tuple(float(c) for c in _C)
"""Nodes, shape (7,)."""
A = tuple(tuple(float(_entry(i, j)) for j in range(STAGES)) for i in range(STAGES))
"""Stage weights, shape (7, 7); the last row is the fifth-order solution."""
AA = tuple(
    tuple(float(sum((_entry(i, m) * _entry(m, j) for m in range(STAGES)), F(0))) for j in range(STAGES))
    for i in range(STAGES)
)
"""Weights of the accelerations in the stage displacements, A A, shape (7, 7)."""
E = tuple(float(_entry(6, i) - _B_FOURTH[i]) for i in range(STAGES))
"""Fifth- minus fourth-order weights, shape (7,)."""
