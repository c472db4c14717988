"""What is tried in files that they are not made for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ballplate.extensions.sweeps.sweep_schema import schema as sweep_schema
from ballplate.simulator.experiment.json_schema import schema

from tests.robustness.mutations import vocabulary

SEED = 1
FILES = Path(__file__).parent / "files"

SIZES = [
    "0 mm",
    "-1 m",
    "1 nm",
    "1 pm",
    "1e-300 m",
    "1e300 m",
    "1e9 m",
    "1e-9 pm",
    "999999 m",
    "5",
    5,
    "1e-18 m",
]
WILD: dict[str, list[Any]] = {
    "balls": [
        [500, 500],
        [200, 200],
        [2, 500],
        [10**5, 10**5],
        [10**9, 2],
        10**9,
        500,
        2,
        [1, 1],
        ["r1c1"] * 3,
        "corners",
    ],
    "size": [*SIZES, ["1e300 m", "1 m"], ["1 nm", "1 nm"]],
    "volume": [
        *(
            ["1e300 m"] * 3,
            ["1 nm"] * 3,
            ["1e-300 m"] * 2,
            ["1 m"] * 4,
            ["1e6 m"] * 3,
            ["1e-17 m"] * 3,
        ),
        {"x": ["0 m", "0 m"], "y": ["0 m", "1e300 m"]},
        {"x": ["-1e6 m", "1e6 m"], "y": ["-1 m", "1 m"], "z": ["-1e-18 m", "1 m"]},
    ],
    "repeatability": [*SIZES, ["1e-300 m", "1e300 m", "1 um"], ["1e-18 m", "1e6 m", "1 um"]],
    "standard_uncertainty": [
        *SIZES,
        "1e-300 m + L/1e-300",
        "1e300 um + L/1",
        {"z": "1 um"},
        ["1 um", "1e300 m"],
    ],
    "target_uncertainty": [*SIZES, "1e-300 m + L/1e300"],
    "level": SIZES,
    "length": SIZES,
    "repeats": [10_000, 10_001, 10**12, 0],
    "random": [10**9, 40_000, 1_000_001, 0],
    "seed": [10**290, 2**64, -1, 1.5],
    "quarter_turns": [10**18, -(10**18), 10**290, 3, [10**18] * 1000, []],
    "position_coefficients": [10**6, 30, 31, 2],
    "rotation_coefficients": [10**6, 30, 31, 1],
    "coefficients": [10**6, 12, 13, 2],
    "order": [10**6, 12, 13, 2],
    "knots": [
        *(
            [k / 30_001 for k in range(1, 30_001)],
            [k / 50 for k in range(1, 50)],
            [0.5] * 11,
            [0.5] * 3,
        ),
        *([1e-300], [1e-9, 2e-9], [5e-324, 0.5], [0.5, 0.5 + 1e-16], [1 - 1e-16]),
    ],
    "centres": [
        [8, 8, 8],
        [9, 9, 9],
        [2, 2, 8],
        [10**9] * 3,
        {"x": "1e300 m"},
        {axis: "500 mm" for axis in "xyz"},
    ],
    "constant": [1e-300, 1e-9, 10, 1e-3],
    "terms": [
        {"centres": [8, 8, 8]},
        "tensor",
        "quadratic",
        {"centres": [4, 4, 4], "constant": 1e-3},
    ],
    "pairs": [
        "all",
        "braced",
        "neighbours",
        [["r1c1", "r1c1"]],
        [[f"r1c{k}", f"r2c{k}"] for k in range(20_000)],
    ],
    "origin": [["1e300 m"] * 3, ["-1e300 m", "0 m"], ["0 m"] * 2],
    "rotation": ["1e300 rad", ["1e300 rad"] * 3, ["90 deg"] * 3, "90 deg", ["1e6 rad"] * 3],
    "rotations": ["full", "linearised"],
    "offset": [["1e300 m"] * 3, ["1e6 m", "0 m", "0 m"]],
    "object": [
        "json:loads",
        "os:getcwd",
        "no_such:build",
        "math:pi",
        ":",
        "a:b:c",
        "os.path:join",
        "mutant",
        "x" * 5000,
    ],
    "options": [{"a": 10**290}, {"": 1}],
    "values": [
        *(
            {"EXX t^2": "1e300 m"},
            {"EXX[1]": "1e-300 m"},
            {"EXX[1]": "1e6 m"},
            {"EAX t^1": "1e5 rad"},
            {"x": "1 um"},
        ),
        {f"EXX t^{k}": "1 um" for k in range(9)},
    ],
    "position": ["1e300 m", "1e6 m", "10 m", "1e-300 m"],
    "expected_rank_deficiency": [10**290, 10**9, 5],
    "variants": [
        *({str(k): {"title": "a"} for k in range(3)}, {f"v{k}": {"title": "a"} for k in range(30)}),
        *({"a": {"positions[0]": 5}}, {f"v{k}": {"title": "a"} for k in range(1001)}),
    ],
    "parameter": ["EXX", "EAX", "x" * 5000, "EXX[1]", "EXX t^2", "low: rotation x"],
    "value": ["1e300 m", "1 um", "1e5 rad", "1e6 m"],
    "set_up": ["0 s", "-1 s", "1e300 h", "1e-300 s", "5"],
    "price": ["0 s", "1000000 s", "1e9 h", "1 mm"],
    "planes": [["x"] * 1000, ["z", "z"], [], ["w"]],
    "levels": [
        *SIZES,
        *({"from": "0 mm", "to": "1 m", "count": count} for count in (2, 1000, 1001, 10**18, 1)),
        *({"x": "1 mm"}, {"from": "1e6 m", "to": "-1e6 m", "count": 3}, {"x": "1 mm", "count": 3}),
    ],
    "corners": [
        {axis: {"from": "0 mm", "to": "1 m", "count": 1000} for axis in "xyz"},
        {},
        {"x": ["1e6 m"] * 1000},
    ],
    "probes": [[["down"]] * 1000, {"x": ["down"]}, [["down"], "down"], {"x": [], "y": [[]]}],
    "keep": ["all", ["x" * 5000], [], ["flat low"] * 1000],
    "at_most": [
        [{"of": {"name": "*" * 60 + "z"}, "count": 1}],
        [{"of": {"name": "["}, "count": 0}],
        [{}],
    ],
    "reach": [{"down": {"x": ["1e6 m", "-1e6 m"]}}, {"down": {}}, {"up": {"x": ["0 m", "1 m"]}}],
    "edge": SIZES,
    "pool": [{}, {"candidates": []}, {"limits": {"keep": "all"}}, {"candidates": [{}] * 1000}],
}
WORDS = vocabulary(schema(), WILD)

PATHS = [
    "seed",
    "positions",
    "positions[0].level",
    "artefacts",
    "artefacts.plate.balls",
    "a..b",
    "[",
    "x" * 5000,
    "variants",
]
SWEEP_WORDS = vocabulary(
    sweep_schema(),
    {
        "base": [
            "quickstart.yaml",
            "mutant.yaml",
            ".",
            "no.yaml",
            "loop.csv",
            "pipe.csv",
            "/dev/zero",
            "x" * 5000,
            "balls.csv",
        ],
        "path": PATHS,
        "paths": [PATHS, [], PATHS[:2], ["seed", "seed"]],
        "from": [*SIZES, 10**290, -1, 0, "1e-300 m", "5 deg"],
        "to": [*SIZES, 10**290, 10**9, "1e300 m", "100001 mm"],
        "count": [2, 100_000, 100_001, 10**18, 0, -1],
        "step": [*SIZES, 1e-300, 10**290, 0, -1],
        "values": [
            *(
                [],
                {},
                [1] * 3,
                list(range(100_001)),
                [None],
                [[]],
                [{}],
                [True, "true"],
                ["1 mm", "1 deg", 5],
            ),
            {str(k): k for k in range(2000)},
        ],
        "together": [
            {},
            {path: [1, 2] for path in PATHS},
            {"seed": [1], "title": [1, 2]},
            {"seed": 5},
        ],
        "names": [[], ["a"] * 2, ["a", "b"], [1, 2], ["x" * 5000, "y"]],
        "sizes": [[1], list(range(1, 7)), [10**18], [0], [3] * 3],
        "always": [["z low"] * 2, ["nobody"], [f"{k}" for k in range(1000)]],
        "among": [["z low"], [], ["nobody"]],
        "variants": ["all", ["one"], [], ["nobody"] * 1000],
        "variant": ["nobody", "one"],
        "skip": [
            [{}],
            [{"size": "500 mm"}] * 1000,
            [{"balls": {"above": 1}}],
            [{"level": {"above": "1 deg"}}],
        ],
        "only": [[{}], [{"size": "5 mm"}], [{"level": {"below": "1 m", "above": "1 m"}}]],
        "trials": [2, 1, 10**7, 10**18],
        "seed": [10**290, 2**64, -1, 1.5],
        "record": [["U1"] * 100, ["U7"], []],
        "axes": [
            {
                f"a{k}": {
                    "path": f"positions[{k}].level",
                    "from": "1 mm",
                    "to": "9 mm",
                    "count": 1000,
                }
                for k in range(6)
            },
            {
                "a": {"path": "seed", "from": 1, "to": 100_000, "step": 1},
                "b": {"path": "sigma", "values": list(range(11))},
            },
        ],
    },
)
