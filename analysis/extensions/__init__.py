"""Extensions that are shipped, each a folder that the rest of ballplate does not import.

An extension imports the contract and its own folder; where it builds on another extension,
`tests/test_extensions.py` says why.
"""

from __future__ import annotations

from typing import Any

from ballplate.simulator.inputs.extensions import Command, Extension


def _here(name: str, **provided: Any) -> Extension:
    return Extension(name, f"{__name__}.{name}", **provided)


def _from(module: str, *names: str) -> dict[str, str]:
    return dict.fromkeys(names, module)


SHIPPED = (
    _here(
        "influences",
        services=_from("campaign_temperatures", "campaign_temperatures"),
        # In the order of the documentation.
        influences={
            "temperature": "temperature",
            "probing": "probing",
            "position scale": "position_scale",
            "reproducibility": "reproducibility",
            "re-indexing": "reindexing",
            "drift": "drift",
            "sag": "sag",
        },
    ),
    _here(
        "own_models",
        services=_from("custom", "module_source", "module_file"),
        calibrations={"python": "python_values"},
        error_models={"python": "python_model"},
    ),
    _here(
        "machine_files",
        services={
            **_from("map_priors", "resolve_map_prior"),
            **_from("fitted_machine", "machine_of_file"),
            **_from("map_of_fit", "map_of", "counted_twice", "left_out_words"),
            **_from("map_files", "write_map"),
            **_from("sigmas_by_campaign", "campaign_sigmas"),
        },
        functions=_from("interface", "load_map", "write_map") | _from("fitted_map", "FittedMap"),
        schemas={"machine": "machine_sections", "map": "map_sections"},
        error_models={"machine": "fitted_machine"},
        true_machines={
            "curves": "measured_curves",
            "machine": "described_machine",
            "map": "mapped_machine",
        },
    ),
    _here(
        "planning",
        commands={
            "plan": Command(
                "plan_command",
                "choose positions and certificates from a pool, and compute a lower bound for any"
                " choice",
                "plan",
            ),
        },
        functions=_from("interface", "plan") | _from("criteria", "Criterion"),
        services=_from("pools", "resolve_candidates", "resolve_pool"),
    ),
    _here(
        "estimators",
        commands={
            "compare": Command(
                "compare_command",
                "compare an alternative estimator with the full one on synthetic data",
            ),
        },
        functions=_from("interface", "compare"),
        services={
            **_from("reversal_fits", "fit_reversal"),
            **_from("length_fits", "fit_lengths"),
            **_from("distances", "fit_alternative"),
        },
    ),
    _here(
        "assumptions",
        functions=_from("interface", "assumptions"),
        services=_from("effects", "assumption_effects"),
        sections={"assumptions": "sections"},
    ),
    _here(
        "information",
        commands={
            "run --errors": Command(
                "errors_command",
                "how much of each error's information goes with each position",
            ),
        },
        functions=_from("interface", "information"),
        services=_from("position_information", "position_information"),
    ),
    _here(
        "requirements",
        commands={
            "reach": Command(
                "reach_command",
                "find the equipment, plate size or hours that meet a target",
                "plan",
            ),
        },
        functions=_from("interface", "reach"),
        services=_from("goals", "parse_goal") | _from("judged_goals", "judged_goals"),
    ),
    _here(
        "repair",
        services=_from("repair_search", "suggested"),
    ),
    _here(
        "drafting",
        functions=_from("interface", "design"),
        services={
            **_from("init_command", "add_data_sheet", "drafted"),
            **_from("sheet_form", "sheet_questions", "sheet_draft"),
        },
    ),
    _here(
        "campaign",
        commands={
            "sheet": Command(
                "sheet_command",
                "write a run sheet to print, a table to fill in and points for a machine's program",
                "measure",
            ),
            "next": Command(
                "next_command",
                "report after each position whether the target is met, and what to read next",
                "measure",
            ),
        },
        functions=_from("interface", "sheet"),
        services={
            **_from("sheet", "Sheet"),
            **_from("earlier", "begun"),
        },
    ),
    _here(
        "laboratory",
        commands={
            "import": Command(
                "import_command", "make a table of readings of reports of CMM programs", "measure"
            ),
        },
        functions=_from("interface", "read_report"),
        services={
            **_from("reading_tables", "OtherTables"),
            **_from("reading_checks", "ReadingChecks"),
        },
    ),
    _here(
        "judgement",
        commands={
            "models": Command(
                "models_command",
                "compare error models on readings: which one do they call for?",
                "evaluate",
            ),
            "validate": Command(
                "validate_command",
                "leave out positions in turn and predict them",
                "evaluate",
            ),
            "run --budget": Command(
                "budget_command",
                "uncertainties by their sources: readings, certificates, probes, influences",
            ),
        },
        functions=_from("interface", "budget", "compare_models", "validate"),
    ),
    _here(
        "diagnosis",
        commands={
            "run --reliability": Command(
                "reliability_command",
                "minimal detectable biases of readings and certificates, and effects of others",
            ),
        },
        functions=_from("interface", "reliability"),
        services=_from("searched_fit", "diagnosed"),
    ),
    _here(
        "certificates",
        commands={
            "certificate": Command(
                "certificate_command",
                "write a plate's ball co-ordinates with their covariance: page, CSV, DCC",
                "evaluate",
            ),
        },
        functions=_from("interface", "certificate"),
        services={
            **_from("plate_certificate", "plate_certificate"),
            **_from("digital_values", "read_digital"),
            **_from("certificate_files", "CertificateFiles"),
        },
    ),
    _here(
        "maps",
        commands={
            "diff": Command(
                "diff_command",
                "compare two maps of a machine: which lengths, errors and balls have changed",
                "evaluate",
            ),
            "correct": Command(
                "correct_command",
                "correct points by the map of a fit, with their uncertainty",
                "use",
            ),
            "map": Command(
                "map_command",
                "compute volumetric errors of a machine file, or of the map that a fit left behind",
                "use",
            ),
            "map --curves": Command(
                "curves_command",
                "parametric errors of a machine file or map along their axes, with uncertainties",
            ),
        },
        functions=_from("interface", "correct", "curves", "diff", "map"),
    ),
    _here(
        "parts",
        commands={
            "part": Command(
                "part_command",
                "uncertainty of each dimension of a part, by a design or a map",
                "use",
            ),
            "acceptance": Command(
                "acceptance_command",
                "predict or evaluate the acceptance test of a machine by ISO 10360-2",
                "use",
            ),
        },
        functions=_from("interface", "part") | _from("acceptance_interface", "acceptance"),
        services={
            **_from("part_uncertainty", "part_uncertainty"),
            **_from("part_page", "part_page", "sections_of_part", "part_for_studio"),
            **_from("acceptance_page", "acceptance_page"),
        },
        sections={"part": "experiment_section"},
        schemas={"part": "part_sections"},
        quantities={"dimensions": "dimension_quantity"},
    ),
    _here(
        "splines",
        commands={
            "spline": Command(
                "spline_command",
                "fit a spline with prescribed values and slopes to measured errors",
            ),
        },
        functions=_from("interface", "spline"),
    ),
    _here(
        "pages",
        functions=_from("interface", "page") | _from("joint_table", "joint_table"),
        services=_from("joint_table", "JointTable"),
    ),
    _here(
        "sweeps",
        commands={
            "sweep": Command(
                "sweep_command",
                "compute a family of experiments into a store, and write its results",
                "plan",
            ),
            "sweep --report": Command(
                "report_command", "results of a store as an HTML page, or a table"
            ),
            "sweep --export": Command("export_command", "results of a store as CSV or Parquet"),
        },
        functions={
            **_from("interface", "stored", "sweep"),
            **_from("running", "OtherSweepError"),
            **_from("store_file", "StoreError"),
        },
        schemas={"sweep": "sweep_schema"},
    ),
    _here(
        "ci",
        services=_from("github", "annotation_lines") | _from("junit", "junit_report"),
    ),
    _here(
        "studio",
        commands={
            "studio": Command(
                "studio_command",
                "open a design in the browser, to move and change it and see its uncertainties",
                "plan",
            ),
        },
    ),
    _here(
        "reproduction",
        commands={
            "reproduce": Command(
                "reproduce_command",
                "compute published experiments, and compare the figures",
            ),
        },
        functions=_from("interface", "reproduce"),
    ),
)
