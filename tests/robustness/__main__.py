"""Tries cases alone, keeps their folders and tells all that comes of them: `python -m
tests.robustness NUMBER`.
"""

from __future__ import annotations

import sys
import tempfile
import traceback
from pathlib import Path

from tests.robustness.cases import Case, case, lay_out, trial
from tests.robustness.kit import make_kit
from tests.robustness.worker import outcome


def tried(one: Case, folder: Path) -> str | None:
    """What is wrong with a case, a traceback included, in this process and so without bounds."""
    try:
        return trial((one.arguments, str(folder)))
    except Exception:
        return traceback.format_exc()


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
        fault = tried(one, folder)
        if fault is None:
            # The same again in another folder, to be shown.
            lay_out(root / "kit", one, root / f"shown-{number}")
            status, out, err = outcome(one.arguments, root / f"shown-{number}" / "in")
            print(
                f"status {status}\n--- standard output\n{out[:3000]}\n--- standard"
                f" error\n{err[:3000]}"
            )
        else:
            print(f"fault:\n{fault}")
        worst |= fault is not None
    return worst


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
