"""Compiled code is kept apart for each state of the sources."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from loopgate.research import kernel_cache
from loopgate.research.kernel_cache import kernel_folder, mark


def package(folder: Path) -> Path:
    """Make a package of three files, in one of which nothing that is compiled can lie."""
    for room in ("research/inner", "report"):
        (folder / room).mkdir(parents=True)
        (folder / room / "b.py").write_text("B = 1\n", encoding="utf-8")
    (folder / "a.py").write_text("A = 1\n", encoding="utf-8")
    return folder


@pytest.mark.parametrize("given", ["", "wanted"])
def test_a_change_in_a_file_leads_to_another_folder(given: str, tmp_path: Path) -> None:
    """Also below the folder that the user wants; what others still run is not touched.

    A file counts in whose room something is compiled.
    """
    place = str(tmp_path / given) if given else ""
    sources = package(tmp_path / "package")
    before = Path(kernel_folder(place, sources))
    assert before.is_dir()
    assert before.parent == (Path(place) if place else sources / "__pycache__")
    assert Path(kernel_folder(place, sources)) == before
    (sources / "report" / "b.py").write_text("B = 12\n", encoding="utf-8")
    assert Path(kernel_folder(place, sources)) == before
    (sources / "research" / "inner" / "b.py").write_text("B = 12\n", encoding="utf-8")
    after = Path(kernel_folder(place, sources))
    assert after != before
    assert before.is_dir()


def test_all_that_is_compiled_lies_where_changes_count() -> None:
    """Constants too, that compiled code takes from elsewhere."""
    package = Path(kernel_cache.__file__).parents[1]
    known = {file for room in kernel_cache._ROOMS for file in package.glob(room)}
    used = re.compile(r"kernel_cache import .*\bkernel\b")
    compiled = {file for file in package.rglob("*.py") if used.search(file.read_text("utf-8"))}
    assert compiled - known == set()
    for file in compiled:
        text = file.read_text("utf-8")
        names = re.findall(r"^from loopgate((?:\.\w+)*) import", text, flags=re.MULTILINE)
        for name in names:
            path = package.joinpath(*name.split(".")[1:])
            assert {path.with_suffix(".py"), path / "__init__.py"} & known, (file, name)


def test_what_is_a_week_old_is_deleted(tmp_path: Path) -> None:
    """When a new folder is made."""
    sources = package(tmp_path / "package")
    before = Path(kernel_folder("", sources))
    os.utime(before, (0.0, time.time() - 8 * 24 * 3600))
    (sources / "a.py").write_text("A = 12\n", encoding="utf-8")
    assert Path(kernel_folder("", sources)).is_dir()
    assert not before.exists()


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="Windows has no such modes")
@pytest.mark.parametrize(
    "spoil", ["open", "listed", "link", "file", "open above", "foreign", "foreign above"]
)
def test_code_that_somebody_else_may_have_left_is_not_run(
    spoil: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiled code is run as it is found: the package's own folder takes the place of such a folder."""
    sources = package(tmp_path / "package")
    place = tmp_path / "wanted"
    folder = Path(kernel_folder(str(place), sources))
    assert folder.parent == place
    assert folder.stat().st_mode & 0o777 == 0o700
    shown, facts = Path.lstat, Path.stat
    if spoil in {"open", "listed"}:
        folder.chmod(0o722 if spoil == "open" else 0o755)
    elif spoil == "link":
        folder.rename(tmp_path / "elsewhere")
        folder.symlink_to(tmp_path / "elsewhere", target_is_directory=True)
    elif spoil == "file":
        folder.rmdir()
        folder.write_text("", encoding="utf-8")
    elif spoil == "open above":
        place.chmod(0o777)
    else:
        of = folder if spoil == "foreign" else place

        def owned(method: Any) -> Any:  # noqa: ANN401  of a path
            def ask(path: Path, **given: Any) -> os.stat_result:  # noqa: ANN401  as the method has it
                found = method(path, **given)
                return os.stat_result((*found[:4], 4_321, *found[5:])) if path == of else found

            return ask

        monkeypatch.setattr(Path, "lstat", owned(shown))
        monkeypatch.setattr(Path, "stat", owned(facts))
    assert Path(kernel_folder(str(place), sources)).parent == sources / "__pycache__"
    place.chmod(0o1777)
    if spoil == "open above":  # as /tmp is: nobody else can rename what is there
        assert Path(kernel_folder(str(place), sources)) == folder


def test_an_installation_that_cannot_be_written_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Here a file is where the folder would have to be: the user's own takes its place, if there is one."""
    sources = package(tmp_path / "package")
    (sources / "__pycache__").write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "mine"))
    assert Path(kernel_folder("", sources)).parent == tmp_path / "mine" / "loopgate"
    (tmp_path / "other").write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))
    assert kernel_folder("", sources) == ""


def test_kernels_are_kept_there(tmp_path: Path) -> None:
    """Where the user wants them."""
    module = "loopgate.research.state_space.kernels"
    script = (
        f"import importlib, numba\nfound = vars(importlib.import_module({module!r})).values()\n"
        "print(*(f.stats.cache_path for f in found if hasattr(f, 'overloads') and f.stats.cache_path))\n"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split()
    assert all(path.startswith(f"{tmp_path}/loopgate-kernels-") for path in done.stdout.split())


def test_compiling_is_announced_once(tmp_path: Path) -> None:
    """Not where nothing is compiled, nor where something of the kind was; and never into stdout."""
    script = (
        "import sys, numpy\nfrom loopgate.research.state_space.kernels import new_slots, rehash\n"
        "sys.stderr.write('imported\\n')\nkeys = numpy.zeros((1, 1), numpy.uint64)\n"
        "rehash(new_slots(2), keys, 1)\nrehash(new_slots(2), keys, eval(sys.argv[1]))\n"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    said = []
    for count in ("1", "numpy.uint8(1)"):
        done = subprocess.run(
            [sys.executable, "-c", script, count],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        assert not done.stdout
        said.append(done.stderr)
    line = "loopgate: compiling its kernels (research), once for this version; about half a minute\n"
    assert said == [f"imported\n{line}", "imported\n"]


def test_without_a_folder_nothing_is_marked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither here nor elsewhere."""
    monkeypatch.chdir(tmp_path)
    assert not mark("", "drive")
    assert not mark(str(tmp_path / "missing"), "drive")
    assert not list(tmp_path.iterdir())
    assert mark(str(tmp_path), "drive")
    assert not mark(str(tmp_path), "drive")


def test_without_numba_exploration_says_what_to_install() -> None:
    """One line; nothing that drives asks for it."""
    words = "['loopgate', 'study', 'explore', 'src/loopgate/research/theory/instances/fig10.json']"
    script = f"import sys; sys.modules['numba'] = None; sys.argv = {words}\n"
    script += "import loopgate.network.cover.search, loopgate.simulation.run\n"
    script += "from loopgate.cli.main import main; main()"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    line = "loopgate: exhaustive exploration needs numba; pip install 'sumo-loopgate[explore]'\n"
    assert (done.returncode, done.stderr) == (2, line)
