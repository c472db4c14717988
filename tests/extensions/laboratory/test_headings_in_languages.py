"""Headings of tables in six languages, and those of one row per axis."""

from __future__ import annotations

from fractions import Fraction

import pytest
from ballplate.extensions.laboratory.headings import Vocabulary, read_headings
from ballplate.simulator.inputs import DURATION_UNITS

DEGREES = {"degC": Fraction(1)}
FURTHER = {"time": DURATION_UNITS, "temperature_artefact": DEGREES, "temperature_scales": DEGREES}
WORDS = Vocabulary(("x", "y", "z"), ("down", "up"), ("low", "high"), further=FURTHER)
ROLES = ["position", "ball", "probe", "unit", *FURTHER]


@pytest.mark.parametrize(
    "heads",
    [
        "Position;Ball;Stylus;Unit;Timestamp;temperature artefact [°C];temperature scales [°C]",
        "Lage;Kugel;Taster;Einheit;Uhrzeit;Temperatur Platte [°C];Temperatur Maßstab [°C]",
        "Läge;Kula;Mätspets;Enhet;Tid;Temperatur platta (°C);Temperatur skalor (°C)",
        "Pose;Sphère;Palpeur;Unité;Heure;Température plaque (°C);Température règles (°C)",
        "Posizione;Sfera;Tastatore;Unità;Ora;Temperatura piastra [°C];Temperatura righe [°C]",
        *(
            f"{head};Kugel;Taster;Einheit;Uhrzeit;Temperatur Platte [°C];Temperatur Maßstab [°C]"
            for head in ("Messlage", "AUFSPANNUNG", "Stellung Nr.")
        ),
        "Posición;Esfera;Palpador;Unidad;Hora;Temperatura placa [°C];Temperatura reglas [°C]",
    ],
)
@pytest.mark.parametrize(
    ("values", "by_axis"),
    [
        ("X;Y;Z", False),
        ("X-Koordinate;Y-Koordinate;Z-Koordinate", False),
        ("X uppmätt [mm];Y uppmätt [mm];Z uppmätt [mm]", False),
        ("Coordonnée X (mm);Coordonnée Y (mm);Coordonnée Z (mm)", False),
        ("X misurato;Y misurato;Z misurato", False),
        ("X medido;Y medido;Z medido", False),
        ("Achse;Messwert;Nennmaß", True),
        ("Axel;Mätvärde;Nominellt", True),
        ("Axe;Valeur mesurée;Valeur nominale", True),
        ("Asse;Valore;Nominale", True),
        ("Eje;Valor medido;Valor nominal", True),
    ],
)
def test_headings_in_six_languages(heads: str, values: str, by_axis: bool) -> None:
    found = read_headings([*heads.split(";"), *values.split(";")], WORDS)
    assert found is not None
    assert {role: column.place for role, column in found.roles.items()} == {
        role: k for k, role in enumerate(ROLES)
    }
    (group,) = found.groups
    first = 10 if by_axis else 7
    assert [axis.place for axis in group.axes] == list(range(first, first + 3))
    assert found.by_axis == ((7, 8) if by_axis else None)
