"""Pictures in space that show themselves in a notebook, each on a small page of its own.

Front ends put the HTML of a result into their own page by different ways: some run scripts in it,
some do not, and some pass on what keys are pressed. A page in a frame runs its script in all of
them, and has its ids, style and keys to itself. Front ends that take frames out, since they do not
trust a notebook, show the still picture behind the frame.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from html import escape
from pathlib import Path

from ballplate.presentation import write_file
from ballplate.simulator.inputs import in_one_line

from .document import head, shipped
from .elements import Html, element, note
from .spatial import SpatialPicture, figure_of, still

WIDTH = "44rem"
# Bytes of all pictures together, beyond which those that take more are left out.
MOST_BYTES = 180_000


@dataclass(frozen=True, eq=False, repr=False)
class View:
    """Pictures in space of a subject with this `label`, the most important one first: a notebook
    shows them, one at a time, to be turned by mouse or keyboard.
    """

    label: str
    title: str
    pictures: tuple[SpatialPicture, ...]

    def save(self, path: str | Path) -> None:
        """Write the pictures as a page that needs no other file or, if the path ends in .svg, the
        first one as shown.

        :raises ValueError: the path has another suffix than .html and .svg.
        :raises OSError: the file cannot be written.

        >>> import tempfile
        >>> import ballplate as bp
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     bp.view(bp.quickstart()).save(f"{folder}/design.svg")
        """
        ending = Path(path).suffix.lower()
        if ending not in (".html", ".svg"):
            raise ValueError(f"a view is written as .html or .svg, unlike {path}")
        text = self._page() if ending == ".html" else self._still()
        write_file(path, text.encode("utf-8", "replace"))

    def __repr__(self) -> str:
        return f"<View of {self.label}: {', '.join(picture.label for picture in self.pictures)}>"

    def _repr_html_(self) -> str:
        data = base64.b64encode(self._still().encode("utf-8", "replace")).decode()
        picture = element(
            "img",
            src=f"data:image/svg+xml;base64,{data}",
            alt=f"{self.title}: {self.pictures[0].words}",
            style="display: block; width: 100%",
        )
        # The page has several lines, which other attributes have not.
        frame = Html(
            f'<iframe title="{escape(in_one_line(self.label))}" srcdoc="{escape(self._page())}"'
            ' style="position: absolute; top: 0; left: 0; width: 100%; height: 100%;'
            ' border: 0"></iframe>'
        )
        return element("div", picture, frame, style=f"position: relative; max-width: {WIDTH}")

    def _still(self) -> str:
        return still(self.pictures[0])

    def _page(self) -> str:
        shown: list[tuple[str, Html]] = []
        omitted, size = [], 0
        for picture in self.pictures:
            figure = figure_of(picture)
            if shown and size + len(figure) > MOST_BYTES:
                omitted.append(picture.label)
                continue
            size += len(figure)
            shown.append((picture.label, figure))
        buttons = (
            element("button", label, type="button", aria_pressed="false") for label, _ in shown
        )
        choice = element("div", *buttons, class_="controls choice", hidden=True)
        omission = (
            f"Not shown here, since there is too much of it: {', '.join(omitted)}."
            if omitted
            else ""
        )
        script = shipped("view.js") + shipped("embedded.js")
        body = element(
            "body",
            choice if len(shown) > 1 else "",
            *(figure for _, figure in shown),
            note(omission) if omission else "",
            Html(f"<script>{script}</script>"),
            class_="embedded",
        )
        return f'<!DOCTYPE html>\n<html lang="en">\n{head(self.title, script)}\n{body}\n</html>\n'
