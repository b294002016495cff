"""Compiled code that is older than its source is forgotten."""

from pathlib import Path

from loopgate.kernel_cache import forget_stale_kernels


def package(folder: Path) -> Path:
    """Make a package of two files, and what a kernel of one left behind."""
    (folder / "inner" / "__pycache__").mkdir(parents=True)
    (folder / "a.py").write_text("A = 1\n", encoding="utf-8")
    (folder / "inner" / "b.py").write_text("B = 1\n", encoding="utf-8")
    for ending in ("nbi", "nbc"):
        (folder / "inner" / "__pycache__" / f"b.{ending}").write_bytes(b"kernel")
    return folder


def kernels(folder: Path) -> int:
    """Count what is left."""
    return len([*folder.rglob("*.nbi"), *folder.rglob("*.nbc")])


def test_a_change_in_any_file_makes_all_kernels_stale(tmp_path: Path) -> None:
    """At first nothing is known of them either; later they stay until a source file changes."""
    folder = package(tmp_path)
    assert forget_stale_kernels(folder)
    assert kernels(folder) == 0
    (folder / "inner" / "__pycache__" / "b.nbi").write_bytes(b"kernel")
    assert not forget_stale_kernels(folder)
    assert kernels(folder) == 1
    (folder / "a.py").write_text("A = 12\n", encoding="utf-8")
    assert forget_stale_kernels(folder)
    assert kernels(folder) == 0


def test_what_cannot_be_written_to_is_left_alone(tmp_path: Path) -> None:
    """An installation may be read-only; here a file is where the folder would have to be."""
    (tmp_path / "a.py").write_text("", encoding="utf-8")
    (tmp_path / "__pycache__").write_text("", encoding="utf-8")
    assert not forget_stale_kernels(tmp_path)
