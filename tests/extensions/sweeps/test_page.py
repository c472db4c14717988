"""The page of a sweep: its figures are the store's, it needs nothing else, and it is the same each
time.
"""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.designs import shipped
from ballplate.extensions.studio.document import opened
from ballplate.extensions.studio.sweeping import swept
from ballplate.extensions.sweeps.error_map_uncertainty import error_map
from ballplate.extensions.sweeps.report.cells import NoExperimentError, experiments
from ballplate.extensions.sweeps.report.page import page
from ballplate.extensions.sweeps.report.results import read_results
from ballplate.extensions.sweeps.report.verdicts import ranks
from ballplate.extensions.sweeps.running import stored_result
from ballplate.extensions.sweeps.store import open_store
from ballplate.results.checked_designs import predict
from ballplate.simulator.computing.steps import unreported
from ballplate.simulator.experiment.loading import load

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.odd_stores import signed
from tests.extensions.sweeps.stores import Page, axis, done, failed, made_up


def sweep(folder: Path, text: str) -> Path:
    """Store of a sweep file."""
    file = folder / "sweep.yaml"
    file.write_text(text, encoding="utf-8")
    store = file.with_suffix(".sqlite")
    main(["sweep", str(file), "--store", str(store), "--workers", "1"])
    return store


def report(store: Path, *more: str) -> str:
    """Page of a store."""
    file = store.with_suffix(".html")
    assert main(["sweep", "--report", str(store), "-o", str(file), *more]) == 0
    return file.read_text(encoding="utf-8")


def assert_accessible(text: str) -> Page:
    """Structure that screen readers, keyboards and browsers without network need."""
    found = Page(text)
    assert found.of("html")[0]["lang"] == "en" and found.texts["title"][0]
    assert (
        found.of("a")[0] == {"class": "skip", "href": "#main"}
        and found.of("main")[0]["id"] == "main"
    )
    ids = [attributes["id"] for _, attributes in found.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    for name in ("href", "aria-labelledby"):
        targets = [attributes[name] for _, attributes in found.tags if name in attributes]
        assert {target.removeprefix("#") for target in targets if target != "data:,"} <= set(ids)
    assert set(re.findall(r"url\(#([^)]+)\)", text)) <= set(ids)
    levels = [int(tag[1]) for tag, _ in found.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after - before <= 1 for before, after in zip(levels, levels[1:], strict=False))
    assert len(found.of("table")) == len(found.of("caption"))
    assert all("scope" in attributes for attributes in found.of("th"))
    pictures = [one for one in found.of("svg") if one.get("aria-hidden") != "true"]
    assert len(found.of("figure")) == len(found.of("figcaption")) == len(pictures)
    assert all(one["aria-label"] and one["role"] == "img" for one in pictures)
    scrolling = [
        attributes
        for _, attributes in found.tags
        if "scroll" in attributes.get("class", "").split()
    ]
    assert all(one["tabindex"] == "0" and one["aria-labelledby"] for one in scrolling)
    assert not found.of("script") and not found.of("img") and not found.of("style")[1:]
    assert not re.search(r"https?://|@import|url\((?!#)|javascript:|\son\w+=", text)
    return found


def assert_of_store(found: Page, store: Path) -> None:
    """Every figure in the page is the frame's, to the last bit."""
    opened = open_store(store)
    table = stored_result(opened).table.set_index("cell")
    opened.close()
    assert found.places
    for place in found.places:
        cell, figure = int(place["data-cell"]), place["data-figure"]
        if "data-value" in place:
            stored, shown = float(table.loc[cell, figure]), float(place["data-value"])
            assert shown == stored or (math.isnan(shown) and math.isnan(stored))
        else:
            assert cell not in table.index or table.loc[cell, "status"] == "failed"


def test_figures_of_the_page_are_the_store_s(plate_sizes: Path, plate_sizes_page: Path) -> None:
    found = assert_accessible(plate_sizes_page.read_text(encoding="utf-8"))
    assert_of_store(found, plate_sizes)
    told = {(place["data-cell"], place["data-figure"]) for place in found.places}
    names = [
        f"{u}_{s}_m"
        for u in ("U1", "U4", "U5", "U6")
        for s in ("maximum", "average", "actual_average")
    ]
    wanted = {
        (str(cell), name) for cell in range(12) for name in names if "actual_maximum" not in name
    }
    assert wanted <= told
    # Two axes with numbers, four quantities; two designs; three levels of the
    # error map.
    assert len(found.of("figure")) == 2 * 4 + 2 + 3
    assert wording.SMALLEST_AVERAGE_OF in found.texts["h3"]


def test_same_store_same_bytes(plate_sizes: Path, plate_sizes_page: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.html"
    assert main(["sweep", "--report", str(plate_sizes), "-o", str(again)]) == 0
    assert again.read_bytes() == plate_sizes_page.read_bytes()


def test_variants_with_deficient_designs(tmp_path: Path) -> None:
    base = Path("designs/npl/6.1.1.yaml").resolve().as_posix()
    text = (
        f"title: <b>kinds</b> & $more$\nbase: {base}\naxes:\n  design: {{variants: all}}\nrecord:"
        " [U1, U4]\n"
    )
    store = sweep(tmp_path, text)
    found = assert_accessible(report(store))
    assert_of_store(found, store)
    assert found.texts["h1"] == ["<b>kinds</b> & $more$"]
    summaries = [" ".join(one.split()) for one in found.texts["summary"]]
    assert "rank deficiency 2, as expected: case 1 (design B)" in summaries
    assert any(wording.EYY_POSITIONING_ERROR in line for line in found.texts["li"])
    assert "full rank, as expected: 2 cases, 0, 2 (design A or C)" in [
        " ".join(one.split()) for one in found.texts["p"]
    ]


def test_failed_cells_and_two_dimensions(tmp_path: Path) -> None:
    base = Path("designs/hocken_borchardt/dummy.yaml").resolve().as_posix()
    axes = "  u: {path: machine.repeatability, values: [1 um, 2 um, -1 um]}\n"
    store = sweep(tmp_path, f"title: flat\nbase: {base}\nvariant: with scale\naxes:\n{axes}")
    found = assert_accessible(report(store))
    assert_of_store(found, store)
    assert "2 of 3 cases done, 1 failed." in found.texts["p"]
    assert "failed" in found.texts["td"]
    # One level only, and one point of the machine, so that there are no tips to draw.
    assert (
        sum(
            wording.MAP_OF_STANDARD_UNCERTAINTIES in one.get("aria-label", "")
            for one in found.of("svg")
        )
        == 1
    )


def test_the_page_of_a_sweep_made_in_the_studio_names_no_file_that_is_gone(tmp_path: Path) -> None:
    path = tmp_path / "plates.yaml"
    path.write_text(Path(shipped("quickstart.yaml")).read_text(encoding="utf-8"), encoding="utf-8")
    axes = [{"paths": ["machine.repeatability"], "values": ["0.1 um", "0.2 um"]}]
    found = swept(opened(path), {"axes": axes}, unreported)
    texts = assert_accessible(found["page"]).texts
    facts = dict(zip(texts["dt"], texts["dd"], strict=True))
    assert facts["Sweep"] == wording.MADE_IN_THE_STUDIO
    assert facts["Experiment"].startswith("plates.yaml: ")
    assert ".ballplate" not in found["page"] and "Sweep file" not in found["page"]


def test_a_store_without_results(tmp_path: Path) -> None:
    store = made_up(
        tmp_path / "none.sqlite", "nothing", [axis("k", ["1", "2"], [1.0, 2.0], "1")], []
    )
    found = assert_accessible(page(store, read_results(store, 1)))
    assert "0 of 2 cases done, 2 left." in found.texts["p"]
    store = made_up(
        tmp_path / "bad.sqlite",
        "bad",
        [axis("k", ["1", "2"], [1.0, 2.0], "1")],
        [failed(0, "no <good>")],
    )
    found = assert_accessible(page(store, read_results(store, 1)))
    assert any(one.strip().startswith("no <good>") for one in found.texts["p"])


def test_a_large_store_makes_a_small_page(tmp_path: Path) -> None:
    axes = [
        axis(name, [f"{k + 1}" for k in range(20)], [k + 1.0 for k in range(20)], "1")
        for name in ("a", "b", "c")
    ]
    names = ("U4_maximum_m", "U4_average_m", "U6_maximum_m", "U6_average_m")

    def rows():  # type: ignore[no-untyped-def]
        for k in range(20**3):
            size = 1e-7 * (1 + k % 20 + k // 400)
            figures = {name: size for name in names} | {
                "U6_undetermined": 0.0,
                "rank_deficiency": float(k % 5 == 0),
            }
            unit = "um" if k % 10 else "µm"
            lines = [f"EXX by {k} {unit}: changes no observation"] if k % 5 == 0 else []
            yield done(k, figures | {"as_expected": 1.0}, undetermined=lines)

    store = made_up(tmp_path / "large.sqlite", "large", axes, rows())
    text = page(store, read_results(store, 1))
    assert len(text) < 1_000_000
    found = assert_accessible(text)
    assert wording.CELLS_MORE_ARE_NOT_SHOWN_HERE in found.texts["p"]
    # Lines of single cells for 6 of 20 values of a second axis, at the best cell's setting first.
    assert any(wording.THE_SETTING_OF_THE_BEST_CELL in one for one in found.texts["figcaption"])
    assert not any("edian" in one for one in found.texts["figcaption"])
    groups = ranks(read_results(store, 1)).shown
    assert [group.count for group in groups] == [1600, 6400] and wording.AMOUNTS_OF_CELL in groups[
        0
    ].heading


def test_models_in_python_are_run_only_if_asked(tmp_path: Path) -> None:
    mark = tmp_path / "has run"
    module = (
        "from pathlib import Path\nfrom ballplate.simulator.machines.kinematic_settings import"
        " KinematicSettings\nfrom ballplate.simulator.machines.settings import"
        " build_error_model\ndef build(lower, upper):\n   "
        f" Path({str(mark)!r}).touch()\n    return"
        " build_error_model(KinematicSettings(kind='kinematic', arrangement='MB2'), lower,"
        " upper)\n"
    )
    base = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    base = re.sub(
        r"(?m)^error_model:.*\n(  .*\n)+",
        "error_model: {kind: python, object: 'own_model:build'}\n",
        base,
    )
    own = "title: own\nbase: base.yaml\naxes:\n  k: {path: machine.repeatability, values: [1 um]}\n"
    figures = {"U4_maximum_m": 2e-6, "U4_average_m": 1e-6, "U4_undetermined": 0.0}
    store = made_up(
        tmp_path / "own.sqlite", "own", [axis("k", ["1 um"], [1e-6], "m")], [done(0, figures)]
    )
    contents = {"made-up.yaml": own, "base.yaml": base, "own_model.py": module}
    rows = [(1, name, content.encode()) for name, content in contents.items()]
    store.connection.executemany("INSERT INTO bundle (sweep, path, content) VALUES (?, ?, ?)", rows)
    store.close()
    signed(store.path)
    assert wording.MODULES_ARE_NOT_ALLOWED_HERE in report(store.path)
    assert not mark.exists()
    # In a process of its own, as the module would stay in this one.
    page_file = tmp_path / "own.html"
    command = [
        sys.executable,
        "-m",
        "ballplate",
        "sweep",
        "--report",
        store.path,
        "--run-modules",
        "--force",
        "-o",
        page_file,
    ]
    subprocess.run(command, check=True)
    assert mark.exists() and "cannot be drawn" not in page_file.read_text(encoding="utf-8")


def test_files_outside_the_store_s_folder_are_not_written(tmp_path: Path) -> None:
    store = made_up(tmp_path / "evil.sqlite", "evil", [axis("k", ["1"], [1.0], "1")], [])
    for name in ("../out.yaml", str(tmp_path / "out.yaml")):
        with store.connection:
            store.connection.execute("DELETE FROM bundle")
            rows = [(1, "made-up.yaml", b""), (1, "base.yaml", b""), (1, name, b"x")]
            store.connection.executemany(
                "INSERT INTO bundle (sweep, path, content) VALUES (?, ?, ?)", rows
            )
        signed(store.path)
        with pytest.raises(NoExperimentError, match=wording.LEADS_OUT_OF_THE_FOLDER):
            experiments(store, read_results(store, 1), [0])
        assert not (tmp_path / "out.yaml").exists()


def test_a_base_other_than_the_one_told_is_not_loaded(tmp_path: Path) -> None:
    store = made_up(tmp_path / "evil.sqlite", "evil", [axis("k", ["1"], [1.0], "1")], [])
    good = Path("designs/quickstart.yaml").read_bytes()
    model = b"error_model: {kind: python, object: 'this:s'}"
    evil = re.sub(rb"error_model:\n(  .*\n)+", model + b"\n", good)
    sweep = b"title: t\nbase: evil.yaml\naxes: {k: {path: seed, values: [1]}}\n"
    with store.connection:
        store.connection.execute("DELETE FROM bundle")
        rows = [(1, "made-up.yaml", sweep), (1, "base.yaml", good), (1, "evil.yaml", evil)]
        store.connection.executemany(
            "INSERT INTO bundle (sweep, path, content) VALUES (?, ?, ?)", rows
        )
    signed(store.path)
    sys.modules.pop("this", None)
    (found,) = experiments(store, read_results(store, 1), [0])
    assert found.error_model.kind == "kinematic" and "this" not in sys.modules


def test_the_error_map_is_u4_on_a_grid() -> None:
    experiment = load("designs/quickstart.yaml")[0]
    found = error_map(experiment)
    corners = [one.values for one in found.slices]
    # All errors are zero at the lower corner, as far as the probe does not turn.
    assert corners[0][0, 0] < 1e-9
    average = predict(experiment).quantities["U4"].average
    assert 0.5 * average < sum(values.mean() for values in corners) / 3 < 2.0 * average
    assert found.within is not None and 0.99 < found.within <= 1.0


def test_the_page_needs_no_extra(
    plate_sizes: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["sweep", "--report", str(plate_sizes), "-o", str(tmp_path / "a.html")]) == 0


def test_python_writes_the_page_of_a_sweep(
    plate_sizes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[Any, ...]] = []
    monkeypatch.setattr(
        "ballplate.extensions.sweeps.report.sweep_page.page",
        lambda *given: asked.append(given) or "page",
    )
    result = bp.stored(plate_sizes)
    told = {"run_modules": True, "compare": plate_sizes}
    assert bp.page(result, tmp_path / "a.html", **told) == "page"
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == "page"
    ((store, results, run_modules, _, beside),) = asked
    assert Path(store.path) == plate_sizes and results.count("done") == 12 and run_modules
    assert beside.sentences[1:] == (wording.ALL_AVERAGES_ARE_THE_SAME,)
    with pytest.raises(ValueError, match=wording.COMPARE_APPLIES_TO_PAGES):
        bp.sweep_report(plate_sizes, form="text", compare=plate_sizes)


def test_tables_need_no_page(plate_sizes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ballplate.extensions.sweeps.report.sweep_page", None)
    assert bp.sweep_report(plate_sizes, form="markdown").startswith("# ")
    with pytest.raises(ImportError):
        bp.sweep_report(plate_sizes)
