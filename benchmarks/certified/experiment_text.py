"""A certified problem as an experiment file and its readings; numbers are text as in the problem's
own file.
"""

from __future__ import annotations

from typing import Any

Problem = dict[str, Any]


def metres(values: list[str]) -> str:
    return "[" + ", ".join(f"{value} m" for value in values) + "]"


def ball_name(number: int | str) -> str:
    return str(int(number) + 1)


def experiment_text(problem: Problem) -> str:
    """An experiment file of the problem's design."""
    lower, upper = problem["volume"]["lower"], problem["volume"]["upper"]
    volume = ", ".join(
        f"{axis}: [{a} m, {b} m]" for axis, a, b in zip("xyz", lower, upper, strict=False)
    )
    lines = [
        "# yaml-language-server: $schema=../schema.json",
        "#",
        f"# {problem['why']}",
        f"# Certified answers: {problem['name']}.json.",
        f"title: {problem['title']}",
        "",
        "machine:",
        f"  volume: {{{volume}}}",
        f"  repeatability: {metres(problem['readings'][0]['standard_uncertainty'])}",
        "",
        f"error_model: {error_model(problem['error_model'])}",
        "",
        "probes:",
        *(f"  {probe['name']}: {probe_text(probe)}" for probe in problem["probes"]),
        "",
        "artefacts:",
        *(
            f"  {artefact['name']}: {artefact_text(problem, artefact)}"
            for artefact in problem["artefacts"]
        ),
        "",
        "positions:",
        *(
            line
            for k in range(len(problem["positions"]))
            for line in position_lines(problem, str(k))
        ),
        "",
        *calibration_lines(problem),
        *prior_lines(problem),
        "evaluation:",
        "  points:",
        *(f"    - {metres(point)}" for point in problem["points"]),
        f"  probe: {problem['probes'][int(problem['point_probe'])]['name']}",
        "",
        "sigma: given",
        f"expected_rank_deficiency: {problem['certified']['as_drawn']['rank_deficiency']}",
    ]
    return "\n".join(lines) + "\n"


def error_model(model: Problem) -> str:
    if model["kind"] == "metric":
        return "{kind: metric, scale: x}" if "alpha" in model["parameters"] else "{kind: metric}"
    counts = ", ".join(
        f"{key}: {model[key]}" for key in ("position_coefficients", "rotation_coefficients")
    )
    return f"{{kind: kinematic, arrangement: MB2, rotations: {model['rotations']}, {counts}}}"


def probe_text(probe: Problem) -> str:
    if not probe["free"]:
        return metres(probe["offset"])
    return (
        f"{{offset: {metres(probe['offset'])}, standard_uncertainty:"
        f" {probe['standard_uncertainty']} m}}"
    )


def artefact_text(problem: Problem, artefact: Problem) -> str:
    if artefact["role"] == "gauge":
        directions = ", ".join(f"[{a} deg, {b} deg]" for a, b in artefact["directions_degrees"])
        return (
            f"{{kind: bryan_gauge, radius: {problem['lengths'][0]['nominal']} m, directions:"
            f" [{directions}]}}"
        )
    balls = (
        f'\n      "{ball_name(k)}": {metres(ball)}' for k, ball in enumerate(artefact["balls"])
    )
    return "\n    kind: balls\n    coordinates:" + "".join(balls)


def position_lines(problem: Problem, number: str) -> list[str]:
    position = problem["positions"][int(number)]
    role = problem["artefacts"][int(position["artefact"])]["role"]
    angles = position["rotation_degrees"]
    rotation = (
        f"{angles[0]} deg"
        if len(angles) == 1
        else "[" + ", ".join(f"{angle} deg" for angle in angles) + "]"
    )
    turned = "" if role == "gauge" else f", rotation: {rotation}"
    own = [reading for reading in problem["readings"] if reading["position"] == number]
    probes = list(
        dict.fromkeys(problem["probes"][int(reading["probe"])]["name"] for reading in own)
    )
    lines = [
        f"  - name: {position['name']}",
        f"    pose: {{origin: {metres(position['origin'])}{turned}}}",
        f"    probes: [{', '.join(probes)}]",
    ]
    if role == "plate":
        lines.append(f"    standard_uncertainty: {metres(own[0]['standard_uncertainty'])}")
    return lines


def calibration_lines(problem: Problem) -> list[str]:
    lines = []
    names = [artefact["name"] for artefact in problem["artefacts"]]
    for item in problem["distances"]:
        pair = ", ".join(ball_name(ball) for ball in item["balls"])
        lines.append(
            f"  - {{kind: distances, artefact: {names[int(item['artefact'])]}, pairs: [[{pair}]], "
            f"values: [{{balls: [{pair}], distance: {item['value']} m}}], "
            f"standard_uncertainty: {item['standard_uncertainty']} m}}"
        )
    if problem["coordinates"]:
        uncertainty = problem["coordinates"][0]["standard_uncertainty"]
        lines.append(
            f"  - {{kind: coordinates, balls: all, values: {problem['name']}-certificate.csv, "
            f"standard_uncertainty: {uncertainty} m}}"
        )
    for item in problem["lengths"]:
        if item["standard_uncertainty"] is not None:
            gauge = problem["artefacts"][0]["role"] == "gauge"
            distance = f"[{{balls: [1, 2], distance: {item['value']} m}}]"
            what = (
                f"radius, value: {item['value']} m"
                if gauge
                else f"distances, pairs: all, values: {distance}"
            )
            lines.append(
                f"  - {{kind: {what}, standard_uncertainty: {item['standard_uncertainty']} m}}"
            )
    return ["calibration:", *lines, ""] if lines else []


def prior_lines(problem: Problem) -> list[str]:
    if not problem["priors"]:
        return []
    lines = [
        f"  - {{parameter: {item['parameter']}, value: {item['value']} m, "
        f"standard_uncertainty: {item['standard_uncertainty']} m}}"
        for item in problem["priors"]
    ]
    return ["priors:", *lines, ""]


def readings_text(problem: Problem) -> str:
    """The readings as CSV, in metres."""
    axes = "xyz"[: int(problem["dimension"])]
    lines = ["position,ball,probe," + ",".join(f"{axis}_m" for axis in axes)]
    for reading in problem["readings"]:
        position = problem["positions"][int(reading["position"])]
        ball = ball_name(reading["ball"])
        names = (position["name"], ball, problem["probes"][int(reading["probe"])]["name"])
        lines.append(",".join([*names, *reading["x"]]))
    return "\n".join(lines) + "\n"


def certificate_text(problem: Problem) -> str:
    """Certified co-ordinates of a plate as CSV, in metres; empty where there are none."""
    by_ball: dict[str, list[str]] = {}
    for item in problem["coordinates"]:
        by_ball.setdefault(ball_name(item["ball"]), []).append(item["value"])
    lines = [",".join([ball, *values]) for ball, values in by_ball.items()]
    return "\n".join(["ball,x_m,y_m,z_m", *lines]) + "\n" if lines else ""


def files(problem: Problem) -> dict[str, str]:
    """Names and contents of the files that hold the problem for ballplate."""
    name = problem["name"]
    found = {
        f"{name}.yaml": experiment_text(problem),
        f"{name}-certificate.csv": certificate_text(problem),
    }
    if "estimate" in problem["certified"]:
        found[f"{name}.csv"] = readings_text(problem)
    return {key: text for key, text in found.items() if text}
