"""XML as it is read here: places, encodings, and everything refused."""

import random
import xml.etree.ElementTree as etree

import pytest
from ballplate.extensions.laboratory import xmltree
from ballplate.extensions.laboratory.xmltree import DEEPEST, Element, parse_xml, read_xml
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import GivenText

from tests.extensions.laboratory import wording

TEXT = """<?xml version="1.0" encoding="{}"?>
<!-- a report -->
<q:Report xmlns:q="urn:q" xmlns="urn:other">
  <q:Ball id="1" q:kind="sphere"><Name>Kugel groß &amp; klein</Name>
    <X><![CDATA[ 1.5 ]]></X></q:Ball>
  <q:Ball id="2"/>
</q:Report>
"""


def refusal(content: bytes) -> str:
    with pytest.raises(ExperimentError) as caught:
        parse_xml(content, "f")
    (message,) = caught.value.messages
    return str(message)


def shape(one: Element) -> tuple:
    name = f"{{{one.namespace}}}{one.name}" if one.namespace else one.name
    return name, one.text, [shape(child) for child in one.children]


def shape_by_etree(one: etree.Element) -> tuple:
    # Its own text is what stands before and between what is below it.
    text = "".join([one.text or "", *(child.tail or "" for child in one)])
    return one.tag, text.strip(), [shape_by_etree(child) for child in one]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1", "windows-1252"])
def test_every_encoding_gives_the_same_tree_with_places(encoding: str) -> None:
    content = TEXT.format(encoding.removesuffix("-sig")).encode(encoding)
    root = parse_xml(content, "f")
    assert shape(root) == shape_by_etree(etree.fromstring(content))
    assert (root.namespace, root.name) == ("urn:q", "Report")
    assert [one.attributes for one in root.all("Ball")] == [
        {"id": "1", "kind": "sphere"},
        {"id": "2"},
    ]
    assert root.text_at("Ball", "Name") == "Kugel groß & klein"
    assert root.text_at("Ball", "X") == "1.5" and root.text_at("Ball", "Y") == ""
    lines = TEXT.split("\n")
    for one in root.walk():
        assert lines[one.mark.line - 1][one.mark.column - 1 :].lstrip("<q:").startswith(one.name)
    assert [one.name for one in root.walk()] == ["Report", "Ball", "Name", "X", "Ball"]


def test_text_from_python_may_declare_any_encoding() -> None:
    assert read_xml(GivenText("given", TEXT.format("ISO-8859-1"))).text_at("Ball", "Name") == (
        "Kugel groß & klein"
    )


BOMB = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 10))


@pytest.mark.parametrize(
    "text",
    [
        f'<!DOCTYPE a [<!ENTITY e0 "x">{BOMB}]><a>&e9;</a>',
        '<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/passwd">]><a>&e;</a>',
        '<!DOCTYPE a SYSTEM "http://example.org/a.dtd"><a/>',
        '<!DOCTYPE a [<!ENTITY % p SYSTEM "file:///etc/passwd">%p;]><a/>',
        "<!DOCTYPE a><a/>",
    ],
)  # fmt: skip
def test_no_document_type_is_read(text: str) -> None:
    place, _, told = refusal(text.encode()).partition(": ")
    assert place.startswith("f:1:")
    assert told.startswith(wording.A_DOCUMENT_TYPE_DOCTYPE)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "f:1:1: not well-formed XML: the file ends before its first element; it is empty or was cut off"),
        (b"<a>\n <b>", "f:2:5: the file ends within <b>; it was cut off, take a whole copy"),
        (b"<a>\n <b></a>", "f:2:7: not well-formed XML: this closing tag does not match the open element"),
        (b"<a>&x;</a>", "f:1:4: not well-formed XML: an entity that XML does not know; write the character itself"),
        (b"<a/><b/>", "f:1:5: not well-formed XML: the file continues after its last element; remove what follows"),
        (b"<a>\x00</a>", "f:1:4: not well-formed XML: a character that XML does not allow here"),
        (b'<?xml version="1.0" encoding="klingon"?><a/>', "f:1:1: the encoding cannot be read (unknown encoding: klingon); save the file with the encoding UTF-8"),
        (b'<?xml version="1.0" encoding="shift_jis"?><a/>', "f:1:1: the encoding cannot be read (multi-byte encodings are not supported); save the file with the encoding UTF-8"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_place(content: bytes, message: str) -> None:
    assert refusal(content) == message


def test_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    deep = b"<a>" * DEEPEST + b"</a>" * DEEPEST
    assert len(list(parse_xml(deep, "f").walk())) == DEEPEST
    assert "more than 100 deep" in refusal(b"<a>" * 100_000)
    assert "more than 50 MB" in refusal(bytes(50_000_001))
    monkeypatch.setattr(xmltree, "MOST_ELEMENTS", 3)
    parse_xml(b"<a><b/><b/></a>", "f")
    assert refusal(b"<a><b/><b/><b/></a>") == wording.MORE_THAN_ELEMENTS
    monkeypatch.setattr(xmltree, "MOST_XML_BYTES", 10)
    assert refusal(b"<a>       </a>") == wording.HAS_MORE_THAN_MB


def test_a_file_cut_anywhere_is_refused_with_a_place() -> None:
    content = TEXT.format("utf-8").rstrip().encode()
    for end in range(len(content)):
        assert refusal(content[:end]).startswith("f:")


def test_flipped_bytes_are_refused_or_read_as_by_etree() -> None:
    content, generator, read = TEXT.format("utf-8").encode(), random.Random(5), 0
    for _ in range(2000):
        changed = bytearray(content)
        for _ in range(generator.randint(1, 3)):
            changed[generator.randrange(len(changed))] = generator.randrange(256)
        try:
            root = parse_xml(bytes(changed), "f")
        except ExperimentError:
            continue
        read += 1
        expected = shape_by_etree(etree.fromstring(bytes(changed)))
        assert shape(root)[0].rpartition("}")[2] == expected[0].rpartition("}")[2]
        assert [one.text for one in root.walk()] == texts(expected)
    assert read > 100


def texts(one: tuple) -> list[str]:
    return [one[1], *(text for child in one[2] for text in texts(child))]
