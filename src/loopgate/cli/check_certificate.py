"""``loopgate study check-certificate``: check the certificates of decisions."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from loopgate.cli.terminal import Report, print_json, show_progress
from loopgate.errors import SystemFileError
from loopgate.reading import refusing

if TYPE_CHECKING:
    from loopgate.model import System

_SHOWN = 5
_LONGEST_KIND = 40


@click.command("check-certificate")
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--json", "as_json", is_flag=True, help="Print JSON only.")
@click.pass_context
def check_certificate(ctx: click.Context, file: Path, *, as_json: bool) -> None:
    """Check the certificates in FILE, which `loopgate study verify --certificates` wrote, without any search.

    Exit code 1 if one does not show what it claims.
    """
    kinds: Counter[str] = Counter()
    wrong: list[str] = []
    with show_progress("certificates") as report:
        for kind, error in _checked(file, report):
            kinds[kind] += 1
            if error:
                wrong.append(error)
    if not kinds:
        msg = f"{file}: there is no certificate in it"
        raise SystemFileError(msg)
    if as_json:
        data = {"checked": kinds.total(), "kinds": dict(sorted(kinds.items())), "wrong": wrong}
        print_json(data)
    else:
        for kind, count in sorted(kinds.items()):
            click.echo(f"{kind:12} {count}")
        for error in wrong[:_SHOWN]:
            click.echo(error)
        click.echo(f"{kinds.total()} certificates, {len(wrong)} wrong")
    ctx.exit(1 if wrong else 0)


def _checked(file: Path, report: Report) -> Iterator[tuple[str, str]]:
    from loopgate.research.theory.certificates import CertificateError
    from loopgate.research.theory.certificates import check_certificate as check

    system: System | None = None
    for number, data in _lines(file):
        report(number)
        if "system" in data:
            system = _system(file, number, data["system"])
            continue
        if system is None:
            msg = f"{file}: line {number}: a certificate before any system; expected a system first"
            raise SystemFileError(msg)
        try:
            check(system, data)
        except CertificateError as error:
            yield str(data.get("kind"))[:_LONGEST_KIND], f"{file}: line {number}: {error}"
        else:
            yield data["kind"], ""


def _lines(file: Path) -> Iterator[tuple[int, dict[str, Any]]]:
    wrong = "not a file of certificates"
    with (
        refusing(file, "certificates", SystemFileError, wrong=wrong),
        file.open(encoding="utf-8-sig") as stream,
    ):
        for number, line in enumerate(stream, start=1):
            data = json.loads(line)
            if not isinstance(data, dict):
                msg = f"{file}: line {number}: expected a JSON object"
                raise SystemFileError(msg)
            yield number, data


def _system(file: Path, number: int, data: object) -> System:
    from loopgate.model import system_from_dict

    with refusing(f"{file}: line {number}", "system", SystemFileError):
        return system_from_dict(data)
