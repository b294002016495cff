"""A command with many options, which its help shows in groups."""

from collections.abc import Mapping
from typing import Any

import click


class GroupedCommand(click.Command):
    """A command whose help lists its options in groups; other options come last, under "Options".

    Parameters
    ----------
    groups
        The parameters of each group in their order, by the title of the group.
    """

    def __init__(self, *args: Any, groups: Mapping[str, tuple[str, ...]], **more: Any) -> None:  # noqa: ANN401
        super().__init__(*args, **more)
        self.groups = groups

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, group by group."""
        known = {p.name: row for p in self.get_params(ctx) if (row := p.get_help_record(ctx)) is not None}
        for title, names in self.groups.items():
            with formatter.section(title):
                formatter.write_dl([known.pop(name) for name in names])
        with formatter.section("Options"):
            formatter.write_dl(list(known.values()))
