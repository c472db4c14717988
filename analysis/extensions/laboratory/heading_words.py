"""The words of headings of tables of readings, and the units in them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import lru_cache

from ballplate.simulator.inputs import DURATION_UNITS, listing, plain_unit, shorten

# Characters of what may be a heading.
LONGEST = 100


def _words(table: str) -> dict[str, tuple[str, ...]]:
    """Return words by the role that begins each line of a table."""
    words: dict[str, tuple[str, ...]] = {}
    for line in table.strip().splitlines():
        role, _, listed = line.strip().partition(": ")
        words[role] = (*words.get(role, ()), *listed.split(", "))
    return words


# How headings write units, by their names in `LENGTH_UNITS`.
_UNITS = _words("""
    in: in, inch, inches, zoll, ", ″
    um: um, micron, microns, micrometre, micrometer, mikrometer
    mm: mm, millimetre, millimeter, millimetres, millimeters
    m: m, metre, meter, metres, meters
    dm: dm
    cm: cm
    nm: nm
""")
UNITS: Mapping[str, str] = {name: unit for unit, names in _UNITS.items() for name in names}
_UNIT = "|".join(re.escape(unit) for unit in sorted(UNITS, key=len, reverse=True))
_HEADING = re.compile(
    rf"(?P<name>.*?)(?:[\s_,;:]+|\s*(?=[\[(/]))(?:in\s+)?[\[(/]?\s*(?P<unit>{_UNIT})\.?\s*[\])]?"
)

# Texts of cells that hold nothing.
NOTHING = frozenset(("", "-", "--", "---", "n/a", "na", "nan", "none", "null"))

# In English, German, Swedish, French, Italian and Spanish.
WORDS = _words("""
    position: position, pos, placement, setup, set up, lage, aufstellung, stellung, messlage
    position: aufspannung, plattenlage, läge, uppställning, uppspänning, pose, emplacement
    position: posizione, piazzamento, posición, posicion
    ball: ball, sphere, ball name, sphere name, kugel, kugelname, kula, bille, sphère, sfera
    ball: esfera, bola
    probe: probe, stylus, tip, probe name, taster, taststift, mätspets, tastspets, palpeur
    probe: stylet, tastatore, stilo, palpador
    unit: unit, units, einheit, einheiten, enhet, unité, unités, unite, unità, unita, unidad
""")
# Only where no column has one of the words above.
LESS_CLEAR = _words("""
    position: position no, position number, position nr, lage nr, pos nr, pos no, stellung nr
    position: messlage nr, aufspannung nr, läge nr
    ball: ball no, ball number, ball id, sphere no, kugel nr, kugelnummer, kula nr, feature
    ball: element, merkmal, name, label, id, no, nr, number, nummer, punkt, élément, elemento
    ball: namn, nom, nome, nombre, numéro, numero
    probe: stylus name, tip name, sensor, probe no, stylus no, taster nr, tip no, spets, punta
""")
# Words that say no more than that a number is a measured one, of an axis, or of a point.
_OF_AXES = _words("""
    value: value, actual, act, measured, meas, wert, ist, istwert, gemessen, messwert, valeur
    value: mesuré, mesurée, valore, misurato, misurata, valor, medido, medida, värde, mätvärde
    value: uppmätt, mätt, values, actuals, istwerte, messwerte, valeurs, valori, valores
    nominal: nominal, nom, nominals, soll, sollwert, sollwerte, nennwert, nennwerte, nennmass
    nominal: theoretical, theo, nominell, nominale, nominali, nominales, théorique, teorico, teórico
    axis: axis, achse, axe, asse, eje, axel, coordinate, koordinate, koordinat, coordonnée
    axis: coordinata, coordenada
    point: coordinates, co, ordinate, coord, coordonnées, centre, center, centro, centrum, mitte
    point: mittelpunkt
""")
VALUES, AXIS_WORDS, NOMINAL = _OF_AXES["value"], _OF_AXES["axis"], _OF_AXES.pop("nominal")
MEASURED = {word for words in _OF_AXES.values() for word in words}

# Other headings of further columns. Those of times have no unit where they are of a clock.
OTHER_HEADINGS = _words("""
    time: date time, datetime, timestamp, time stamp, zeit, uhrzeit, zeitstempel, tid, klockslag
    time: tidpunkt, heure, horodatage, temps, ora, tempo, hora, tiempo, date heure, data ora
    time: fecha hora
    temperature_artefact: plattentemperatur, temperatur platte, temperatur platta
    temperature_artefact: température plaque, temperatura piastra, temperatura placa
    temperature_scales: massstabstemperatur, temperatur massstab, temperatur skalor
    temperature_scales: température règles, temperatura righe, temperatura reglas
""")
_CLOCK = re.compile(r"(?:hh?:mm(?::ss)?)?", re.IGNORECASE)


def quoted(names: Iterable[str], limit: int = 8) -> str:
    """Return names in quotation marks as a `listing`."""
    return listing((f'"{shorten(name)}"' for name in names), limit)


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


@lru_cache(maxsize=100_000)
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


@lru_cache(maxsize=100_000)
def unit_of_further(cell: str, name: str) -> str | None:
    """Return the unit of a heading that names a further column, empty without one; None for other
    headings.

    >>> unit_of_further("t_scales_degC", "t_scales"), unit_of_further("T scales [°C]", "t_scales")
    ('degC', 'degC')
    """
    names = (folded(name), *OTHER_HEADINGS.get(name, ()))
    if folded(cell[:LONGEST]) in names:
        return ""
    match = re.fullmatch(
        r"(.+?)(?:[\s_]+|\s*(?=[\[(/]))[\[(/]?\s*([^\s_\[\]()/]+)\s*[\])]?", cell[:LONGEST]
    )
    if match is None or folded(match[1]) not in names:
        return None
    return plain_unit(match[2]).replace("°", "deg")


def is_clock(unit: str, units: Mapping[str, Fraction]) -> bool:
    """True if a heading with a unit, empty without one, is of clock times.

    >>> [is_clock(unit, DURATION_UNITS) for unit in ("", "hh:mm", "s")]
    [True, True, False]
    """
    return units == DURATION_UNITS and _CLOCK.fullmatch(unit) is not None
