"""Files of results as DMIS 5 describes them: FA(…) states what was measured, F(…) what was
planned.
"""

from __future__ import annotations

from decimal import Decimal

import numpy as np

from tests.extensions.laboratory.samples.readings import (
    DIAMETER,
    INCH,
    MILLIMETRE,
    Reading,
    fixed,
    in_unit,
)


def dmis_millimetres(readings: list[Reading]) -> str:
    """One line for a feature, nominal and tolerance between; in millimetres with 5 decimals."""
    lines = [
        "FILNAM/'KUGELPLATTE_44',05.2",
        "DATE=2026/03/04",
        "TIME=09:12:31",
        "PN(PART)='PLATE 44'",
        "PS(SERIAL)='0007'",
        "OP(OPERATOR)='LAB 2'",
        "$$",
        "$$ ball plate, 5 positions, tips DOWN, SIDE and BACK",
        "UNITS/MM,ANGDEC",
        "V(OUT)=VFORM/ALL",
        "D(MACHINE)=DATSET/MCS",
        "",
        "T(TDIA)=TOL/DIAM,-0.01000,0.01000",
    ]
    for group in positions(readings):
        name = group[0].position
        lines += ["", f"TEXT/OUTFIL,'POSITION {name}'", "RECALL/D(MACHINE)", *_clutter(name)]
        for reading in group:
            label = "_".join(reading.key).upper()
            nominal = ",".join(in_unit((*reading.nominal, DIAMETER), MILLIMETRE, 5))
            actual = ",".join(in_unit((*reading.centre, reading.diameter), MILLIMETRE, 5))
            lines.append(f"F({label})=FEAT/SPHERE,OUTER,CART,{nominal}")
            lines.append(f"FA({label})=FEAT/SPHERE,OUTER,CART,{actual}")
            deviation = fixed(reading.diameter - DIAMETER, 5)
            lines.append(f"TA(TDIA)=TOL/DIAM,{deviation},INTOL")
    return "\n".join([*lines, "", "ENDFIL", ""])


def _clutter(name: str) -> list[str]:
    """Two features besides: of the table and of a bore in it."""
    return [
        f"F(TABLE_{name})=FEAT/PLANE,CART,0.00000,0.00000,-12.00000,0.00000,0.00000,1.00000",
        f"FA(TABLE_{name})=FEAT/PLANE,CART,0.00013,-0.00021,-12.00342,0.00002,-0.00001,1.00000",
        f"F(BORE_{name})=FEAT/CIRCLE,INNER,CART,25.00000,25.00000,-5.00000,$",
        "0.00000,0.00000,1.00000,12.00000",
        f"FA(BORE_{name})=FEAT/CIRCLE,INNER,CART,25.01234,24.99871,-5.00000,$",
        "0.00000,0.00000,1.00000,12.00419",
    ]


def dmis_inches(readings: list[Reading]) -> str:
    """Only what was measured, with blanks and continued lines; in inches with 7 decimals."""
    lines = [
        "$$",
        "$$ Results of program KP44",
        "$$",
        "DMISMN/'KP44',05.0",
        "UNITS/INCH,ANGDEC",
        "",
        "FA(Plane_1) = FEAT/PLANE, CART,$",
        "0.0000051, -0.0000083, -0.4725731,$",
        "0.0000200, -0.0000100, 1.0000000",
    ]
    for reading in readings:
        x, y, z, d = in_unit((*reading.centre, reading.diameter), INCH, 7)
        lines.append(f"FA(Sphere_{'_'.join(reading.key)}) = FEAT/SPHERE, OUTER, CART,$")
        lines += [f"{x}, {y}, {z},$", d]
        if reading.ball == "r4c4":
            lines.append(f"FA(Point_{reading.position}_{reading.probe}) = FEAT/POINT, CART,$")
            lines.append("1.0000000, 2.0000000, -0.4724409, 0.0000000, 0.0000000, 1.0000000")
    return "\r\n".join([*lines, "ENDFIL", ""])


def dmis_surface_points(readings: list[Reading]) -> str:
    """Points on the spheres alone, nine on those that the tip down read and five on those of the
    others, exactly on a sphere about the centre but for 6 decimals of a millimetre.
    """
    lines = [
        "FILNAM/'KP44 POINTS',05.2",
        "DATE=2026/03/05",
        "TIME=14:40:02",
        "$$ points on the surface, the tip's radius taken off",
        "UNITS/MM,ANGDEC",
        "FA(TABLE_1)=FEAT/POINT,CART,10.000000,10.000000,-12.003310,0.000000,0.000000,1.000000",
        "FA(TABLE_2)=FEAT/POINT,CART,550.000000,10.000000,-12.003402,0.000000,0.000000,1.000000",
        "FA(TABLE_3)=FEAT/POINT,CART,300.000000,550.000000,-12.003377,0.000000,0.000000,1.000000",
    ]
    for reading in readings:
        label = "_".join(reading.key).upper()
        nominal = ",".join(in_unit((*reading.nominal, DIAMETER), MILLIMETRE, 6))
        lines.append(f"F({label})=FEAT/SPHERE,OUTER,CART,{nominal}")
        for number, normal in enumerate(_normals(reading.probe), 1):
            point = [c + DIAMETER / 2 * n for c, n in zip(reading.centre, normal, strict=True)]
            text = ",".join(in_unit((*point, *normal), MILLIMETRE, 6))
            lines.append(f"FA({label}_{number})=FEAT/POINT,CART,{text}")
    return "\n".join([*lines, "ENDFIL", ""])


def _normals(probe: str) -> list[tuple[Decimal, ...]]:
    """Where a tip touches: at the pole that it looks at and round it."""
    rings = [(45, 45), (90, 0)] if probe == "down" else [(90, 0)]
    poles = {"down": [0.0, 0.0, 1.0], "side": [-0.8, -0.6, 0.0], "back": [0.0, 1.0, 0.0]}
    pole = np.array(poles[probe])
    across = np.array([1.0, 0.0, 0.0] if probe == "down" else [0.0, 0.0, 1.0])
    third = np.cross(pole, across)
    normals = [pole]
    for latitude, start in rings:
        tilt = np.radians(latitude)
        for turn in np.radians(start + 90.0 * np.arange(4)):
            round_it = np.cos(turn) * across + np.sin(turn) * third
            normals.append(np.cos(tilt) * pole + np.sin(tilt) * round_it)
    return [tuple(Decimal(repr(float(n))) for n in normal) for normal in normals]


def positions(readings: list[Reading]) -> list[list[Reading]]:
    """The readings of each position."""
    names = list(dict.fromkeys(reading.position for reading in readings))
    return [[r for r in readings if r.position == name] for name in names]
