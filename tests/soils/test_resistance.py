"""Laws of the soil's ultimate resistance: against the oracle, in whole impacts, in the energy ledger, in answers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from boulder_kernels.ground import BROMS, KP_SQUARED, WIDTH_CAPPED
from boulder_sweep.answers.uncertainty import uncertainty
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.impact.simulation import simulate
from boulder_sweep.judge.inputs import designs_of
from boulder_sweep.settings import Sweep
from boulder_sweep.settings.model import PRESETS, RESISTANCES, Model
from boulder_sweep.soils import coefficients, with_law
from boulder_sweep.views.wording import LAW_WORDS, design_line
from tests import oracle
from tests.answers.designs import bare_need, site
from tests.judge.plain import plain_designs
from tests.oracle.soil import lateral_coefficient

OTHERS = RESISTANCES[1:]


def by(law: str, sweep: Sweep) -> Sweep:
    """Return a sweep with another law."""
    return replace(sweep, model=replace(sweep.model, resistance=law))


def test_settings_and_kernels_agree_on_laws_and_water() -> None:
    assert tuple(map(RESISTANCES.index, ("kp_squared", "broms", "width_capped"))) == (KP_SQUARED, BROMS, WIDTH_CAPPED)


@pytest.mark.parametrize("law", RESISTANCES)
def test_coefficients_are_those_of_the_oracle(law: str) -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        phi, width, depth = math.radians(rng.uniform(20.0, 49.0)), rng.uniform(0.1, 4.0), rng.uniform(0.5, 3.0)
        expected = lateral_coefficient(replace(oracle.RWG, phi=phi, W=width, d=depth, resistance=law))
        assert coefficients(plain_designs(phi=phi, W=width, d=depth).table, law)[0] == pytest.approx(
            expected, rel=1e-12
        )


def test_figures_by_hand() -> None:
    """K_p = 3 at 30 degrees: 9, 9, and 3 (1 + 1.6 (8/3)^0.67 / 6) for a body as wide as deep; never above K_p^2."""
    wide, slender = (plain_designs(phi=math.radians(30.0), W=width, d=1.5).table for width in (1.5, 0.01))
    assert coefficients(wide, "kp_squared")[0] == pytest.approx(9.0)
    assert coefficients(wide, "broms")[0] == pytest.approx(9.0)
    assert coefficients(wide, "width_capped")[0] == pytest.approx(4.5434, abs=1e-4)
    assert coefficients(slender, "width_capped")[0] == pytest.approx(9.0)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("law", OTHERS)
def test_whole_impacts_are_those_of_the_oracle(law: str, preset: str) -> None:
    found = simulate(by(law, crash_test("rwg")), readings=preset)
    readings = oracle.CORRECTED if preset == "corrected" else oracle.AS_PRINTED
    known = oracle.simulate(replace(oracle.RWG, resistance=law), readings, horizon=float(found.time_s[-1]))
    maxima = found.motion.outcome.maxima
    assert maxima.theta == pytest.approx(known.max_rotation.value, abs=math.radians(1e-4))
    assert maxima.x_b == pytest.approx(known.max_displacement.value, abs=1e-6)
    assert maxima.F_v == pytest.approx(known.peak_force.value, rel=1e-6)


@pytest.mark.parametrize("law", OTHERS)
def test_the_energy_ledger_closes(law: str) -> None:
    for name in ("abg", "rwg"):
        assert simulate(by(law, crash_test(name))).energy().largest_residual < 1e-6


def test_the_papers_law_leaves_every_bit_alone() -> None:
    sweep = site()
    block = sweep.block(0, sweep.n_designs)
    plain, named = designs_of(block), designs_of(block, None, Model(resistance="kp_squared"))
    assert all(np.array_equal(a, b) for a, b in zip(plain.table, named.table, strict=True))
    table = plain.table
    assert with_law(table, "kp_squared") is table
    back = with_law(with_law(table, "broms"), "kp_squared", "broms")
    assert back.K_epsilon == pytest.approx(table.K_epsilon, rel=1e-15)


def test_less_resistance_needs_more_depth_and_is_passed_less_often() -> None:
    heavy = site(height="3.6 m", friction="42 deg")
    depth = {law: bare_need(by(law, heavy)).frame.least_embedment_depth_m.iloc[0] for law in ("kp_squared", "broms")}
    assert depth["kp_squared"] < depth["broms"]
    uncertain = site(site="embedment_depth: 2.2 m", friction="{mean: 40 deg, sd: 2 deg}", height="3.2 m")
    chance = {law: uncertainty(by(law, uncertain)).frame.p_pass.iloc[0] for law in ("kp_squared", "broms")}
    assert chance["broms"] < chance["kp_squared"]


def test_pictures_name_a_law_that_is_not_the_papers() -> None:
    """So do pages, see `tests/report/test_page.py`."""
    plain, capped = (
        design_line(simulate(by(law, crash_test("rwg")), horizon_s=0.02)) for law in ("kp_squared", "width_capped")
    )
    assert plain.splitlines()[0].endswith("readings corrected")
    assert capped.splitlines()[0].endswith("readings corrected, resistance capped by the width")
    assert set(LAW_WORDS) == set(OTHERS)
