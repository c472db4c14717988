"""Changes of command lines, drawn from the parser's own grammar: a new option is tried without
being named here.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from pathlib import Path
from random import Random

from ballplate.cli._parsers import parser

# Tried with every option; those that its type takes are what it is for.
PLAUSIBLE = (
    *("1", "2", "3", "0", "0.5", "7", "2,2,2", "3,2", "50%", "100%", "5 mm", "1 um"),
    *("0.5 um + L/1000000", "2 um/mm", "U6", "U6 average 1 um", "tasks", "lengths", "A", "EXX"),
    *("EAX", "y = 300 mm, z = 200 mm", "start", "end", "none", "10 mm, 20 mm"),
    *("0 mm, 0 mm, 0 mm to 600 mm, 500 mm, 400 mm", "1-9", "position", "error", "finish_error"),
    *("down", "right", "plate", "bar", "plain", "with scale", "radius known", "length known"),
    *("5.2", "weak", "deficient", "value", "slope", "out.csv", "out.svg", "out.html", "out.yaml"),
    *("out.md", "out.parquet", "out.txt", "new.sqlite"),
)
# No pipe, as writing into one waits for its reader, and rightly so.
ODD = (
    *("", " ", "nan", "NaN", "inf", "-inf", "-1", "-0", "-5 mm", "1e300", "1e-300", "1e999"),
    "9999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999999",
    *("0x10", "1_0", "１", "٣", "½", "éééééééééééééééééééééééééééééééééééééééééééééééééé"),
    "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx",
    "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx",
    *("a\nb", "\x1b[31mred", "\u2028", "\udcff.csv", "=1+1", "%s%n", "{}", "--", "-", "---"),
    *("-h", "@small.yaml", "a,b", ",", "1,", "0 mm", "1e300 m", "1e300 mm", "NaN mm", "5 parsec"),
    *("1,5 mm", "5 deg", "U9", "U6 average", "U6 average 0 um", "100.1%", "0%", "%", "1 um"),
    *("all", "*", "[", ".", "..", "folder", "folder/out.csv", "no/such/out.csv"),
    *("small.yaml/out.csv", "loop.csv", "loop.csv", "missing", "old.csv", "old.yaml", "old.svg"),
    *("old.html", "empty.txt", "junk.bin", "foreign.sqlite", "CON", "a:b.csv", "~", "é.csv"),
    *("a\nb.svg", "\x1b.yaml"),
    "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx.csv",
    *(".csv", ".svg", "OUT.SVG", "missing.yaml", "missing.csv"),
)
FILES = (
    *(
        "small.yaml",
        "tables.yaml",
        "splines.yaml",
        "pool.yaml",
        "dummy.yaml",
        "bar-bell.yaml",
        "sweep.yaml",
    ),
    *(
        "machine.yaml",
        "gec-like.yaml",
        "small-readings.csv",
        "tables-readings.csv",
        "small-certificate.csv",
    ),
    *("part.yaml", "part-readings.csv", "lengths.csv", "measured.yaml"),
    *("curve.csv", "balls.csv", "sweep.sqlite", "trials.sqlite", "planned.yaml"),
)
# Options whose values may be large without much work; of others a large one is meant to take long,
# and may.
LARGE = (
    "seed",
    "calibration",
    "sweep",
    "straight",
    "order",
    "every",
    "positions",
    "readings",
    "hours",
)
MOST = 50

Grammar = dict[str, tuple[argparse.Action, ...]]


@cache
def _parser() -> argparse.ArgumentParser:
    return parser()


@cache
def grammar() -> Grammar:
    """Options and arguments of every command that ends by itself."""
    commands = next(
        one for one in _parser()._actions if isinstance(one, argparse._SubParsersAction)
    )
    return {
        name: tuple(
            action for action in command._actions if not isinstance(action, argparse._HelpAction)
        )
        for name, command in commands.choices.items()
        if name not in SERVING
    }


# Commands that run until they are interrupted.
SERVING = {"studio"}


@cache
def fitting(action: argparse.Action) -> tuple[str, ...]:
    """Plausible values that an option takes, as far as its type can tell."""
    if action.choices is not None:
        return tuple(map(str, action.choices))
    return tuple(text for text in PLAUSIBLE if is_taken(action, text) and is_quick(action, text))


def is_taken(action: argparse.Action, text: str) -> bool:
    """Does the option's type take the text?"""
    if not callable(action.type):
        return True
    try:
        action.type(text)
    except (argparse.ArgumentTypeError, TypeError, ValueError):
        return False
    return True


def is_quick(action: argparse.Action, text: str) -> bool:
    """Does the value not ask for long work, or for other processes?"""
    if action.dest == "workers":
        return text == "1" or not is_taken(action, text)
    if action.dest in LARGE or not callable(action.type) or not is_taken(action, text):
        return True
    value = action.type(text)
    return not isinstance(value, int) or value <= MOST


def value(random: Random, action: argparse.Action) -> str:
    """A value for an option or argument, which fits it about half of the time."""
    draw = random.random()
    known = fitting(action)
    if known and draw < 0.5:
        return random.choice(known)
    odd = random.choice(FILES if draw < 0.65 else ODD)
    return odd if is_quick(action, odd) else "0"


def as_arguments(random: Random, action: argparse.Action) -> list[str]:
    """An option with a value, or with as many as it takes, seldom with one too few."""
    if not action.option_strings:
        return [value(random, action)]
    name = random.choice(action.option_strings)
    wanted = {None: 1, "?": 1, "*": 1, "+": 1}.get(action.nargs, action.nargs)  # type: ignore[call-overload]
    if random.random() < 0.04:
        wanted = max(0, wanted - 1) if wanted else 1
    found = [value(random, action) for _ in range(wanted)]
    if len(found) == 1 and name.startswith("--") and random.random() < 0.4:
        return [f"{name}={found[0]}"]
    return [name, *found]


def drawn(random: Random) -> list[str]:
    """A line from the grammar alone: what a command must have, and some of what it may."""
    name = random.choice(list(grammar()))
    line = [name]
    for action in grammar()[name]:
        must = action.required or not action.option_strings
        if random.random() < (0.95 if must else 0.15):
            line += as_arguments(random, action)
    return line


def _option_added(random: Random, line: list[str], actions: Sequence[argparse.Action]) -> None:
    options = [action for action in actions if action.option_strings] or list(actions)
    for action in random.choices(options, k=random.choice((1, 1, 2)) if options else 0):
        line += as_arguments(random, action)


def _value_replaced(random: Random, line: list[str], actions: Sequence[argparse.Action]) -> None:
    """Another value for an option or argument that stands there already."""
    at = random.randrange(1, len(line)) if len(line) > 1 else 0
    by_name = {name: action for action in actions for name in action.option_strings}
    before = by_name.get(line[at - 1])
    if at and line[at] not in by_name:
        places = [action for action in actions if not action.option_strings]
        action = before or (random.choice(places) if places else None)
        line[at] = random.choice(ODD) if action is None else value(random, action)


def _removed(random: Random, line: list[str], _: Sequence[argparse.Action]) -> None:
    del line[
        random.randrange(1 if random.random() < 0.95 else 0, len(line)) if len(line) > 1 else 0
    ]


def _repeated(random: Random, line: list[str], _: Sequence[argparse.Action]) -> None:
    at = random.randrange(len(line))
    line[at:at] = line[at : at + random.choice((1, 1, 2))]


def _exchanged(random: Random, line: list[str], _: Sequence[argparse.Action]) -> None:
    one, other = random.randrange(len(line)), random.randrange(len(line))
    line[one], line[other] = line[other], line[one]


def _inserted(random: Random, line: list[str], _: Sequence[argparse.Action]) -> None:
    line.insert(random.randrange(len(line) + 1), random.choice(ODD))


def _files_swapped(random: Random, line: list[str], _: Sequence[argparse.Action]) -> None:
    places = [
        k
        for k, text in enumerate(line)
        if Path(text).suffix in (".yaml", ".csv", ".sqlite", ".svg", ".json")
    ]
    if places:
        line[random.choice(places)] = random.choice(FILES if random.random() < 0.6 else ODD)


def _written_over(random: Random, line: list[str], actions: Sequence[argparse.Action]) -> None:
    """An output that is an input, with and without leave to overwrite."""
    inputs = [text for text in line[1:] if Path(text).suffix in (".yaml", ".csv", ".sqlite")]
    outputs = [action for action in actions if action.option_strings and action.type is not None]
    outputs = [
        action
        for action in outputs
        if any(text == "out.svg" or text == "out.csv" for text in fitting(action))
    ]
    if inputs and outputs:
        name = (
            random.choice(inputs) if random.random() < 0.7 else f"folder/../{random.choice(inputs)}"
        )
        line += [random.choice(outputs).option_strings[-1], name]
    if any("--force" in action.option_strings for action in actions) and random.random() < 0.7:
        line.append("--force")


CHANGES = {
    "written over": _written_over,
    "option added": _option_added,
    "and another": _option_added,
    "value replaced": _value_replaced,
    "other value": _value_replaced,
    "removed": _removed,
    "repeated": _repeated,
    "exchanged": _exchanged,
    "inserted": _inserted,
    "files swapped": _files_swapped,
}


def changed_line(random: Random, line: Sequence[str]) -> tuple[str, list[str]]:
    """A command line with one change, and what that is."""
    changed = list(line)
    name = random.choice(list(CHANGES))
    CHANGES[name](random, changed, grammar().get(line[0], ()))
    return name, changed


# Where one of these is among a command's options, it starts other processes with that one only, and
# takes no number of them without.
REPEATS = {"trials", "until"}


def quick(line: Sequence[str]) -> list[str]:
    """The same line, in one process where the command would start others and does not say how
    many.
    """
    options = vars(parsed(line) or argparse.Namespace(workers=1))
    starts = REPEATS & options.keys()
    if options.get("workers", 1) or starts and not any(options[name] for name in starts):
        return list(line)
    return [*line[:1], "--workers=1", *line[1:]]


def parsed(line: Sequence[str]) -> argparse.Namespace | None:
    """What the parser makes of a line, None where it takes it for wrong usage."""
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        try:
            return _parser().parse_args(list(line))
        except SystemExit:
            return None
