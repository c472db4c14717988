"""A fit of readings that leave something open says so, whatever noise and errors make of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.cli import main


@pytest.mark.parametrize("unread", [["x high"], ["z high", "x high", "y low"]])
def test_positions_that_were_not_read_are_told_as_such(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], unread: list[str]
) -> None:
    """Each leaves the six directions of its pose open, and nobody is told to expect that."""
    design = Path("designs/quickstart.yaml")
    plain = "".join(
        line + "\n"
        for line in design.read_text().splitlines()
        if not line.startswith("expected_rank_deficiency")
    )
    path, readings = tmp_path / "plan.yaml", tmp_path / "readings.csv"
    path.write_text(plain)
    assert main(["simulate", str(path), "-o", str(readings)]) == 0
    lines = readings.read_text().splitlines(keepends=True)
    readings.write_text("".join(one for one in lines if one.split(",")[0] not in unread))
    capsys.readouterr()
    for text in (plain, plain + "expected_rank_deficiency: 0\n"):
        path.write_text(text)
        assert main(["fit", str(path), str(readings)]) == 1
        out, err = capsys.readouterr()
        names, were = ", ".join(unread), "was" if len(unread) == 1 else "were"
        assert f"{names} {were} not read, which leaves {6 * len(unread)} directions" in out
        assert f"; {names} {were} not read" in err
        assert "expected_rank_deficiency" not in err
        told = [line for line in out.splitlines() if line.startswith("undetermined ")]
        assert not any("moved positions" in one and "changes no" in one for one in told)
        deficiency = int(out.split("rank deficiency ")[1].split(",")[0].split(" ")[0])
        assert deficiency == 6 * len(unread) + len(told)
