"""Names of files in a bundle, which are the same on every system."""

from __future__ import annotations

from pathlib import Path, PurePath, PurePosixPath, PureWindowsPath

import pytest
from ballplate.extensions.sweeps.bundle import Bundle, names_of, unpack

from tests.extensions.sweeps import wording


@pytest.mark.parametrize("top", ["C:/plan", "//server/share/plan", "D:/with blank/µ"])
def test_names_in_a_bundle_are_those_of_posix(top: str) -> None:
    names = ["Z.yaml", "a.yaml", "b-c/x.csv", "b/x.csv", "tables/µ 1.csv"]
    posix = names_of([PurePosixPath("/plan") / name for name in names])
    windows = names_of([PureWindowsPath(top) / name.replace("/", "\\") for name in reversed(names)])
    assert list(windows.values()) == list(posix.values())
    assert sorted(posix.values()) == sorted(names)


def test_files_on_two_drives_have_no_names() -> None:
    paths: list[PurePath] = [
        PureWindowsPath("C:/plan/sweep.yaml"),
        PureWindowsPath("D:/plan/base.yaml"),
    ]
    with pytest.raises(ValueError, match="several drives"):
        names_of(paths)


def test_names_that_differ_in_case_only_are_not_mixed_up(tmp_path: Path) -> None:
    """Here the same name stands for it twice, as a file system that does not tell case has it."""
    bundle = Bundle(
        "s.yaml", "b.yaml", (("s.yaml", b"1"), ("b.yaml", b"2"), ("x.csv", b"3"), ("x.csv", b"4"))
    )
    with pytest.raises(ValueError, match=wording.DIFFERS_IN_CASE_ONLY):
        unpack(bundle, tmp_path)
    assert (tmp_path / "x.csv").read_bytes() == b"3"
