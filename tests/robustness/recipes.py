"""Command lines that do something, in the folder that `kit` fills: what cases start from."""

from __future__ import annotations

RECIPES = (
    "check small.yaml",
    "check --fail-weak bar-bell.yaml",
    "check --suggest deficient.yaml",
    "check --format github --no-modules tables.yaml small.yaml",
    "check --format junit splines.yaml",
    "check --json --goal lengths --share 95% small.yaml",
    "check --goal 'U6 average 1 um' --goal tasks small.yaml",
    "check --variant 'radius known' bryan-gauge.yaml",
    "check 'sm*.yaml'",
    "run tables.yaml --report out.html",
    "run --json small.yaml",
    "run bryan-gauge.yaml --variant 'radius known' --report out.html",
    "run small.yaml --trials 4 --seed 3 --workers 1",
    "run bar-bell.yaml --variant 'length known' --until 30% --trials 20 --workers 1",
    "plan pool.yaml --positions 2 --workers 1 -o out.yaml --sheet sheet.html",
    "plan pool.yaml --hours 2 --criterion A --curve --workers 1 --sheet sheet.html",
    (
        "plan pool.yaml --done planned-readings.csv --from planned.yaml --positions 1 --workers 1"
        " --json"
    ),
    (
        "plan pool.yaml --done planned-readings.csv --from planned.yaml --moved --readings 12 --workers 1 --sheet"
        " sheet.html -o out.yaml"
    ),
    "next small.yaml small-readings.csv",
    "next planned.yaml planned-readings.csv --goal 'U6 average 1 um' --json",
    "next tables.yaml tables-readings.csv --target '5 um' --share 95%",
    "reach small.yaml --by repeatability --goal 'U6 average 1 um' --fail",
    "reach small.yaml --by certificate --target '5 um' --json",
    "reach bar-bell.yaml --variant 'length known' --by certificate --calibration 0 --artefact bar",
    "reach small.yaml --by repeats --goal tasks",
    "'run --errors' small.yaml",
    "'run --errors' tables.yaml --json",
    "'run --reliability' small.yaml -o out.csv",
    "'run --reliability' tables.yaml --false-alarm 1% --power 90% --sigma given --json",
    "simulate small.yaml -o out.csv --certificate certificate.csv --seed 4",
    "simulate tables.yaml -o - --exact",
    "simulate splines.yaml --variant plain -o old.csv --force",
    "fit small.yaml small-readings.csv --certificate small-certificate.csv --report out.html",
    (
        "fit tables.yaml tables-readings.csv --certificate tables-certificate.csv --sigma estimated"
        " --json"
    ),
    "fit splines.yaml splines-readings.csv --variant plain --monomials",
    "fit small.yaml small-readings.csv --estimator distances --pairs corners --across-probes",
    "fit bar-bell.yaml bar-bell-readings.csv --variant 'length known' --estimator length-equations",
    (
        "fit bryan-gauge.yaml bryan-gauge-readings.csv --variant 'radius known' --estimator"
        " sphere-then-metric --json"
    ),
    (
        "fit dummy.yaml dummy-readings.csv --variant 'with scale' --estimator reversal --scale x"
        " --no-offsets"
    ),
    "fit dummy.yaml dummy-readings.csv --variant 'with scale'",
    "reach angles.yaml --variant 'any angles' --by balls --goal 'U6 average 1 um'",
    "fit angles.yaml angles-readings.csv --variant 'any angles' --plot out.svg",
    "certificate small.yaml small-readings.csv --sigma given -o out.html",
    (
        "certificate small.yaml small-readings.csv -o out.xml --about date=2026-11-02 --about"
        " country=DE --json"
    ),
    "certificate tables.yaml tables-readings.csv -o out.csv --datum all --coverage-factor 3",
    "fit small.yaml small-readings.csv -o new.yaml --date 2026-11-22",
    "correct map.yaml to-correct.csv --length A B --tasks small.yaml",
    "correct again.yaml to-correct.csv -o out.csv --covariance covariance.csv --coverage-factor 3 --json",
    "correct map.yaml small-readings.csv --probe right --with-repeatability",
    "diff map.yaml again.yaml --grid 2 -o out.csv",
    "diff machine.yaml map.yaml --stated '1 um + L/1000000' --json",
    "diff map.yaml again.yaml --grid 2 --plot out.svg --dates 2025-01-01 2026-01-01 --fail",
    "models small.yaml small-readings.csv --coefficients 3",
    (
        "models tables.yaml tables-readings.csv --certificate tables-certificate.csv --sigma given"
        " --coefficients 3 --json"
    ),
    "validate small.yaml small-readings.csv --sigma estimated",
    (
        "diff tables.yaml tables.yaml --readings tables-readings.csv tables-again.csv"
        " --shared certificate --json"
    ),
    "compare small.yaml --trials 2 --points 5 --pairs braced --seed 2",
    (
        "compare bar-bell.yaml --variant 'length known' --trials 2 --points 5 --estimator"
        " length-equations --json"
    ),
    "sweep sweep.yaml --workers 1",
    "sweep sweep.yaml --workers 1 --store new.sqlite --retry-failed --fail-fast",
    "sweep trials.yaml --workers 1 --beside --folder folder",
    "sweep ranges.yaml --dry-run",
    "sweep subsets.yaml --dry-run --workers 1",
    "sweep variants.yaml --dry-run --workers 1",
    "'sweep --export' sweep.sqlite -o out.csv",
    "'sweep --export' trials.sqlite -o out.parquet --sweep 1",
    "'sweep --export' trials.sqlite -o -",
    "'sweep --report' sweep.sqlite -o out.html",
    "'sweep --report' sweep.sqlite --format markdown",
    "'sweep --report' trials.sqlite --format latex",
    "'sweep --report' trials.sqlite --format text",
    "sheet small.yaml",
    "sheet small.yaml -o sheet.html --readings template.csv --points out.csv",
    "import z-low.dmo --for quickstart.yaml -o out.csv",
    "import z-low.dmo --from dmis --unit mm -o out.csv",
    "map machine.yaml --grid 3,3,2",
    "map machine.yaml --line 'y = 300 mm, z = 200 mm' --points 3 --json",
    "map gec-like.yaml --grid 2,3,4 --format csv",
    "map gec-like.yaml --grid 2,2,2 --plot out.svg",
    "map map.yaml --grid 3,2,2 --draw 3 --seed 4",
    "map again.yaml --plane 'z = 200 mm' --grid 3,3 --probe right --plot out.svg --json",
    "map map.yaml --points to-correct.csv --format csv",
    "'map --curves' map.yaml",
    "'map --curves' again.yaml --error EXX --error EC0Y --points 5 --format csv",
    "map machine.yaml --line '0 mm, 0 mm, 0 mm to 600 mm, 500 mm, 400 mm' --plot out.svg",
    "spline curve.csv --every 3 --start-value '0 um' --end-slope '1 um/mm' --plot out.svg",
    "spline curve.csv --knots '50 mm, 100 mm' --json -o out.csv --powers global",
    "spline table-1.csv --x arc_length --y finish_error --boundary '100 mm' --points 1-30 --json",
    "spline table-1.csv --y finish_error --straight 1 --whiskers out.svg",
    (
        "spline table-1.csv --y semi_finish_error --points 1-10 --corner '44.704 mm, -114.554 mm'"
        " --straight 1 --straight 2 --knots none --compensated out.csv"
    ),
    "reproduce npl --designs npl --experiment 5.2 --quick",
    "schema machine",
    "schema sweep",
    "'run --budget' small.yaml --by position",
    "'run --budget' tables.yaml tables-readings.csv --certificate tables-certificate.csv --json",
    "init out.yaml",
    "init --machine out.yaml",
)
