"""How long a hundred dimensions of fifty points each take at a thousand drawn machines, in terms of
the same by linear uncertainties.

Run with

    python -m pytest -s benchmarks/bench_parts.py
"""

from __future__ import annotations

import time
from pathlib import Path

import ballplate as bp

KINDS = (
    "diameter: {0}",
    "cylindricity: {0}",
    "perpendicularity: {0}, datums: A",
    "position: {0}, datums: [A, b0, b98]",
)


def part(folder: Path) -> Path:
    bores = [
        f"  b{k}: {{bore: z, at: [{20 + 40 * (k % 10)}, {20 + 40 * (k // 10)}], diameter: 20,"
        " depths: [5, 15, 25, 35, 45], points: 10}"
        for k in range(101)
    ]
    dimensions = [
        f"  - {{{KINDS[k % 4].format(f'b{k}')}, tolerance: 0.02}}" for k in range(1, 98)
    ] + [f"  - {{diameter: b{k}}}" for k in (0, 98, 99)]
    path = folder / "part.yaml"
    path.write_text(
        "part: a hundred bores\nprobing: {point_repeatability: 0.4 um, tip: {diameter: 4}}\n"
        "places: {low: {origin: [100, 100, 100]}}\nfeatures:\n"
        "  A: {plane: z+, at: 60, from: [10, 8], to: [390, 390], points: [5, 10]}\n"
        + "\n".join(bores)
        + "\ndimensions:\n"
        + "\n".join(dimensions)
        + "\n",
        encoding="utf-8",
    )
    return path


def test_drawn_machines(tmp_path: Path) -> None:
    path, times = part(tmp_path), {}
    for draws in (0, 1000):
        start = time.perf_counter()
        assert len(bp.part(path, bp.quickstart(), draws=draws).dimensions) == 100
        times[draws] = time.perf_counter() - start
    ratio = (times[1000] - times[0]) / times[0]
    print(f"linear {times[0]:.1f} s; a thousand machines more: {ratio:.1f} times as long")
