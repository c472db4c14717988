"""Pictures in space that can be turned, and that may move: a still SVG as well as a script's data.

All layers are drawn with the eye of `scene`. In a page with the script `view.js` the same layers
follow the eye, and those with displacements swing along them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.presentation import RISE, TURN, projection
from ballplate.simulator.computing import svd
from ballplate.simulator.machines import Array

from .document import shipped
from .elements import Html, element, joined

WIDTH, HEIGHT = 480.0, 360.0
MARGIN = 30.0


@dataclass(frozen=True, eq=False)
class Layer:
    """Marks of one class `style`: lines or areas through `points` (m, d) in metres, `sizes` points
    each; dots; labels with `names`; ellipsoids with square roots `shapes` (m, d, d).

    With `moves` (m, d) points swing by these amounts, in metres of the picture.
    """

    kind: str
    style: str
    points: Array
    sizes: tuple[int, ...] = ()
    moves: Array | None = None
    shapes: Array | None = None
    names: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Eye:
    """Projection of points to paper: a matrix (2, d), the middle (d,) and the scale."""

    view: Array
    centre: Array
    scale: float

    def paper(self, points: Array) -> Array:
        across = (points - self.centre) @ self.view.T * self.scale
        return np.round([0.5 * WIDTH, 0.5 * HEIGHT] + across * [1.0, -1.0], 1)


@dataclass(frozen=True, eq=False)
class SpatialPicture:
    """Layers as a picture: the `name` is its id on a page, the `label` its short name, and `words`
    are for those who do not see it.
    """

    layers: Sequence[Layer]
    name: str
    label: str
    words: str
    caption: str | Html


def figure_of(picture: SpatialPicture) -> Html:
    """Return the picture for a page, with its controls."""
    layers = [layer for layer in picture.layers if len(layer.points)]
    eye = _eye(layers)
    d = len(eye.centre)
    moving = any(layer.moves is not None for layer in layers)
    svg = _svg(layers, eye, picture.words, tabindex="0" if d == 3 else None)
    data = {
        "centre": [round(1e3 * v, 3) for v in eye.centre.tolist()],
        "scale": eye.scale / 1e3,
        "turn": TURN,
        "rise": RISE,
        "layers": [_data(layer) for layer in layers],
    }
    # No text in the data may end the element.
    stored = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    return element(
        "figure",
        svg,
        _controls(d, moving),
        element("figcaption", picture.caption),
        Html(f'<script type="application/json">{stored}</script>'),
        class_="view moving" if moving else "view",
        id=picture.name,
    )


def still(picture: SpatialPicture) -> str:
    """The picture as an SVG file of its own."""
    layers = [layer for layer in picture.layers if len(layer.points)]
    paper = element("rect", width="100%", height="100%", style="fill: var(--paper)")
    before = Html(f"<style>{shipped('marks.css')}</style>"), paper
    size = {"width": f"{WIDTH:g}", "height": f"{HEIGHT:g}", "class_": "view"}
    space = "http://www.w3.org/2000/svg"
    return _svg(layers, _eye(layers), picture.words, *before, xmlns=space, **size)


def _svg(
    layers: Sequence[Layer],
    eye: _Eye,
    words: str,
    *before: Html,
    **attributes: str | None,
) -> Html:
    return element(
        "svg",
        *before,
        joined(_drawn(layer, k, eye) for k, layer in enumerate(layers)),
        viewBox=f"0 0 {WIDTH:g} {HEIGHT:g}",
        role="img",
        aria_label=words,
        **attributes,
    )


def _eye(layers: Sequence[Layer]) -> _Eye:
    every = np.concatenate([layer.points for layer in layers])
    lower, upper = every.min(axis=0), every.max(axis=0)
    centre = 0.5 * (lower + upper)
    flat, _ = projection(len(centre))
    on_paper = (every - centre) @ flat.T
    extent = 2.0 * np.abs(on_paper).max(axis=0)
    room = np.array([WIDTH, HEIGHT]) - 2.0 * MARGIN
    return _Eye(flat, centre, float((room / np.maximum(extent, 1e-9)).min()))


def _controls(dimension: int, moving: bool) -> Html:
    """Return buttons, hidden without the script."""
    views = ("oblique", "above", "front", "right") if dimension == 3 else ()
    parts = [
        element(
            "button",
            view_name,
            type="button",
            data_view=view_name,
            title=f"seen from {view_name}" if k else None,
        )
        for k, view_name in enumerate(views)
    ]
    parts += [
        element("button", "+", type="button", data_zoom="1.25", aria_label="larger"),
        element("button", "−", type="button", data_zoom="0.8", aria_label="smaller"),
    ]
    if moving:
        parts.insert(
            0, element("button", "move", type="button", data_play=True, aria_pressed="false")
        )
    return element("div", *parts, class_="controls", hidden=True)


def _drawn(layer: Layer, number: int, eye: _Eye) -> Html:
    points = layer.points if layer.moves is None else layer.points + layer.moves
    paper = eye.paper(points).tolist()
    if layer.kind == "labels":
        texts = (
            element("text", name, x=f"{x:g}", y=f"{y:g}", text_anchor="middle")
            for name, (x, y) in zip(layer.names, paper, strict=True)
        )
        return element("g", joined(texts), class_=f"labels {layer.style}", data_layer=number)
    if layer.kind == "dots":
        path = "".join(f"M{x:g} {y:g}h0" for x, y in paper)
    elif layer.kind == "ellipsoids" and layer.shapes is not None:
        path = "".join(
            _ellipse(centre, shape)
            for centre, shape in zip(paper, eye.scale * (eye.view @ layer.shapes), strict=True)
        )
    else:
        end = "Z" if layer.kind == "areas" else ""
        ends = np.cumsum([0, *layer.sizes])
        path = "".join(
            "M" + "L".join(f"{x:g} {y:g}" for x, y in paper[first:last]) + end
            for first, last in zip(ends, ends[1:], strict=False)
        )
    return element("path", class_=f"{layer.kind} {layer.style}", d=path, data_layer=number)


def _ellipse(centre: Sequence[float], root: Array) -> str:
    """Outline of an ellipsoid on the paper, whose root there is (2, d)."""
    axes, sizes, _ = svd(root, full_matrices=False)
    x, y = (axes[:, 0] * sizes[0] * [1.0, -1.0]).tolist()
    angle = np.degrees(np.arctan2(y, x))
    arc = f"a{sizes[0]:.1f} {sizes[1]:.1f} {angle:.0f} 1 0"
    there, back = (f"{arc} {2 * way * x:.1f} {2 * way * y:.1f}" for way in (1, -1))
    return f"M{centre[0] - x:.1f} {centre[1] - y:.1f}{there}{back}"


def _data(layer: Layer) -> dict[str, Any]:
    layer_data: dict[str, Any] = {"kind": layer.kind, "points": _millimetres(layer.points, 1)}
    if layer.sizes:
        layer_data["sizes"] = list(layer.sizes)
    if layer.moves is not None:
        layer_data["moves"] = _millimetres(layer.moves, 1)
    if layer.shapes is not None:
        layer_data["shapes"] = _millimetres(layer.shapes, 2)
    return layer_data


def _millimetres(values: Array, digits: int) -> list[float]:
    flat = (np.round(1e3 * values, digits) + 0.0).ravel().tolist()
    return [int(coordinate) if coordinate == int(coordinate) else coordinate for coordinate in flat]
