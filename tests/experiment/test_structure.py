"""Sections validated one by one, each by the form of its own kind, against the whole file at once."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.simulator.experiment.sections import ExperimentSettings
from ballplate.simulator.experiment.structure import ENTRIES, validate_sections
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.yamltree import Mapping, parse_tree, to_python

DESIGNS = Path(__file__).parents[2] / "designs"
KINDS = ("error_model", "true_machine", "artefacts", "calibration", "influences")
INFLUENCES = """
influences:
  - {kind: probing, standard_uncertainty: 0.3 um, between_probes: 0.1 um}
  - {kind: reproducibility, each: [position, probe], standard_uncertainty: 0.3 um}
"""


@pytest.fixture(scope="module")
def files() -> list[Mapping]:
    """Shipped experiments of many kinds, with influences added to one."""
    paths = [
        path
        for folder in ("gilsinn", "hurt_foss", "park", "planning")
        for path in sorted((DESIGNS / folder).glob("*.yaml"))
    ]
    texts = [path.read_text(encoding="utf-8") for path in paths]
    texts.append((DESIGNS / "quickstart.yaml").read_text(encoding="utf-8") + INFLUENCES)
    roots = [parse_tree(text, "file.yaml") for text in texts]
    return [one for one in roots if isinstance(one, Mapping) and "positions" in one.items]


@pytest.mark.parametrize("key", KINDS)
def test_each_section_by_its_own_kind_is_as_in_the_whole_file(
    key: str, files: list[Mapping]
) -> None:
    seen = set()
    for root in files:
        said, problems = to_python(root), Problems(root)
        whole = getattr(ExperimentSettings.model_validate(said), key)
        sections = validate_sections(root, problems)
        assert not problems.messages
        if key in ENTRIES:
            whole = list(whole.values() if isinstance(whole, dict) else whole or ())
            one_by_one = list(sections.entries(key).values())
        else:
            whole, one_by_one = [whole], [sections.get(key)]
        assert one_by_one == whole
        seen |= {type(one) for one in whole}
    assert len(seen) > 1
