"""A sweep from the studio over several axes, of the design as it is on the page."""

from pathlib import Path

import ballplate as bp
import pytest
from ballplate.designs import shipped
from ballplate.extensions.studio.actions import ActionError
from ballplate.extensions.studio.document import DesignDocument, changed, opened
from ballplate.extensions.studio.sweeping import MOST_CELLS, ensure_possible, swept
from ballplate.simulator.computing.steps import unreported
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.studio import wording


@pytest.fixture
def document(tmp_path: Path) -> DesignDocument:
    """A design that is not saved, with a table beside it."""
    path = tmp_path / "my plate #1.yaml"
    path.write_text("title: nothing of this is swept\n")
    tables = tmp_path / "tables"
    tables.mkdir()
    for name, length in (("a", 0.5), ("b", 0.75)):
        rows = [f"{k},{length * (k % 4) / 3},{length * (k // 4) / 3},0" for k in range(16)]
        (tables / f"{name}.csv").write_text("ball,x_m,y_m,z_m\n" + "\n".join(rows) + "\n")
    text = Path(shipped("quickstart.yaml")).read_text()
    return changed(opened(path), text.replace("[5, 5]", "[4, 4]"))


@pytest.fixture
def page_of_sweep(monkeypatch):
    monkeypatch.setattr(
        "ballplate.extensions.sweeps.result.SweepResult.page_text", lambda _: "the page"
    )


def test_every_combination_is_what_run_says_of_it(document, tmp_path, page_of_sweep):
    steps = []
    axes = [
        {"paths": ["machine.repeatability"], "values": ["0.1 um", "0.4 um"]},
        {
            "paths": ["artefacts.plate.size[0]", "artefacts.plate.size[1]"],
            "values": ["500 mm", "750 mm"],
        },
    ]
    before = sorted(one.name for one in tmp_path.iterdir())
    found = swept(document, {"axes": axes}, steps.append)
    assert sorted(one.name for one in tmp_path.iterdir()) == before
    assert found["headline"].startswith("4 cases, 4 done") and str(steps[-1]).startswith("4 of 4")
    saved = tmp_path / "saved.yaml"
    saved.write_text(document.text)
    experiment = bp.load(saved)
    for cell in found["cells"]:
        noise, size = cell["values"]
        other = experiment.with_(
            {
                "machine.repeatability": noise,
                "artefacts.plate.size[0]": size,
                "artefacts.plate.size[1]": size,
            }
        )
        lengths = bp.run(other).quantities["U6"]
        assert cell["average"] == pytest.approx(lengths.average, rel=1e-12)
        assert cell["maximum"] == pytest.approx(lengths.maximum, rel=1e-12)
        assert cell["within"] == lengths.within_target and cell["deficiency"] == 0
    assert len({cell["average"] for cell in found["cells"]}) == 4
    assert found["page"] == "the page"


def test_values_may_name_files_beside_the_design(document, page_of_sweep):
    axes = [
        {
            "paths": ["artefacts.plate"],
            "values": [f"{{kind: balls, file: tables/{name}.csv}}" for name in "ab"],
        }
    ]
    text = document.text.replace("pairs: corner sides", "pairs: all")
    assert text != document.text
    found = swept(changed(document, text), {"axes": axes}, unreported)
    assert [cell["reason"] for cell in found["cells"]] == ["", ""], found
    assert len({cell["average"] for cell in found["cells"]}) == 2 and found["page"] == "the page"


def test_a_cell_that_fails_says_why(document, page_of_sweep):
    axes = [{"paths": ["machine.repeatability"], "values": ["0.2 um", "2 furlongs"]}]
    good, bad = swept(document, {"axes": axes}, unreported)["cells"]
    assert good["reason"] == "" and "furlongs" in bad["reason"] and bad["average"] is None
    # The file of the sweep is nobody's: the key tells the place.
    assert bad["reason"].startswith("machine.repeatability: ")


@pytest.mark.parametrize(
    "axes, words",
    [
        ([], "needs a key"),
        ([{"paths": ["machine.repeatability"], "values": []}], "its values"),
        ([{"paths": ["a"], "values": ["1"] * (MOST_CELLS + 1)}], f"at most {MOST_CELLS}"),
        ([{"paths": ["machine.repeatability"], "values": ["[1"]}], "no value of a file"),
        ([{"paths": ["title", "title"], "values": ["x"]}], "title"),
        ([{"paths": ["artefacts.plat.size"], "values": ["1"]}], "no artefacts.plat; did you mean"),
        ([{"paths": ["title"], "values": ["x", "x"]}], 'has the value "x" twice'),
        ([{"paths": ["title"], "values": ["x"]}] * 2, "two axes vary title"),
        ([{"paths": 3, "values": "x"}], "its paths and values"),
        (["x"], "list of axes"),
    ],
)
def test_what_a_sweep_lacks_is_told(document, axes, words):
    with pytest.raises((ActionError, ExperimentError)) as told:
        swept(document, {"axes": axes}, unreported)
    assert words in str(told.value)
    assert "ballplate-sweep" not in str(told.value)


def test_a_number_without_a_unit_is_refused_before_the_start(document):
    def axes(path, *values):
        return {"axes": [{"paths": [path], "values": list(values)}]}

    for path in ("artefacts.plate.size[0]", "machine.repeatability"):
        with pytest.raises(ActionError, match=wording.HAS_NO_UNIT) as told:
            ensure_possible(document, axes(path, "1 um", "400"))
        assert str(told.value).startswith(f"{path}: ")
        ensure_possible(document, axes(path, "1 um", "400 um"))
    ensure_possible(document, axes("error_model.position_coefficients", "5", "6"))
    with pytest.raises(ActionError, match="title: expected a text"):
        ensure_possible(document, axes("title", "5"))
