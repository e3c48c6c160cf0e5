"""Published coefficients of variation of the inputs, with their sources; offered, never assumed."""

from __future__ import annotations

from typing import NamedTuple


class Published(NamedTuple):
    """A coefficient of variation as stated by a source."""

    input: str
    """Key of the input."""
    cov: str
    """Coefficient of variation, as stated."""
    of: str
    """What it applies to."""
    source: str


JCSS = "JCSS Probabilistic Model Code, part 3.7, indicative standard deviations of soil properties"
DUNCAN = "Duncan (2000), J. Geotech. Geoenviron. Eng. 126(4), Table 3, as quoted by others"
PHOON = "Phoon & Kulhawy (1999), Can. Geotech. J. 36, 612-624, Tables 1 and 2, as quoted by others"
PUBLISHED = (
    Published("soil.friction_angle", "10 to 20 %", "tan φ′, drained, from point to point", JCSS),
    Published("soil.friction_angle", "2 to 13 %", "φ′", DUNCAN),
    Published("soil.friction_angle", "5 to 11 %", "φ′ of sand with a mean of 35 to 41°", PHOON),
    Published("soil.density", "5 to 10 %", "unit weight, from point to point", JCSS),
    Published("soil.density", "3 to 7 %", "unit weight", DUNCAN),
    Published("soil.density", "3 to 20 %", "unit weight of 14 to 20 kN/m³", PHOON),
    Published("soil.subgrade_reaction", "20 to 100 %", "stiffness, from point to point", JCSS),
)
