"""Writes the certified problems: `python -m benchmarks.certified.make [NAME …]`, into designs/certified.

Readings are built so that their answer is known beforehand: noise, projected on what no change of
parameters can follow, is added to the readings of a chosen state, which is then the least-squares
estimate. They are rounded to femtometres, and the estimate of the rounded readings is computed in
120 digits.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from random import Random
from typing import Any

from mpmath import mp, mpf, nstr

from . import multiprecision as exact
from .experiment_text import files
from .problems import PROBLEMS, Problem

FOLDER = Path("designs", "certified")
# Digits after the point of readings and certified values in metres, and digits of what is
# certified.
DECIMALS = 15
CERTIFIED_DIGITS = 25
# What readings may still change by, in metres, when their noise is made orthogonal once more.
MOST_ROUNDS, SETTLED = 10, mpf("1e-16")
# Goes before the digits of a number while `json` takes it for text.
MARK = "number "


def decimals(value: Any) -> Any:
    """The same with every number but truth values as a decimal of many digits, as it is written in
    a file.
    """
    return json.loads(json.dumps(value), parse_float=exact.number, parse_int=exact.number)


def drawn_state(problem: Problem, seed: int) -> exact.State:
    """A true machine, plate and poses near the nominal ones, in short decimals."""
    random = Random(seed)
    sizes = problem.get("errors", {"position": mpf("2e-6"), "rotation": mpf("4e-6")})
    state = exact.nominal_state(problem)
    change = {}
    for key in exact.parameters(problem):
        size = {"ball": 2e-5, "pose": 2e-4, "offset": 1e-5, "length": 5e-7, "machine": 2e-6}[key[0]]
        if key[0] == "machine" and "errors" in problem:
            size = float(sizes["position" if key[1] < 9 * 2 - 3 else "rotation"])
        change[key] = mpf(f"{random.gauss(0.0, size):.3g}")
    return exact.changed(problem, state, change)


def built(problem: Problem, seed: int) -> tuple[Problem, exact.State]:
    """The problem with readings and certified values to which a drawn state is the estimate, and
    that state.
    """
    state = drawn_state(problem, seed)
    random = Random(seed + 1)
    noise: list[Any] | None = None
    p = problem
    target = [exact.place(p, state, int(r["position"]), int(r["ball"])) for r in p["readings"]]
    x = exact.without_error(p, state, target)
    for _ in range(MOST_ROUNDS):
        before = x
        every = exact.rows(p, x)
        linear = exact.linearised(p, state, every)
        if noise is None:
            noise = [mpf(f"{random.gauss(0.0, 1.0):.6f}") for _ in linear.residuals]
        inverse, null = exact.inverted(exact.parameters(p), linear.derivatives)
        assert not null
        gradient = {key: mpf(0) for key in inverse}
        for value, derivative in zip(noise, linear.derivatives, strict=True):
            for key, slope in derivative.items():
                gradient[key] += slope * value
        step = {
            key: sum((row[o] * gradient[o] for o in row), mpf(0)) for key, row in inverse.items()
        }
        noise = [
            value - sum((slope * step[key] for key, slope in derivative.items()), mpf(0))
            for value, derivative in zip(noise, linear.derivatives, strict=True)
        ]
        p, x = with_residuals(p, state, target, noise)
        # The derivatives are those at readings that the noise has moved.
        if (
            max(
                abs(a - b)
                for new, old in zip(x, before, strict=True)
                for a, b in zip(new, old, strict=True)
            )
            < SETTLED
        ):
            break
    rounded = [[mpf(nstr_fixed(c)) for c in values] for values in x]
    for key in ("distances", "coordinates", "lengths", "priors"):
        p = {**p, key: [{**item, "value": mpf(nstr_fixed(item["value"]))} for item in p[key]]}
    # A probe is drawn with the offset that its certificate states, and a gauge with its radius.
    stated = [[mpf(nstr_fixed(c)) for c in probe["stated"]] for probe in p["probes"]]
    probes = [
        {**probe, "stated": c, "offset": c} for probe, c in zip(p["probes"], stated, strict=True)
    ]
    if any(artefact["role"] == "gauge" for artefact in p["artefacts"]):
        p = {**p, "lengths": [{**item, "nominal": item["value"]} for item in p["lengths"]]}
    return exact.with_readings({**p, "probes": probes}, rounded), state


def of_plate(problem: Problem, reading: Problem) -> bool:
    artefact = problem["positions"][int(reading["position"])]["artefact"]
    return bool(problem["artefacts"][int(artefact)]["role"] == "plate")


def with_residuals(
    problem: Problem, state: exact.State, target: list[Any], noise: list[Any]
) -> tuple[Problem, list[Any]]:
    """The problem with certified values, and the readings, whose whitened residuals at `state` are
    `noise`.
    """
    left = iter(noise)
    moved = [list(place) for place in target]
    for k, reading in enumerate(problem["readings"]):
        if of_plate(problem, reading):
            moved[k] = [
                c + u * next(left)
                for c, u in zip(moved[k], reading["standard_uncertainty"], strict=True)
            ]
    p = dict(problem)
    p["distances"] = []
    for item in problem["distances"]:
        own = state.balls[int(item["artefact"])]
        i, j = (int(ball) for ball in item["balls"])
        length = exact.norm([u - v for u, v in zip(own[i], own[j], strict=True)])
        p["distances"].append({**item, "value": length - item["standard_uncertainty"] * next(left)})
    p["coordinates"] = []
    for item in problem["coordinates"]:
        at = state.balls[int(item["artefact"])][int(item["ball"])][int(item["axis"])]
        p["coordinates"].append({**item, "value": at - item["standard_uncertainty"] * next(left)})
    for item in problem["measured_lengths"]:
        # The first end takes the residual, along the line to the second.
        first = int(item["first"])
        start = target[first]
        position = int(problem["readings"][first]["position"])
        end = state.origins[position] if item["second"] is None else target[int(item["second"])]
        apart = [u - v for u, v in zip(start, end, strict=True)]
        length = exact.norm(apart)
        by = item["standard_uncertainty"] * next(left)
        moved[first] = [c + by * a / length for c, a in zip(start, apart, strict=True)]
    p["lengths"] = [
        (
            {**item, "value": state.lengths[k] - item["standard_uncertainty"] * next(left)}
            if item["standard_uncertainty"] is not None
            else item
        )
        for k, item in enumerate(problem["lengths"])
    ]
    p["probes"] = [
        (
            {
                **probe,
                "stated": [
                    c - probe["standard_uncertainty"] * next(left) for c in state.offsets[k]
                ],
            }
            if probe["free"]
            else probe
        )
        for k, probe in enumerate(problem["probes"])
    ]
    p["priors"] = []
    for item in problem["priors"]:
        place = exact.machine_names(problem["error_model"]).index(item["parameter"])
        value = exact.quoted(problem["error_model"], state.machine)[place]
        p["priors"].append({**item, "value": value - item["standard_uncertainty"] * next(left)})
    return p, exact.without_error(p, state, moved)


def nstr_fixed(value: Any) -> str:
    """A decimal with so many digits after the point."""
    scaled = int(mp.nint(value * mpf(10) ** DECIMALS))
    sign, digits = "-" if scaled < 0 else "", str(abs(scaled)).rjust(DECIMALS + 1, "0")
    return f"{sign}{digits[:-DECIMALS]}.{digits[-DECIMALS:]}".rstrip("0").rstrip(".")


def certified(problem: Problem, state: exact.State | None) -> Problem:
    """What is certified: the design as drawn and, if it has readings, the estimate."""
    drawn = exact.as_drawn(problem)
    rows = exact.linearised(
        problem, drawn.state, exact.rows(problem, exact.error_free(problem, drawn.state))
    )
    found: Problem = {
        "as_drawn": {
            "equations": mpf(len(rows.residuals)),
            "parameters": mpf(len(drawn.keys)),
            "rank_deficiency": mpf(len(drawn.null)),
            "uncertainties": exact.uncertainties(problem, drawn),
        }
    }
    if state is None:
        return found
    # What nothing determines as drawn, errors and noise seem to determine a little, which is no
    # answer to certify.
    assert not drawn.null
    solution = exact.estimate(problem, state)
    assert not solution.null and solution.steps[-1] < mpf(10) ** exact.SMALL_STEP, solution.steps
    model = problem["error_model"]
    found["estimate"] = {
        "sum_of_squares": solution.sum_of_squares,
        "machine": dict(
            zip(
                exact.machine_names(model), exact.quoted(model, solution.state.machine), strict=True
            )
        ),
        "balls": [
            balls
            for balls, a in zip(solution.state.balls, problem["artefacts"], strict=True)
            if a["role"] == "plate"
        ],
        "origins": [
            origin
            for origin, position in zip(solution.state.origins, problem["positions"], strict=True)
            if position["free"]
        ],
        "offsets": [
            o
            for o, probe in zip(solution.state.offsets, problem["probes"], strict=True)
            if probe["free"]
        ],
        "lengths": solution.state.lengths,
        "uncertainties": exact.uncertainties(problem, solution),
        "built_within": max(solution.steps),
    }
    return found


def written(value: Any, digits: int) -> Any:
    if isinstance(value, dict):
        return {key: written(item, digits) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [written(item, digits) for item in value]
    if isinstance(value, mpf):
        if value == int(value) and abs(value) < 10**9:
            return int(value)
        text = nstr(value, digits, min_fixed=-4, max_fixed=9, strip_zeros=True)
        return f"{MARK}{text.rstrip('.')}"
    return value


def dumped(problem: Problem) -> str:
    """JSON with a line for each reading and each entry of a list."""
    lines = []
    for key, value in problem.items():
        if isinstance(value, list) and value and isinstance(value[0], dict | list):
            inner = ",\n    ".join(json.dumps(item) for item in value)
            lines.append(f'  "{key}": [\n    {inner}\n  ]')
        elif key == "certified":
            lines.append(f'  "{key}": ' + json.dumps(value, indent=2).replace("\n", "\n  "))
        else:
            lines.append(f'  "{key}": {json.dumps(value)}')
    return re.sub(f'"{MARK}([^"]*)"', r"\1", "{\n" + ",\n".join(lines) + "\n}\n")


def made(given: Problem, seed: int) -> Problem:
    """A problem as it is written: with readings unless it is planned only, and with its certified
    answers.
    """
    with mp.workdps(exact.DIGITS):
        problem = decimals(given)
        planned_only = problem.pop("planned_only", False)
        state = None
        if planned_only:
            for reading in problem["readings"]:
                reading["x"] = None
        else:
            problem, state = built(problem, seed)
        problem.pop("errors", None)
        answers = certified(problem, state)
        told = written(problem, 30)
        return {**told, "certified": written(answers, CERTIFIED_DIGITS)}


def main(names: list[str]) -> None:
    FOLDER.mkdir(exist_ok=True)
    for number, make in enumerate(PROBLEMS):
        given = make()
        if not names or given["name"] in names:
            found = made(given, 1000 + number)
            write(given["name"], dumped(found))
            print(FOLDER / given["name"], flush=True)


def write(name: str, text: str) -> None:
    """The problem as JSON, and the same as an experiment file with its readings."""
    Path(FOLDER, f"{name}.json").write_text(text, encoding="utf-8")
    for other, content in files(json.loads(text, parse_float=str, parse_int=str)).items():
        Path(FOLDER, other).write_text(content, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
