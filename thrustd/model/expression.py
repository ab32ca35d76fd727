"""An effect from an expression, without code: `k * dynamic_pressure_Pa` adds that force, k is estimated.

    force = core force + expression(channels, parameters)

The text is parsed by Python's own parser (never evaluated), checked against a short list of operators and functions,
and flattened into a program in reverse Polish notation. One compiled step interprets every program, so expressions
diagnose, extend, compile, replay and fly like any built-in effect:

    c = [n, op_1, arg_1, ... op_n, arg_n]    op: push constant | push channel | add | multiply | ...    x: the stack

Names of the catalogue are channels, and so is whatever stands in quotes, `k * "Temp [degC]"` (`expression_effect` puts
them where the columns of a recording are given; artifacts of before have brackets). Every other name is a parameter.
A parameter that makes the whole expression vanish at zero is an amplitude; the others are shape. Where they begin, and
how far they may go, follows from the records (`diagnose/search/formulas.py`).
"""

import ast
import math
from collections.abc import Collection, Mapping
from functools import cache, partial

import numpy as np

from thrustd.core.errors import ModelError
from thrustd.core.signals import CATALOGUE
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, Stage, jit

PREFIX = "expression: "
LONGEST = 400  # characters
LONGEST_NAME = 200  # of a column
DEEPEST = 16  # stack
NESTED = 60  # parts within each other: what walks over them recurses
LIMIT = 1e12
DRAWS = 16  # values of names and channels at which a formula is tried
CONSTANT, CHANNEL, ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, NEGATE = range(8)
_BINARY = {ast.Add: ADD, ast.Sub: SUBTRACT, ast.Mult: MULTIPLY, ast.Div: DIVIDE, ast.Pow: POWER}
FUNCTIONS = {"abs": 8, "sqrt": 9, "exp": 10, "log": 11, "sin": 12, "cos": 13, "tanh": 14, "sign": 15}
ALLOWED = "+ - * / **, " + ", ".join(FUNCTIONS) + ', numbers, channels, columns as "Temp [degC]" and free names'
_PARAMETER = -1  # in a program before its parameters have values

Program = tuple[tuple[int, float | str], ...]


class LacksColumnError(ModelError):
    """A formula that a recording may mend: one of its free names may be a column there."""


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    top = -1
    for i in range(int(c[0])):
        op, arg = int(c[1 + 2 * i]), c[2 + 2 * i]
        if op == 0:
            top += 1
            x[top] = arg
        elif op == 1:
            top += 1
            x[top] = u[int(arg)]
        elif op < 7:
            top -= 1
            a, b = x[top], x[top + 1]
            if op == 2:
                x[top] = a + b
            elif op == 3:
                x[top] = a - b
            elif op == 4:
                x[top] = a * b
            elif op == 5:
                x[top] = a / b
            else:
                x[top] = a**b
        else:
            x[top] = _function(op, x[top])
    return v + x[0]


@jit
def _function(op: int, a: float) -> float:
    if op == 7:
        return -a
    if op == 8:
        return abs(a)
    if op == 9:
        return math.sqrt(a)
    if op == 10:
        return math.exp(a)
    if op == 11:
        return math.log(a)
    if op == 12:
        return math.sin(a)
    if op == 13:
        return math.cos(a)
    if op == 14:
        return math.tanh(a)
    return (a > 0.0) - (a < 0.0)


def is_expression(text: str) -> bool:
    """Whether `text` asks for an expression rather than names an effect."""
    return text.startswith(PREFIX) or any(not (ch.isalnum() or ch in "_#") for ch in text.strip())


def expression_effect(text: str, columns: Collection[str] = ()) -> Effect:
    """The effect of an expression; `columns`: further channel names that it may use without quotes."""
    source = text.removeprefix(PREFIX).strip()
    return _effect(_canonical(_parsed(source), source, frozenset(columns)))


def _parsed(source: str) -> ast.expr:
    if not source or len(source) > LONGEST:
        raise ModelError(f"expression '{source[:40]}': {len(source)} characters, expected 1 to {LONGEST}")
    try:
        tree = ast.parse(source, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ModelError(f"expression '{source}': not a formula, expected {ALLOWED}") from None
    level: list[ast.AST] = [tree]
    for _ in range(NESTED):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
    if level:
        raise ModelError(f"expression '{source}': nested too deep, expected at most {NESTED} steps")
    return tree


def _canonical(tree: ast.expr, source: str, columns: frozenset[str]) -> str:
    """Text with quotes round the columns that the catalogue does not have."""
    _flat(tree, source, columns)  # refuses what is not allowed, before anything else

    class Quotes(ast.NodeTransformer):
        def visit_List(self, node: ast.List) -> ast.AST:
            return node

        def visit_Name(self, node: ast.Name) -> ast.AST:
            unknown = node.id in columns and node.id not in CATALOGUE
            return ast.Constant(node.id) if unknown else node

    return ast.unparse(Quotes().visit(tree))


def _is_column(name: str) -> bool:
    return 0 < len(name) <= LONGEST_NAME and name.isprintable()


def _flat(node: ast.expr, source: str, columns: frozenset[str] = frozenset()) -> list[tuple[int, float | str]]:
    """Reverse Polish notation; ModelError names the part that is not allowed."""
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        return [(CONSTANT, float(min(node.value, LIMIT)))]
    if isinstance(node, ast.Name):
        known = node.id in CATALOGUE or node.id in columns
        return [(CHANNEL if known else _PARAMETER, node.id)]
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and _is_column(node.value):
        return [(CHANNEL, node.value)]
    if isinstance(node, ast.List) and len(node.elts) == 1 and isinstance(node.elts[0], ast.Name):
        return [(CHANNEL, node.elts[0].id)]
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return [*_flat(node.left, source, columns), *_flat(node.right, source, columns), (_BINARY[type(node.op)], 0.0)]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.UAdd | ast.USub):
        inner = _flat(node.operand, source, columns)
        return [*inner, (NEGATE, 0.0)] if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and (len(node.args), node.keywords) == (1, []):
        function = FUNCTIONS.get(node.func.id)
        if function is not None:
            return [*_flat(node.args[0], source, columns), (function, 0.0)]
    part = ast.get_source_segment(source, node) or type(node).__name__
    raise ModelError(f"expression '{source}': '{part}' is not allowed, expected {ALLOWED}")


@cache
def _effect(source: str) -> Effect:
    program = tuple(_flat(_parsed(source), source))
    depth = _depth(program)
    if depth > DEEPEST:
        raise ModelError(f"expression '{source}': {depth} values at once, expected at most {DEEPEST}")
    channels, names = _names(program, CHANNEL), _names(program, _PARAMETER)
    if not channels:
        raise LacksColumnError(
            f"expression '{source}': reads no channel, expected one, such as k * dynamic_pressure_Pa"
        )
    amplitudes = _amplitudes(program, channels, names, source)
    return Effect(
        name=PREFIX + source,
        title=f"force {source}",
        site="force",
        channels=channels,
        parameters=tuple(_parameter(name, name in amplitudes) for name in names),
        step=step,
        prepare=partial(_prepare, program, channels),
        n_state=depth,
        equation=f"F = F_core + {source}",
        source="given by the user",
        separating_test=f"move {' and '.join(channels)} at constant thrust",
    )


def along(part: ast.expr, columns: Mapping[str, Floats], values: Mapping[str, float]) -> Floats:
    """A formula or a part of one on every row (n,), with these values of its names; not finite where it is no number.

    `columns`: its channels and time_s.
    """
    program = tuple(_flat(part, ast.unparse(part)))
    channels = _names(program, CHANNEL)
    stage = Stage("formula", step, _prepare(program, channels, values, 1.0), _depth(program), channels)
    return stage.from_rest(columns, np.zeros(len(columns["time_s"])))


def _names(program: Program, kind: int) -> tuple[str, ...]:
    return tuple(dict.fromkeys(str(arg) for op, arg in program if op == kind))


def _parameter(name: str, amplitude: bool) -> Parameter:
    neutral = 0.0 if amplitude else 1.0
    return Parameter(name, "", neutral, -LIMIT, LIMIT, (1.0,), "free name of the expression", amplitude)


def _prepare(program: Program, channels: tuple[str, ...], p: Mapping[str, float], dt_s: float) -> Floats:
    c = [float(len(program))]
    for op, arg in program:
        if op == _PARAMETER:
            c += [CONSTANT, p[str(arg)]]
        elif op == CHANNEL:
            c += [CHANNEL, channels.index(str(arg))]
        else:
            c += [op, float(arg)]
    return np.array(c)


def _depth(program: Program) -> int:
    depth = deepest = 0
    for op, _ in program:
        depth += 1 if op in (CONSTANT, CHANNEL, _PARAMETER) else -1 if op <= POWER else 0
        deepest = max(deepest, depth)
    return deepest


def _amplitudes(program: Program, channels: tuple[str, ...], names: tuple[str, ...], source: str) -> set[str]:
    """Parameters whose zero makes the expression vanish: each alone, or else all of them together."""
    alone = {name for name in names if _vanishes(program, channels, names, {name})}
    if alone:
        return alone
    if names and _vanishes(program, channels, names, set(names)):
        return set(names)
    raise ModelError(
        f"expression '{source}': does not vanish for any value of a free name, expected a factor to estimate,"
        f" such as k * ({source})"
    )


def _vanishes(program: Program, channels: tuple[str, ...], names: tuple[str, ...], zero: set[str]) -> bool:
    """Wherever it is a number: a factor of nothing does not make one of a root of what is negative."""
    rng = np.random.default_rng(0)
    x, found = np.zeros(_depth(program)), False
    for _ in range(DRAWS):
        values = {name: 0.0 if name in zero else float(rng.uniform(0.5, 1.5)) for name in names}
        value = step(x, _prepare(program, channels, values, 1.0), rng.uniform(0.5, 1.5, len(channels)), 0.0)
        if math.isfinite(value) and value != 0.0:
            return False
        found = found or value == 0.0
    return found
