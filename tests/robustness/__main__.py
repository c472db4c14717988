"""Tries one case alone, keeps its folder and tells all that comes of it: `python -m tests.robustness NUMBER`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.robustness.cases import case, lay_out, trial
from tests.robustness.kit import make_kit
from tests.robustness.worker import outcome


def main(numbers: list[str]) -> int:
    root = Path(tempfile.mkdtemp(prefix="ballplate-cases-"))
    (root / "kit").mkdir()
    make_kit(root / "kit")
    worst = 0
    for number in map(int, numbers):
        one = case(root / "kit", number)
        folder = root / f"case-{number}"
        lay_out(root / "kit", one, folder)
        print(f"{one}\nin {folder / 'in'}", flush=True)
        fault = trial((one.arguments, str(folder)))
        # The same again in another folder, to be shown.
        lay_out(root / "kit", one, root / f"shown-{number}")
        status, out, err = outcome(one.arguments, root / f"shown-{number}" / "in")
        print(
            f"status {status}\n--- standard output\n{out[:3000]}\n--- standard error\n{err[:3000]}\n--- fault\n{fault}"
        )
        worst |= fault is not None
    return worst


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
