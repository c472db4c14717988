"""Parts of results as text for people, and as plain data for programs."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING, Any

from ballplate.presentation.formatting import (
    Data,
    given,
    number,
    percent,
    picked,
    shown_unit,
    uncertainty_words,
)
from ballplate.rank.verdicts import GREAT, Verdict
from ballplate.simulator.computing.numerics import printable
from ballplate.simulator.inputs.settings import listing, number_of
from ballplate.uncertainty.scale import Scale
from ballplate.uncertainty.summaries import Quantity

if TYPE_CHECKING:
    from ballplate.simulator.estimation.gauss_newton import Iteration
    from ballplate.simulator.experiment.model import Experiment


# Format of sums of squares.
SQUARES = "{:.5e}".format


def _counted(quantity: Quantity) -> str:
    count = str(quantity.count)
    return f"{count} ({quantity.undetermined} undetermined)" if quantity.undetermined else count


QUANTITY_COLUMNS: dict[str, Any] = {
    "standard uncertainty of": "description",
    "maximum": "maximum",
    "average": "average",
    "unit": "unit",
    "count": "count",
    "undetermined": "undetermined",
    "largest at": "largest",
}


def uncertainty_table(quantities: dict[str, Quantity], caveat: str = "") -> list[str]:
    """Return U1 to U6 as lines of text; a `caveat` follows shares within the target."""
    from ballplate.presentation.table_columns import table_lines

    shown = {symbol: row for symbol, row in quantities.items() if ", " not in row.unit}
    names = [symbol.partition(" ")[0] for symbol in shown]
    firsts = ["" if name in names[:k] else name for k, name in enumerate(names)]
    columns = {"": firsts, **QUANTITY_COLUMNS, "count": _counted}
    lines = table_lines(columns, list(shown.values()), "undetermined")
    locations = list(
        dict.fromkeys(location for quantity in quantities.values() for location in quantity.places)
    )
    lines += [f"({', '.join(locations)})"] if locations else []
    for quantity in quantities.values():
        if quantity.parameters:
            values = (
                f"{name} {'undetermined' if math.isnan(u) else number(1e6 * u)}"
                for name, u in quantity.parameters
            )
            unit = shown_unit(quantity.unit)
            lines.append(f"({quantity.description}, {unit}: {', '.join(values)})")
        if quantity.within_target is not None:
            uncertainty = uncertainty_words(quantity.coverage_factor)
            share = percent(quantity.within_target)
            lines.append(
                f"within the target uncertainty ({uncertainty}): {share} of"
                f" {quantity.symbol}{caveat}"
            )
    return lines


def verdict_lines(
    judged: Verdict,
    lengths: Quantity | None = None,
    unread: Collection[str] = (),
) -> list[str]:
    """Return a verdict on rank as lines of text.

    `lengths`, U6, quantifies all directions together; poses of `unread` positions share one line.
    """
    lines = []
    rank = f"rank deficiency {judged.deficiency}" if judged.deficiency else "full rank"
    if judged.expected is not None or not judged.as_expected:
        expected = judged.expected or "full rank"
        rank += ", as expected" if judged.as_expected else f", expected {expected}"
        rank += " (the file does not say otherwise)" if judged.expected is None else ""
    lines.append(f"{rank}; {judged.parameters} parameters, {judged.observations} observations")
    for title, directions in (("undetermined", judged.null), ("weakly determined", judged.weak)):
        listed = [
            (k, direction)
            for k, direction in enumerate(directions, start=1)
            if not direction.is_pose_of(unread)
        ]
        if len(listed) < len(directions):
            count = len(directions) - len(listed)
            poses = f"{number_of(count, 'direction')} of poses"
            lines.append(f"{title}: {not_read(unread)}, which leaves {poses} open")
        for k, direction in listed[:20]:
            lines.append(f"{title} {k}: {direction}")
        if len(listed) > 20:
            lines.append(f"{title}: {len(listed) - 20} directions more")
    if judged.weak and lengths is not None:
        lines.append(f"all directions together: {_lengths_words(lengths)}")
    return lines


def iteration_lines(
    record: Sequence[Iteration], shown: Callable[[float], str] = SQUARES
) -> list[str]:
    """Return the record of iterations as lines of text, with steps as `shown`."""
    from ballplate.presentation.table_columns import table_lines

    columns = {
        "iteration": range(len(record)),
        "step": ([None, *(iteration.step for iteration in record[1:])], shown),
        "S^2": ("sum_of_squares", SQUARES),
    }
    return table_lines(columns, record)


def map_lines(experiment: Experiment | None) -> list[str]:
    """Return how prior maps are scaled without an estimated sigma, as lines of text."""
    campaigns = () if experiment is None else experiment.earlier_campaigns
    return [
        f"prior {campaign.file} scaled with its sigma, {number(campaign.sigma)}"
        for campaign in campaigns
    ]


def not_read(unread: Collection[str]) -> str:
    """Return a sentence that names positions without readings.

    >>> not_read(["P3"]), not_read(["P3", "P4"])
    ('P3 was not read', 'P3, P4 were not read')
    """
    return f"{listing(unread)} {'was' if len(unread) == 1 else 'were'} not read"


def _lengths_words(lengths: Quantity) -> str:
    if lengths.undetermined:
        is_all = lengths.undetermined == lengths.count
        part = f"{lengths.undetermined} of {lengths.count} distances"
        return f"{'all are' if is_all else part} undetermined"
    # A share of an expanded uncertainty precedes this: name the standard one.
    symbol = "U6" if lengths.coverage_factor == 1.0 else "standard uncertainty U6"
    return (
        f"{symbol} {number(1e6 * lengths.average)} µm on average,"
        f" {number(1e6 * lengths.maximum)} µm at most"
    )


def target_lines(lengths: Quantity | None) -> list[str]:
    """Return the share of lengths within the target uncertainty, with U6, as a line of text; empty
    without a target.
    """
    if lengths is None or lengths.within_target is None:
        return []
    uncertainty, share = uncertainty_words(lengths.coverage_factor), percent(lengths.within_target)
    return [
        f"within the target uncertainty ({uncertainty}): {share} of {lengths.count} lengths;"
        f" {_lengths_words(lengths)}"
    ]


def scale_lines(scale: Scale | None) -> list[str]:
    """Return the sources of scale as a line of text; empty if scale is undetermined."""
    if scale is None:
        return []
    if all(carrier.without is None for carrier in scale.carriers):
        # The uncertainty of other parameters is no measure of the scales' error.
        return [f"scale comes from {' and '.join(carrier.words for carrier in scale.carriers)}"]
    sources = []
    for carrier in scale.carriers:
        if carrier.without is None:
            sources.append(carrier.words)
            continue
        without = (
            "undetermined"
            if math.isinf(carrier.without)
            else f"{number(1e6 * carrier.without, 3)} ppm"
        )
        sources.append(f"{carrier.words} ({without} without)")
    return [f"scale known to {number(1e6 * scale.uncertainty, 3)} ppm from {' and '.join(sources)}"]


def scale_warnings(scale: Scale | None) -> list[str]:
    """Return a warning if scale rests on probe offsets taken as exact."""
    if scale is None or not scale.rests_on_offsets:
        return []
    warning = "warning: the scale rests on probe offsets that are held exact"
    if scale.loosened is not None:
        loose = scale.loosened
        average, most, before = (
            number(1e6 * value) for value in (loose.average, loose.maximum, loose.before)
        )
        warning += (
            f": with a standard uncertainty of {1e6 * loose.offset_uncertainty:g} µm of each but"
            f" one, U6 would be {average} µm on average and {most} µm at most instead of"
            f" {before} µm on average"
        )
    return [f"{warning}; calibrate a distance, or state the standard uncertainty of the offsets"]


def scale_data(scale: Scale | None) -> Data | None:
    """Return the sources of scale as plain data, relative standard uncertainties, and U6 in
    metres.
    """
    if scale is None:
        return None
    loose = scale.loosened
    return {
        "standard_uncertainty": scale.uncertainty,
        "carried_by": [
            {"text": carrier.words, "without": carrier.without} for carrier in scale.carriers
        ],
        "rests_on_exact_offsets": scale.rests_on_offsets,
        "with_uncertain_offsets": loose
        and {
            "standard_uncertainty": loose.offset_uncertainty,
            "U6_average": loose.average,
            "U6_maximum": loose.maximum,
        },
    }


def singular_value_words(judged: Verdict) -> str:
    """Return the largest and smallest singular value that count, and those that follow."""
    values = judged.singular_values
    rank = len(values) - judged.deficiency
    text = "no singular value is above rounding"
    if rank:
        largest, smallest = printable(values[0]), printable(values[rank - 1])
        text = f"singular values {largest:.3g} to {smallest:.3g}{_border(judged)}"
    return text + ", in standard deviations per micrometre"


def _border(judged: Verdict) -> str:
    """Return the singular values that follow those that count; rounding errors stay unnamed."""
    if not judged.deficiency:
        return ""
    if judged.gap >= GREAT:
        return f", then rounding (gap above {GREAT:.0e})"
    first = judged.singular_values[-judged.deficiency]
    return f", then {printable(first):.3g} and below (gap {printable(judged.gap):.2g})"


def quantities_data(quantities: dict[str, Quantity]) -> Data:
    return {symbol: quantity_data(quantity) for symbol, quantity in quantities.items()}


def quantity_data(q: Quantity) -> Data:
    compared = {}
    if q.within_target is not None:
        compared = {"within_target": q.within_target, "target_coverage_factor": q.coverage_factor}
    return {
        **picked(q, "maximum", "average", "unit", "count", "undetermined"),
        "largest_at": q.largest,
        **given(largest_places=q.places),
        **compared,
        **given(parameters=dict(q.parameters)),
        "description": q.description,
    }


def verdict_data(judged: Verdict) -> Data:
    return {
        **picked(judged, "parameters", "observations"),
        "rank_deficiency": judged.deficiency,
        "expected_rank_deficiency": judged.expected,
        **picked(judged, "as_expected", "singular_values", "gap"),
        "undetermined": list(map(str, judged.null)),
        "weakly_determined": [
            {
                "text": str(direction),
                **picked(direction, "standard_deviation", "points"),
                "points_beyond_limit": direction.beyond,
                "limit": direction.limit,
            }
            for direction in judged.weak
        ],
    }
