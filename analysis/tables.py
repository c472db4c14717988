"""Results as text for people, and as plain data for programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from .adjustments import ARCSECOND, Adjustment, freedom_words
from .plates import PlateCoordinates
from .rank import Verdict
from .study import Fit, Plan
from .tasks import TaskUncertainty, is_determined
from .uncertainty import Quantity

# Small lengths and angles are shown in these; the factor takes metres and radians there.
SHOWN = {"m": "um", "rad": "urad", "1": "ppm"}


# Balls of a plate that a table has room for.
MOST_BALLS = 100


def shown_unit(unit: str) -> str:
    """Unit in which tables show values of a unit.

    >>> shown_unit("m, rad")
    'um, urad'
    """
    return ", ".join(SHOWN[part] for part in unit.split(", "))


def number(value: float, digits: int = 4) -> str:
    """A number with significant digits, and a dash for what is undetermined.

    >>> number(0.123456), number(12345.678), number(float("nan"))
    ('0.1235', '12350', '-')
    """
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    if value == 0:
        return "0"
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    magnitude = round(value, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{magnitude:.{decimals}f}" if decimals < 12 else f"{value:.{digits - 1}e}"


def to_uncertainty(value: float, uncertainty: float) -> str:
    """A value to the third digit of its standard uncertainty.

    >>> to_uncertainty(50000.2134, 0.169), to_uncertainty(-0.0421495, 0.597), to_uncertainty(12.0, float("nan"))
    ('50000.213', '-0.042', '12.0000')
    """
    if math.isnan(value) or not uncertainty > 0.0:
        return number(value, 6)
    return f"{value:.{max(2 - math.floor(math.log10(uncertainty)), 0)}f}"


def aligned(rows: Sequence[Sequence[str]], right: Sequence[bool]) -> list[str]:
    """Rows of cells as lines of text with aligned columns.

    >>> aligned([["a", "1"], ["bb", "22"]], [False, True])
    ['a    1', 'bb  22']
    """
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if to_right else cell.ljust(width)
            for cell, width, to_right in zip(row, widths, right, strict=True)
        ]
        lines.append("  ".join(cells).rstrip())
    return lines


def uncertainty_table(quantities: dict[str, Quantity]) -> list[str]:
    """U1 to U6 as lines of text."""
    rows = [["", "standard uncertainty of", "maximum", "average", "unit", "count", "largest at"]]
    for symbol, quantity in quantities.items():
        count = str(quantity.count)
        if quantity.undetermined:
            count += f" ({quantity.undetermined} undetermined)"
        rows.append(
            [
                symbol.partition(" ")[0] if " " not in symbol else "",
                quantity.description,
                number(1e6 * quantity.maximum),
                number(1e6 * quantity.average),
                shown_unit(quantity.unit),
                count,
                quantity.largest,
            ]
        )
    lines = aligned(rows, [False, False, True, True, False, False, False])
    for quantity in quantities.values():
        if quantity.within_target is not None:
            share = number(100 * quantity.within_target)
            lines.append(f"within the target accuracy (one standard uncertainty): {share} % of {quantity.symbol}")
    return lines


def task_table(tasks: Sequence[TaskUncertainty]) -> list[str]:
    """Measuring tasks as lines of text."""
    rows = [["task", "length, mm", "standard uncertainty, um", "expanded (k = 2), um", "target, um", "within target"]]
    for task in tasks:
        rows.append(
            [
                task.name,
                number(1e3 * task.length, 6),
                *(number(1e6 * u) for u in (task.standard_uncertainty, task.expanded_uncertainty)),
                "" if task.target is None else number(1e6 * task.target),
                _judged(task),
            ]
        )
    with_target = any(task.target is not None for task in tasks)
    note = ["(the target is compared with the standard uncertainty)"] if with_target else []
    return [*aligned(rows, [False, True, True, True, True, False]), *note]


def _judged(task: TaskUncertainty) -> str:
    if not is_determined(task):
        return "undetermined"
    return "" if task.is_within is None else "yes" if task.is_within else "no"


def task_data(tasks: Sequence[TaskUncertainty]) -> dict[str, Any]:
    """Measuring tasks as plain data in metres; what is undetermined is None."""
    return {
        task.name: {
            "length": task.length,
            "standard_uncertainty": finite(task.standard_uncertainty),
            "expanded_uncertainty": finite(task.expanded_uncertainty),
            "target": task.target,
            "within_target": task.is_within,
            "unit": "m",
        }
        for task in tasks
    }


def verdict_lines(judged: Verdict, with_values: bool = False) -> list[str]:
    """A verdict on rank as lines of text."""
    lines = []
    rank = f"rank deficiency {judged.deficiency}" if judged.deficiency else "full rank"
    if judged.expected is not None or not judged.as_expected:
        wanted = judged.expected or 0
        rank += ", as expected" if judged.as_expected else f", expected {wanted or 'full rank'}"
        rank += " (the file does not say otherwise)" if judged.expected is None else ""
    lines.append(f"{rank}; {judged.parameters} parameters, {judged.observations} observations")
    values = judged.singular_values
    if len(values) and with_values:
        rank_of = len(values) - judged.deficiency
        text = (
            f"singular values {values[0]:.3g} to {values[rank_of - 1]:.3g}" if rank_of else "no singular value counts"
        )
        if judged.deficiency:
            text += f", then {values[rank_of]:.3g} and below (gap {judged.gap:.2g})"
        lines.append(text + ", in standard deviations per micrometre")
    for title, directions in (("undetermined", judged.null), ("weakly determined", judged.weak)):
        for k, direction in enumerate(directions[:20], start=1):
            lines.append(f"{title} {k}: {direction}")
        if len(directions) > 20:
            lines.append(f"{title}: {len(directions) - 20} directions more")
    lines += [f"reason: {reason}" for reason in judged.reasons]
    return lines


def plan_lines(plan: Plan) -> list[str]:
    """A plan as lines of text: title, verdict and table."""
    lines = [f"{plan.label}: {plan.title}", *verdict_lines(plan.verdict, with_values=True)]
    lines += ["", *uncertainty_table(plan.quantities)] if plan.quantities else []
    return lines + ["", *task_table(plan.tasks)] if plan.tasks else lines


def fit_lines(fit: Fit) -> list[str]:
    """A fit as lines of text: iterations, verdict, U1 to U6 and the machine's parameters."""
    record = fit.solution.iterations
    lines = [f"{fit.label}: {fit.title}", *verdict_lines(fit.verdict, with_values=True)]
    how = "estimated from the residuals" if fit.sigma_is_estimated else "as given"
    summary = f"{fit.solution.status} after {len(record) - 1} iterations; S^2 = {record[-1].sum_of_squares:.6g}"
    if fit.converged:
        summary += f" with {freedom_words(fit.degrees_of_freedom)}; sigma = {fit.sigma:.4g} times the stated "
        summary += f"uncertainties ({how})"
    rows = [["iteration", "step", "S^2"]]
    rows += [[str(k), f"{it.step:.5e}" if k else "", f"{it.sum_of_squares:.5e}"] for k, it in enumerate(record)]
    lines += [summary, "", *aligned(rows, [True, True, True])]
    if not fit.converged:
        return lines
    lines += ["", *residual_table(fit)]
    if fit.diagnosis:
        from .reliability.wording import diagnosis_lines

        lines += diagnosis_lines(fit.diagnosis, fit.marks)
    lines += ["", *uncertainty_table(fit.quantities), ""]
    lines += [*task_table(fit.tasks), ""] if fit.tasks else []
    rows = [["parameter", "value", "standard uncertainty", "unit"]]
    machine_and_poses = [
        e for e in fit.estimates if ": origin" not in e.name and not e.name.endswith((": x", ": y", ": z"))
    ]
    for estimate in machine_and_poses:
        rows.append(
            [
                estimate.name,
                to_uncertainty(1e6 * estimate.value, 1e6 * estimate.standard_uncertainty),
                number(1e6 * estimate.standard_uncertainty, 3),
                SHOWN[estimate.unit],
            ]
        )
    lines += aligned(rows, [False, True, True, False])
    lines.append("(origins of positions and co-ordinates of balls are among the estimates of --json)")
    if fit.adjustments:
        lines += ["", *adjustment_lines(fit.adjustments)]
    for plate in fit.plates:
        lines += ["", *plate_table(plate, named=len(fit.plates) > 1)]
    return lines


def plate_table(plate: PlateCoordinates, named: bool = False, most: int = MOST_BALLS) -> list[str]:
    """A plate's co-ordinates in its own axes as lines of text, for the first balls of a large one."""
    title = "co-ordinates of the balls in the plate's own axes"
    lines = [f"{plate.artefact + ': ' if named else ''}{title} ({plate.words})"]
    rows = [["ball", "x, mm", "y, mm", "standard uncertainty of x, um", "of y, um"]]
    for name, values, uncertainties in zip(plate.names, plate.coordinates, plate.standard_uncertainties, strict=True):
        x, y = (to_uncertainty(1e3 * v, 1e3 * u) for v, u in zip(values, uncertainties, strict=True))
        rows.append([name, x, y, *(number(1e6 * u, 3) for u in uncertainties)])
    lines += aligned(rows[: most + 1], [False, True, True, True, True])
    return lines + ([f"({len(rows) - 1 - most} balls more in --json)"] if len(rows) - 1 > most else [])


def adjustment_lines(found: Sequence[Adjustment]) -> list[str]:
    """Adjustments as a table of text."""
    rows = [["adjustment", "is off by", "standard uncertainty", "expanded, 95 %", "unit", "what to do"]]
    for one in found:
        shown = ARCSECOND if one.unit == "rad" else 1e-6
        value, u, expanded = (
            number(v / shown) for v in (one.value, one.standard_uncertainty, one.expanded_uncertainty)
        )
        rows.append([one.what, value, u, expanded, "arcsec" if one.unit == "rad" else "um/m", one.words])
    return [
        *aligned(rows, [False, True, True, True, False, False]),
        "(a scale is off by what readings lack of the true length; an angle by what it exceeds 90 deg)",
    ]


def adjustment_data(found: Sequence[Adjustment]) -> dict[str, Any]:
    """Adjustments as plain data; what is open is None."""
    return {
        one.name: {
            "what": one.what,
            "value": finite(one.value),
            "standard_uncertainty": finite(one.standard_uncertainty),
            "expanded_uncertainty": finite(one.expanded_uncertainty),
            "unit": one.unit,
            "words": one.words,
        }
        for one in found
    }


def residual_table(fit: Fit, count: int = 3) -> list[str]:
    """The largest residuals as lines of text."""
    rows = [["largest residuals", "", "", "", "um", "standard uncertainties"]]
    for one in fit.largest[:count]:
        rows.append(
            [one.position, one.ball, one.probe, one.axis, number(1e6 * one.value), number(one.standardised / fit.sigma)]
        )
    return aligned(rows, [False, False, False, False, True, True])


def plan_data(plan: Plan) -> dict[str, Any]:
    """A plan as plain data in metres and radians at full precision; what is undetermined is None."""
    return {
        "experiment": plan.label,
        "title": plan.title,
        **_verdict_data(plan.verdict),
        "sigma": 1.0,
        "quantities": _quantities_data(plan.quantities),
        **({"tasks": task_data(plan.tasks)} if plan.tasks else {}),
    }


def fit_data(fit: Fit) -> dict[str, Any]:
    """A fit as plain data in metres and radians at full precision; what is undetermined is None."""
    suspected: dict[str, Any] = {}
    if fit.diagnosis:
        from .reliability.wording import diagnosis_data

        suspected = {"suspected": diagnosis_data(fit.diagnosis, fit.marks)}
    return {
        "experiment": fit.label,
        "title": fit.title,
        **_verdict_data(fit.verdict),
        "status": fit.solution.status,
        "sigma": fit.sigma,
        "sigma_is_estimated": fit.sigma_is_estimated,
        "degrees_of_freedom": fit.degrees_of_freedom,
        "too_large": fit.too_large,
        "sum_of_squares": finite(fit.solution.factor.sum_of_squares),
        "iterations": [
            {"step": finite(it.step), "sum_of_squares": finite(it.sum_of_squares)} for it in fit.solution.iterations
        ],
        "quantities": _quantities_data(fit.quantities),
        **({"tasks": task_data(fit.tasks)} if fit.tasks else {}),
        "largest_residuals": [
            {
                "position": one.position,
                "ball": one.ball,
                "probe": one.probe,
                "axis": one.axis,
                "value": one.value,
                "unit": "m",
                "standard_uncertainties": one.standardised / fit.sigma,
            }
            for one in fit.largest
        ],
        **suspected,
        "estimates": {
            e.name: {
                "value": finite(e.value),
                "standard_uncertainty": finite(e.standard_uncertainty),
                "unit": e.unit,
            }
            for e in fit.estimates
        },
        **({"plates": {plate.artefact: plate_data(plate) for plate in fit.plates}} if fit.plates else {}),
        **({"adjustments": adjustment_data(fit.adjustments)} if fit.adjustments else {}),
    }


def plate_data(plate: PlateCoordinates) -> dict[str, Any]:
    """A plate's co-ordinates in its own axes as plain data in metres; what is undetermined is None."""
    axes = plate.axes
    return {
        "axes": {"origin": plate.names[axes.origin], "xy"[axes.axis]: plate.names[axes.ball]},
        "balls": {
            name: {
                axis: {"value": finite(value), "standard_uncertainty": finite(uncertainty), "unit": "m"}
                for axis, value, uncertainty in zip("xy", values, uncertainties, strict=True)
            }
            for name, values, uncertainties in zip(
                plate.names, plate.coordinates.tolist(), plate.standard_uncertainties.tolist(), strict=True
            )
        },
    }


def finite(value: float) -> float | None:
    """A value as JSON can have it; None for what is undetermined."""
    return value if math.isfinite(value) else None


def _quantities_data(quantities: dict[str, Quantity]) -> dict[str, Any]:
    return {
        symbol: {
            "maximum": finite(q.maximum),
            "average": finite(q.average),
            "unit": q.unit,
            "count": q.count,
            "undetermined": q.undetermined,
            "largest_at": q.largest,
            **({} if q.within_target is None else {"within_target": q.within_target}),
            "description": q.description,
        }
        for symbol, q in quantities.items()
    }


def _verdict_data(judged: Verdict) -> dict[str, Any]:
    return {
        "parameters": judged.parameters,
        "observations": judged.observations,
        "rank_deficiency": judged.deficiency,
        "expected_rank_deficiency": judged.expected,
        "as_expected": judged.as_expected,
        "singular_values": [float(v) for v in judged.singular_values],
        "gap": finite(judged.gap),
        "undetermined": [str(direction) for direction in judged.null],
        "reasons": list(judged.reasons),
        "weakly_determined": [
            {"text": str(direction), "standard_deviation": direction.standard_deviation} for direction in judged.weak
        ],
    }
