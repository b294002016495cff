"""``loopgate study paper``: Section 5 of Zhou et al. 2020 with our figures beside the printed ones."""

from pathlib import Path

import click

from loopgate.cli.terminal import print_json, show_progress


@click.command()
@click.option("--quick", is_flag=True, help="Fewer experiments and rounds: under a minute.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("analysis/paper/out"),
    show_default=True,
    help="Folder for the table and the figures.",
)
@click.option("--seed", default=1, show_default=True, help="Seed of the random numbers.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON only.")
def paper(out: Path, *, quick: bool, seed: int, as_json: bool) -> None:
    """Repeat the experiments of the paper: its figure, our figure, and why they differ."""
    from loopgate.research.paper import reproduce

    with show_progress("steps") as report:
        data = reproduce(out, quick=quick, seed=seed, progress=report)
    if as_json:
        print_json(data)
        return
    for row in data["rows"]:
        click.echo(f"{row['what']}\n    printed {row['printed']}\n    ours    {row['ours']}")
        if row["why"]:
            click.echo(f"    why     {row['why']}")
    click.echo(f"{data['seconds']} s; tables and figures are in {out}")
