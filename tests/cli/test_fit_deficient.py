"""A fit of readings that leave something open says so, whatever noise and errors make of it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from ballplate.cli import main


@pytest.mark.parametrize(
    "truth", ["kind: random\n  position: 2 um\n  rotation: 4 urad\n  seed: 7", "kind: zero"]
)
def test_the_rank_of_a_fit_is_that_of_the_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], truth: str
) -> None:
    text = Path("designs/quickstart.yaml").read_text()
    lines = [line for line in text.splitlines() if "plane: y" not in line]
    text = "\n".join(lines).replace(
        "kind: random\n  position: 2 um\n  rotation: 4 urad\n  seed: 7", truth
    )
    path, readings = tmp_path / "plan.yaml", tmp_path / "readings.csv"
    path.write_text(text + "\n")
    assert main(["check", str(path), "--json"]) == 1
    deficiency = json.loads(capsys.readouterr().out)["rank_deficiency"]
    assert deficiency > 0
    assert main(["simulate", str(path), "-o", str(readings)]) == 0
    assert main(["fit", str(path), str(readings), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["rank_deficiency"] == deficiency
