"""Reports as measuring programs write them, of readings that are known: for tests only.

Written from the published descriptions that docs/how-to/import-readings.md cites, and apart from
the readers: no program of a maker was at hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal


@dataclass(frozen=True)
class Ball:
    """A measured ball: the name of its feature, its sensor, and its centre in millimetres."""

    name: str
    sensor: str
    centre: tuple[Decimal, Decimal, Decimal]

    @property
    def nominal(self) -> tuple[Decimal, ...]:
        return tuple(round(value, 0) for value in self.centre)


def dmis(balls: Sequence[Ball], unit: str = "MM", factor: str = "1") -> str:
    """DMIS output, with a plane and a tolerance among the spheres."""
    lines = [
        "DMISMN/'BALL PLATE',05.2", "FILNAM/'PLATE',05.2", "$$ written for a test",
        f"UNITS/{unit},ANGDEC", "D(0)=DATSET/MCS",
        "F(TOP)=FEAT/PLANE,CART,0,0,0,0,0,1", "FA(TOP)=FEAT/PLANE,CART,0,0,0.0011,0,0,1",
    ]  # fmt: skip
    sensor = None
    for ball in balls:
        if ball.sensor != sensor:
            lines.append(f"SNSLCT/SA({ball.sensor})")
            sensor = ball.sensor
        x, y, z = (value / Decimal(factor) for value in ball.centre)
        a, b, c = (value / Decimal(factor) for value in ball.nominal)
        lines += [
            f"F({ball.name})=FEAT/SPHERE,OUTER,CART,{a},{b},{c},{22 / Decimal(factor)}",
            f"FA({ball.name})=FEAT/SPHERE,OUTER,CART,$",
            f"{x},{y},$",
            f"{z},{Decimal('21.9998') / Decimal(factor)}",
        ]
    return "\n".join([*lines, "TA(T1)=TOL/POS,3D,0.0112,INTOL", "ENDFIL", ""])


def pcdmis(balls: Sequence[Ball], unit: str = "MM", factor: str = "1", newer: bool = False) -> str:
    """A text report of PC-DMIS, older or newer, with the flatness of a plane first."""
    lines = [
        "PART NAME  : PLATE", "REV NUMBER :", "SER NUMBER : 1", "",
        f"DIM FLAT1= FLATNESS OF PLANE PLN1  UNITS={unit} ,$",
        "GRAPH=OFF  TEXT=OFF  MULT=10.00  OUTPUT=BOTH",
        "AX    NOMINAL       +TOL       -TOL       MEAS        DEV     OUTTOL",
        "M      0.0000     0.0100     0.0000     0.0021     0.0021     0.0000 #--------",
        "END OF DIMENSION FLAT1", "",
    ]  # fmt: skip
    for k, ball in enumerate(balls, start=1):
        measured = [round(value / Decimal(factor), 7) for value in ball.centre]
        nominal = [round(value / Decimal(factor), 7) for value in ball.nominal]
        if newer:
            lines += [
                f"⊕   {unit}   LOC{k} - {ball.name}",
                "AX       MEAS    NOMINAL       +TOL       -TOL        DEV     OUTTOL",
            ]
        else:
            lines += [
                f"DIM LOC{k}= LOCATION OF SPHERE {ball.name}  UNITS={unit} ,$",
                "GRAPH=OFF  TEXT=OFF  MULT=10.00  OUTPUT=BOTH  HALF ANGLE=NO",
                "AX    NOMINAL       +TOL       -TOL       MEAS        DEV     OUTTOL",
            ]
        for axis, one, other in zip("XYZ", measured, nominal, strict=True):
            columns = [one, other] if newer else [other]
            cells = [*columns, "0.0500", "0.0500", *([] if newer else [one]), one - other, "0.0000"]
            lines.append(f"{axis} " + "".join(f"{cell!s:>14}" for cell in cells) + " ----#----")
        lines += [] if newer else [f"END OF DIMENSION LOC{k}"]
        lines.append("")
    return "\n".join(lines)


CHARACTERISTICS = [
    *("planid", "partnb", "id", "type", "idsymbol", "actual", "nominal", "uppertol", "lowertol"),
    *("deviation", "exceed", "featureid", "unit", "group1"),
]


def calypso(balls: Sequence[Ball], comma: bool = False) -> str:
    """Calypso's table of characteristics, parted by tabulators, with a diameter to each ball."""
    rows = [CHARACTERISTICS]
    for ball in balls:
        for axis, one, other in zip("xyz", ball.centre, ball.nominal, strict=True):
            rows.append(
                [
                    *("PLATE", "1", f"{ball.name}_{axis.upper()}", f"{axis}Value", axis.upper()),
                    *(str(one), str(other), "0.05", "-0.05", str(one - other), ""),
                    *(ball.name, "mm", ""),
                ]
            )
        rows.append(
            [*("PLATE", "1", f"{ball.name}_D", "diameter", "D", "21.9998", "22", "0.1", "-0.1")]
            + ["-0.0002", "", ball.name, "mm", ""]
        )
    text = "\r\n".join("\t".join(row) for row in rows) + "\r\nEND\r\n"
    return text.replace(".", ",") if comma else text


def german(balls: Sequence[Ball]) -> str:
    """A printed table with German headings and decimal commas, columns parted by blanks."""
    lines = ["Messprotokoll   CALYPSO", "Prüfplan: Kugelplatte", ""]
    lines.append(
        "Name                    Istwert [mm]    Sollwert    Ob.Tol    Unt.Tol    Abweichung"
    )
    lines.append("=" * 70)
    for ball in balls:
        for axis, one, other in zip("XYZ", ball.centre, ball.nominal, strict=True):
            row = f"{axis}-Wert_{ball.name}   {one}   {other}   0.05   -0.05   {one - other}"
            lines.append(row.replace(".", ","))
    return "\r\n".join([*lines, ""])


def qif(balls: Sequence[Ball], version: int = 3) -> str:
    """QIF results, of version 2 or 3."""
    items, measured = [], []
    word = "FeatureMeasurement" if version == 3 else "FeatureActual"
    for k, ball in enumerate(balls):
        place = " ".join(str(value) for value in ball.centre)
        items.append(
            f'<SphereFeatureItem id="{1000 + k}"><FeatureNominalId>1</FeatureNominalId>'
            f"<FeatureName>{ball.name}</FeatureName></SphereFeatureItem>"
        )
        measured.append(
            f'<Sphere{word} id="{5000 + k}"><FeatureItemId>{1000 + k}</FeatureItemId>'
            f"<Location>{place}</Location><Diameter>21.9998</Diameter></Sphere{word}>"
        )
    measured.append(
        f'<Plane{word} id="4"><FeatureItemId>3</FeatureItemId><Location>0 0 0</Location></Plane{word}>'
    )
    body = "\n".join(measured)
    body = body if version == 3 else f'<FeatureActuals n="9">{body}</FeatureActuals>'
    outer = "Results" if version == 3 else "MeasurementsResults"
    every = "\n".join(items)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<QIFDocument xmlns="http://qifstandards.org/xsd/qif{version}" versionQIF="{version}.0.0" idMax="9999">
<FileUnits><PrimaryUnits><LinearUnit><SIUnitName>meter</SIUnitName><UnitName>mm</UnitName>
<UnitConversion><Factor>0.001</Factor></UnitConversion></LinearUnit></PrimaryUnits></FileUnits>
<Features><FeatureItems n="9">{every}</FeatureItems></Features>
<{outer}><MeasurementResultsSet n="1"><MeasurementResults id="2">
<MeasuredFeatures n="9">
{body}
</MeasuredFeatures></MeasurementResults></MeasurementResultsSet></{outer}>
</QIFDocument>
"""
