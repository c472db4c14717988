"""Conversion of the settings of a pool into candidates, without duplicates, and limits on the
choice.
"""

from __future__ import annotations

import fnmatch
from collections import Counter
from collections.abc import Iterable, Mapping as AnyMapping, Sequence as AnySequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from ballplate.simulator.design import Calibration, RadiusCalibration
from ballplate.simulator.experiment import (
    EDGE,
    OUTSIDE,
    TOLERANCE,
    AtMost,
    Bounds,
    Candidate,
    ChangeTimes,
    LimitsSettings,
    ListedSettings,
    OwnTimesSettings,
    Pool,
    PoolSettings,
    Position,
    References,
    Sections,
    SelectorSettings,
    TimesSettings,
    check_inside,
    check_lengths,
    edge_of,
    entered,
    is_group,
    limits_of,
    resolve_calibration,
    resolve_positions,
)
from ballplate.simulator.geometry import AXIS_INDEX, ball_coordinates
from ballplate.simulator.inputs import (
    Array,
    Mapping,
    Sequence,
    Steps,
    format_length,
    format_path,
    hint,
    listing,
    to_python,
    written,
    written_count,
    written_text,
)

from .pool_groups import FORBIDDEN, generate, occupied
from .room_lengths import in_lengths

SET_UP, READING, PROBE_CHANGE, PLANE_CHANGE = 20 * 60.0, 15.0, 2 * 60.0, 30 * 60.0


@dataclass
class Candidates:
    """Valid positions to choose from, and the boxes (n, 2, d) that none may enter; `complete` is
    true if every entry is valid.
    """

    found: list[Candidate] = field(default_factory=list)
    dropped: dict[str, int] = field(default_factory=dict)
    complete: bool = True
    names: set[str] = field(default_factory=set)
    seen: dict[Any, str] = field(default_factory=dict)
    forbidden: Array = field(default_factory=lambda: np.zeros((0, 2, 3)))

    def add(self, candidate: Candidate) -> None:
        """Add a candidate unless the same exists already."""
        key = _identity(candidate.item) if isinstance(candidate.item, Position) else candidate.name
        if key in self.seen and not candidate.drawn:
            self.drop("same place as another")
            return
        self.seen.setdefault(key, candidate.name)
        name, k = candidate.name, 1
        while name in self.names:
            k += 1
            name = f"{candidate.name} ({k})"
        self.names.add(name)
        if name != candidate.name:
            assert isinstance(candidate.item, Position)
            item = replace(candidate.item, name=name)
            candidate = replace(
                candidate, name=name, item=item, settings={**candidate.settings, "name": name}
            )
        self.found.append(candidate)

    def drop(self, reason: str) -> None:
        """Count a candidate that is dropped."""
        self.dropped[reason] = self.dropped.get(reason, 0) + 1

    @property
    def positions(self) -> tuple[Position, ...]:
        """The candidates that are positions."""
        return tuple(
            candidate.item for candidate in self.found if isinstance(candidate.item, Position)
        )


# In one piece: candidates are counted, completed and refused in the order of the file.
def resolve_candidates(
    sections: Sections,
    positions: AnyMapping[int, Position],
    bounds: Bounds | None,
    references: References,
) -> Candidates:
    """Return the positions to choose from, if there is a pool; faults go to the problems."""
    problems = references.problems
    root, result = problems.root, Candidates()
    node = written(root, "pool")
    pool = sections.pool
    if pool is None:
        result.complete = node is None
        return result
    # The candidates have a limit of their own.
    references = replace(references, tally=Counter())
    # Candidates may be what a key that is misspelt or no list was meant to be.
    is_known = isinstance(node, Mapping) and set(node.items) <= set(PoolSettings.model_fields)
    is_list = isinstance(written(root, "pool", "candidates"), Sequence | None)
    names_differ = _check_names(references)
    times = pool.times
    if bounds is not None:
        result.forbidden = bounds.forbidden
    all_drawn = len(positions) == written_count(root, "positions")
    result.complete = is_known and is_list and names_differ and all_drawn
    for i, position in positions.items():
        if not position.enabled:
            continue
        plane = sections.positions[i].plane
        item_settings = to_python(written(root, "positions", i))  # type: ignore[arg-type]
        own_times = (times.positions or {}).get(position.name)
        result.add(
            _candidate(position, plane, "", True, item_settings, times, own_times, references)
        )
        references.count_readings(result.found[-1].readings, ("positions", i))
        if bounds is not None:
            _check_bounds(position, ("positions", i), bounds, references)
            if (box := _entered(position, bounds, references)) is not None:
                text = f"is in pool.limits.forbidden[{box}]; move it, or correct the box"
                problems.add(("positions", i), text)
    position_names = {position.name for position in positions.values()}
    for name in (times.positions or {}) if all_drawn else ():
        references.is_position(name, position_names, ("pool", "times", "positions", name))
    count = len(positions)
    for i in range(written_count(root, "pool", "candidates")):
        steps = ("pool", "candidates", i)
        settings = pool.candidates.get(i)
        if settings is None:
            references.check_written(steps)
            result.complete = False
            count += 1
        elif isinstance(settings, ListedSettings):
            count += 1
            listed = resolve_positions({steps: settings}, bounds, references).get(steps)
            if listed is None:
                result.complete = False
                continue
            if not listed.enabled:
                result.drop("switched off")
                continue
            if bounds is not None:
                if _entered(listed, bounds, references) is not None:
                    result.drop(FORBIDDEN)
                    continue
                before = len(problems.messages)
                check_inside({steps: listed}, bounds.volume, bounds.probes, references)
                if len(problems.messages) == before:
                    _check_bounds(listed, steps, bounds, references)
            item_settings = to_python(written(root, *steps))  # type: ignore[arg-type]
            result.add(
                _candidate(
                    listed,
                    settings.plane,
                    settings.name,
                    False,
                    item_settings,
                    times,
                    settings.times,
                    references,
                )
            )
        else:
            generated = generate(settings, steps, bounds, count, references)
            if generated is None:
                result.complete = False
                continue
            count += len(generated)
            group = settings.name or format_path(steps[1:])
            for candidate in generated:
                if candidate.position is None:
                    result.drop(candidate.reason)
                    continue
                result.add(
                    _candidate(
                        candidate.position,
                        candidate.plane,
                        group,
                        False,
                        candidate.settings,
                        times,
                        settings.times,
                        references,
                    )
                )
    if result.complete and not result.found:
        why = [f"{number} {reason}" for reason, number in result.dropped.items()]
        text = (
            f"no candidate is left: {listing(why)}"
            if why
            else "there is no candidate; add some, or positions"
        )
        problems.add(
            ("pool", "candidates"), f"{text}; widen the pool" if why else text, of_key=True
        )
        result.complete = False
    return result


def resolve_pool(
    sections: Sections,
    candidates: Candidates,
    calibrations: AnyMapping[int, Calibration],
    references: References,
) -> Pool | None:
    """Return the pool, if there is one; faults go to the problems."""
    problems = references.problems
    root = problems.root
    if sections.pool is None:
        return None
    chosen_from, complete = list(candidates.found), candidates.complete
    at_most = []
    radii: dict[str, list[int]] = {}
    fixed = {
        calibration.artefact: i
        for i, calibration in calibrations.items()
        if isinstance(calibration, RadiusCalibration)
    }
    by_steps: dict[Steps, Calibration] = {
        ("calibration", i): calibration for i, calibration in calibrations.items()
    }
    for i in range(written_count(root, "pool", "calibration")):
        steps: Steps = ("pool", "calibration", i)
        settings = sections.pool.calibration.get(i)
        if settings is None:
            references.check_written(steps)
            complete = False
            continue
        item = resolve_calibration(settings, steps, references)
        if item is None:
            complete = False
            continue
        by_steps[steps] = item
        if isinstance(item, RadiusCalibration):
            if item.artefact in fixed:
                text = (
                    f'the radius of "{item.artefact}" is already in'
                    f" calibration[{fixed[item.artefact]}]"
                    "; "
                )
                problems.add(steps, f"{text}remove one of the two")
            radii.setdefault(item.artefact, []).append(len(chosen_from))
        item_settings = to_python(written(root, *steps))  # type: ignore[arg-type]
        item_settings = {
            key: value for key, value in item_settings.items() if key not in ("name", "price")
        }
        chosen_from.append(
            Candidate(settings.name, item, settings.price, "", settings.name, False, item_settings)
        )
    if complete:
        check_lengths(by_steps, candidates.positions, references)
    at_most += [AtMost(tuple(members), 1) for members in radii.values() if len(members) > 1]
    limits, times = sections.pool.limits, sections.pool.times
    must, limited = _limits(limits, chosen_from, complete, references)
    changes = change_times(times)
    return Pool(
        tuple(chosen_from),
        changes,
        must,
        (*at_most, *limited),
        candidates.dropped,
        candidates.forbidden,
        limits.edge,
    )


def _candidate(
    position: Position,
    plane: str | None,
    group: str,
    drawn: bool,
    item_settings: AnyMapping[str, Any],
    times: TimesSettings,
    own_times: OwnTimesSettings | None,
    references: References,
) -> Candidate:
    set_up, reading = durations(times, own_times)
    seconds = seconds_of(position, set_up, reading, change_times(times).probe)
    across = "" if plane is None or references.dimension == 2 else plane
    item_settings = {
        key: value for key, value in in_lengths(item_settings, position).items() if key != "times"
    }
    return Candidate(position.name, position, seconds, across, group, drawn, item_settings, reading)


def seconds_of(
    position: Position,
    set_up: float = SET_UP,
    reading: float = READING,
    probe_change: float = PROBE_CHANGE,
) -> float:
    """Return the duration of a position in seconds, by default the usual one."""
    return set_up + position.count * reading + (len(position.probes) - 1) * probe_change


def durations(times: TimesSettings, own_times: OwnTimesSettings | None) -> tuple[float, float]:
    """Return the seconds to set a position up, and those of a reading: its own, those of its file,
    or the usual ones.
    """
    set_up, reading = (
        _or(getattr(own_times, key, None), _or(getattr(times, key), default))
        for key, default in (("set_up", SET_UP), ("reading", READING))
    )
    return set_up, reading


def change_times(times: TimesSettings) -> ChangeTimes:
    """Return the changes between positions, by default the usual ones."""
    return ChangeTimes(_or(times.probe_change, PROBE_CHANGE), _or(times.plane_change, PLANE_CHANGE))


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


def _identity(position: Position) -> Any:
    """Return a key that is equal for equal positions: artefact, pose to a nanometre, and
    readings.
    """
    pose = np.concatenate([position.pose.rotation.ravel(), position.pose.origin])
    return (
        position.artefact,
        tuple(np.rint(1e9 * pose).tolist()),
        tuple(
            (
                frozenset(reading.probes),
                (
                    reading.ball_indices.tobytes()
                    if len(reading.balls) < 2
                    else np.sort(reading.ball_indices).tobytes()
                ),
                reading.repeats,
                None
                if reading.standard_uncertainty is None
                else reading.standard_uncertainty.tobytes(),
            )
            for reading in position.readings
        ),
    )


def _check_names(references: References) -> bool:
    """True if no entry of the pool has the name of another, or of a position; others are
    reported.
    """
    problems, before = references.problems, len(references.problems.messages)
    first: dict[str, str] = {}
    for section in (("positions",), ("pool", "candidates"), ("pool", "calibration")):
        for i in range(written_count(problems.root, *section)):
            steps: Steps = (*section, i)
            name = written_text(problems.root, *steps, "name")
            if name is None:
                continue
            if name in first and section != ("positions",):
                problems.add(
                    (*steps, "name"),
                    f'"{name}" is the name of {first[name]} already; names must differ',
                )
            first.setdefault(name, format_path(steps))
    return len(problems.messages) == before


def _entered(position: Position, bounds: Bounds, references: References) -> int | None:
    """The first forbidden box that a position's artefact enters, if any."""
    layout, edge = (
        references.layouts[position.artefact],
        edge_of(position.artefact, bounds, references),
    )
    around = occupied(position.pose, layout, edge)
    boxes = np.flatnonzero(entered(around, bounds.forbidden))
    return int(boxes[0]) if len(boxes) else None


def _check_bounds(position: Position, steps: Steps, bounds: Bounds, references: References) -> None:
    """Report a position whose plate's edge is outside the volume, or that a probe cannot reach."""
    edge = edge_of(position.artefact, bounds, references)
    read = [(group.ball_indices, group.probes) for group in position.readings]
    layout = references.layouts[position.artefact]
    balls = ball_coordinates(position.pose, layout)
    limits = limits_of(position.pose, layout, balls, edge, read, bounds)
    for reason, (least, greatest) in limits.items():
        by_axis = np.maximum(least, -greatest)
        beyond, axis = float(by_axis.max()), list(AXIS_INDEX)[by_axis.argmax()]
        if reason == OUTSIDE or beyond <= TOLERANCE:
            continue
        text = (
            f"a ball is {format_length(beyond)} {reason} along {axis}; move it, or correct"
            " pool.limits.reach"
        )
        if edge is not None and reason == EDGE:
            text = (
                f"with its edge of {format_length(edge)} the plate is {format_length(beyond)}"
                " outside the volume; move it, or correct pool.limits.edge"
            )
        references.problems.add(steps, text)


def _limits(
    limits: LimitsSettings,
    candidates: AnySequence[Candidate],
    complete: bool,
    references: References,
) -> tuple[tuple[int, ...], list[AtMost]]:
    """Return indices of required candidates, and limits on numbers."""
    problems, place = references.problems, ("pool", "limits")
    index = {one.name: i for i, one in enumerate(candidates)}
    before = len(problems.messages)

    def of_names(names: Iterable[str], steps: Steps) -> list[int]:
        for k, name in enumerate(names):
            if name not in index and complete:
                text = f'unknown candidate "{name}"; {hint(name, index)}'
                problems.add((*steps, k), text)
        return [index[name] for name in dict.fromkeys(names) if name in index]

    if limits.keep == "all":
        must = [i for i, one in enumerate(candidates) if one.drawn]
    else:
        must = of_names(limits.keep, (*place, "keep"))
    at_most = []
    for k, limit in enumerate(limits.at_most):
        members = _selected(
            limit.of, candidates, complete, (*place, "at_most", k, "of"), references
        )
        if members:
            at_most.append((AtMost(tuple(members), limit.count), (*place, "at_most", k)))
    for one, steps in at_most:
        required_names = [candidates[i].name for i in sorted(set(must) & set(one.members))]
        if len(required_names) > one.count and len(problems.messages) == before:
            text = (
                f"at most {one.count} of these are allowed, but {listing(required_names)} are to"
                " be kept;"
                " correct pool.limits"
            )
            problems.add(steps, text)
    return tuple(sorted(must)), [one for one, _ in at_most]


def _selected(
    selector: SelectorSettings,
    candidates: AnySequence[Candidate],
    complete: bool,
    steps: Steps,
    references: References,
) -> list[int]:
    """Indices of the candidates to which everything applies that a selector states."""
    root = references.problems.root
    groups = {candidate.group for candidate in candidates if candidate.group} | set(
        _group_names(root)
    )
    names_by_selector = {
        "group": groups,
        "artefact": references.artefact_names,
        "probe": references.probes,
    }
    for key, names in names_by_selector.items():
        name = getattr(selector, key)
        if name is not None and name not in names:
            text = f'unknown {key} "{name}"; {hint(name, sorted(names))}'
            references.problems.add((*steps, key), text)
            return []
    tests = []
    if selector.name is not None:
        stated = selector.name
        patterns = stated if isinstance(stated, tuple) else (stated,)
        for k, pattern in enumerate(patterns if complete else ()):
            if not fnmatch.filter((candidate.name for candidate in candidates), pattern):
                place = (*steps, "name", *((k,) if isinstance(stated, tuple) else ()))
                text = f'no candidate has a name such as "{pattern}"; correct it'
                references.problems.add(place, text)
        tests.append(
            lambda candidate: any(fnmatch.fnmatchcase(candidate.name, each) for each in patterns)
        )
    if selector.group is not None:
        tests.append(lambda candidate: candidate.group == selector.group)
    if selector.plane is not None:
        tests.append(lambda candidate: candidate.plane == selector.plane)
    if selector.artefact is not None:
        tests.append(lambda candidate: candidate.item.artefact == selector.artefact)
    if selector.probe is not None:
        tests.append(
            lambda candidate: (
                isinstance(candidate.item, Position) and selector.probe in candidate.item.probes
            )
        )
    return [i for i, candidate in enumerate(candidates) if all(test(candidate) for test in tests)]


def _group_names(root: Any) -> list[str]:
    names = []
    for i in range(written_count(root, "pool", "candidates")):
        entry = written(root, "pool", "candidates", i)
        name = written_text(root, "pool", "candidates", i, "name")
        if name is None and entry is not None and is_group(getattr(entry, "items", None)):
            name = f"candidates[{i}]"
        names += [name] if name is not None else []
    return names
