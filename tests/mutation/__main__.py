"""The mutation score from the command line: python -m tests.mutation --count 3 results rank."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from tests.mutation.score import ROOMS, files_of_tests, sample, scored, stored, summary

parser = argparse.ArgumentParser(prog="python -m tests.mutation")
parser.add_argument("rooms", nargs="*", metavar="ROOM", help=", ".join(ROOMS))
parser.add_argument("--count", type=int, default=2, help="mutants of each room")
parser.add_argument("--seed", type=int, default=1, help="which mutants are drawn")
parser.add_argument("--seconds", type=float, default=600.0, help="begin none after these")
parser.add_argument("--each", type=float, default=60.0, help="seconds of tests for a mutant")
parser.add_argument("--store", type=Path, default=Path("mutants.jsonl"), help="results so far")
parser.add_argument("--tests", nargs="+", default=files_of_tests(), help="files or folders")
parser.add_argument("--show", action="store_true", help="compare outputs of the survivors instead")
options = parser.parse_args()
unknown = set(options.rooms) - set(ROOMS)
if unknown:
    parser.error(f"no room {', '.join(sorted(unknown))}; there are {', '.join(ROOMS)}")
os.environ["OPENBLAS_NUM_THREADS"] = "1"
if options.show:
    # It loads NumPy, for which the number of threads is set above.
    from tests.mutation.outputs import shown

    names = {one.mutant for one in stored(options.store) if one.ended == "survived"}
    every = [
        one for room in options.rooms or ROOMS for one in sample(room, options.count, options.seed)
    ]
    shown([one for one in every if one.name in names], print)
    sys.exit()
outcomes = scored(
    options.rooms or list(ROOMS),
    options.count,
    options.seed,
    options.store,
    options.seconds,
    options.each,
    options.tests,
)
print("\n".join(summary(outcomes)))
