"""Extensions that are shipped, each a folder that the rest of ballplate does not import.

An extension imports the contract and its own folder; where it builds on another extension,
`tests/test_extensions.py` says why.
"""

from __future__ import annotations

from ballplate.simulator.inputs.extensions import Extension


def _here(name: str, **provided: dict[str, str]) -> Extension:
    return Extension(name, f"{__name__}.{name}", **provided)


def _from(module: str, *names: str) -> dict[str, str]:
    return dict.fromkeys(names, module)


SHIPPED = (
    _here(
        "requirements",
        commands={"reach": "reach_command"},
        functions=_from("interface", "reach"),
        services=_from("goals", "GoalError", "parse_goal") | _from("judged_goals", "judged_goals"),
    ),
    _here(
        "repair",
        functions=_from("interface", "repair"),
        services={
            **_from("repair_search", "repairs"),
            **_from("scale", "scale_certificate"),
            **_from("repair_tables", "certificate_data", "certificate_lines", "repair_data"),
            **_from("repair_tables", "repair_lines", "changes_in_words"),
            **_from("mending_command", "with_repairs"),
        },
    ),
    _here(
        "campaign",
        commands={"sheet": "sheet_command", "next": "next_command"},
        functions=_from("interface", "sheet"),
        services={
            **_from("sheet_command", "sheet_name"),
            **_from("campaign_picture", "draw_campaign"),
            **_from("sheet", "Sheet"),
        },
    ),
    _here(
        "laboratory",
        commands={"import": "import_command"},
        functions=_from("interface", "read_report"),
        services=_from("reading_tables", "any_source_rows", "any_table_rows"),
    ),
    _here(
        "judgement",
        commands={
            "budget": "budget_command",
            "ladder": "ladder_command",
            "validate": "validate_command",
        },
        functions=_from("interface", "budget", "cross_validate", "ladder", "validate"),
        services=_from("bootstrap", "bootstrap") | _from("components", "variance_components"),
    ),
    _here(
        "reliability",
        commands={"reliability": "reliability_command"},
        functions=_from("interface", "reliability"),
    ),
    _here(
        "certificates",
        commands={"certificate": "certificate_command"},
        services={
            **_from("plate_certificate", "plate_certificate"),
            **_from("digital_values", "read_digital"),
        },
    ),
    _here(
        "maps",
        commands={
            "lengths": "lengths_command",
            "correct": "correct_command",
            "curves": "curves_command",
            "convert": "convert_command",
            "map": "map_command",
            "diff": "diff_command",
            "adjust": "adjust_command",
        },
        functions=_from(
            "interface", "adjust", "convert", "correct", "curves", "diff", "lengths", "map"
        ),
    ),
    _here(
        "compensation",
        commands={"compensation": "compensation_command"},
        functions=_from("interface", "compensation", "read_compensation"),
    ),
    _here(
        "splines",
        commands={"spline": "spline_command"},
        functions=_from("interface", "spline"),
    ),
    _here(
        "pages",
        functions=_from("interface", "page", "view"),
        services=_from("offered", "design_view", "fit_page_text", "fit_view"),
    ),
    _here(
        "sweeps",
        commands={"sweep": "sweep_command", "export": "export_command", "report": "report_command"},
        functions={
            **_from("stores", "stored", "sweep", "sweep_report"),
            **_from("running", "OtherSweepError"),
            **_from("store_file", "StoreError"),
        },
        services=_from("running", "SweepResult"),
        schemas={"sweep": "sweep_schema"},
    ),
    _here("studio", commands={"studio": "studio_command"}),
    _here(
        "reproduction",
        commands={"reproduce": "reproduce_command"},
        functions=_from("interface", "reproduce"),
    ),
)
