"""What would have been noticed of each assumption, and what cannot be, in residuals without the
causes found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from ballplate.presentation import number
from ballplate.simulator.computing import svd
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Array, Unit

from .cause_search import Search
from .events import ASSUMED
from .findings import AssumptionAnswer
from .names import name
from .power import noncentrality
from .remainders import HIDDEN, Leftover
from .scatter import log_chances
from .wording import words_of

# Power of the tests of what can be noticed.
POWER = 0.8

# Terms of a combination of parameters below this share are not printed.
SMALLEST_TERM = 0.01


def assumptions_tested(search: Search) -> Iterator[AssumptionAnswer]:
    """Return the answer to each assumption: its smallest p-value times the number of its tests."""
    biases, left = search.patterns, search.left
    least = _least(search, True)
    single = search.best_event_chance(lambda kind: kind not in ASSUMED)
    information = search.columns.information[biases.of_kind("reading")]
    seen = information[information > 0.0]
    noticed = least / math.sqrt(seen.min()) if len(seen) else math.nan
    hidden = [name(biases, k) for k in biases.of_kind("reading")[information <= 0.0].tolist()]
    yield _answer("gross errors", *single, noticed, "m", hidden)
    least = _least(search, False)
    for kind, assumed in ASSUMED.items():
        columns = biases.of_kind(kind)
        sizes, not_seen = [], []
        for subject in np.unique(biases.subject[columns]).tolist():
            own = columns[biases.subject[columns] == subject]
            names = [AXIS_NAMES[axis] if axis >= 0 else "" for axis in biases.axis[own].tolist()]
            dense = biases.matrix[:, own].toarray()
            sizes_seen, unseen = _seen(search, left, dense, names)
            sizes += (least * sizes_seen).tolist()
            not_seen += [f"{words_of(biases, own)}, {each}".rstrip(", ") for each in unseen]
        if len(columns):
            best = search.best_event_chance(kind.__eq__)
            most, unit = max(sizes, default=math.nan), biases.unit(int(columns[0]))
            yield _answer(assumed, *best, most, unit, not_seen)
    chances = search.chances()
    for assumed in dict.fromkeys(each.assumed for each in search.hypotheses):
        sizes, not_seen, of_it = [], [], []
        for k, each in enumerate(search.hypotheses):
            if each.assumed == assumed and search.bases[k].shape[1]:
                of_it.append(float(chances[k]))
            if each.assumed == assumed and each.parameters:
                sizes_seen, unseen = _seen(search, left, each.biases, each.parameters)
                sizes += (least * sizes_seen).tolist()
                not_seen += [f"{each.words}, {one}" for one in unseen]
        unit = next(each.unit for each in search.hypotheses if each.assumed == assumed)
        noticed = max(sizes, default=math.nan)
        yield _answer(assumed, min(of_it, default=0.0), len(of_it), noticed, unit, not_seen)
    noise = log_chances(search.scatters, left, search.estimated).tolist()
    if noise:
        yield _answer("scatter", min(noise), len(noise), math.nan, "1", [])


def _answer(
    assumed: str, best: float, count: int, noticed: float, unit: Unit, not_seen: list[str]
) -> AssumptionAnswer:
    p_value = min(count * math.exp(best), 1.0) if count else math.nan
    return AssumptionAnswer(assumed, p_value, count, noticed, unit, tuple(not_seen))


def _least(search: Search, is_single: bool) -> float:
    """Return the size, in metres per unit of sensitivity, that a test at its limit notices."""
    left = search.left
    freedom = left.freedom - 1 if search.estimated else math.inf
    sigma = math.sqrt(left.sum_of_squares / left.freedom) if search.estimated else 1.0
    limit = search.limit if is_single else search.other_limit
    return noncentrality(math.exp(limit), POWER, freedom) * sigma


def _seen(
    search: Search, left: Leftover, sensitivity: Array, names: Sequence[str]
) -> tuple[Array, list[str]]:
    """Return standard uncertainties (r,), in units of sigma, of the combinations of parameters that
    residuals show, and the combinations that they never show.
    """
    size = np.linalg.norm(sensitivity, axis=0)
    size[size == 0.0] = 1.0
    _, values, vectors = svd(left.of(sensitivity / size), full_matrices=False)
    shown = int((values**2 > HIDDEN).sum())
    rows = _reduced(vectors[:shown] * size)
    root = (rows / size) @ vectors[:shown].T / values[:shown]
    _, values, vectors = svd(search.start.of(sensitivity / size), full_matrices=False)
    hidden = _reduced(vectors[values**2 <= HIDDEN] * size)
    return np.linalg.norm(root, axis=1), [combination(row, names) for row in hidden]


def _reduced(rows: Array) -> Array:
    """Return rows (r, k) that span the same, each with 1 in a column in which the others have 0."""
    rows, columns = rows.copy(), np.zeros(len(rows), np.int64)
    for k in range(len(rows)):
        row, columns[k] = divmod(int(np.abs(rows[k:]).argmax()), rows.shape[1])
        rows[[k, k + row]] = rows[[k + row, k]]
        rows[k] /= rows[k, columns[k]]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, columns[k]], rows[k])
    return rows[np.argsort(columns)]


def combination(row: Array, names: Sequence[str]) -> str:
    """Return a combination of named parameters, such as "x - 0.5 y", without its smallest terms."""
    terms = ""
    for factor, parameter in zip(row.tolist(), names, strict=True):
        if abs(factor) >= SMALLEST_TERM:
            sign = ("-" if factor < 0.0 else "+") if terms or factor < 0.0 else ""
            terms += f" {sign} " if terms else sign
            is_one = abs(abs(factor) - 1.0) < SMALLEST_TERM
            terms += parameter if is_one else f"{number(abs(factor), 2)} {parameter}"
    return terms
