"""Digital certificates against the schemas that the Physikalisch-Technische Bundesanstalt has
published.

These are under the GNU Lesser General Public License, version 3, and no part of this source tree:
a folder with a copy of each is named by BALLPLATE_DCC_SCHEMAS. Copies are known by their SHA-256,
with line feeds as line ends.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest

from tests.extensions.certificates.campaigns import IN_PLANE, IN_SPACE
from tests.extensions.certificates.test_plate_certificate import ABOUT

# Version, where it was published, and SHA-256.
PUBLISHED = {
    "dcc.xsd": (
        "3.1.2",
        "https://ptb.de/dcc/v3.1.2/dcc.xsd",
        "daf869dc4d03b53ca2d33fc4894ffa4ec4e109b81fcd0ebcd74aa8a63f617e11",
    ),
    "SI_Format.xsd": (
        "2.1.0",
        "https://ptb.de/si/v2.1.0/SI_Format.xsd",
        "42e158ac16d0125b8cff32bedd5cf3e434955b729a00c9867f0510faa7905f2e",
    ),
}
FOLDER = os.environ.get("BALLPLATE_DCC_SCHEMAS")


@pytest.fixture(scope="module")
def schema() -> Any:
    """The schema of certificates, with that of quantities beside it."""
    xmlschema = pytest.importorskip("xmlschema")
    if not FOLDER:
        pytest.skip("BALLPLATE_DCC_SCHEMAS names no folder with dcc.xsd and SI_Format.xsd")
    texts = {}
    for name, (version, _, expected) in PUBLISHED.items():
        content = (Path(FOLDER) / name).read_bytes().replace(b"\r\n", b"\n")
        assert hashlib.sha256(content).hexdigest() == expected, (name, version)
        texts[name] = content.decode("utf-8")
    beside = (Path(FOLDER) / "SI_Format.xsd").resolve().as_uri()
    return xmlschema.XMLSchema(
        texts["dcc.xsd"].replace(PUBLISHED["SI_Format.xsd"][1], beside), allow="local"
    )


TEMPERATURE = {
    "kind": "temperature",
    "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "1 um/m/K"},
    "artefact_temperature": {"value": "20.4 degC", "standard_uncertainty": "0.05 degC"},
}
CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "in space": (IN_SPACE, {}),
    "in the plane": (IN_PLANE, {"datum": ("r1c1", "r1c4")}),
    "all balls": (IN_SPACE, {"datum": "all", "coverage_factor": 2.5}),
    "with a temperature": ({**IN_SPACE, "influences": [TEMPERATURE]}, {}),
    "odd texts": (
        {**IN_SPACE, "title": "<a> & 'b' \"c\" é"},
        {"about": ABOUT | {"laboratory": "A & B <c>", "identifier": "  17 \x01 "}},
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_certificates_are_valid(schema: Any, name: str) -> None:
    sections, chosen = CASES[name]
    model = {"kind": "metric"} if sections["machine"]["volume"][2:] else {"kind": "kinematic"}
    experiment = bp.experiment({**sections, "error_model": model})
    fit = bp.fit(experiment, bp.simulate(experiment))
    (text,) = fit.certificate(**{"about": ABOUT, **chosen}).texts("plate.xml").values()
    errors = [(error.path, error.reason) for error in schema.iter_errors(text)]
    assert not errors
    # What it would not accept is refused, so that the check is one.
    assert not schema.is_valid(text.replace("valueXMLList", "valuesXMLList"))
    assert not schema.is_valid(text.replace('schemaVersion="3.1.2"', 'schemaVersion="3.1.1"'))
