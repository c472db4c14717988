"""Reports of other programs, rich text, zero bytes and encodings: what is no report of a known
program is not read as one, and what is one is read in its encoding.
"""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.extensions.laboratory.formats.registered import recognised
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.laboratory import makers
from tests.extensions.laboratory.makers import Ball
from tests.extensions.laboratory.test_other_characteristics import EXPERIMENT, PLACES

D = Decimal
NAMES = ["左", "右", "上", "下"]
BALLS = [
    Ball(name, "", (D(str(x)), D(str(y)), D(str(z))))
    for name, (x, y, z) in zip(NAMES, PLACES.values(), strict=True)
]
PLAIN = [Ball("P1_a", "", BALLS[0].centre), Ball("P1_b", "", BALLS[1].centre)]
# Reports of optical machines: a heading, then blocks; rows of a table; rows below each other.
OTHER_PROGRAMS = [
    """Machine Serial Number: SN7      Page: 1
Feature      Unit   Nominal     Actual      Tolerances      Deviation   Exceeded
Step 1 - Ball A, touch
Sphere Diame   +00022.000 +00021.998        -00000.002
X Location     +00100.000 +00100.003        +00000.003
Y Location     +00200.000 +00200.001        +00000.001
""",
    """Feature         Unit   Nominal    Actual     Deviation
X Location      mm     100.000    100.003    0.003
Y Location      mm     200.000    200.001    0.001
Z Location      mm     300.000    300.004    0.004
""",
    "Name\tType\tNominal\tActual\tDeviation\nBall A X\tX\t100\t100.003\t0.003\n",
    "Element;Merkmal;Sollwert;Istwert;Abweichung\nKugel A;X;100,000;100,003;0,003\n",
    "Feature   Nominal   Actual   UpperTol   LowerTol   Deviation\nX_A   1   1.001   1   1   0.001\n",
]


@pytest.mark.parametrize("text", OTHER_PROGRAMS)
def test_reports_of_other_programs_are_of_no_known_format(tmp_path: Path, text: str) -> None:
    assert recognised(text) is None
    (tmp_path / "report.txt").write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        bp.read_report(tmp_path / "report.txt")
    assert len(caught.value.messages) == 1


RICH = r"{\rtf1\ansi{\fonttbl{\f0 Courier New;}}\f0" + "\nSphere  X  +454.74389\\par\n}\n"


@pytest.mark.parametrize("before", [b"", b"\xef\xbb\xbf", b"\r\n  "])
@pytest.mark.parametrize("after", [b"", b"\0", b"\0\0\0", b"\x1a\0"])
@pytest.mark.parametrize("text", [RICH, RICH.replace("rtf", "RTF"), RICH.replace("rtf1", "urtf0")])
def test_rich_text_is_named(tmp_path: Path, before: bytes, after: bytes, text: str) -> None:
    path = tmp_path / "report.txt"
    for content in (before + text.encode() + after, text.encode("utf-16") + 2 * after):
        path.write_bytes(content)
        with pytest.raises(ExperimentError, match="is rich text"):
            bp.read_report(path)
        with pytest.raises(ExperimentError, match="is rich text"):
            bp.fit("designs/quickstart.yaml", path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-16-le", "cp1252"])
@pytest.mark.parametrize("end", ["\0", "\0\0", "\0" * 3, "\0" * 512, "\x1a"])
def test_zero_bytes_at_the_end_change_nothing(tmp_path: Path, encoding: str, end: str) -> None:
    path = tmp_path / "report.txt"
    for text in (makers.calypso(PLAIN), makers.dmis(PLAIN), makers.pcdmis(PLAIN)):
        text = text.replace("PLATE", "Prüfung")
        path.write_bytes(text.encode("utf-8"))
        expected = bp.read_report(path).to_frame()
        path.write_bytes((text + end).encode(encoding))
        found = bp.read_report(path)
        assert found.to_frame().equals(expected)
        assert (f"{path}: not UTF-8; read as cp1252" in found.remarks) == (encoding == "cp1252")


@pytest.mark.parametrize("more", ["", "x"])
def test_a_zero_byte_within_is_named_with_its_line(tmp_path: Path, more: str) -> None:
    path = tmp_path / "report.txt"
    path.write_bytes(
        b"FILNAM/'A'\nUNITS/MM\nFA(A\0)=FEAT/SPHERE,OUTER,CART,1,2,3,4\n" + more.encode()
    )
    with pytest.raises(ExperimentError, match=r"report.txt:3:1: the control character U\+0000"):
        bp.read_report(path)


@pytest.mark.parametrize("encoding", ["cp932", "shift_jis", "utf-16", "utf-16-be", "euc_jp"])
@pytest.mark.parametrize("form", ["calypso", "dmis", "pcdmis"])
def test_reports_are_read_in_the_encoding_that_is_stated(
    tmp_path: Path, encoding: str, form: str, capsys: pytest.CaptureFixture[str]
) -> None:
    experiment = EXPERIMENT.replace("coordinates: ball centres", f"encoding: {encoding}")
    for old, new in zip(PLACES, NAMES, strict=True):
        experiment = experiment.replace(f"{old}:", f"{new}:")
    path = tmp_path / "four.yaml"
    path.write_text(experiment, encoding="utf-8")
    report = tmp_path / "P1.txt"
    text = getattr(makers, form)(BALLS).replace("⊕", "")
    report.write_bytes(text.encode(encoding))
    read = bp.read_report(report, path)
    assert read.to_frame()["ball"].tolist() == NAMES
    assert read.to_frame()["x_mm"].tolist() == [place[0] for place in PLACES.values()]
    capsys.readouterr()
    assert main(["fit", str(path), str(report)]) in (0, 1)
    shown = capsys.readouterr()
    assert "左" in shown.out and "cp1252" not in shown.err
    fit = bp.fit(path, report)
    assert fit.to_dict()["observations"] == 24
