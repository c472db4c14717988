"""Changes of meaning of Python source, one at a time."""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from tests.reference.installed_extension import TOP

COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
EXTREMES = {"min": "max", "max": "min", "argmin": "argmax", "argmax": "argmin"}
EXTREMES |= {"nanmax": "nanmin", "nanmin": "nanmax", "minimum": "maximum", "maximum": "minimum"}
KINDS = ("comparison", "sum", "extreme", "constant", "factor", "junction", "returned", "setting")


@dataclass(frozen=True, order=True)
class Mutant:
    """A change of the `node`-th node, in the order of `ast.walk`, of a file below the package.

    A "setting" is a constant of the module, which has a name.
    """

    path: str
    line: int
    kind: str
    node: int
    setting: str = ""

    @property
    def name(self) -> str:
        return f"{self.path}:{self.line}: {self.kind} {self.node}"


def mutants(path: Path, name: str) -> list[Mutant]:
    """All changes of a file: none of annotations, of decorators and of what is raised."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    number = {id(node): k for k, node in enumerate(ast.walk(tree))}
    found = {
        Mutant(name, getattr(node, "lineno", 0), kind, number[id(node)])
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef)
        for statement in function.body
        for node in _computed(statement)
        for kind in KINDS
        if kind != "setting" and _changed(node, kind, function) is not None
    }
    for statement in tree.body:
        if not isinstance(statement, ast.Assign) or not isinstance(statement.targets[0], ast.Name):
            continue
        for node in _computed(statement.value):
            if _changed(node, "constant", None) is not None:
                place = Mutant(name, statement.lineno, "setting", number[id(node)])
                found.add(replace(place, setting=statement.targets[0].id))
    return sorted(found)


def mutated(path: Path, mutant: Mutant) -> str:
    """The source of a file with the change."""
    return ast.unparse(_changed_tree(path, mutant))


def changed_tree(mutant: Mutant) -> ast.Module:
    """The module of a file of the package with the change."""
    return _changed_tree(source_of(mutant.path), mutant)


def probed_tree(
    path: str, by_number: dict[int, Mutant], settings: dict[str, list[int]], probe: str
) -> ast.Module:
    """The module of a file where each place of a change, and each use of a setting by its name in a
    function, calls a probe with the numbers of the changes.
    """
    tree = ast.parse(source_of(path).read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    places = [(nodes[mutant.node], [number]) for number, mutant in by_number.items()]
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    within = {id(node): node for one in functions for node in _inside(one)}
    for node in within.values():
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in settings:
            places.append((node, settings[node.id]))
    for node, numbers in places:
        value = node.value if isinstance(node, ast.Return) else node
        calls = [
            ast.Call(ast.Name(probe, ast.Load()), [ast.Constant(number)], []) for number in numbers
        ]
        pair = ast.Tuple([*calls, value], ast.Load())
        _exchange(tree, value, ast.Subscript(pair, ast.Constant(-1), ast.Load()))
    return ast.fix_missing_locations(tree)


def new_value(mutant: Mutant, names: dict[str, object]) -> object:
    """The value that a setting has with the change, of the names of its module."""
    tree = _changed_tree(source_of(mutant.path), mutant)
    (statement,) = [one for one in tree.body if getattr(one, "lineno", 0) == mutant.line]
    assert isinstance(statement, ast.Assign)
    return eval(compile(ast.Expression(statement.value), mutant.path, "eval"), dict(names))


def source_of(path: str) -> Path:
    """The file of a path below the package."""
    return TOP / path if path.startswith("simulator/") else TOP / "analysis" / path


def _changed_tree(path: Path, mutant: Mutant) -> ast.Module:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    target = nodes[mutant.node]
    within = [
        one
        for one in nodes
        if isinstance(one, ast.FunctionDef) and any(node is target for node in ast.walk(one))
    ]
    kind = "constant" if mutant.setting else mutant.kind
    changed = _changed(target, kind, within[-1] if within else None)
    assert changed is not None
    _exchange(tree, target, changed)
    return ast.fix_missing_locations(tree)


def _exchange(tree: ast.Module, target: ast.AST, changed: ast.AST) -> None:
    class Exchange(ast.NodeTransformer):
        def visit(self, node: ast.AST) -> ast.AST:
            return changed if node is target else self.generic_visit(node)

    Exchange().visit(tree)


def drawn(every: list[Mutant], count: int, seed: int) -> list[Mutant]:
    """So many at random, the kinds as evenly as there are any; the first of more are the same."""
    draw = random.Random(seed)
    by_kind = {kind: [one for one in every if one.kind == kind] for kind in KINDS}
    for some in by_kind.values():
        draw.shuffle(some)
    turns = max(map(len, by_kind.values()), default=0)
    return [some[k] for k in range(turns) for some in by_kind.values() if k < len(some)][:count]


def _computed(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a statement that compute something."""
    if isinstance(node, ast.Raise | ast.Assert | ast.FunctionDef | ast.ClassDef):
        return
    yield node
    for field, value in ast.iter_fields(node):
        if field in ("annotation", "decorator_list", "returns"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _computed(child)


def _inside(function: ast.FunctionDef) -> Iterator[ast.AST]:
    """The nodes of a function's statements that compute something."""
    for statement in function.body:
        yield from _computed(statement)


def _changed(node: ast.AST, kind: str, function: ast.FunctionDef | None) -> ast.AST | None:
    """The node as the change leaves it; None where it has no such change."""
    if kind == "comparison" and isinstance(node, ast.Compare) and len(node.ops) == 1:
        return ast.Compare(node.left, [COMPARISONS[type(node.ops[0])]()], node.comparators)
    if kind == "sum" and isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
        if any(
            isinstance(one, ast.List | ast.Tuple | ast.JoinedStr) or _is_text(one)
            for one in (node.left, node.right)
        ):
            return None
        return ast.BinOp(
            node.left, ast.Sub() if isinstance(node.op, ast.Add) else ast.Add(), node.right
        )
    if kind == "factor" and isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
        return node.right if isinstance(node.op, ast.Mult) else node.left
    if kind == "extreme" and isinstance(node, ast.Call):
        return _other_extreme(node)
    if kind == "junction" and isinstance(node, ast.BoolOp):
        return ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    if kind == "constant" and isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return ast.Constant(
            node.value + 1 if isinstance(node.value, int) else 2.0 * node.value or 1.0
        )
    if kind == "returned" and isinstance(node, ast.Return) and node.value is not None:
        returns = ast.unparse(function.returns) if function and function.returns else ""
        if returns == "bool":
            return ast.Return(ast.UnaryOp(ast.Not(), node.value))
        if returns in ("float", "Array"):
            return ast.Return(ast.BinOp(ast.Constant(2.0), ast.Mult(), node.value))
    return None


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _other_extreme(node: ast.Call) -> ast.Call | None:
    name = node.func
    if isinstance(name, ast.Name) and name.id in EXTREMES:
        return ast.Call(ast.Name(EXTREMES[name.id], ast.Load()), node.args, node.keywords)
    if isinstance(name, ast.Attribute) and name.attr in EXTREMES:
        other = ast.Attribute(name.value, EXTREMES[name.attr], ast.Load())
        return ast.Call(other, node.args, node.keywords)
    return None
