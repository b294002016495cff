"""Whether an installation is compiled: where it should be, where it cannot be, and what it then says."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest
from compiled_wheel import SETTING, SOURCE, WHY_PLAIN, compile_or_say_why, sources, stale

from loopgate import versions


def fail(folder: Path) -> list[Path]:
    """Stand for a compiler that fails."""
    raise subprocess.CalledProcessError(1, "cc", stderr=f"{folder}\nerror: no Python.h\n".encode())


def build(folder: Path) -> list[Path]:
    """Stand for a compiler that works."""
    return [folder / "ledger.so"]


@pytest.fixture
def compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Put nothing but a C compiler on the path, unset the setting, and return the compiler."""
    monkeypatch.delenv(SETTING, raising=False)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    file = tmp_path / "cc"
    file.write_text("#!/bin/sh\n")
    file.chmod(0o755)
    return file


def test_it_is_compiled_where_it_can_be(compiler: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody has to ask for it; 0 leaves it out."""
    folder = compiler.parent
    assert compile_or_say_why(folder, build) == [folder / "ledger.so"]
    assert not (folder / WHY_PLAIN).exists()
    monkeypatch.setenv(SETTING, "0")
    assert compile_or_say_why(folder, build) == []
    assert "LOOPGATE_COMPILE was 0" in (folder / WHY_PLAIN).read_text()


@pytest.mark.parametrize(
    ("there", "why"), [(False, "no C compiler was found"), (True, "the compiler failed (error: no Python.h)")]
)
def test_where_it_cannot_be_compiled_it_is_plain(
    compiler: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    *,
    there: bool,
    why: str,
) -> None:
    """The build and the package say why; only who demands a compiled one gets no installation."""
    if not there:
        compiler.unlink()
    folder = compiler.parent
    assert compile_or_say_why(folder, fail) == []
    assert why in capsys.readouterr().err
    assert why in (folder / WHY_PLAIN).read_text()
    monkeypatch.setenv(SETTING, "1")
    with pytest.raises(SystemExit, match="LOOPGATE_COMPILE=1"):
        compile_or_say_why(folder, fail)


def test_the_package_says_why_it_is_plain(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the words of the build."""
    monkeypatch.setattr(versions, "__file__", str(tmp_path / "versions.py"))
    (tmp_path / WHY_PLAIN.name).write_text("no C compiler was found when it was installed\n")
    monkeypatch.setattr(versions, "ledger_kind", lambda: "plain")
    assert versions.ledger_words().startswith("plain ledger (no C compiler was found when it was installed)")
    monkeypatch.setattr(versions, "ledger_kind", lambda: "compiled")
    assert versions.ledger_words() == "compiled ledger"


def test_what_was_compiled_of_older_source_is_stale(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests refuse to begin then: it would run instead of the source."""
    shutil.copytree(SOURCE / "loopgate", tmp_path / "loopgate", ignore=shutil.ignore_patterns("*.so"))
    monkeypatch.setattr("compiled_wheel.SOURCE", tmp_path)
    assert not stale()
    (tmp_path / "loopgate" / "control" / "ledger.so").touch()
    assert not stale()
    newer = sources(tmp_path)[0]
    os.utime(newer, (2e9, 2e9))
    assert stale() == [newer]


@pytest.mark.slow
@pytest.mark.skipif(not (find_spec("mypyc") and shutil.which("cc")), reason="needs mypyc and a compiler")
def test_the_wheel_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has every compiled module, and a tag of this Python; with a broken compiler it has none."""
    words = ("pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", str(tmp_path))
    monkeypatch.setenv("MYPYC_OPT_LEVEL", "0")
    monkeypatch.delenv(SETTING, raising=False)
    for compiler in ("cc", "false"):
        monkeypatch.setenv("CC", compiler)
        subprocess.run([sys.executable, "-m", *words, str(SOURCE.parent)], check=True, timeout=600)
    plain, compiled = sorted(tmp_path.glob("*.whl"), key=lambda wheel: "none-any" not in wheel.name)
    assert f"cp3{sys.version_info[1]}-cp3{sys.version_info[1]}-" in compiled.name
    names = zipfile.ZipFile(compiled).namelist()
    for source in sources(SOURCE):
        start = f"{source.relative_to(SOURCE).with_suffix('')}."
        assert any(name.startswith(start) and name.endswith(".so") for name in names), start
    assert not any(name.endswith(".so") for name in zipfile.ZipFile(plain).namelist())
    assert "the compiler failed" in zipfile.ZipFile(plain).read(str(WHY_PLAIN)).decode()
