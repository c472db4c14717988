"""Unknowns of the search: each is a family of experiment files, one for each value."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from itertools import chain, product
from typing import Literal, get_args

from ballplate.simulator.experiment import Experiment, node_at, override
from ballplate.simulator.geometry import GridSettings, SquareSettings
from ballplate.simulator.inputs import (
    KINDS,
    QUANTITY,
    LengthFunction,
    Mapping,
    Node,
    QuantityError,
    Scalar,
    Sequence,
    child,
    hint,
    listing,
    parse_length_function,
    plain_unit,
    typed_length,
)
from ballplate.uncertainty import exact_offsets

from .steps import at_step, exact, round_down, round_up, step_of, times

UnknownName = Literal[
    "repeatability", "certificate", "tips", "thermometers", "repeats", "balls", "size", "hours"
]
# Those that are tried by default: plans of many hours take long.
NAMES: tuple[UnknownName, ...] = get_args(UnknownName)[:-1]
# Those that limit all others, where they are uncertain.
SOURCES = NAMES[:4]

# Ratio to the present value at which a repeatability or certificate counts as exact, or as of no
# use.
EXTREME = 10_000
# Balls on a side, repeats of a reading, and ratio of the present size to the smallest, that are
# looked at.
MOST_BALLS, MOST_REPEATS, SMALLEST = 30, 10_000, 20
# Ratio of the largest size that is looked at to the present one; the volume is smaller.
LARGEST = 100


class NotVariableError(ValueError):
    """The experiment lacks the unknown, or has several without a choice; the message states the
    remedy.
    """


@dataclass(frozen=True)
class Unknown:
    """One quantity of an experiment with values `first` to `last`, by indices in ascending order.

    `tree` gives the file with a value, `words` the value as text and `value` in metres, in the
    `unit` of an uncertainty that is not a length, or as a number. `grows`: a larger value improves
    every result, otherwise a smaller one; `is_monotone` is true if that is certain. `present` is
    the current value as text, and `drawn` the value next to it.
    """

    name: UnknownName
    title: str
    present: str
    drawn: int
    first: int
    last: int
    grows: bool
    is_monotone: bool
    tree: Callable[[int], Node]
    words: Callable[[int], str]
    value: Callable[[int], float]
    unit: str = "m"


def unknown(
    name: UnknownName,
    experiment: Experiment,
    root: Node,
    artefact: str | None,
    calibration: int | None,
) -> Unknown:
    """Return an unknown of the experiment whose file is `root`.

    `artefact` and `calibration`, an index, select among several.

    :raises NotVariableError: the experiment lacks it, or has several.
    """
    if artefact is not None and artefact not in experiment.artefacts:
        raise NotVariableError(
            f'unknown artefact "{artefact}"; {hint(artefact, experiment.artefacts)}'
        )
    if calibration is not None and calibration >= len(experiment.calibration):
        count = len(experiment.calibration)
        indices_text = f"the indices are 0 to {count - 1}" if count else "there is none"
        raise NotVariableError(f"there is no calibration[{calibration}]; {indices_text}")
    if name == "repeatability":
        return _scaled(name, "machine's repeatability", root, ["machine.repeatability"])
    if name == "tips":
        return _tips(experiment, root)
    if name == "thermometers":
        return _thermometers(root)
    if name == "certificate":
        chosen = [
            k
            for k, listed in enumerate(experiment.calibration)
            if artefact in (None, listed.artefact) and calibration in (None, k)
        ]
        if not chosen:
            of_artefact = "" if artefact is None else f' of "{artefact}"'
            raise NotVariableError(
                f"the file states no calibration{of_artefact}; there is no certificate to improve"
            )
        return _certificate(root, [f"calibration[{k}]" for k in chosen])
    if name == "repeats":
        return _repeats(experiment, root, artefact)
    return _of_plate(name, experiment, root, artefact)


def _certificate(root: Node, items: list[str]) -> Unknown:
    """Return standard uncertainties of calibration items by their paths, lengths first.

    :raises NotVariableError: no item states one that can be multiplied.
    """
    lengths, rows_skipped, skipped = list[str](), list[str](), list[str]()
    common = [f"{item}.common" for item in items if node_at(root, f"{item}.common") is not None]
    for item in items:
        path = f"{item}.standard_uncertainty"
        try:
            node = node_at(root, path)
            leaves = [] if node is None else _leaves(node)
        except QuantityError:
            leaves = []
        if not leaves:
            skipped.append(item)
        else:
            are_lengths = isinstance(leaves[0], LengthFunction)
            (lengths if are_lengths else rows_skipped).append(path)
    if not lengths + rows_skipped:
        raise NotVariableError(
            f"{listing(skipped)} states no standard_uncertainty that can be multiplied; there is no"
            " certificate to improve"
        )
    title = "certificate's standard uncertainty"
    if skipped:
        title += f" (without {listing(skipped)}, which states no standard_uncertainty to multiply)"
    return _scaled("certificate", title, root, lengths + rows_skipped + common)


def _tips(experiment: Experiment, root: Node) -> Unknown:
    """Return the stated uncertainties of tips, or one of all exact offsets but the first.

    :raises NotVariableError: there is a single tip, or all are estimated without a statement.
    """
    certified = [probe.name for probe, *_ in experiment.certified_offsets]
    exact_names = () if certified else exact_offsets(experiment)
    for name in exact_names:
        node = node_at(root, f"probes[{name}]")
        if not isinstance(node, Mapping):
            entry = Mapping(root.mark, {"offset": node or root}, {"offset": root.mark})
            root = override(root, f"probes[{name}]", entry, root.mark)
        path = f"probes[{name}].standard_uncertainty"
        root = override(root, path, Scalar(root.mark, "1 um"), root.mark)
    if not certified and not exact_names:
        raise NotVariableError("the file states no second tip whose offset may be uncertain")
    paths = [f"probes[{name}].standard_uncertainty" for name in certified or exact_names]
    found = _scaled("tips", "standard uncertainty of tips", root, paths)
    return replace(found, present="exact") if exact_names else found


def _thermometers(root: Node) -> Unknown:
    """Return the stated uncertainties of temperatures by one factor.

    :raises NotVariableError: none is stated.
    """
    influences, paths = child(root, "influences"), []
    for k in range(len(influences.items) if isinstance(influences, Sequence) else 0):
        for place in ("artefact_temperature", "scale_temperature"):
            for key in ("standard_uncertainty", "sensor_uncertainty"):
                path = f"influences[{k}].{place}.{key}"
                with suppress(QuantityError, ValueError):
                    if (node := node_at(root, path)) is not None and _leaves(node):
                        paths.append(path)
    if not paths:
        raise NotVariableError(
            "the file states no uncertainty of temperatures; ballplate run --assumptions prints"
            " such an influence"
        )
    return _scaled("thermometers", "standard uncertainty of temperatures", root, paths)


@dataclass(frozen=True)
class _Quantity:
    """A number above zero with a unit other than of length, as written."""

    number: Decimal
    unit: str


def _scaled(name: UnknownName, title: str, root: Node, paths: list[str]) -> Unknown:
    """Return uncertainties multiplied by one factor; the first has three digits, the others
    fewer.
    """
    nodes = [node_at(root, path) for path in paths]
    leaves = [leaf for node in nodes if node is not None for leaf in _leaves(node)]
    first, unit, scale = leaves[0], "m", 1.0
    if isinstance(first, _Quantity):
        plain = plain_unit(first.unit)
        kind = next(kind for kind in KINDS.values() if plain in kind.units)
        lead, unit, scale = first.number, kind.base, float(kind.units[plain])
    else:
        lead = exact(first.constant or first.slope)

    def factor(step: int) -> Fraction:
        return Fraction(at_step(step)) / Fraction(lead)

    def tree(step: int) -> Node:
        changed_tree = root
        for path, node in zip(paths, nodes, strict=True):
            assert node is not None
            changed_tree = override(changed_tree, path, _with_leaves(node, factor(step)), node.mark)
        return changed_tree

    def words(step: int) -> str:
        return _several([_text(leaf, factor(step)) for leaf in leaves])

    middle = step_of(lead)
    width = step_of(Decimal(EXTREME))
    present = _several([_text(leaf, Fraction(1)) for leaf in leaves])
    return Unknown(
        name,
        title,
        present,
        middle,
        middle - width,
        middle + width,
        False,
        True,
        tree,
        words,
        lambda step: scale * _metres(step),
        unit,
    )


def _metres(step: int) -> float:
    return float(at_step(step))


def _leaf(value: object) -> LengthFunction | _Quantity:
    """Return an uncertainty as written.

    :raises QuantityError: neither a length nor another number above zero with a unit.
    """
    try:
        return parse_length_function(value)
    except QuantityError:
        match = QUANTITY.fullmatch(value.strip()) if isinstance(value, str) else None
        is_length = match is not None and plain_unit(match[2] or "") in chain(
            *(kind.units for kind in KINDS.values())
        )
        if match is None or not is_length or Decimal(match[1]) <= 0:
            raise
        return _Quantity(Decimal(match[1]), match[2].strip())


def _leaves(node: Node) -> list[LengthFunction | _Quantity]:
    if isinstance(node, Scalar):
        return [_leaf(node.value)]
    parts = node.items.values() if isinstance(node, Mapping) else node.items
    return [leaf for part in parts for leaf in _leaves(part)]


def _with_leaves(node: Node, factor: Fraction) -> Node:
    """The node with all uncertainties multiplied and cut to three digits."""
    if isinstance(node, Scalar):
        return Scalar(node.mark, _text(_leaf(node.value), factor))
    if isinstance(node, Mapping):
        return Mapping(
            node.mark, {k: _with_leaves(v, factor) for k, v in node.items.items()}, node.key_marks
        )
    return Sequence(node.mark, tuple(_with_leaves(item, factor) for item in node.items))


def _text(leaf: LengthFunction | _Quantity, factor: Fraction) -> str:
    """Return an uncertainty multiplied by a factor, in its written form; cut to three digits
    unless the factor is 1.
    """
    if isinstance(leaf, _Quantity):
        number = leaf.number if factor == 1 else round_down(times(leaf.number, factor))
        return f"{number.normalize():f} {leaf.unit}"
    constant = exact(leaf.constant)
    if constant and factor != 1:
        constant = round_down(times(constant, factor))
    length = typed_length(float(constant))
    if not leaf.slope:
        return length
    divisor = 1 / exact(leaf.slope)
    divisor = divisor if factor == 1 else round_up(times(divisor, 1 / factor))
    return f"{length} + L/{float(divisor):.9g}"


def _several(texts: list[str]) -> str:
    """Return one text if all are equal."""
    return texts[0] if len(set(texts)) == 1 else listing(texts, 3)


def _repeats(experiment: Experiment, root: Node, artefact: str | None) -> Unknown:
    """Return the number of repeats, or its multiple if repeats differ; all artefacts are placed."""
    places = [
        k
        for k, position in enumerate(experiment.positions)
        if artefact in (None, position.artefact)
    ]
    groups = [
        (
            f"positions[{k}].readings[{j}]" if _has_groups(root, k) else f"positions[{k}]",
            group.repeats,
        )
        for k in places
        for j, group in enumerate(experiment.positions[k].readings)
    ]
    counts = sorted({count for _, count in groups})
    is_same = len(counts) == 1

    def tree(step: int) -> Node:
        changed_tree = root
        for path, count in groups:
            mark = root.mark
            changed_tree = override(
                changed_tree,
                f"{path}.repeats",
                Scalar(mark, step if is_same else step * count),
                mark,
            )
        return changed_tree

    def words(step: int) -> str:
        return str(step) if is_same else f"{step} times as many"

    present = str(counts[0]) if is_same else f"{counts[0]} to {counts[-1]}"
    most = MOST_REPEATS if is_same else MOST_REPEATS // counts[-1]
    return Unknown(
        "repeats",
        "repeats of every reading",
        present,
        counts[0] if is_same else 1,
        1,
        most,
        True,
        True,
        tree,
        words,
        int,
    )


def _has_groups(root: Node, position: int) -> bool:
    return child(node_at(root, f"positions[{position}]"), "readings") is not None


def _of_plate(
    name: UnknownName, experiment: Experiment, root: Node, artefact: str | None
) -> Unknown:
    """Balls per side, or size, of a grid or square."""
    fitting = [
        artefact_name
        for artefact_name, settings in experiment.artefacts.items()
        if isinstance(settings, GridSettings | SquareSettings) and artefact in (None, artefact_name)
    ]
    if artefact is None:
        plates = [
            artefact_name
            for artefact_name in fitting
            if experiment.artefacts[artefact_name].role == "plate"
        ]
        fitting = plates or fitting
    if not fitting:
        subject = "no artefact is" if artefact is None else f'"{artefact}" is not'
        raise NotVariableError(f"{subject} of kind grid or square, whose {name} could be varied")
    if len(fitting) > 1:
        raise NotVariableError(
            f"there are several plates; choose one with --artefact: {listing(fitting)}"
        )
    plate = experiment.artefacts[fitting[0]]
    assert isinstance(plate, GridSettings | SquareSettings)
    path = f"artefacts[{fitting[0]}].{name}"
    return _balls(plate, root, path) if name == "balls" else _size(plate, root, path)


def _balls(plate: GridSettings | SquareSettings, root: Node, path: str) -> Unknown:
    """Balls of a plate of the same size, in the order of their number."""
    mark, present = root.mark, plate.balls
    every: list[tuple[int, ...]]
    if isinstance(present, int):
        every = [(side,) for side in range(2, max(MOST_BALLS, present) + 1)]
    else:
        every = list(_grids(*present))

    def tree(step: int) -> Node:
        scalars = tuple(Scalar(mark, count) for count in every[step])
        node = scalars[0] if isinstance(present, int) else Sequence(mark, scalars)
        return override(root, path, node, mark)

    def words(step: int) -> str:
        return (
            f"{every[step][0]} a side"
            if isinstance(present, int)
            else " x ".join(map(str, every[step]))
        )

    def value(step: int) -> float:
        return every[step][0]

    drawn = every.index((present,) if isinstance(present, int) else present)
    last = len(every) - 1
    return Unknown(
        "balls", "balls of the plate", words(drawn), drawn, 0, last, True, False, tree, words, value
    )


def _grids(columns: int, rows: int) -> Iterator[tuple[int, int]]:
    """Columns and rows with which one side is within a ball of being in proportion to the other, by
    their number.

    Of as many balls, those nearest to the proportion come first.
    """
    sides = range(2, max(MOST_BALLS, columns, rows) + 1)
    near = [
        (n, m)
        for n, m in product(sides, sides)
        if abs(m * columns - n * rows) <= max(columns, rows)
    ]
    yield from sorted(
        near,
        key=lambda grid: (grid[0] * grid[1], abs(grid[1] * columns - grid[0] * rows), -grid[0]),
    )


def _size(plate: GridSettings | SquareSettings, root: Node, path: str) -> Unknown:
    """Size of a plate with the same balls, and the same ratio of its sides; its positions keep
    corner or centre.
    """
    mark = root.mark
    edges = [plate.size] if isinstance(plate, SquareSettings) else list(plate.size)
    lead = exact(edges[0])

    def texts(step: int) -> list[str]:
        factor = Fraction(at_step(step)) / Fraction(lead)
        return [typed_length(float(round_down(times(exact(edge), factor), 6))) for edge in edges]

    def tree(step: int) -> Node:
        scalars = tuple(Scalar(mark, text) for text in texts(step))
        node = scalars[0] if isinstance(plate, SquareSettings) else Sequence(mark, scalars)
        return override(root, path, node, mark)

    def words(step: int) -> str:
        return " x ".join(texts(step))

    present = " x ".join(map(typed_length, edges))
    first, drawn, last = (step_of(size) for size in (lead / SMALLEST, lead, lead * LARGEST))
    return Unknown(
        "size", "size of the plate", present, drawn, first, last, True, False, tree, words, _metres
    )
