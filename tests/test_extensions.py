"""Extensions: the kernel imports none, each imports few others, and without any of them the basic
commands work and what is missing is named.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.extensions import SHIPPED
from ballplate.simulator.inputs import extensions
from ballplate.simulator.inputs.extensions import KINDS, Extension

from tests.reference.installed_extension import LABORATORY
from tests.test_architecture import EXTENSIONS, arrows, trees

TOP = Path(__file__).parents[1]
QUICKSTART = "designs/quickstart.yaml"
NAMES = tuple(extension.name for extension in SHIPPED)

# What an extension takes from another one, and why that is no part of the kernel.
BUILDS_ON = {
    ("campaign", "requirements"): "the next position is chosen for the goals of `reach`",
    ("judgement", "diagnosis"): "the residuals of each model are searched as those of a fit",
    ("certificates", "laboratory"): "both read XML",
    ("certificates", "influences"): "a certificate states the temperature of its plate",
    ("reproduction", "estimators"): "published comparisons of estimators are reproduced",
    ("diagnosis", "influences"): "influences that are not stated are searched in readings",
    ("maps", "diagnosis"): "certificates in common act on fits as gross errors do",
    ("maps", "machine_files"): "machine files are maps that are drawn and compared, too",
    ("parts", "maps"): "dimensions are of points corrected by a map, and of drawn machines",
    ("parts", "machine_files"): "parts and tests are measured on the machine of a map",
    ("parts", "pages"): "the page of a part is a page",
    ("campaign", "machine_files"): "the next position knows of earlier campaigns' maps",
    ("certificates", "machine_files"): "a certificate names its readings as a map does",
    ("judgement", "machine_files"): "each position is left out with the sigmas of prior maps",
    ("campaign", "planning"): "run sheets are of the steps of a plan, and plans begun are read",
    ("requirements", "planning"): "the hours that meet a target are those of plans",
    ("repair", "planning"): "what repairs a design is chosen as positions of a plan are",
    ("drafting", "planning"): "the hours of a draft's positions are those of plans",
    ("repair", "drafting"): "a design is compared with the strategies of drafts",
    ("studio", "planning"): "the studio plans",
    ("pages", "campaign"): "the page of a design has its run sheet",
    ("pages", "maps"): "the page of a design has its map of lengths",
    ("pages", "diagnosis"): "pages show how gross errors would act",
    ("studio", "maps"): "the studio shows the map of lengths in the volume",
    ("studio", "pages"): "the studio moves designs as pages do",
    ("sweeps", "pages"): "the page of a sweep is a page",
    ("sweeps", "estimators"): "an axis of estimators compares them with the full one",
    ("sweeps", "planning"): "cases choose their positions as plans do, and cost hours",
    ("studio", "repair"): "the studio writes changes into the file as repairs are written",
    ("studio", "sweeps"): "the studio computes sweeps and shows their page",
}


# What has no table of public names: all of it is public, or only its path is asked for.
WHOLE = ("ballplate", "ballplate.arguments", "ballplate.designs", "ballplate.simulator")
# Public names that serve extensions of others, such as that of a laboratory.
FOR_OTHERS = {
    alias.name
    for path in LABORATORY.rglob("*.py")
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    if isinstance(node, ast.ImportFrom) and f"{node.module}".startswith("ballplate.")
    for alias in node.names
}


def extension_of(path: Path) -> str:
    """The extension of a module; empty of one of the kernel."""
    return path.parts[2] if EXTENSIONS in path.parents and len(path.parts) > 3 else ""


def texts(path: Path) -> Iterator[str]:
    """The texts in a module that are no docstrings."""
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(trees()[path])
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(trees()[path]):
        if isinstance(node, ast.Constant) and id(node) not in docstrings:
            yield str(node.value)


def test_the_kernel_imports_no_extension() -> None:
    for path, found in arrows().items():
        if not extension_of(path):
            assert not [other for other in found if extension_of(other)], path
            assert not [text for text in texts(path) if "ballplate.extensions." in text], path


def test_extensions_build_on_few_others() -> None:
    between = {
        (extension_of(path), extension_of(other))
        for path, found in arrows().items()
        for other in found
        if extension_of(path) and extension_of(other)
    }
    assert {pair for pair in between if pair[0] != pair[1]} == set(BUILDS_ON)


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """Packages or modules, and names that a module of an extension imports from them."""
    package = ("ballplate", *path.parts[1:-1])
    for node in ast.walk(trees()[path]):
        if isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else ()
            for alias in node.names:
                yield ".".join((*above, *filter(None, [node.module]))), alias.name
        elif isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)


def test_extensions_import_public_names_alone() -> None:
    """Of at most twenty packages, the face, and what reads the arguments of functions."""
    used = dict[str, set[str]]()
    for path in filter(extension_of, trees()):
        for module, name in imports(path):
            if module.startswith("ballplate") and not module.startswith("ballplate.extensions."):
                used.setdefault(module, set()).add(name)
    assert len(used) <= 22, sorted(used)
    for module in set(used) - set(WHOLE):
        package = import_module(module)
        public = set(package.__all__)
        assert used[module] <= public and public - {"main"} <= used[module] | FOR_OTHERS, module
        assert all(hasattr(package, name) for name in public), module


def test_no_extension_imports_another_by_its_name() -> None:
    for path in trees():
        if extension_of(path):
            assert not [text for text in texts(path) if "ballplate.extensions." in text], path


def test_each_folder_is_an_extension() -> None:
    folders = {extension_of(path) for path in trees()} - {""}
    assert folders == set(NAMES) and len(NAMES) == len(folders)


@pytest.mark.parametrize("extension", SHIPPED, ids=NAMES)
def test_what_the_table_names_is_there(extension: Extension) -> None:
    for name, listed in extension.commands.items():
        command = extension.load(listed.module)
        assert listed.help and command.DESCRIPTION and command.run and command.add_options, name
    for name, module in extension.functions.items():
        assert callable(getattr(extension.load(module), name)), name
    for name, module in extension.services.items():
        assert hasattr(extension.load(module), name), name
    for module in extension.schemas.values():
        assert extension.load(module).schema()


def test_no_name_is_provided_twice() -> None:
    for kind in KINDS:
        names = extensions.names(kind)
        assert len(names) == len(set(names)), kind


# What others build on.
SOME = ("campaign", "influences", "laboratory", "maps", "diagnosis", "requirements")

WITHOUT = """
import sys
from importlib.abc import MetaPathFinder

class Missing(MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if any(f"{name}.".startswith(f"ballplate.extensions.{one}.") for one in sys.argv[3:]):
            raise ModuleNotFoundError(f"{name} is hidden", name=name)

sys.meta_path.insert(0, Missing())
from ballplate.cli import main

quickstart = "designs/quickstart.yaml"
for line in (
    ["check", quickstart],
    ["run", quickstart],
    ["run", quickstart, "--trials", "4"],
    ["simulate", quickstart, "-o", sys.argv[1]],
    ["simulate", quickstart, "-o", sys.argv[1], "--force"],
    ["fit", quickstart, sys.argv[1]],
):
    assert main([*line, "--quiet"]) == 0, line

import ballplate as bp
import contextlib, io, warnings
from ballplate.extensions import SHIPPED

fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
unsearched = [text for text in fit.warnings if "not looked for" in text]
hidden = {"laboratory", "diagnosis", "influences"} & {*sys.argv[3:]}
assert len(unsearched) == ("laboratory" in hidden) + bool(hidden), fit.warnings
assert all(any(f"extension {name}" in text for name in hidden) for text in unsearched)
assert fit.converged and "<table" in fit._repr_html_() and "<table" in bp.check(quickstart)._repr_html_()
with contextlib.suppress(SystemExit):
    main(["--help"])
assert main(["schema"]) == 0
with open(quickstart, encoding="utf-8") as file:
    text = file.read().replace("position_coefficients", "position_coeficients")
with open(sys.argv[2], "w", encoding="utf-8") as file:
    file.write(text)
told = io.StringIO()
with contextlib.redirect_stderr(told):
    assert main(["check", sys.argv[2]]) == 3
assert "position_coeficients: unknown key" in told.getvalue(), told.getvalue()
told = io.StringIO()
with contextlib.redirect_stderr(told):
    status = main(["run", quickstart, "--report", sys.argv[1] + ".html"])
assert status == 0 or "is not installed" in told.getvalue(), told.getvalue()
assert not hasattr(bp, "nosuch")
missing = {name for one in SHIPPED if one.name in sys.argv[3:] for name in one.functions}
assert not missing & {*dir(bp)} and {"fit", "check"} <= {*dir(bp)}
for one in SHIPPED:
    if one.name in sys.argv[3:]:
        for command in one.commands:
            told = io.StringIO()
            with contextlib.redirect_stderr(told):
                assert main([command, "--help"]) == 2
            assert f"the extension {one.name} is not installed" in told.getvalue()
        for function in one.functions:
            try:
                getattr(bp, function)
            except bp.MissingExtensionError as error:
                assert one.name in str(error) and not hasattr(bp, function)
            else:
                raise AssertionError(function)
"""

OPTIONS = {
    "repair": (["check", "designs/quickstart.yaml", "--suggest"],),
    "requirements": (["check", "designs/quickstart.yaml", "--goal", "U6 average 1 um"],),
    "pages": (["run", "designs/quickstart.yaml", "--report", "page.html"],),
    "judgement": (["run", "designs/quickstart.yaml", "--budget"],),
    "campaign": (["plan", "POOL", "--positions", "6", "--sheet", "sheet.html"],),
    "laboratory": (["fit", "designs/quickstart.yaml", "designs/reports/z-low.dmo"],),
    "influences": (["check", "tests/cli/files/effects.yaml"],),
    "planning": (["check", "POOL"],),
    "machine_files": (["check", "designs/park/plate.yaml"],),
    "own_models": (["check", "OWN"],),
    "estimators": (["fit", "designs/quickstart.yaml", "READINGS", "--estimator", "distances"],),
    "sweeps": (["schema", "sweep"],),
    "maps": (["map", "designs/park/machines/npl-like.yaml", "--curves"],),
    "certificates": (
        ["fit", "designs/quickstart.yaml", "READINGS", "--certificate", "values.csv"],
        ["simulate", "designs/quickstart.yaml", "-o", "again.csv", "--certificate", "values.csv"],
    ),
    "assumptions": (["run", "designs/quickstart.yaml", "--assumptions"],),
    "ci": (
        ["check", "designs/quickstart.yaml", "--format", "github"],
        ["check", "designs/quickstart.yaml", "--format", "junit"],
    ),
}

POOL = """
pool:
  candidates:
    - {name: low, plane: z, level: 100 mm, corner: {x: 0 mm, y: 0 mm}, probes: [down]}
"""


@pytest.mark.parametrize(
    "hidden",
    [NAMES, SOME, *(pytest.param((name,), marks=pytest.mark.long) for name in NAMES)],
    ids=["every one", "those that pages need", *NAMES],
)
def test_the_kernel_works_without(hidden: tuple[str, ...], tmp_path: Path) -> None:
    quickstart = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    (tmp_path / "pool.yaml").write_text(quickstart + POOL, encoding="utf-8")
    files = (str(tmp_path / "readings.csv"), str(tmp_path / "pool.yaml"))
    command = [sys.executable, "-c", WITHOUT, *files, *hidden]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr


OPTION_WITHOUT = (
    WITHOUT.split("from ballplate.cli import main")[0]
    + """
from ballplate.cli import main

sys.exit(main(sys.argv[1].split("|")))
"""
)


@pytest.mark.parametrize(
    ("name", "line"), [(name, line) for name, lines in OPTIONS.items() for line in lines]
)
def test_an_option_names_the_extension_that_it_needs(
    name: str, line: list[str], tmp_path: Path
) -> None:
    quickstart = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    places = {"POOL": tmp_path / "pool.yaml", "READINGS": tmp_path / "readings.csv"}
    places["OWN"] = tmp_path / "own.yaml"
    places["POOL"].write_text(quickstart + POOL, encoding="utf-8")
    own = quickstart.replace("kind: kinematic", "kind: python")
    places["OWN"].write_text(own, encoding="utf-8")
    bp.simulate("designs/quickstart.yaml").to_csv(places["READINGS"], index=False)
    words = [
        str(places.get(word, tmp_path / word if "." in word[-5:] and "/" not in word else word))
        for word in line
    ]
    command = [sys.executable, "-c", OPTION_WITHOUT, "|".join(words), "", name]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode in (2, 3), (ended.stdout, ended.stderr)
    assert f"extension {name}" in ended.stderr and "not installed" in ended.stderr
    assert not list(tmp_path.glob("*.html"))


def test_a_function_names_the_extension_that_it_needs() -> None:
    code = (
        OPTION_WITHOUT.split("sys.exit")[0]
        + """
import ballplate as bp

try:
    bp.reliability(bp.quickstart())
except bp.MissingExtensionError as error:
    assert "extension influences is not installed" in str(error)
else:
    raise AssertionError
"""
    )
    command = [sys.executable, "-c", code, "", "", "influences"]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], None]]:
    """Installs a package of a laboratory's own, with what it registers."""
    monkeypatch.syspath_prepend(tmp_path)

    def install(registered: str) -> None:
        folder = tmp_path / "laboratory_package"
        folder.mkdir()
        (folder / "__init__.py").write_text(
            f"from ballplate import Command, Extension\n\nEXTENSION = {registered}\n",
            encoding="utf-8",
        )
        (folder / "counting.py").write_text(COUNTING, encoding="utf-8")
        about = tmp_path / "laboratory_package-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text(
            "Metadata-Version: 2.1\nName: laboratory-package\nVersion: 1.0\n"
        )
        (about / "entry_points.txt").write_text(
            "[ballplate.extensions]\ncounting = laboratory_package:EXTENSION\n"
        )
        extensions.registered.cache_clear()

    yield install
    extensions.registered.cache_clear()
    for name in [name for name in sys.modules if name.startswith("laboratory_package")]:
        del sys.modules[name]


COUNTING = """
DESCRIPTION = "print the number of positions of a design"


def add_options(parser):
    parser.add_argument("file")


def run(options):
    print(count(options.file))
    return 0


def count(file):
    import ballplate as bp

    return len(bp.load(file).positions)
"""


def test_an_extension_of_a_laboratory_is_found(
    installed: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    """Its command, its function, its option of a command, and its line in the help."""
    from ballplate.cli import main

    command = 'Command("counting", "print the number of positions of a design, 100 % of them")'
    installed(
        f'Extension("counting", "laboratory_package", functions={{"count": "counting"}},'
        f' commands={{"count": {command}, "run --count": {command}}})'
    )
    for line in (["count", QUICKSTART], ["run", QUICKSTART, "--count"]):
        assert main(line) == 0
        assert capsys.readouterr().out == "6\n"
    assert bp.count(QUICKSTART) == 6
    vars(bp).pop("count")
    assert "count" in dir(bp)
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "print the number of positions of a design, 100 % of them" in " ".join(
        capsys.readouterr().out.split()
    )


@pytest.mark.parametrize(
    ("registered", "told"),
    [
        (
            'Extension("mine", "mine", commands={"sweep": Command("a", "b")})',
            "sweep (commands) is provided by sweeps",
        ),
        (
            'Extension("mine", "mine", commands={"check": Command("a", "b")})',
            "check (commands) is provided by ballplate",
        ),
        (
            'Extension("mine", "mine", functions={"fit": "a"})',
            "fit (functions) is provided by ballplate",
        ),
        (
            'Extension("mine", "mine", schemas={"experiment": "a"})',
            "experiment (schemas) is provided by ballplate",
        ),
        ('Extension("mine", "mine", commands=["a"])', "its commands are no mapping"),
        ('Extension("mine", "mine", commands={"a": "b"})', "a (commands) is 'b', and no Command"),
        ('"mine"', "'mine' is no Extension"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
    ],
)
def test_what_cannot_be_used_is_left_out_and_told(
    registered: str, told: str, installed: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    """By its package, and nothing else fails for it: help, mistypings, names of the face."""
    from ballplate.cli import main

    installed(registered)
    words = "warning: entry point counting of laboratory-package is not used: "
    for line in (["--help"], ["--version"], ["chekc"]):
        with pytest.raises(SystemExit) as ended:
            main(line)
        err = capsys.readouterr().err
        assert words in err and told in err and "Traceback" not in err
        assert ended.value.code == 2 * (line == ["chekc"])
    assert main([]) == 2 and not hasattr(bp, "nosuch")
    assert main(["schema"]) == 0


@pytest.mark.parametrize(
    ("module", "told"),
    [
        ("nowhere", "module nowhere cannot be loaded (ModuleNotFoundError"),
        ("__init__", "DESCRIPTION"),
    ],
)
def test_a_command_that_cannot_be_loaded_is_told(
    module: str, told: str, installed: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    from ballplate.cli import main

    command = f'Command("{module}", "count")'
    installed(f'Extension("mine", "laboratory_package", commands={{"count": {command}}})')
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0 and capsys.readouterr().err == ""
    assert main(["count", "a.yaml"]) == 2 and told in capsys.readouterr().err


def test_a_group_that_the_help_lacks_is_the_last_one(
    installed: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    from ballplate.cli import main

    command = 'Command("counting", "print the number of positions", "ours")'
    installed(f'Extension("mine", "laboratory_package", commands={{"count": {command}}})')
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "print the number of positions" in capsys.readouterr().out.partition(" more\n")[2]
