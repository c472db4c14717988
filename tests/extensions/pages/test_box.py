"""The volume in a drawing: what is written beside its edges can be read, however flat it is."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.machine_files.machine_file import load_machine
from ballplate.extensions.maps import volumetric_plots
from ballplate.extensions.maps.map_places import PlacesAsked, map_places
from ballplate.extensions.maps.volumetric_errors import Volumetric
from ballplate.presentation.svg import save
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox


def test_names_and_ends_of_axes_stand_apart_inside_the_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "machine.yaml"
    path.write_text(
        "title: flat\narrangement: MB2\nvolume: {x: [0 mm, 800 mm], y: [0 mm, 600 mm],"
        " z: [0 mm, 50 mm]}\nerrors:\n  EXX: {polynomial: [0 um, 5 um]}\n",
        encoding="utf-8",
    )
    drawn: list[tuple[str, Bbox]] = []

    def measured(figure: Figure, *arguments: str) -> Figure:
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        renderer = canvas.get_renderer()
        drawn.extend(
            (text.get_text(), text.get_window_extent(renderer))
            for text in figure.axes[0].texts
            if text.get_bbox_patch() is None
        )
        drawn.append(("", figure.bbox))
        return save(figure, tmp_path / "grid.svg", arguments[-1])

    monkeypatch.setattr(volumetric_plots, "save", measured)
    machine = Volumetric(load_machine(path, []))
    found = machine.errors(map_places(machine.volume, PlacesAsked((2, 2, 2))).points)
    volumetric_plots.draw_grid(
        found, machine.lengths(*machine.volume.diagonals), (2, 2, 2), tmp_path / "grid.svg"
    )
    *texts, (_, whole) = drawn
    assert sorted(text for text, _ in texts) == sorted(
        ["x, mm", "y, mm", "z, mm", "0", "0", "0", "800", "600", "50"]
    )
    for _, place in texts:
        assert np.array_equal(Bbox.intersection(place, whole), place)
    for (one, place), (other, there) in combinations(texts, 2):
        assert not place.overlaps(there), (one, other)
