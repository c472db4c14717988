"""The page of a sweep: its figures are the store's, it needs nothing else, and it is the same each
time.
"""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

import ballplate as bp
from ballplate.cli import main
from ballplate.designs import shipped
from ballplate.extensions.studio.document import opened
from ballplate.extensions.studio.sweeping import swept
from ballplate.presentation.formatting import number
from ballplate.simulator.computing.steps import unreported

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.stores import Page, axis, done, failed, made_up_result


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


def cells_of(text: str, name: str) -> list[list[str]]:
    """Texts of the rows of a table of a page."""
    (part,) = re.findall(rf'id="table-{name}".*?</table>', text, flags=re.DOTALL)
    rows = re.findall(r"<tr>(.*?)</tr>", part, flags=re.DOTALL)
    return [
        [unescape(one) for one in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)] for row in rows
    ]


def test_figures_of_the_page_are_the_store_s(plate_sizes: Path, plate_sizes_page: Path) -> None:
    text = plate_sizes_page.read_text(encoding="utf-8")
    found, frame = assert_accessible(text), bp.stored(plate_sizes).to_frame()
    heads, *rows = cells_of(text, "cases")
    assert len(rows) == len(frame) == 12
    for statistic in ("maximum", "average"):
        for symbol in ("U1", "U4", "U5", "U6"):
            shown = [row[heads.index(f"{symbol} {statistic}, µm")] for row in rows]
            assert shown == [number(1e6 * one) for one in frame[f"{symbol}_{statistic}_m"]]
    # One chart against hours, one along each axis, a dot for each case.
    drawings = [one for one in found.of("figure") if "class" in one]
    assert len(found.of("figure")) == 3 + len(drawings) and text.count("dots noted") == 36
    best = [row[:3] for row in cells_of(text, "best")[1:]]
    assert best[0] == ['<a href="#case-9">9</a>', "750 mm", "4"] and len(best) == 8


def test_variants_with_deficient_designs(tmp_path: Path) -> None:
    base = Path("designs/npl/6.1.1.yaml").resolve().as_posix()
    text = (
        f"title: <b>kinds</b> & $more$\nbase: {base}\naxes:\n  design: {{variants: all}}\nrecord:"
        " [U1, U4]\n"
    )
    store = sweep(tmp_path, text)
    page = report(store)
    found = assert_accessible(page)
    assert found.texts["h1"] == ["<b>kinds</b> & $more$"]
    heads, *rows = cells_of(page, "cases")
    assert [row[heads.index("rank deficiency")] for row in rows] == ["0", "2", "0", "2"]
    given = [row[heads.index("given")] for row in rows]
    assert [one.startswith("2 undetermined directions") for one in given] == [
        False,
        True,
        False,
        True,
    ]


def test_failed_cells_and_two_dimensions(tmp_path: Path) -> None:
    base = Path("designs/hocken_borchardt/dummy.yaml").resolve().as_posix()
    axes = "  u: {path: machine.repeatability, values: [1 um, 2 um, -1 um]}\n"
    store = sweep(tmp_path, f"title: flat\nbase: {base}\nvariant: with scale\naxes:\n{axes}")
    found = assert_accessible(report(store))
    assert "3 cases, 2 done, 1 failed." in found.texts["p"]
    assert "failed" in found.texts["td"] and found.texts["li"][-1].startswith("case 2 failed: ")


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


def test_a_sweep_without_results(tmp_path: Path) -> None:
    axes = [axis("k", ["1", "2"], [1.0, 2.0], "1")]
    text = made_up_result(tmp_path / "none.sqlite", "nothing", axes, []).page_text()
    assert "2 cases, 0 done, 0 failed, 2 left." in assert_accessible(text).texts["p"]
    text = made_up_result(
        tmp_path / "bad.sqlite", "bad", axes, [failed(0, "no <good>")]
    ).page_text()
    assert "case 0 failed: no <good>" in assert_accessible(text).texts["li"]


def test_a_large_sweep_makes_a_small_page(tmp_path: Path) -> None:
    axes = [
        axis(name, [f"{k + 1}" for k in range(20)], [k + 1.0 for k in range(20)], "1")
        for name in ("a", "b", "c")
    ]
    names = ("U4_maximum_m", "U4_average_m", "U6_maximum_m", "U6_average_m")

    def rows():  # type: ignore[no-untyped-def]
        for k in range(20**3):
            size = 1e-7 * (1 + k % 20 + k // 400)
            yield done(k, {**{name: size for name in names}, "rank_deficiency": 0.0})

    text = made_up_result(tmp_path / "large.sqlite", "large", axes, rows()).page_text()
    # Every case is a dot, and most have no text.
    assert len(text) < 500_000
    found = assert_accessible(text)
    assert wording.CASES_NOT_SHOWN in found.texts["p"]
    assert len(cells_of(text, "cases")) == 201
    assert all(wording.FORTY_LINES in one for one in found.texts["figcaption"])
    assert not found.texts.get("title")[1:]
