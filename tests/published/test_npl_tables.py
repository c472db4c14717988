"""The uncertainties of NPL Report CISE 15/98, Tables 5 C, 6, 7, 8 and 11, from the shipped designs.

The printed figures carry the residual estimate of sigma of one simulated data set, a factor that all figures of
a column share. It is taken out as the geometric mid-range of the ratios that are compared.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from analysis.study import plan
from simulator.experiment.load import load

TABLES = Path(__file__).with_name("npl-cise-15-98-tables.csv")
SYMBOLS = ("U1", "U2", "U3", "U4", "U5", "U6")


def columns() -> Iterator[tuple[str, str, dict[str, float]]]:
    """Variant, statistic and printed figures of every column to compare."""
    for row in csv.DictReader(TABLES.read_text(encoding="utf-8").splitlines()):
        table, n, ndel = row["table"], row["n"], row["ndel"]
        if (table, row["statistic"]) in (("8", "maximum"), ("6", "maximum"), ("11", "maximum")):
            continue
        label = {
            "5": f"6.1.1-weights[C w={row['weight']}]",
            "6": "6.1.2[B]",
            "7": f"6.2.1[n={n} NDEL={ndel}]",
            "8": f"6.2.2[n={n} NDEL={ndel}]",
            "11": f"6.2.5[n={n} NDEL={ndel}]",
        }[table]
        yield label, row["statistic"], {symbol: float(row[symbol]) for symbol in SYMBOLS if row[symbol]}


def compared(label: str, statistic: str) -> dict[str, float]:
    """Permitted deviation of each symbol that is compared.

    Maxima over the unstated evaluation points, U3 (quoted for a conversion that the report does not give at NDEL 7)
    and U5 at small weights, for unstated pairs, cannot be compared.
    """
    if statistic == "maximum":
        return {"U1": 0.10, "U2": 0.10, "U5": 0.10}
    wide = 0.15 if label.startswith("6.1.2") else 0.10
    allowed = {"U1": wide, "U2": wide, "U4": 0.15, "U5": wide, "U6": wide}
    if "w=" in label and float(label.partition("w=")[2].rstrip("]")) < 2:
        del allowed["U5"]
    return allowed


def test_tables() -> None:
    experiments = {
        experiment.label: experiment
        for name in ("6.1.1-weights", "6.1.2", "6.2.1", "6.2.2", "6.2.5")
        for experiment in load(f"designs/npl/{name}.yaml")
    }
    failures, seen = [], 0
    print(f"\n{'experiment':28}{'':9}{'factor':>7}", *(f"{symbol:>7}" for symbol in SYMBOLS))
    for label, statistic, printed in columns():
        quantities = plan(experiments[label]).quantities
        ratio = {s: value / getattr(quantities[s], statistic) for s, value in printed.items()}
        allowed = compared(label, statistic)
        used = [ratio[s] for s in allowed if s in ratio]
        factor = math.sqrt(max(used) * min(used))
        seen += len(used)
        shown = (f"{ratio[s] / factor:7.3f}" if s in ratio else "      -" for s in SYMBOLS)
        print(f"{label:28}{statistic:9}{factor:7.3f}", *shown)
        # The factor is an estimate of sigma with a relative spread of a few percent.
        if not 0.85 < factor < 1.15:
            failures.append(f"{label} {statistic}: common factor {factor:.3f}")
        failures += [
            f"{label} {statistic} {s}: ratio {ratio[s] / factor:.3f}, permitted 1 +- {limit}"
            for s, limit in allowed.items()
            if s in ratio and abs(ratio[s] / factor - 1.0) > limit
        ]
    assert seen > 100
    assert not failures, "\n".join(failures)


def test_u3_of_the_five_coefficient_tables() -> None:
    """U3 is not part of the comparison above, but its averages at NDEL 5 agree within 15 %."""
    for experiment in load("designs/npl/6.2.2.yaml"):
        for label, statistic, printed in columns():
            if label == experiment.label and statistic == "average" and "NDEL=5" in label:
                assert plan(experiment).quantities["U3"].average == pytest.approx(printed["U3"], rel=0.15)


def test_empirical_errors_are_known_well_but_less_so_than_kinematic_ones() -> None:
    """Section 6.2.6: what the report says of Table 12."""
    found = {e.name: plan(e).quantities for e in load("designs/npl/6.2.6.yaml")}
    for n in (5, 7):
        for symbol in ("U1", "U2", "U4", "U6"):
            ratio = found[f"n={n} empirical"][symbol].average / found[f"n={n} kinematic"][symbol].average
            assert 1.0 < ratio < 2.0, (n, symbol)
