"""``sweep uncertainty``: the probability of passing when inputs are uncertain, and which input matters most."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from boulder_sweep.cli.loading import load_sweep, refuse_missing, refuse_units_of_json, refuse_unwritable
from boulder_sweep.cli.options import (
    OUTPUT,
    cluster_options,
    jobs_option,
    json_option,
    second_opinion_option,
    set_option,
    units_option,
)
from boulder_sweep.cli.output import say, show
from boulder_sweep.text import counted

EXAMPLES = """\b
Examples:
  sweep uncertainty configs/uncertain_site.yaml
  sweep uncertainty configs/uncertain_site.yaml --plot chances.png
  sweep uncertainty configs/uncertain_site.yaml --rare -o chances.parquet
  sweep uncertainty configs/uncertain_site.yaml --doubts
  sweep uncertainty --published
"""


@click.command("uncertainty", short_help="The probability of passing with uncertain inputs.", epilog=EXAMPLES)
@click.argument("grid", type=click.Path(), required=False)
@click.option("--half-width", default="0.01", metavar="P", help="Largest half-width of the interval [0.01].")
@click.option("--confidence", default="95 %", metavar="SHARE", help="Confidence level of the interval [95 %].")
@click.option("--margin", default="0", metavar="SHARE", help="Least margin to the limits, e.g. '25 %'.")
@click.option("--rare", is_flag=True, help="Also small probabilities, by subset simulation.")
@second_opinion_option
@click.option(
    "--doubts", is_flag=True, help="Divide a design's uncertainty among inputs, readings and numerical error."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, metavar="N", help="Seed of the random numbers [0].")
@jobs_option
@click.option("-o", "--output", "out", type=OUTPUT, metavar="F.parquet", help="Table; indices and samples next to it.")
@click.option("--plot", "picture", type=OUTPUT, metavar="F.png", help="Picture (.png, .svg or .pdf) of one design.")
@click.option(
    "--design", type=click.IntRange(min=0), default=0, metavar="ID", help="The design of --plot and --doubts [0]."
)
@click.option("--published", is_flag=True, help="List published spreads with their sources; takes no GRID.")
@click.option("-q", "--quiet", is_flag=True, help="No notes.")
@cluster_options
@units_option
@set_option
@json_option
def uncertainty(
    grid: str | None,
    half_width: str,
    confidence: str,
    margin: str,
    rare: bool,
    second_opinion: bool,
    doubts: bool,
    seed: int,
    jobs: int | None,
    backend: str,
    scheduler: str | None,
    out: str | None,
    picture: str | None,
    design: int,
    published: bool,
    units: str,
    quiet: bool,
    overrides: tuple[str, ...],
    as_json: bool,
) -> int:
    """Estimate the probability of passing for every design of GRID, in which some inputs have distributions.

    An input takes a distribution instead of a value: {mean: 38 deg, sd: 3 deg}, or with cov: 5 %. Sampling continues
    until the interval is narrow enough.
    """
    if published:
        return _show_published(grid, units, as_json)
    if grid is None:
        raise click.MissingParameter(param_hint="'GRID'", param_type="argument")
    from boulder_sweep.answers.printing import doubt_lines, uncertainty_lines
    from boulder_sweep.answers.uncertainty import uncertainty as estimate
    from boulder_sweep.cli.progress import kernels_for, working

    refuse_units_of_json(units, as_json)
    from boulder_sweep.settings.overrides import ALL_OPINIONS

    sweep = load_sweep(grid, (*overrides, *([ALL_OPINIONS] if second_opinion else [])), quiet)
    refuse_missing(sweep, grid, design)
    refuse_unwritable(out, picture)
    with working(quiet, kernels_for(sweep)) as progress:
        found = estimate(
            sweep,
            half_width=half_width,
            confidence=confidence,
            margin=margin,
            seed=seed,
            rare=rare,
            jobs=jobs,
            backend=backend,
            scheduler=scheduler,
            progress=progress,
        )
    parts = []
    if doubts:
        from boulder_sweep.answers.doubts import doubts as part

        parts = part(sweep, design=design, seed=seed, jobs=jobs)
    if as_json:
        show(json.dumps(found.to_dict() | ({"doubts": [asdict(own) for own in parts]} if doubts else {})))
    else:
        show(*uncertainty_lines(found, units=units), *(["", *doubt_lines(parts)] if doubts else []))
    if not quiet:
        drawn = sum(found.arrow["p_pass_designs"].to_pylist())
        say(f"{counted(len(found), 'row')}; {counted(drawn, 'design')} drawn for the chances; seed {seed}")
    if out is not None:
        for file in found.write(out):
            say(f"written  {file}")
    if picture is not None:
        found.plot(picture, design, units=units)
    return 0


def _show_published(grid: str | None, units: str, as_json: bool) -> int:
    """List published spreads with their sources."""
    if grid is not None or units != "si":
        other = "GRID" if grid is not None else f"--units {units}"
        raise click.UsageError(f"--published lists spreads as their sources state them; leave out {other}")
    from boulder_sweep.answers.published import PUBLISHED

    if as_json:
        show(json.dumps({"published": [own._asdict() for own in PUBLISHED]}))
        return 0
    for own in PUBLISHED:
        show(f"{own.input:<24}{own.cov:<14}{own.of}", f"{'':<38}{own.source}")
    return 0
