"""Reports that are cut off, damaged, of another encoding or meant to do harm are refused in words, or
give centres that were written: never another one, no traceback and no waiting.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.extensions.laboratory.formats.registered import FORMATS
from ballplate.extensions.laboratory.formats.report import Report
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.laboratory import makers, wording
from tests.extensions.laboratory.makers import Ball

D = Decimal
BALLS = [
    Ball("P1_r1c1", "DOWN", (D("10.12312"), D("-20.53453"), D("300.12345"))),
    Ball("P1_r1c2", "LEFT", (D("111.45612"), D("-77.75533"), D("51.98745"))),
]
CENTRES = {ball.name: tuple(float(value) / 1000 for value in ball.centre) for ball in BALLS}
WRITTEN: dict[str, tuple[str, Callable[[], str]]] = {
    "dmis": ("dmis", lambda: makers.dmis(BALLS)),
    "pcdmis": ("pcdmis", lambda: makers.pcdmis(BALLS)),
    "pcdmis newer": ("pcdmis", lambda: makers.pcdmis(BALLS, newer=True)),
    "calypso": ("calypso", lambda: makers.calypso(BALLS)),
    "german": ("calypso", lambda: makers.german(BALLS)),
    "qif 2": ("qif", lambda: makers.qif(BALLS, 2)),
    "qif 3": ("qif", lambda: makers.qif(BALLS, 3)),
}


def read(kind: str, content: bytes) -> Report | None:
    """A report, or None where it is refused in words that name the file."""
    form = next(one for one in FORMATS if one.name == WRITTEN[kind][0])
    try:
        return form.read(content, "f", None)
    except ExperimentError as error:
        assert error.messages and all(str(one).startswith("f:") for one in error.messages)
        return None


def is_written(centre: tuple[float, float, float]) -> bool:
    return any(
        all(abs(a - b) < 1e-12 for a, b in zip(centre, one, strict=True))
        for one in CENTRES.values()
    )


@pytest.mark.parametrize("kind", WRITTEN)
def test_a_file_cut_anywhere_gives_no_centre_that_was_not_written(kind: str) -> None:
    content = WRITTEN[kind][1]().encode()
    whole = read(kind, content)
    assert whole is not None and sum(one.centre is not None for one in whole.features) >= 2
    refused = 0
    for end in range(len(content)):
        found = read(kind, content[:end])
        refused += found is None
        for one in found.features if found else ():
            if one.kind != "plane" and one.centre is not None:
                assert is_written(one.centre), (content[:end][-60:], one)
    assert refused > len(content) // 20


@pytest.mark.parametrize("kind", ["pcdmis", "pcdmis newer"])
def test_a_dimension_that_has_begun_is_refused_or_told(kind: str) -> None:
    content = WRITTEN[kind][1]()
    for end in range(content.index(BALLS[0].name), len(content)):
        cut = content[:end]
        whole_lines, _, last = cut.rpartition("\n")
        begun = [ball.name for ball in BALLS if ball.name in whole_lines]
        found = read(kind, cut.encode())
        if found is None:
            continue
        assert [one.name for one in found.features if one.kind != "plane"] == begun, cut[-60:]
        assert all(one.centre is not None or one.lacks for one in found.features)
        assert bool(found.remarks) == bool(last.strip()), cut[-60:]
        assert not last.startswith("DIM")


@pytest.mark.parametrize("end", ["DIM L", "DIM LOC9= LOCATION OF SPHERE A_1\nAX    NOMINAL    "])
def test_what_begins_at_the_end_of_a_file_is_refused(end: str) -> None:
    assert read("pcdmis", (WRITTEN["pcdmis"][1]() + end).encode()) is None
    # Where others follow, it is one that is left.
    found = read("pcdmis", (end + "\n" + WRITTEN["pcdmis"][1]()).encode())
    assert found is not None
    lacking = [one.lacks for one in found.features if one.name == "A_1"]
    lacking += [kind for kind in found.others if "without its name" in kind]
    assert len(lacking) == 1 and lacking[0]


def test_a_table_that_ends_within_a_name_is_told() -> None:
    content = WRITTEN["calypso"][1]()
    found = read("calypso", (content.rstrip("\n") + "\nPLA").encode())
    assert found is not None and wording.MAY_HAVE_BEEN_CUT_OFF in found.remarks[-1]
    found = read("calypso", content.encode())
    assert found is not None and not found.remarks


@pytest.mark.parametrize("kind", WRITTEN)
def test_damaged_bytes_are_refused_or_change_no_more_than_they_hit(kind: str) -> None:
    content, generator, read_ones = WRITTEN[kind][1]().encode(), random.Random(11), 0
    for _ in range(1500):
        damaged = bytearray(content)
        for _ in range(generator.choice((1, 1, 2, 5))):
            damaged[generator.randrange(len(damaged))] = generator.randrange(256)
        found = read(kind, bytes(damaged))
        for one in found.features if found else ():
            # What cannot be read is never taken as zero.
            if one.kind in ("sphere", "feature") and one.centre is not None:
                read_ones += 1
                assert 0.0 not in one.centre
    # Hardly any damage leaves XML well-formed.
    assert read_ones > 30


@pytest.mark.parametrize("kind", WRITTEN)
def test_lines_in_another_order_are_refused_or_read(kind: str) -> None:
    lines, generator = WRITTEN[kind][1]().splitlines(), random.Random(12)
    for _ in range(300):
        shuffled = lines[:]
        i, j = generator.randrange(len(lines)), generator.randrange(len(lines))
        if generator.random() < 0.5:
            shuffled[i], shuffled[j] = shuffled[j], shuffled[i]
        else:
            del shuffled[min(i, j) : max(i, j)]
        read(kind, "\n".join(shuffled).encode())


HARMFUL = {
    "an entity that names a file": '<!DOCTYPE q [<!ENTITY a SYSTEM "file:///etc/hostname">]>'
    '<QIFDocument xmlns="http://qifstandards.org/xsd/qif3"><Results>&a;</Results></QIFDocument>',
    "elements without end": '<QIFDocument xmlns="http://qifstandards.org/xsd/qif3">' + "<a>" * 100_000,
    "blanks in a label": "FILNAM/'A'\nUNITS/MM\nFA(" + " " * 200_000 + "\n",
    "lines without anything": "FILNAM/'A'\n" + "\n" * 300_000,
    "a statement that goes on and on": "FILNAM/'A'\nUNITS/MM\n" + "FA(A)=FEAT/SPHERE,$\n" * 50_000,
    "braces": "FILNAM/'A'\n" + "FA((((" * 50_000,
    "a row of hyphens": "DIM A= LOCATION OF SPHERE B UNITS=MM\nMM " + " - " * 100_000,
    "a name of hyphens": "id\tactual\tnominal\n" + "-_" * 100_000 + "X\t1\t1\t\n",
    "ever more numbers": "DIM A= LOCATION OF SPHERE B UNITS=MM\nAX MEAS\nX " + "1 " * 200_000,
    "columns": "\t".join(["id", "actual", "nominal", *["x"] * 100_000]) + "\n",
    "a number of many digits": "FILNAM/'A'\nUNITS/MM\nFA(A_1)=FEAT/SPHERE,CART,"
    + "9" * 100_000
    + ",1,1,1\nENDFIL\n",
    "an exponent": "FILNAM/'A'\nUNITS/MM\nFA(A_1)=FEAT/SPHERE,CART,1e999999,1,1,1\nENDFIL\n",
    "a factor of zero": makers.qif(BALLS).replace("0.001<", "0<"),
    "an index of many digits": makers.qif(BALLS).replace(
        "<Location>10.12312 -20.53453 300.12345</Location>",
        f'<PointList><SinglePointSetId index="{"9" * 5000}">1000</SinglePointSetId></PointList>',
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", HARMFUL)
def test_files_that_mean_harm_are_refused_soon(what: str, tmp_path: Path) -> None:
    path = tmp_path / "report"
    path.write_text(HARMFUL[what], encoding="utf-8")
    # Where time grew as the square of the size, this would not end.
    with pytest.raises(ExperimentError):
        bp.read_report(path)


@pytest.mark.parametrize("content", [b"\x00" * 100, b"\xff\xfe\x00", b"\xfe\xff\xd8\x00" * 9, bytes(range(256))])  # fmt: skip
@pytest.mark.parametrize("form", ["dmis", "pcdmis", "calypso", "qif"])
def test_what_is_no_text_is_refused_by_every_reader(
    content: bytes, form: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "report"
    path.write_bytes(content)
    assert main(["import", str(path), "--from", form, "-o", "-"]) == 3
    captured = capsys.readouterr()
    assert str(path) in captured.err and "Traceback" not in captured.err
    assert captured.out == ""


def test_decimal_commas_in_dmis_are_refused() -> None:
    """Also where some co-ordinates are whole numbers, or decimals begin with no zero."""
    whole = WRITTEN["dmis"][1]()
    assert read("dmis", re.sub(r"(\d)\.(\d)", r"\1,\2", whole).encode()) is None
    for numbers in ("749,5,-1,25,250,5,22", "0,00112,5,250,22", "1,5,2,5,3,5,22,5"):
        said = f"FILNAM/'A'\nUNITS/MM,ANGDEC\nFA(S)=FEAT/SPHERE,OUTER,CART,{numbers}\nENDFIL\n"
        assert read("dmis", said.encode()) is None, numbers
    upright = "FILNAM/'A'\nUNITS/MM,ANGDEC\nFA(S)=FEAT/SPHERE,OUTER,CART,1,2,3,22,0,0,1\nENDFIL\n"
    found = read("dmis", upright.encode())
    assert found is not None and found.features[0].centre == pytest.approx((0.001, 0.002, 0.003))
