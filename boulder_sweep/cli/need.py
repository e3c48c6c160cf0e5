"""``sweep need``: the least that passes, for every combination of the other inputs."""

from __future__ import annotations

import json

import click

from boulder_sweep.cli.loading import load_sweep, refuse_units_of_json, refuse_unwritable
from boulder_sweep.cli.options import OUTPUT, cluster_options, jobs_option, json_option, set_option, units_option
from boulder_sweep.cli.output import say, show
from boulder_sweep.text import counted

EXAMPLES = """\b
Examples:
  sweep need configs/site.yaml
  sweep need configs/site.yaml --margin '25 %' --plot depths.png
  sweep need configs/site.yaml --robust
  sweep need configs/site.yaml --least height -o heights.parquet
  sweep need configs/uncertain_site.yaml --probability 0.95 --least mass
  sweep need configs/site.yaml --most speed --between '5 m/s' '40 m/s'
"""


@click.command("need", short_help="The least depth (or any input) that passes.", epilog=EXAMPLES)
@click.argument("grid", type=click.Path())
@click.option("--least", metavar="KEY", help="Input whose smallest passing value is wanted [embedment_depth].")
@click.option("--most", metavar="KEY", help="Input whose largest passing value is wanted, e.g. speed.")
@click.option("--margin", default="0", metavar="SHARE", help="Least margin to the limits, e.g. '25 %'.")
@click.option("--probability", metavar="P", help="Probability of passing, e.g. 0.95, if inputs have distributions.")
@click.option(
    "--open-readings", is_flag=True, help="With --probability: treat all readings of the paper as equally likely."
)
@click.option(
    "--between", nargs=2, metavar="A B", help="Range to search [default: the axis of the file, or the usual]."
)
@click.option("--tolerance", metavar="T", help="Spacing of the values tried [1 mm, 0.01 deg, 0.01 m/s, ...].")
@click.option("--robust", is_flag=True, help="Count only passes that stand under every second opinion, with --margin.")
@click.option("--other-readings", is_flag=True, help="Also answer by the other readings of the paper: takes longer.")
@jobs_option
@click.option("-o", "--output", "out", type=OUTPUT, metavar="F.parquet", help="Table of all answers.")
@click.option("--plot", "picture", type=OUTPUT, metavar="F.png", help="Design chart (.png, .svg or .pdf).")
@click.option("-q", "--quiet", is_flag=True, help="No notes.")
@cluster_options
@units_option
@set_option
@json_option
def need(
    grid: str,
    least: str | None,
    most: str | None,
    margin: str,
    probability: str | None,
    open_readings: bool,
    between: tuple[str, str] | None,
    tolerance: str | None,
    robust: bool,
    other_readings: bool,
    jobs: int | None,
    backend: str,
    scheduler: str | None,
    out: str | None,
    picture: str | None,
    units: str,
    quiet: bool,
    overrides: tuple[str, ...],
    as_json: bool,
) -> int:
    """Find the least KEY that passes, for every combination of the other inputs of GRID.

    If KEY is an axis of the grid, the axis is the search range; otherwise the usual range, for depths from 0.35 of the
    height to where the truck would go over the boulder. Every answer has a bracket: the value that passes and the next
    one, which does not, both judged as in `sweep run`. A row of which nothing passes is `blocked_by_overlap` if the
    truck goes over the boulder at the end of the range (overlap below criterion.min_overlap), and `never` if not.
    """
    from boulder_sweep.answers.need import need as find
    from boulder_sweep.answers.need_printing import need_lines
    from boulder_sweep.cli.progress import kernels_for, working
    from boulder_sweep.errors import EXIT_DONE, EXIT_SOME_ROWS_FAILED

    refuse_units_of_json(units, as_json)
    sweep = load_sweep(grid, overrides, quiet)
    refuse_unwritable(out, picture)
    with working(quiet, kernels_for(sweep), of="designs" if probability is None else "values") as progress:
        found = find(
            sweep,
            least,
            most=most,
            margin=margin,
            probability=probability,
            open_readings=open_readings,
            between=between,
            tolerance=tolerance,
            robust=robust,
            both_readings=other_readings,
            jobs=jobs,
            backend=backend,
            scheduler=scheduler,
            progress=progress,
        )
    if as_json:
        show(json.dumps(found.to_dict()))
    else:
        show(*need_lines(found, units=units, file=grid))
    if not quiet:
        counts = ", ".join(f"{word} {count:,}" for word, count in found.counts().items())
        say(f"{counted(len(found), 'row')}: {counts}; {counted(found.simulated, 'simulation')}")
    if out is not None:
        found.write(out)
    if picture is not None:
        found.plot(picture, units=units)
    return EXIT_SOME_ROWS_FAILED if found.errors else EXIT_DONE
