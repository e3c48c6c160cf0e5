"""The two crash tests of the paper, Tables 1 to 3."""

from __future__ import annotations

from math import radians

from .inputs import Inputs

# Table 1: common to both tests.
_VEHICLE = {"k_v": 3103.3e3, "c_v": 138.91e3}
_SOIL = {"rho_s": 1859.9, "phi": radians(43.2), "beta": 95.0}

# Table 2: American Black Granite.
ABG = Inputs(L=0.762, W=1.016, H=2.2, rho_b=3074.0, d=1.2, e=0.754, m_v=6795.0, v_0=13.36, **_VEHICLE, **_SOIL)

# Table 3: Rockville White Granite. The density is the one of the table (the text has 2652).
RWG = Inputs(L=1.65, W=1.68, H=3.44, rho_b=2596.0, d=2.03, e=0.938, m_v=6722.0, v_0=14.5, **_VEHICLE, **_SOIL)
