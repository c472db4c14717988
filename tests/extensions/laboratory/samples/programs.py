"""Reports and tables as programs of CMMs write them."""

from __future__ import annotations

from decimal import Decimal

from tests.extensions.laboratory.samples.readings import (
    DIAMETER,
    INCH,
    MILLIMETRE,
    Reading,
    fixed,
    in_unit,
)

LINES_OF_A_PAGE = 60
LINES_OF_THE_FIRST_PAGE = 49


def pcdmis_millimetres(readings: list[Reading]) -> str:
    """A report with 4 decimals in which the features have the names of the readings."""
    dimensions = []
    for reading in readings:
        feature = "_".join(reading.key).upper()
        title = f"DIM LOC{len(dimensions) + 1}= LOCATION OF SPHERE {feature}  UNITS=MM"
        dimensions.append(_dimension(title, reading, MILLIMETRE, 4, False))
    dimensions[16:16] = [_plane("MM", 4, False)]
    return _pages(dimensions, "BALL PLATE 44", "04-Mar-26", "09:12:31 AM")


def pcdmis_inches(readings: list[Reading]) -> str:
    """A report with 5 decimals, what was measured before what was planned, in which the dimensions
    have names and the spheres only numbers.
    """
    dimensions = []
    for reading in readings:
        name = f"{reading.position}_{reading.probe.upper()}_{reading.number:02d}"
        title = f"DIM {name}= LOCATION OF SPHERE SPH{len(dimensions) + 1}  UNITS=IN"
        dimensions.append(_dimension(title, reading, INCH, 5, True))
    dimensions[40:40] = [_plane("IN", 5, True)]
    return _pages(dimensions, "BP44", "05-Mar-26", "02:01:10 PM")


def _dimension(title: str, reading: Reading, unit: Decimal, digits: int, first: bool) -> list[str]:
    measured = (*reading.centre, reading.diameter)
    rows = [title, _head(first)]
    for axis, m, n in zip("XYZD", measured, (*reading.nominal, DIAMETER), strict=True):
        rows.append(_row(axis, Decimal(fixed(m / unit, digits)), n / unit, digits, first))
    return rows


def _plane(unit: str, digits: int, first: bool) -> list[str]:
    rows = [f"DIM FLAT1= FLATNESS OF PLANE PLN1  UNITS={unit}", _head(first)]
    return [*rows, _row("M", Decimal("0.0012"), Decimal(0), digits, first)]


def _head(first: bool) -> str:
    names = ["NOMINAL", "+TOL", "-TOL"]
    names = ["MEAS", *names] if first else [*names, "MEAS"]
    return "AX " + "".join(f"{name:>12}" for name in [*names, "DEV", "OUTTOL"])


def _row(axis: str, measured: Decimal, nominal: Decimal, digits: int, first: bool) -> str:
    tolerance = Decimal("0.02")
    deviation = measured - Decimal(fixed(nominal, digits))
    outside = max(abs(deviation) - tolerance, Decimal(0))
    values = [nominal, tolerance, tolerance]
    values = [measured, *values] if first else [*values, measured]
    place = min(max(4 + round(deviation / tolerance * 4), 0), 8)
    graph = "-" * place + "#" + "-" * (8 - place)
    texts = (f"{fixed(value, digits):>12}" for value in [*values, deviation, outside])
    return f"{axis:<3}" + "".join(texts) + " " + graph


def _pages(dimensions: list[list[str]], part: str, date: str, time: str) -> str:
    lines = [
        " ",
        "        ",
        f"DATE={date}                       TIME={time}",
        f"PART NAME  : {part}",
        "REV NUMBER : A",
        "SER NUMBER : 0007",
        "STATS COUNT : 1",
        " ",
        "OPERATOR : LAB 2",
    ]
    page, left = 1, LINES_OF_THE_FIRST_PAGE - len(lines)
    for dimension in dimensions:
        for line in dimension:
            if left == 0:
                page, left = page + 1, LINES_OF_A_PAGE
                lines.append(f"PART NUMBER={part}    DATE={date}     TIME={time}     PAGE#={page}")
            lines.append(line)
            left -= 1
    return "\r\n".join([*lines, ""])


CHARACTERISTICS = (
    "planid partnb id type idsymbol actual nominal uppertol lowertol deviation exceed warningLimitCF"
    " featureid featuresigma comment link linkmode mmc useruppertol userlowertol fftphi fftphiunit"
    " zoneroundnessangle groupname groupname2 datumAid datumBid datumCid natuppertolid"
    " natlowertolid decimalplaces featurePosX featurePosY featurePosZ unit group1 group2"
)
FEATURES = (
    "planid partnb id type idsymbol technology outside numpoints x y z nx ny nz diameter diameter2"
    " a1 a2 angle apexangle width length depth startangle endangle filter sigma mindev maxdev form"
    " mindevpoint maxdevpoint evaluation stylus alignment unit x_nom y_nom z_nom nx_nom ny_nom"
    " nz_nom diameter_nom diameter2_nom"
)
PLAN = {"planid": "Kugelplatte Prüfung", "partnb": "7"}


def calypso(readings: list[Reading]) -> dict[str, str]:
    """The three tables, by the end of their name, with tabs, decimal commas and 7 decimals."""
    features = [_feature("Ebene_Tisch", "Plane", ["0", "0", "-12.0034200", "0", "0", "1"])]
    circle = ["25.0123400", "24.9987100", "-5", "0", "0", "1", "12.0041900"]
    features.append(_feature("Bohrung_1", "Circle", circle))
    characteristics = [_characteristic("Ebenheit_Tisch", "flatness", "Ebene_Tisch", "0.0012", "0")]
    for reading in readings:
        name = "_".join(reading.key)
        measured = in_unit((*reading.centre, reading.diameter), MILLIMETRE, 7)
        nominal = in_unit((*reading.nominal, DIAMETER), MILLIMETRE, 7)
        values = [*measured[:3], "0", "0", "1", measured[3]]
        features.append(_feature(name, "Sphere", values, nominal, reading.probe))
        kinds = zip(("xValue", "yValue", "zValue", "diameter"), measured, nominal, strict=True)
        for kind, m, n in kinds:
            letter = kind[0].upper()
            characteristics.append(_characteristic(f"{name}_{letter}", kind, name, m, n))
    header = PLAN | {
        "date": "04.03.2026",
        "time": "09:12:31",
        "operid": "Labor 2",
        "order": "KP-44",
        "drawingno": "",
        "dmeid": "KMG 1",
        "devicegroup": "Messraum",
        "dmesn": "000000",
        "controllertyp": "",
        "dmeswi": "Calypso",
        "dmeswv": "",
        "comment": "20,1 °C",
    }
    return {
        "hdr": _table(list(header), [header]),
        "fet": _table(FEATURES.split(), features),
        "chr": _table(CHARACTERISTICS.split(), characteristics),
    }


def _feature(
    name: str, kind: str, values: list[str], nominal: list[str] | None = None, stylus: str = ""
) -> dict[str, str]:
    row = PLAN | {"id": name, "type": "measured", "idsymbol": kind, "outside": "1"}
    row |= dict(zip(("x", "y", "z", "nx", "ny", "nz", "diameter"), values, strict=False))
    row |= {"sigma": "0.0003000", "form": "0.0009000", "alignment": "Gerät", "unit": "mm"}
    wanted = ("x_nom", "y_nom", "z_nom", "diameter_nom")
    return row | {"stylus": stylus} | dict(zip(wanted, nominal or (), strict=False))


def _characteristic(
    name: str, kind: str, feature: str, measured: str, nominal: str
) -> dict[str, str]:
    deviation = fixed(Decimal(measured) - Decimal(nominal), 7)
    row = PLAN | {"id": name, "type": kind[0].upper() + "1", "idsymbol": kind, "unit": "mm"}
    row |= {"actual": fixed(Decimal(measured), 7), "nominal": fixed(Decimal(nominal), 7)}
    row |= {"uppertol": "0.0200000", "lowertol": "-0.0200000", "deviation": deviation}
    return row | {"featureid": feature, "decimalplaces": "4", "groupname": "Kugeln"}


def _table(names: list[str], rows: list[dict[str, str]]) -> str:
    """Rows with decimal commas; a date keeps its points."""
    lines = ["\t".join(names)]
    for row in rows:
        cells = [row.get(name, "") for name in names]
        cells = [
            c.replace(".", ",") if c.lstrip("-")[:1].isdigit() and c.count(".") == 1 else c
            for c in cells
        ]
        lines.append("\t".join(cells))
    return "\r\n".join([*lines, "END", ""])


def qif(readings: list[Reading], version: str) -> str:
    """Results in QIF 3.0 in millimetres with 6 decimals, or in 2.1 in inches with 9."""
    new = version == "3.0.0"
    unit, digits = (MILLIMETRE, 6) if new else (INCH, 9)
    name, factor = ("mm", "0.001") if new else ("inch", "0.0254")
    separator = " " if new else "_"
    kind = "Measurement" if new else "Actual"
    planned: list[str] = []
    items: list[str] = []
    measured: list[str] = []
    for number, reading in enumerate(readings):
        nominal, item, actual = (20 + 3 * number + i for i in range(3))
        x, y, z, d = in_unit((*reading.centre, reading.diameter), unit, digits)
        place = " ".join(in_unit(reading.nominal, unit, digits))
        planned.append(
            f'<SphereFeatureNominal id="{nominal}"><FeatureDefinitionId>2</FeatureDefinitionId>'
            f"<Location>{place}</Location></SphereFeatureNominal>"
        )
        items.append(
            f'<SphereFeatureItem id="{item}"><FeatureNominalId>{nominal}</FeatureNominalId>'
            f"<FeatureName>{separator.join(reading.key)}</FeatureName>{CHECKED}</SphereFeatureItem>"
        )
        measured.append(
            f'<SphereFeature{kind} id="{actual}"><FeatureItemId>{item}</FeatureItemId>'
            f"<Location>{x} {y} {z}</Location><Diameter>{d}</Diameter></SphereFeature{kind}>"
        )
    plane = in_unit((Decimal(0), Decimal(0), Decimal("-12.00342")), unit, digits)
    planned.append(
        '<PlaneFeatureNominal id="4"><FeatureDefinitionId>3</FeatureDefinitionId>'
        f"<Location>{' '.join(plane)}</Location><Normal>0 0 1</Normal></PlaneFeatureNominal>"
    )
    items.append(
        '<PlaneFeatureItem id="5"><FeatureNominalId>4</FeatureNominalId>'
        f"<FeatureName>table</FeatureName>{CHECKED}</PlaneFeatureItem>"
    )
    measured.append(
        f'<PlaneFeature{kind} id="6"><FeatureItemId>5</FeatureItemId>'
        f"<Location>{' '.join(plane)}</Location><Normal>0 0 1</Normal></PlaneFeature{kind}>"
    )
    features = _counted(f"Feature{kind}s" if not new else "MeasuredFeatures", measured)
    if not new:
        features = ["<MeasuredFeatures>", *features, "</MeasuredFeatures>"]
    results = "Results" if new else "MeasurementsResults"
    lines = [
        *_qif_head(version, 20 + 3 * len(readings), name, factor),
        "<Features>",
        '<FeatureDefinitions n="2">',
        '<SphereFeatureDefinition id="2"><InternalExternal>EXTERNAL</InternalExternal>'
        f"<Diameter>{fixed(DIAMETER / unit, digits)}</Diameter></SphereFeatureDefinition>",
        '<PlaneFeatureDefinition id="3"/>',
        "</FeatureDefinitions>",
        *_counted("FeatureNominals", planned),
        *_counted("FeatureItems", items),
        "</Features>",
        f"<{results}>",
        '<MeasurementResultsSet n="1">',
        '<MeasurementResults id="7">',
        *features,
        "<InspectionStatus><InspectionStatusEnum>PASS</InspectionStatusEnum></InspectionStatus>",
        "</MeasurementResults>",
        "</MeasurementResultsSet>",
        f"</{results}>",
        "</QIFDocument>",
    ]
    return "\n".join([*lines, ""])


CHECKED = (
    "<DeterminationMode><Checked><CheckDetails><Measured/></CheckDetails></Checked>"
    "</DeterminationMode>"
)


def _counted(name: str, lines: list[str]) -> list[str]:
    return [f'<{name} n="{len(lines)}">', *lines, f"</{name}>"]


def _qif_head(version: str, most: int, unit: str, factor: str) -> list[str]:
    space = f"http://qifstandards.org/xsd/qif{version[0]}"
    return [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<QIFDocument xmlns="{space}" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"',
        f'  versionQIF="{version}" idMax="{most}">',
        "<QPId>8f2d6b1c-3f0e-4b7a-9d55-0a6c5e1b2f44</QPId>",
        "<Version><TimeCreated>2026-03-04T09:12:31</TimeCreated></Version>",
        "<Header><Application><Name>laboratory</Name></Application></Header>",
        "<FileUnits><PrimaryUnits>",
        "<AngularUnit><SIUnitName>radian</SIUnitName><UnitName>degree</UnitName>"
        "<UnitConversion><Factor>0.017453292519943</Factor></UnitConversion></AngularUnit>",
        f"<LinearUnit><SIUnitName>meter</SIUnitName><UnitName>{unit}</UnitName>"
        f"<UnitConversion><Factor>{factor}</Factor></UnitConversion></LinearUnit>",
        "</PrimaryUnits></FileUnits>",
    ]
