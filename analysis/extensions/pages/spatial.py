"""Pictures in space as SVG, drawn with the eye of `scene`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.presentation import projection
from ballplate.simulator.machines import Array

from .elements import Html, element, joined

WIDTH, HEIGHT = 480.0, 360.0
MARGIN = 30.0


@dataclass(frozen=True, eq=False)
class Layer:
    """Marks of one class `style`: lines or areas through `points` (m, d) in metres, `sizes` points
    each; dots; labels with `names`.
    """

    kind: str
    style: str
    points: Array
    sizes: tuple[int, ...] = ()
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
    """Layers as a picture; `words` are for those who do not see it."""

    layers: Sequence[Layer]
    words: str
    caption: str


def still_figure(picture: SpatialPicture) -> Html:
    """Return the picture for a page."""
    layers = [layer for layer in picture.layers if len(layer.points)]
    eye = _eye(layers)
    svg = element(
        "svg",
        joined(_drawn(layer, eye) for layer in layers),
        viewBox=f"0 0 {WIDTH:g} {HEIGHT:g}",
        role="img",
        aria_label=picture.words,
    )
    return element("figure", svg, element("figcaption", picture.caption), class_="view")


def _eye(layers: Sequence[Layer]) -> _Eye:
    every = np.concatenate([layer.points for layer in layers])
    lower, upper = every.min(axis=0), every.max(axis=0)
    centre = 0.5 * (lower + upper)
    flat, _ = projection(len(centre))
    on_paper = (every - centre) @ flat.T
    extent = 2.0 * np.abs(on_paper).max(axis=0)
    room = np.array([WIDTH, HEIGHT]) - 2.0 * MARGIN
    return _Eye(flat, centre, float((room / np.maximum(extent, 1e-9)).min()))


def _drawn(layer: Layer, eye: _Eye) -> Html:
    paper = eye.paper(layer.points).tolist()
    if layer.kind == "labels":
        texts = (
            element("text", name, x=f"{x:g}", y=f"{y:g}", text_anchor="middle")
            for name, (x, y) in zip(layer.names, paper, strict=True)
        )
        return element("g", joined(texts), class_=f"labels {layer.style}")
    if layer.kind == "dots":
        path = "".join(f"M{x:g} {y:g}h0" for x, y in paper)
    else:
        end = "Z" if layer.kind == "areas" else ""
        ends = np.cumsum([0, *layer.sizes])
        path = "".join(
            "M" + "L".join(f"{x:g} {y:g}" for x, y in paper[first:last]) + end
            for first, last in zip(ends, ends[1:], strict=False)
        )
    return element("path", class_=f"{layer.kind} {layer.style}", d=path)
