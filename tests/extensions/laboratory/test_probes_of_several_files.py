"""Probes that one file states stay, where another file has no column of them."""

import csv
from pathlib import Path

from ballplate.cli import main

QUICKSTART = "designs/quickstart.yaml"
AXES = ("x_mm", "y_mm", "z_mm")


def test_stated_probes_stay_where_another_file_has_no_column_of_probes(tmp_path: Path) -> None:
    simulated = tmp_path / "all.csv"
    assert main(["simulate", QUICKSTART, "-o", str(simulated)]) == 0
    rows = list(csv.DictReader(simulated.read_text(encoding="utf-8").splitlines()))
    planned = {row["position"]: set[str]() for row in rows}
    for row in rows:
        planned[row["position"]].add(row["probe"])
    single = next(position for position, probes in planned.items() if len(probes) == 1)
    files = []
    for name, columns, is_single in (
        ("single.csv", ("position", "ball", *AXES), True),
        ("others.csv", ("position", "ball", "probe", *AXES), False),
    ):
        chosen = [row for row in rows if (row["position"] == single) == is_single]
        lines = [columns, *([row[column] for column in columns] for row in chosen)]
        files.append(tmp_path / name)
        files[-1].write_text("".join(";".join(line) + "\n" for line in lines), encoding="utf-8")
    assert main(["fit", QUICKSTART, *map(str, files)]) == 0
