"""The words of headings of tables of readings, and the units in them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache

from ballplate.simulator.inputs import DURATION_UNITS, plain_unit

# Characters of what may be a heading.
LONGEST = 100

# How headings write units that `LENGTH_UNITS` has under another name.
UNITS: Mapping[str, str] = {
    **{unit: unit for unit in ("m", "dm", "cm", "mm", "um", "nm", "in")},
    **dict.fromkeys(("inch", "inches", "zoll", '"', "″"), "in"),
    **dict.fromkeys(("micron", "microns", "micrometre", "micrometer", "mikrometer"), "um"),
    **dict.fromkeys(("millimetre", "millimeter", "millimetres", "millimeters"), "mm"),
    **dict.fromkeys(("metre", "meter", "metres", "meters"), "m"),
}
_UNIT = "|".join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))
_HEADING = re.compile(
    rf"(?P<name>.*?)(?:[\s_,;:]+|\s*(?=[\[(/]))(?:in\s+)?[\[(/]?\s*(?P<unit>{_UNIT})\.?\s*[\])]?"
)

# Words beside an axis that say no more than that it is what was measured.
MEASURED = frozenset(
    (
        *("coordinate", "coordinates", "co", "ordinate", "koordinate", "coord", "value", "wert"),
        *("actual", "act", "ist", "istwert", "measured", "meas", "gemessen", "messwert"),
        *("centre", "center", "centro", "mitte", "mittelpunkt"),
    )
)
WORDS: Mapping[str, tuple[str, ...]] = {
    "position": (
        *("position", "pos", "placement", "setup", "set up", "lage", "aufstellung"),
        *("stellung", "messlage", "aufspannung", "plattenlage"),
    ),
    "ball": ("ball", "sphere", "kugel", "ball name", "sphere name", "kugelname", "bille", "esfera"),
    "probe": ("probe", "stylus", "tip", "taster", "taststift", "probe name", "palpeur", "palpador"),
    "diameter": ("diameter", "diam", "dia", "durchmesser", "sphere diameter", "ball diameter"),
}
# Only where no column has one of the words above.
LESS_CLEAR: Mapping[str, tuple[str, ...]] = {
    "position": (
        "position no",
        "position number",
        "lage nr",
        "pos nr",
        "pos no",
        "stellung nr",
        "messlage nr",
        "aufspannung nr",
    ),
    "ball": (
        *("ball no", "ball number", "ball id", "sphere no", "kugel nr", "kugelnummer", "feature"),
        *("element", "merkmal", "name", "label", "id", "no", "nr", "number", "nummer", "punkt"),
    ),
    "probe": ("stylus name", "tip name", "sensor", "probe no", "stylus no", "taster nr", "tip no"),
    "diameter": ("d", "ø", "actual diameter", "diameter actual", "durchmesser ist"),
}

# Other headings of times, which have no unit where they are those of a clock.
OF_CLOCKS: Mapping[str, tuple[str, ...]] = {
    "time": ("date time", "datetime", "timestamp", "time stamp", "zeit", "uhrzeit", "zeitstempel")
}
_CLOCK = re.compile(r"(?:hh?:mm(?::ss)?)?", re.IGNORECASE)


@lru_cache(maxsize=100_000)
def folded(text: str) -> str:
    """A text without what people write differently: case, signs between words, zeros before
    numbers.

    >>> folded("Z_low"), folded("z  LOW"), folded("P-007"), folded("p7")
    ('z low', 'z low', 'p 7', 'p 7')
    """
    plain = unicodedata.normalize("NFKC", text).casefold()
    words = re.findall(r"[^\W\d_]+|\d+", plain)
    return " ".join(word.lstrip("0") or "0" if word.isdigit() else word for word in words)


def heading(cell: str) -> tuple[str, str | None]:
    """The name of a column, folded, and the unit that its heading states.

    >>> [heading(cell) for cell in ("x_mm", "X [µm]", "Y/mm", "z in inch", "x in", "x")]
    [('x', 'mm'), ('x', 'um'), ('y', 'mm'), ('z', 'in'), ('x', 'in'), ('x', None)]
    """
    if len(cell) > LONGEST:
        return "", None
    match = _HEADING.fullmatch(plain_unit(cell).casefold())
    if match is None or not match["name"].strip():
        return folded(cell), None
    return folded(match["name"]), UNITS[match["unit"]]


def unit_of(cell: str) -> str | None:
    """Return the unit that a text states, in brackets or not, if it states one.

    >>> unit_of("[mm]"), unit_of("inch"), unit_of("12")
    ('mm', 'in', None)
    """
    return UNITS.get(plain_unit(cell).strip().strip("[]() ").casefold())


def unit_of_further(cell: str, name: str) -> str | None:
    """Return the unit of a heading that names a further column, empty without one; None for other
    headings.

    >>> unit_of_further("t_scales_degC", "t_scales"), unit_of_further("T scales [°C]", "t_scales")
    ('degC', 'degC')
    """
    names = (folded(name), *OF_CLOCKS.get(name, ()))
    if folded(cell[:LONGEST]) in names:
        return ""
    match = re.fullmatch(
        r"(.+?)(?:[\s_]+|\s*(?=[\[(/]))[\[(/]?\s*([^\s_\[\]()/]+)\s*[\])]?", cell[:LONGEST]
    )
    if match is None or folded(match[1]) not in names:
        return None
    return match[2].replace("°", "deg")


def is_clock(unit: str, units: Mapping[str, Fraction]) -> bool:
    """True if a heading with a unit, empty without one, is of clock times.

    >>> [is_clock(unit, DURATION_UNITS) for unit in ("", "hh:mm", "s")]
    [True, True, False]
    """
    return units == DURATION_UNITS and _CLOCK.fullmatch(unit) is not None
