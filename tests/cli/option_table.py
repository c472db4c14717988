"""What each option of each command does: a command line, the option, and a text of its outcome that
is there with the option and not without it, or behind "without: " the other way round.

The outcome is the status, both outputs, and the files written; the folder is that of `option_kit`.
"""

from __future__ import annotations

from tests.robustness.recipes import DUMMY, RECIPES

FIT = "plate.yaml plate.csv"
SHEET = {
    "--machine-type": "'fixed bridge'",
    "--volume": "'600 600 500 mm'",
    "--mpe": "'1 um + L/300'",
    "--plate": "'4 x 4, 300 mm'",
    "--certificate": "'0.4 um + 0.5 um/m, k=2'",
}


def init(*left_out: str) -> str:
    """A data sheet, less the options left out."""
    stated = (f"{name} {value}" for name, value in SHEET.items() if name not in left_out)
    return " ".join(["init out.yaml", *stated])


PLAN = "plan pool.yaml --workers 1"
PLATE = "plate.yaml --by repeatability"
CERTIFICATE = "--certificate plate-certificate.csv"
MAPS = "diff map.yaml again.yaml --grid 2"
POINTS = "correct map.yaml to-correct.csv"
MACHINE = "map machine.yaml --grid 2,2,2"
LINE = "map machine.yaml --line 'y = 300 mm, z = 200 mm'"
SWEEP = "sweep sweep.yaml --workers 1"
NPL = "reproduce npl --quick --experiment 5.2"
REVERSAL = "fit dummy.yaml dummy-readings.csv --variant 'with scale' --estimator reversal"

TABLE: tuple[tuple[str, str, str], ...] = (
    ("init out.yaml", "--machine", "title: moving bridge"),
    (init(), "--example", "--example take no data sheet"),
    ("init out.yaml --example", "--quiet", "without: out.yaml written"),
    (init(), "--tips one", "# A single tip does not show"),
    (init(), "--repeatability '0.7 um'", "repeatability: 0.7 um"),
    (init(), "--temperature '0.3 K'", "0.3 K"),
    (init(), "--target '3 um'", "target_uncertainty: 3 um"),
    (init(), "--hours 3", "ballplate plan out.yaml --hours 3"),
    *((init(name), f"{name} {value}", "status 0") for name, value in SHEET.items()),
    ("check pair.yaml", "--variant coarse", "without: pair[plain]"),
    ("check plate.yaml", "--format junit", '<testsuite name="plate.yaml"'),
    ("check deficient.yaml", "--suggest", "repair 1, in the file: positions[z high]"),
    ("check deficient.yaml", "--fix", "--file deficient.yaml"),
    ("check plate.yaml", "--goal 'U6 average 0.1 um'", "status 1"),
    ("check plate.yaml --goal lengths", "--share 50%", "50 % of lengths (U6)"),
    ("check certified/weak.yaml", "--fail-weak", "status 1"),
    ("run pair.yaml", "--variant coarse", "without: pair[plain]"),
    ("run plate.yaml", "--trials 4", "Monte Carlo: 4 data sets"),
    ("run plate.yaml --trials 1000 --workers 1", "--until 30%", "without: 1000 data sets"),
    ("run plate.yaml --trials 2 --workers 1", "--seed 5", "seed 5"),
    ("run plate.yaml", "--assumptions", "influences:"),
    ("run plate.yaml", "--report out.html", "<html"),
    ("run plate.yaml", "--errors", "U6 without, µm"),
    ("run plate.yaml", "--budget", "calibration[0]: distances of plate"),
    ("run plate.yaml", "--reliability", "minimal detectable bias"),
    ("plan twice.yaml --positions 2 --workers 1", "--variant coarse", "twice[coarse]"),
    (f"{PLAN} --positions 2", "--criterion D", "semi-axes of the parameters'"),
    (f"{PLAN} --positions 3", "--hours 1", "0.97"),
    (f"{PLAN} --hours 3", "--positions 2", "no more than 3 h, 2 positions"),
    (f"{PLAN} --positions 3", "--readings 12", "no more than 12 readings, 3 positions"),
    (f"{PLAN} --from planned.yaml --positions 1", "--done planned-readings.csv", "status 0"),
    (f"{PLAN} --from planned.yaml --positions 1 --done begun.csv", "--moved", "it is left so"),
    (f"{PLAN} --positions 2", "--from planned.yaml", "chosen before"),
    (f"{PLAN} --positions 2", "-o out.yaml", "# Chosen by ballplate plan from pool.yaml"),
    (f"{PLAN} --positions 2", "--sheet out.html", "--file out.html"),
    (f"{PLAN} --positions 2", "--curve", "3 positions   1.331"),
    (f"{PLAN} --positions 2", "--plot out.svg", "positions P1, P2 in the volume"),
    (f"{PLAN} --positions 2 -o out.yaml", "--quiet", "without:  written\n"),
    ("simulate pair.yaml -o -", "--variant coarse", "position,ball,probe"),
    ("simulate plate.yaml -o -", "-o out.csv", "--file out.csv"),
    ("simulate plate.yaml -o -", "--certificate out.csv", "certificate values of plate"),
    ("simulate plate.yaml -o - --certificate out.csv", "--seed 9", "seed 9"),
    ("simulate plate.yaml -o -", "--exact", "low,r1c1,down,50.0,50.0,150.0"),
    ("simulate plate.yaml -o out.csv", "--quiet", "without: readings written to out.csv"),
    (f"fit {FIT}", CERTIFICATE, "sigma = 0.9194"),
    (f"fit {FIT}", "--sigma given", "(as given)"),
    ("fit small.yaml small-readings.csv", "--monomials", "EXX t^2"),
    (f"fit {FIT}", "--estimator distances", "22 pairs of balls, 180 terms"),
    (f"fit {FIT} --estimator distances", "--pairs neighbours", "12 pairs of balls"),
    (f"fit {FIT} --estimator distances", "--across-probes", "252 terms"),
    (REVERSAL, "--scale y", "scale difference: y"),
    (REVERSAL, "--no-offsets", "three parameters, no offsets"),
    (f"fit {FIT}", "--plot out.svg", "residuals as vectors"),
    (f"fit {FIT}", "-o out.yaml", "map: 1\n"),
    (f"fit {FIT} -o out.yaml", "--date 2026-11-22", 'date: "2026-11-22"'),
    (f"fit {FIT}", "--report out.html", "<html"),
    ("compare pair.yaml --trials 2", "--variant coarse", "without: pair[plain]"),
    ("compare plate.yaml", "--trials 3", "in each of 3 data sets"),
    ("compare plate.yaml --trials 2", "--points 5", "of 5 random pairs of points"),
    ("compare plate.yaml --trials 2", "--seed 5", "0.2591"),
    ("compare plate.yaml --trials 2", "--estimator cresto", "estimator cresto"),
    ("compare plate.yaml --trials 2", "--pairs neighbours", "12 pairs of balls"),
    ("compare plate.yaml --trials 2", "--across-probes", "across probes"),
    ("schema", "--verbose", "\nnumpy "),
    ("'run --errors' pair.yaml", "--variant coarse", "pair[coarse]"),
    ("reach pair.yaml --by repeatability", "--variant coarse", "pair[coarse]"),
    ("reach plate.yaml", "--by repeats", "without: machine's repeatability"),
    (f"reach {PLATE}", "--goal 'U6 average 0.5 um'", "goal: average U6 at most 0.5 µm"),
    ("reach plate.yaml --by certificate", "--calibration 3", "the indices are 0 to 0"),
    (f"reach {PLATE}", "--share 50%", "50 % of lengths within"),
    (f"reach {PLATE}", "--target '1 um'", "at most 0.755 um"),
    ("reach tables.yaml --by certificate", "--artefact bar", "without: and 1 more"),
    ("reach tables.yaml --by certificate", "--calibration 1", "without: and 1 more"),
    (f"reach {PLATE} --target '0.01 um'", "--fail", "status 1"),
    ("sheet pair.yaml", "--variant coarse", "pair[coarse]"),
    ("sheet plate.yaml", "-o out.html", "<html"),
    ("sheet plate.yaml", "--readings out.csv", "position,ball,probe,x_mm,y_mm,z_mm\n"),
    ("sheet plate.yaml", "--points out.csv", "low,r1c1,down,50"),
    ("sheet plate.yaml --points out.dmi", "--ball-diameter '22 mm'", "50.0000,100.0000,22.0000"),
    ("sheet plate.yaml -o out.html", "--quiet", "without:  written\n"),
    (f"next {FIT}", "--goal 'U6 average 0.1 um'", "target not met"),
    (f"next {FIT} --target '0.45 um'", "--share 50%", "target met"),
    (f"next {FIT}", "--target '0.1 um'", "target not met"),
    ("import z-low.dmo -o -", "-o out.csv", "--file out.csv"),
    ("import z-low.dmo -o -", "--for plate.yaml", "ZLOW,R1C1,down"),
    ("import z-low.dmo -o - --for pair.yaml", "--variant coarse", "ZLOW,R1C1,down"),
    ("import z-low.dmo -o -", "--name '{ball}_{position}'", "R1C1,ZLOW,DOWN"),
    ("import z-low.dmo -o -", "--from calypso", "z-low.dmo:1:1: no headings"),
    ("import z-low.dmo -o out.csv", "--quiet", "without: readings written"),
    (f"models {FIT}", CERTIFICATE, "0.9194"),
    (f"models {FIT}", "--sigma given", "sigma given"),
    ("models small.yaml small-readings.csv", "--coefficients 3", "without: 4 and 4"),
    (f"validate {FIT}", CERTIFICATE, "1.09        0.29  r2c1 down z"),
    (f"validate {FIT}", "--sigma given", "chi-squared: p-value"),
    (f"'run --budget' {FIT}", CERTIFICATE, "readings                            0.455"),
    (f"'run --budget' {FIT}", "--sigma given", "readings                            0.495"),
    ("'run --budget' plate.yaml", "--by position", "readings in low"),
    ("'run --reliability' pair.yaml", "--variant coarse", "without: pair[plain]"),
    ("'run --reliability' plate.yaml", "--false-alarm 1%", "with a false alarm of 1 %"),
    ("'run --reliability' plate.yaml", "--power 90%", "with a power of 90 %"),
    ("'run --reliability' plate.yaml", "--sigma given", "sigma as given: 4.132 standard"),
    ("'run --reliability' plate.yaml", "-o out.csv", "name,kind,redundancy,"),
    (f"certificate {FIT}", CERTIFICATE, "standard uncertainty 0.293 µm/m"),
    (f"certificate {FIT}", "--sigma given", "uncertainties as stated in the experiment"),
    (f"certificate {FIT}", "-o out.csv", "--file out-covariance.csv"),
    ("certificate plates.yaml plates.csv", "--plate second", "plate: second"),
    (f"certificate {FIT}", "--datum all", "axes: all balls as close as possible"),
    (f"certificate {FIT}", "--coverage-factor 3", "uncertainty: U = 3 u"),
    (f"certificate {FIT}", "--about laboratory=Ours", "laboratory: Ours"),
    (f"certificate {FIT} -o out.csv", "--quiet", "without:  written\n"),
    (MAPS, "--grid 3", "shift along x              0.3777"),
    (MAPS, "--probe right", "measured with probe right"),
    (MAPS, "--coverage-factor 3", "U = 3 u"),
    (MAPS, "--dates 2025-01-01 2026-01-01", "µm per year"),
    ("diff machine.yaml map.yaml --grid 2", "--fail", "status 1"),
    ("diff machine.yaml map.yaml --grid 2", "--stated '100 um'", "as well known as is stated"),
    (MAPS, "-o out.csv", "kind,figure,difference,standard uncertainty"),
    (MAPS, "--plot out.svg", "<title>again less map"),
    ("diff plate.yaml plate.yaml", "--readings plate.csv plate-again.csv", "second less first"),
    (
        "diff plate.yaml plate.yaml --readings plate.csv plate-again.csv",
        "--shared certificate",
        "certified values are the same in both campaigns",
    ),
    ("correct map.yaml anonymous.csv", "--probe right", "A      right"),
    (POINTS, "--coordinates 'ball centres'", "99.995503"),
    (POINTS, "--length A B", "A to B"),
    (POINTS, "--tasks small.yaml", "along x"),
    (POINTS, "--coverage-factor 3", "U = 3 u"),
    (POINTS, "--with-repeatability", "with the noise of the corrected readings"),
    (POINTS, "-o out.csv", "name,probe,x_mm"),
    (POINTS, "--covariance out.csv", "covariance_um2,A: x"),
    ("map machine.yaml", "--grid 2,2,2", "without:   250"),
    ("map machine.yaml", "--line 'y = 300 mm, z = 200 mm'", "   40    300    200"),
    ("map machine.yaml", "--plane 'z = 200 mm'", "    0      0    200"),
    (LINE, "--points 3", "without:   40    300    200"),
    ("map map.yaml --grid 2,2,2", "--probe right", "probe right, offset (60, 0, 0) mm"),
    (MACHINE, "--draw 3", "drawn from seed 1"),
    (f"{MACHINE} --draw 3", "--seed 4", "drawn from seed 4"),
    (MACHINE, "--budget", "length error alone"),
    (MACHINE, "--plot out.svg", "<title>Volumetric errors"),
    (MACHINE, "--format csv", "x_mm,"),
    ("map machine.yaml", "--curves", "from, mm  to, mm"),
    ("'map --curves' machine.yaml", "--error EXX", "without: EYX"),
    ("'map --curves' machine.yaml --format csv", "--points 3", "without: EYX,,20,"),
    ("'map --curves' machine.yaml", "--format csv", "EXX,,"),
    ("spline table-1.csv --y finish_error", "--x nominal_x", "finish error against nominal x"),
    ("spline table-1.csv", "--y finish_error", "finish error against arc length"),
    ("spline curve.csv", "--points 1-8", "8 points, curve from 0 mm to 140 mm"),
    ("spline curve.csv", "--every 3", "3 knots at 40, 100, 160 mm"),
    ("spline curve.csv", "--knots '50 mm, 100 mm'", "2 knots at 50, 100 mm"),
    ("spline curve.csv", "--start '-10 mm'", "curve from -10 mm"),
    ("spline curve.csv", "--end '230 mm'", "to 230 mm"),
    ("spline curve.csv", "--boundary '100 mm'", "share value and slope at 100 mm"),
    (
        "spline table-1.csv --y finish_error --knots none",
        "--corner '60 mm'",
        "features meet at a corner at 60 mm",
    ),
    ("spline curve.csv --boundary '100 mm'", "--straight 1", "feature 1 is a straight line"),
    ("spline curve.csv", "--start-value '3 um'", "prescribed: value 3 µm at 0 mm"),
    ("spline curve.csv", "--start-slope '2 um/mm'", "prescribed: slope 2 µm/mm at 0 mm"),
    ("spline curve.csv", "--end-value '3 um'", "prescribed: value 3 µm at 220 mm"),
    ("spline curve.csv", "--end-slope '2 um/mm'", "prescribed: slope 2 µm/mm at 220 mm"),
    ("spline curve.csv", "--powers global", "polynomials of u, the position, in mm"),
    ("spline curve.csv", "-o out.csv", "# error = c0 + c1 u"),
    ("spline table-1.csv --y finish_error --every 3", "--compensated out.csv", "compensated_x_mm"),
    ("spline curve.csv", "--plot out.svg", "<title>error against position"),
    ("spline table-1.csv --y finish_error", "--whiskers out.svg", "as bars normal to a profile"),
    (SWEEP, "--store out.sqlite", "out.sqlite: 6 cases, 2 done, 4 failed\n"),
    (SWEEP, "--dry-run", "0: size 250 mm, balls few"),
    (SWEEP, "--retry-failed", "4 failed (1 of them before)"),
    (f"{SWEEP} --store out.sqlite", "--fail-fast", "1 failed, 3 left"),
    ("sweep trials.yaml --workers 1 --store sweep.sqlite", "--beside", "6 cases of sweep 2"),
    ("sweep sweep.sqlite", "--report", "<html"),
    ("sweep sweep.sqlite -o out.csv", "--export", "--file out.csv"),
    ("'sweep --report' sweep.sqlite", "--sweep 2", "status 3"),
    ("'sweep --report' sweep.sqlite", "-o out.html", "--file out.html"),
    ("'sweep --report' sweep.sqlite", "--format text", "without: <html"),
    ("'sweep --export' sweep.sqlite -o -", "--sweep 2", "status 3"),
    ("'sweep --export' sweep.sqlite -o -", "-o out.csv", "--file out.csv"),
    ("reproduce npl --experiment 6.2.7 --trials 1 --quick", "--experiment 5.2", "Section 5.2"),
    (NPL, "--designs certified", "status 3"),
    ("reproduce npl --experiment 6.2.7 --trials 2", "--quick", "without: 5 x 5"),
    ("reproduce npl --experiment 6.2.7 --trials 1", "--trials 2", "1.0837"),
)

# Of the commands that take readings: how a table is written that they do not read without.
READING = {
    "fit": "full rank",
    "next": "3 positions read",
    "certificate": "scale: from certificates",
    "models": "error models on the same readings",
    "validate": "each left out in turn",
    "'run --budget'": "together, in squares",
}
TABLES = (
    ("renamed.csv", "--columns position=wo,ball=was"),
    ("unitless.csv", "--unit mm"),
    ("thousands.csv", "--decimal point"),
    ("centres.csv", "--coordinates 'ball centres'"),
    ("features.csv", "--name '{position}/{ball}/{probe}'"),
    ("blank.csv", "--fill-down"),
    ("two.xlsx", "--sheet taken"),
    ("swapped.csv", "--swap-names"),
)

# What is kept of the files of the folder `files`; readings in `wrong.csv` and `wrong-small.csv` have
# a gross error, those in `off.csv` errors that the model has not.
EFFECTS = "effects.yaml effects.csv"
LIMITED = "plan limited.yaml --workers 1"
REPORTS = ("dmis_inch.dmo", "dmis_points.dmo", "dmis_mm.dmo", "qif_3_0.qif", "qif_2_1_inch.qif")
REPORTS += ("pcdmis_inch.txt", "pcdmis_mm.txt", "calypso_chr.txt", "calypso_fet.txt")
EXPORTS = ("axes-en.csv", "merged-en.csv", "programma-it.txt", "hoja-es.csv", "plain.csv")
EXPORTS += ("kalkylblad-sv.csv", "program-en.txt", "programm-de.txt", "spreadsheet-de.csv")
READINGS = (
    "inches",
    "index",
    "part",
    "shuffled",
    "swapped",
    "centres",
    "german",
    "missing",
    "wide",
)
ABOUT = "--about date=2026-11-02 --about country=DE"
LINES = (
    "run effects.yaml --trials 4 --seed 2 --workers 1 --json",
    "run effects.yaml --assumptions --report out.html",
    *(f"{name} effects.yaml" for name in ("'run --budget'", "'run --reliability'", "sheet")),
    "'run --errors' effects.yaml",
    "reach effects.yaml --by thermometers --target '0.5 um'",
    f"fit {EFFECTS} --report out.html -o new.yaml --plot out.svg",
    f"fit {EFFECTS} --monomials --json",
    f"validate {EFFECTS}",
    f"certificate {EFFECTS} --plate plate -o out.html",
    f"next {EFFECTS} --json",
    "fit effects.yaml wrong.csv --report out.html",
    f"{LIMITED} --positions 5 --curve --sheet out.html --plot out.svg -o out.yaml",
    f"{LIMITED} --positions 3 --criterion A --json",
    "next limited-plan.yaml begun-limited.csv",
    *("check lost.yaml --json", "'run --errors' lost.yaml", "'run --reliability' lost.yaml"),
    "fit lost.yaml lost.csv --report out.html",
    *("compare pair.yaml --trials 2 --points 5", "run plate.yaml --trials 5 --workers 1 --json"),
    "fit small.yaml off.csv --report out.html --plot out.svg",
    "validate small.yaml off.csv --json",
    *(f"fit small.yaml wrong-small.csv {more}" for more in ("--report out.html", "--json")),
    "fit tables.yaml tables-again.csv --report out.html",
    "diff tables.yaml tables.yaml --readings tables-readings.csv tables-again.csv --grid 2",
    *(f"import samples/{name} --for samples/campaign.yaml -o -" for name in REPORTS),
    *(f"fit exports/plate.yaml exports/{name}" for name in EXPORTS),
    *(f"fit samples/campaign.yaml samples/{name}.csv" for name in READINGS),
    *("check mistakes.yaml", "check references.yaml", "map mistaken-machine.yaml"),
    *("sweep mistaken-sweep.yaml --dry-run", "fit small.yaml mistaken.csv"),
    "correct map.yaml mistaken.csv",
    *(f"fit {DUMMY} --estimator reversal{more}" for more in (" --json", "", " --plot out.svg")),
    "compare dummy.yaml --variant 'with scale' --estimator reversal --trials 3 --points 5 --json",
    "fit small.yaml small-again.csv --estimator kruth --json",
    "fit small.yaml small-again.csv --estimator cresto --pairs all --monomials",
    "compare small.yaml --trials 2 --points 5 --estimator kruth --json",
    "run tables.yaml --trials 4 --workers 1 --seed 3 --json",
    *(
        "run certified/weak.yaml --json",
        "check certified/weak.yaml",
        "run certified/deficient.yaml",
    ),
    "fit certified/weak.yaml certified/weak.csv --report out.html",
    "'run --budget' effects.yaml effects.csv --by position --json",
    *("map gec-like.yaml --budget --grid 2,2,2", "'map --curves' gec-like.yaml --json"),
    *(
        f"{command} shifted.yaml{more}"
        for command, more in (
            ("run", " --trials 5 --workers 1 --json"),
            ("run", " --report out.html"),
            ("'run --errors'", ""),
            ("'run --budget'", " --by position --json"),
            ("'run --reliability'", " --json"),
            ("sheet", " -o out.html --points out.dmi --ball-diameter '20 mm'"),
            ("fit", " shifted.csv --report out.html -o new.yaml --plot out.svg"),
            ("validate", " shifted.csv --json"),
            ("models", " shifted.csv"),
            ("certificate", " shifted.csv --plate few -o out.html"),
            ("next", " shifted.csv --json"),
            ("certificate", f" shifted.csv --plate large --sigma given -o out.xml {ABOUT}"),
            ("reach", " --by certificate --target '1 um'"),
            ("compare", " --trials 2 --points 5"),
        )
    ),
    *(
        f"{name} partial.csv"
        for name in ("fit small.yaml", "validate small.yaml", "next small.yaml")
    ),
    *(f"import {name} --for shifted.yaml -o -" for name in ("large-low.dmo", "sets.qif")),
    *(f"fit small.yaml {name}.csv" for name in ("numbers", "disordered", "two-tables")),
    *(
        f"fit small.yaml {name}.csv"
        for name in ("no-ball", "no-axis", "no-heads", "words", "twice")
    ),
    *(
        "next small.yaml first.csv",
        "validate small.yaml first.csv",
        "sweep variants.yaml --workers 1",
    ),
    *("simulate shifted.yaml -o -", "check --no-modules effects.yaml"),
    "fit small.yaml two-tables.csv --columns 'x=X mm,y=Y mm'",
    *(f"map shifted-machine.yaml {more}" for more in ("--grid 2,2,2 --budget", "--draw 2")),
    "'map --curves' shifted-machine.yaml",
    "run bar-bell.yaml --variant 'length unknown' --trials 4 --workers 1 --json",
    *(
        f"fit {DUMMY} --estimator reversal {more}"
        for more in ("--pairs all", "--across-probes", "--monomials", "--no-offsets --scale none")
    ),
    *(f"fit {DUMMY} {more}" for more in ("--scale x", "--no-offsets")),
    "fit tables.yaml tables-readings.csv --estimator reversal",
    *(
        "simulate bar-bell.yaml -o out.csv",
        "check doubtful.yaml",
        "check bar-bell.yaml --variant long",
    ),
    "compare dummy.yaml --variant 'with scale' --pairs braced",
    "check --suggest certified/weak.yaml",
    *(f"check --suggest {name}.yaml" for name in ("bar-bell", "bryan-gauge", "angles", "limited")),
    *(f"check --suggest --format {form} deficient.yaml" for form in ("github", "junit", "json")),
    *("sheet tables.yaml -o out.html", "sheet angles.yaml --variant 'any angles' -o out.html"),
    "fit small.yaml wrong-small.csv -o new.yaml",
    "check --suggest --json small.yaml --goal 'U6 average 0.3 um'",
    "sweep reasons.yaml --workers 1",
    "reach limited.yaml --by hours --target '3 um'",
    *(f"reproduce npl --quick --trials 2 --experiment {name}" for name in ("6.1.2", "6.2.5")),
    "init out.yaml --machine-type 'horizontal arm' --volume '1 x 2.5 x 1.5 m' --mpe '15 um + L/100'"
    " --plate '5 x 5, 600 mm' --certificate '1 um, k=2' --hours 6",
)

# Actions of the studio upon a design, and what its page then asks for.
STUDIO = "studio: "
ACTIONS = tuple(
    f"{STUDIO}{line}"
    for line in (
        'small.yaml later {"do": "move", "position": "high", "by": [0.01, -0.02, 0.05]}',
        'small.yaml matrix {"do": "turn", "position": "x low"}',
        'small.yaml preview {"do": "stand", "position": "low", "across": "y"}',
        'small.yaml drawn {"do": "copy", "position": "y low", "map": "points"}',
        'lost.yaml drawn {"do": "put", "motion": 1, "map": "lengths"}',
        'effects.yaml drawn {"do": "put", "like": "low", "at": [0.3, 0.2, 0.2], "map": "lengths"}',
        'effects.yaml drawn {"do": "remove", "position": "high"}',
        'effects.yaml later {"do": "off", "position": "y low"}',
        'effects.yaml preview {"do": "probes", "position": "low", "probes": ["down", "right"]}',
        'small.yaml preview {"do": "balls", "position": "low", "balls": ["r1c1", "r1c3", "r3c2"]}',
        'small.yaml later {"do": "set", "path": ["machine", "volume", 2], "value": "350 mm"}',
        'mistakes.yaml later {"do": "set", "path": ["seed"], "value": "2"}',
        'references.yaml later {"do": "off", "position": "big"}',
        'limited.yaml pool {"do": "fill", "probes": {"z": ["down"], "x": ["right"]}, "quarter_turns": [0, 1], "count": 2}',
        'limited.yaml pool {"do": "forbid", "corner": ["low", "high", "low"]}',
        'small.yaml later {"do": "fit"}',
        'certified/deficient.yaml suggest {"do": "set", "path": ["seed"], "value": 3}',
        'small.yaml next {"do": "remove", "position": "y high"}',
        'limited.yaml next {"do": "off", "position": "z low"}',
        'shifted.yaml next {"do": "off", "position": "few 2"}',
        'limited.yaml plan {"do": "off", "position": "z low", "hours": 2}',
        'small.yaml monte carlo {"do": "turn", "position": "high", "trials": 4}',
        'shifted.yaml drawn {"do": "move", "position": "few 2", "by": [0.01, -0.02, 0.05]}',
    )
)

DUMMY_TURNED = (
    "load('dummy.yaml', 'with scale').with_({'positions[0].pose.rotation': '-89.9 deg',"
    " 'machine.repeatability': '0.5 um'})"
)
JOINED = {
    **{f"artefacts.{name}.role": "plate" for name in ("bar", "rod")},
    "priors": [{"kind": "map", "file": "shifted-map.yaml", "inflation": 2.0}],
    "influences": [
        {"kind": "drift", "axes": {"standard_uncertainty": "0.5 um/h"}},
        {"kind": "sag", "artefact": "large", "value": "1 um", "standard_uncertainty": "0.4 um"},
    ],
}
UNKNOWN = {"offset": ["60 mm", "0 mm", "0 mm"], "unknown": True}
AT_ONE_POINT = {"down": ["0 mm", "0 mm", "0 mm"]}
SIZED = "load('small.yaml').with_({'artefacts.plate.size[0]': '%s'})"
UNKNOWNS = ("size", "repeatability", "repeats", "certificate", "offsets", "thermometers")
CORNER = {"x": "50 mm", "y": "50 mm"}
FLAT = [
    {"name": f"at {z}", "plane": "z", "level": f"{z} mm", "corner": CORNER, "probes": ["down"]}
    for z in (100, 300)
]
# Expressions of Python with the names of the package.
PYTHON = "python: "
EXPRESSIONS = tuple(
    f"{PYTHON}{line}"
    for line in (
        "diff('map.yaml', 'again.yaml', dates='2025-01-01')",
        "diff('map.yaml', 'again.yaml', grid=6, dates=('2025-01-01',))",
        "plan('pool.yaml', positions=2, hours=-1.0)",
        "run('small.yaml', until=0.0)",
        "run('small.yaml', until=0.2, trials=0)",
        "reach('small.yaml', unknowns=['repeats', 'repeatability'], target='1 um', share=0.8)",
        "reach('tables.yaml', unknowns='certificate', calibration=7)",
        "reliability('small.yaml', false_alarm=0.0)",
        "reliability('small.yaml', power=1.0)",
        "fit('small.yaml', 'small-readings.csv', estimator='cresto', pairs='corners')",
        "fit('small.yaml', 'small-readings.csv', offsets=False)",
        "fit('small.yaml', simulate('shifted.yaml'))",
        "compare_models('small.yaml', 'small-readings.csv', coefficients=0)",
        "correct('map.yaml', [[0.1, 0.2, 0.3], [0.4, 0.2, 0.1]], probe='down', lengths=[(0, 1)])",
        "correct('map.yaml', [[0.1, 0.2]], probe='up')",
        "curves('map.yaml', errors=['EXX', 'EBY'], points=3)",
        "map('machine.yaml', grid=(2, 1, 2))",
        "map('map.yaml', points=[[0.1, 0.2, 0.3]], draw=2, seed=3, probe='right')",
        "spline('curve.csv', every=3, knots='50 mm')",
        "information('small.yaml', added=[quickstart()])",
        "simulate('small.yaml', exact=True).describe().to_dict()",
        "check('shifted.yaml', goals=['U6 average 0.1 um', 'U5'], share=2.0)",
        "load('small.yaml').with_({'machine.repeatability': '1 m', 'probes.up': []})",
        "load_map('small.yaml')",
        *(f"load('small.yaml').with_({{'positions[0].quarter_turns': {k}}})" for k in (90, -90)),
        "read_report('z-low.dmo', 'quickstart.yaml', unit='ft')",
        "budget('shifted.yaml', by='probe')",
        *(
            f"check(load('small.yaml').with_({change}), suggest=True)"
            for change in (
                {"calibration": [], "probes.right": UNKNOWN},
                {f"positions[{k}].probes": ["down"] for k in (2, 4)},
                {"error_model": {"kind": "metric"}, "probes": AT_ONE_POINT, "positions": FLAT},
                {"calibration[0].pairs": "corners", "positions": FLAT},
            )
        ),
        *(
            f"fit('small.yaml', simulate('small.yaml').assign({change}))"
            for change in (
                "x_mm=lambda t: t.x_mm * (1 + 2e-5 * (t.position == 'high'))",
                "y_mm=lambda t: t.y_mm + 0.004 * (t.probe == 'right')",
                "z_mm=lambda t: t.z_mm + 0.003 * (t.position == 'low') * (t.ball == 'r2c2')",
                "x_mm=lambda t: t.x_mm + 4e-5 * t.index",
                "y_mm=lambda t: t.y_mm + 1e-5 * t.x_mm",
                "z_mm=lambda t: t.z_mm + 2e-8 * t.x_mm**2 * (t.z_mm > 200)",
                "x_mm=lambda t: t.x_mm + 0.003 * (t.index > 40)",
            )
        ),
        "run(load('small.yaml').with_({'priors': [{'kind': 'map', 'file': 'suspect.yaml'}]}))",
        *(
            f"load('small.yaml').with_({{{key!r}: 1}})"
            for key in ("calibration[corners].pairs", "positions[hihg].level", "seed[2]", "seeed")
        ),
        *(f"compare_models('{name}.yaml', '{name}.csv')" for name in ("lost", "effects")),
        "fit('small.yaml', simulate('small.yaml').rename(columns=lambda n: n.replace('_mm', '_m')))",
        *(f"fit({SIZED % side}, 'small-readings.csv')" for side in ("270 mm", "299 mm", "3 m")),
        "compare_models('small.yaml', 'small-readings.csv', coefficients=12)",
        "check('lost.yaml', goals=['U6 average 1 um', 'tasks', 'lengths', 'U1 maximum 1 um'])",
        *(f"reach('small.yaml', unknowns={name!r}, target='0.35 um')" for name in UNKNOWNS),
        "diff('suspect.yaml', 'map.yaml', dates=('2024-01-01', '2026-02-03'))",
        "curves('shifted-map.yaml', points=4)",
        *(f"correct('{name}.yaml', 'to-correct.csv')" for name in ("suspect", "map", "machine")),
        "page('shifted.yaml')",
        "page(fit('small.yaml', 'off.csv'))",
        "page(validate('small.yaml', 'wrong-small.csv'))",
        "service('sheet_questions')()",
        *(
            f"service('sheet_draft')(Path('x.yaml'), {answers})"
            for answers in (
                {},
                {"machine_type": "gantry", "volume": "2.1 x 1.3 x 0.7 m", "tips": "one"},
                {"plate": "3 x 9, 200 mm", "certificate": "none", "target": "2 um + L/1"},
                {"machine_type": "horizontal arm", "temperature": "0.5 K", "mpe": "3 um + L/200"},
            )
        ),
        *(f"{name}('effects.yaml')" for name in ("assumptions", "budget", "sheet", "reliability")),
        *(f"{name}('small.yaml', 'off.csv')" for name in ("fit", "validate", "compare_models")),
        "diff('shifted-map.yaml', 'again.yaml', grid=2)",
        "spline('curve.csv', boundary=['100 mm'], end_slope='1 um/mm')",
        "stored('trials.sqlite')",
        "read_report('large-low.dmo', 'shifted.yaml')",
        "run('small.yaml', trials=4)",
        "fit(x := load('angles.yaml', 'quarter turn'), simulate(x), estimator='reversal')",
        f"fit(x := {DUMMY_TURNED}, simulate(x), estimator='reversal', sigma='given')",
        "fit(x := load('small.yaml').with_({'error_model': {'kind': 'metric'}}), simulate(x))",
        f"fit(x := {DUMMY_TURNED}, simulate(x), estimator='reversal', scale='y')",
        f"fit(x := {DUMMY_TURNED}, simulate(x), estimator='reversal', offsets=False)",
        f"compare(x := {DUMMY_TURNED}, estimator='reversal', trials=2, points=4)",
        f"run(x := load('shifted.yaml').with_({JOINED}))",
        f"fit(x := load('shifted.yaml').with_({JOINED}), simulate(x))",
        *(
            f"run(load('small.yaml').with_({{{change}}}))"
            for change in (
                "'error_model': {'kind': 'empirical', 'coefficients': 3, 'terms': 'sums'}",
                "'error_model.arrangement': 'CX1', 'error_model.rotations': 'full'",
                "'error_model': {'kind': 'metric'}, 'probes.right': {'offset': ['60 mm', '0 mm', '0 mm'], 'unknown': True}",
                "'true_machine': None, 'calibration': [], 'positions[1].balls': ['r1c1', 'r3c3']",
                "'positions[2].probes': ['right'], 'expected_rank_deficiency': 2",
            )
        ),
        "plan(load('limited.yaml').with_({'pool.times.set_up': '1 h'}), hours=5.0)",
        "plan('limited.yaml', readings=60, criterion='U5-maximum')",
        "run(load('splines.yaml', 'plain'))",
        "run(load('splines.yaml', 'tensor'))",
        "fit(x := load('splines.yaml', 'tensor'), simulate(x))",
    )
)

# What else is written as data.
AS_DATA = (
    "run",
    "fit",
    "plan",
    "check",
    "compare",
    "next",
    "reach",
    "certificate",
    "models",
    "map",
)
AS_DATA += ("validate", "diff", "correct", "spline", "'run", "'map", "init", "sheet")
AGAIN = tuple(
    f"{line} --json"
    for line in (*RECIPES, *LINES)
    if line.split()[0] in AS_DATA and not {"--json", "--format", "hours"} & {*line.split()}
)
KEPT = (*RECIPES, *LINES, *ACTIONS, *EXPRESSIONS, *AGAIN)
