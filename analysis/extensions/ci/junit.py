"""Checked files as a JUnit report, which most build servers can show."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree import ElementTree

from ballplate.results import CheckedDesign, CheckedFile, verdict_lines
from ballplate.simulator.inputs import in_one_line

# No XML document can hold these, not even as character references.
NOT_IN_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_report(files: Sequence[CheckedFile]) -> str:
    """One XML document in ASCII: a suite for each file, a case for each design.

    A rank that is not as expected is a failure, and so is a goal that is missed; a file that cannot
    be used an error.
    """
    suites = [_suite(checked) for checked in files]
    top = ElementTree.Element("testsuites", {"name": "ballplate check", **_totals(suites)})
    top.extend(suites)
    ElementTree.indent(top)
    return ElementTree.tostring(top, "us-ascii", xml_declaration=True).decode("ascii") + "\n"


def _suite(checked: CheckedFile) -> ElementTree.Element:
    file = _clean(checked.file)
    cases = [_case(file, design) for design in checked.designs]
    if checked.messages:
        case = ElementTree.Element("testcase", {"classname": file, "name": "experiment file"})
        texts = [_clean(str(message)) for message in checked.messages]
        error = ElementTree.SubElement(
            case, "error", {"type": "unusable file", "message": texts[0]}
        )
        error.text = "\n".join(texts)
        cases.append(case)
    suite = ElementTree.Element("testsuite", {"name": file, **_counts(cases)})
    suite.extend(cases)
    return suite


def _case(file: str, design: CheckedDesign) -> ElementTree.Element:
    prediction = design.prediction
    case = ElementTree.Element("testcase", {"classname": file, "name": _clean(prediction.label)})
    # Outside attributes a line's end is one, and the log of a build server may take what follows
    # for a command.
    lines = [_clean(in_one_line(line)) for line in prediction.lines()]
    if design.place is None:
        ElementTree.SubElement(case, "system-out").text = "\n".join(lines)
        return case
    is_rank = bool(prediction.verdict.complaint)
    failures = verdict_lines(prediction.verdict)[:1] if is_rank else design.missed
    message = _clean("; ".join([*failures, *prediction.qualified]))
    kind = "rank" if is_rank else "goal"
    failure = ElementTree.SubElement(case, "failure", {"type": kind, "message": message})
    place = f"{design.place.file}:{design.place.line}:{design.place.column}"
    failure.text = "\n".join([_clean(in_one_line(place)), *lines])
    return case


def _counts(cases: Sequence[ElementTree.Element]) -> dict[str, str]:
    def having(tag: str) -> str:
        return str(sum(case.find(tag) is not None for case in cases))

    return {
        "tests": str(len(cases)),
        "failures": having("failure"),
        "errors": having("error"),
        "skipped": "0",
    }


def _totals(suites: Sequence[ElementTree.Element]) -> dict[str, str]:
    return {
        key: str(sum(int(suite.get(key, "0")) for suite in suites))
        for key in ("tests", "failures", "errors")
    }


def _clean(text: str) -> str:
    return NOT_IN_XML.sub("", text)
