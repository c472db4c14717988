"""The data sheet as a form: the questions of `ballplate init` and the drafts of answers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import format_length, number_of
from ballplate.simulator.machines import ARRANGEMENTS

from .checked_draft import checked_draft
from .data_sheet import READERS, DataSheet, data_sheet
from .machine_tables import chain_words, table
from .shapes import draft_shapes, machine_shapes, on_paper
from .sheet_values import function_text


def sheet_questions() -> list[dict[str, Any]]:
    """Return the questions of `ballplate init` in their order, as plain data.

    Each has its name, label, hint, default and fields; choices of the machine have their chain of
    axes in words, and kinds of machine `shapes` on paper.
    """
    machines = []
    for name in (*table("kinds"), *ARRANGEMENTS):
        chain = table("kinds").get(name, [name])[0]
        shapes = on_paper(machine_shapes(name)) if name in table("kinds") else []
        machines.append(
            {"value": name, "words": f"{chain}: {chain_words(chain)}", "shapes": shapes}
        )
    questions = [{"name": name, **table("entries")[name]} for name in READERS]
    questions[0]["fields"] = [questions[0]["fields"][0] | {"choices": machines}]
    return questions


def sheet_draft(path: Path, answers: Mapping[str, Any]) -> dict[str, Any]:
    """Return the draft of answers, texts by the names of the questions, as plain data: its `text`,
    `words` by name on what it assumes, and `shapes` on paper; or `messages` by name.

    An answer that is empty or absent is the default.
    """
    entries = table("entries")
    texts = {name: f"{answers.get(name) or entries[name]['default']}".strip() for name in READERS}
    messages = {}
    for name, read in READERS.items():
        try:
            _ = texts[name] and read(texts[name])
        except ValueError as error:
            messages[name] = str(error)
    if messages:
        return {"messages": messages}
    # Answers that are readable one by one may contradict each other.
    name = "repeatability"
    try:
        sheet = data_sheet(texts)
        name = "plate"
        _ = sheet.places
        name = "hours"
        text, _, experiment = checked_draft(path, sheet, texts)
    except ValueError as error:
        return {"messages": {name: str(error)}}
    shapes = on_paper(draft_shapes(experiment))
    return {"messages": {}, "text": text, "words": _words(sheet, experiment), "shapes": shapes}


def _words(sheet: DataSheet, experiment: Experiment) -> dict[str, str]:
    """Return in words what a draft makes of entries."""
    tips, target, pool = sheet.tips_there, experiment.target_uncertainty, experiment.pool
    assert target is not None and pool is not None
    axes = "xyz"[: experiment.dimension]
    words = {
        "machine_type": f"{chain_words(sheet.arrangement, axes)} ({sheet.arrangement})",
        "certificate": f"u = {function_text(sheet.certificate.standard)}",
        "tips": f"{', '.join(tips.offsets)}; {format_length(tips.length)} long,"
        f" offsets uncertain by {format_length(sheet.tips.uncertainty)}",
        "repeatability": format_length(float(experiment.machine.repeatability[0])),
        "target": f"U = {function_text(target.stated)}, k = {target.coverage_factor:g}",
        "hours": f"{number_of(len(experiment.positions), 'position')} to start with; the plan"
        f" chooses from {number_of(len(pool.candidates), 'place')}",
    }
    if sheet.temperature:
        words["temperature"] = f"{sheet.temperature} in all positions alike, and again in each"
    return {name: text.replace(" um", " µm") for name, text in words.items()}
