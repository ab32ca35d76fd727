"""A compiled step of Python as a function of C99: the same operations in the same order, so the same doubles.

Steps are written so that numba can compile them: numbers, loops and rows of doubles, no objects. Each piece of that
small Python has one translation here; anything else is a ModelError that names it, so C can be missing but not
different. A row becomes a pointer and its length; an int a long; anything else a double.

    v + c[0] * max(u[0], 0.0)   ->   (v + (c[0] * larger(u[0], 0.0)))

`min`, `max`, `//` and `%` are Python's own (`_PYTHONS_OWN`): C's fmin and fmax treat NaN and zeros another way.
"""

import ast
import inspect
import re
import textwrap
from collections.abc import Callable
from typing import Any

from thrustd.core.errors import ModelError

_PYTHONS_OWN = {
    "smaller": "double {0}_smaller(double a, double b) {{ return b < a ? b : a; }}",
    "larger": "double {0}_larger(double a, double b) {{ return b > a ? b : a; }}",
    "quotient": "long {0}_quotient(long a, long b) {{ return a / b - (a % b != 0 && (a % b < 0) != (b < 0)); }}",
    "remainder": "long {0}_remainder(long a, long b) {{ return (a % b + b) % b; }}",
}
_MATH = ("exp", "expm1", "log", "sin", "cos", "tanh", "erf", "sqrt", "floor", "copysign")
_ARITHMETIC = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
_COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_KINDS = {"Floats": "row", "float": "double", "int": "long", "None": "void"}
_INT, _REAL, _ROW = "long", "double", "row"
Expression = tuple[str, str]  # C, and its kind


def plain(function: Any) -> Callable[..., Any]:
    """The Python that a compiled function was made of."""
    python: Callable[..., Any] = getattr(function, "py_func", function)
    return python


class Library:
    """Functions of C made so far, each once, callees first. `prefix` keeps the names of several models apart."""

    def __init__(self, prefix: str) -> None:
        self.prefix = prefix
        self._names: dict[str, str] = {}  # of a Python function -> its name in C
        self._texts: list[str] = []

    def text(self) -> str:
        return "\n".join(self._texts)

    def pythons_own(self, word: str) -> str:
        """Name in C of one of Python's own operations."""
        if word not in self._names:
            self._names[word] = f"{self.prefix}_{word}"
            self._texts.append(f"static {_PYTHONS_OWN[word].format(self.prefix)}\n")
        return self._names[word]

    def add(self, function: Any) -> str:
        """Name in C of a compiled function; ModelError if it says what has no translation."""
        python = plain(function)
        key = f"{python.__module__}.{python.__qualname__}"
        if key not in self._names:
            name = f"{self.prefix}_{python.__module__.rpartition('.')[2]}_{python.__name__}"
            while name in self._names.values():
                name += "_"
            text = _Function(self, python, name).text()
            self._names[key] = name
            self._texts.append(text)
        return self._names[key]


class _Function:
    """One function on its way to C."""

    def __init__(self, library: Library, python: Callable[..., Any], name: str) -> None:
        self._library, self._python, self._name = library, python, name
        self._kinds: dict[str, str] = {}  # of arguments and local variables
        self._locals: dict[str, str] = {}

    def text(self) -> str:
        tree = self._tree()
        arguments = ", ".join(self._argument(each, i == 0) for i, each in enumerate(tree.args.args))
        returns = _KINDS[ast.unparse(tree.returns)] if tree.returns is not None else "void"
        body = [line for each in tree.body for line in self._statement(each)]
        declared = [f"{kind} {name} = 0;" for name, kind in self._locals.items()]
        names = [name for node in tree.args.args for name in (node.arg, f"n_{node.arg}") if name in arguments]
        unused = [f"(void){name};" for name in names if not re.search(rf"\b{name}\b", "\n".join(body))]
        lines = [f"static {returns} {self._name}({arguments})", "{", *_indented([*declared, *unused, *body]), "}"]
        return "\n".join(lines) + "\n"

    def _tree(self) -> ast.FunctionDef:
        try:
            source = textwrap.dedent(inspect.getsource(self._python))
        except (OSError, TypeError):
            raise ModelError(f"{self._name}: its source is not at hand, so it cannot be written in C") from None
        (tree,) = ast.parse(source).body
        assert isinstance(tree, ast.FunctionDef)
        return tree

    def _argument(self, node: ast.arg, is_state: bool) -> str:
        kind = _KINDS[ast.unparse(node.annotation)] if node.annotation else _REAL
        self._kinds[node.arg] = kind
        constant = "" if is_state else "const "
        return f"{constant}double *{node.arg}, long n_{node.arg}" if kind == _ROW else f"{kind} {node.arg}"

    def _unknown(self, node: ast.AST) -> ModelError:
        said = ast.unparse(node).splitlines()[0]
        return ModelError(f"{self._python.__module__}.{self._python.__name__}: '{said}' has no translation to C")

    # statements -> lines

    def _statement(self, node: ast.stmt) -> list[str]:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return []  # docstring
        if isinstance(node, ast.Expr):
            return [f"{self._value(node.value)[0]};"]
        if isinstance(node, ast.Return):
            return [f"return {self._value(node.value)[0]};" if node.value is not None else "return;"]
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            return self._assigned(node.targets[0], node.value)
        if isinstance(node, ast.AugAssign):
            return self._assigned(node.target, ast.BinOp(node.target, node.op, node.value))
        if isinstance(node, ast.If | ast.While):
            return self._branch("if" if isinstance(node, ast.If) else "while", node)
        if isinstance(node, ast.For):
            return self._loop(node)
        raise self._unknown(node)

    def _branch(self, word: str, node: ast.If | ast.While) -> list[str]:
        lines = [f"{word} ({self._value(node.test)[0]}) {{", *self._block(node.body), "}"]
        return [*lines, "else {", *self._block(node.orelse), "}"] if node.orelse else lines

    def _block(self, body: list[ast.stmt]) -> list[str]:
        return _indented([line for each in body for line in self._statement(each)])

    def _loop(self, node: ast.For) -> list[str]:
        if not (isinstance(node.iter, ast.Call) and ast.unparse(node.iter.func) == "range" and not node.orelse):
            raise self._unknown(node)
        bounds = [self._value(each)[0] for each in node.iter.args]
        begin, end = bounds if len(bounds) == 2 else ("0", *bounds)
        assert isinstance(node.target, ast.Name)
        self._declare(node.target.id, _INT)
        i = node.target.id
        return [f"for ({i} = {begin}; {i} < {end}; {i}++) {{", *self._block(node.body), "}"]

    def _assigned(self, target: ast.expr, value: ast.expr) -> list[str]:
        if isinstance(target, ast.Tuple):
            assert isinstance(value, ast.Tuple)
            return [line for one, its in zip(target.elts, value.elts, strict=True) for line in self._assigned(one, its)]
        text, kind = self._value(value)
        if isinstance(target, ast.Name):
            self._declare(target.id, kind)
            return [f"{target.id} = {text};"]
        if isinstance(target, ast.Subscript) and isinstance(target.slice, ast.Slice):
            row, size = self._slice(target)
            return [f"{{ long k_; for (k_ = 0; k_ < {size}; k_++) ({row})[k_] = {text}; }}"]
        return [f"{self._value(target)[0]} = {text};"]

    def _declare(self, name: str, kind: str) -> None:
        if name not in self._kinds:
            self._kinds[name] = self._locals[name] = kind
        elif (self._kinds[name], kind) == (_INT, _REAL):
            raise ModelError(f"{self._name}: '{name}' is an int first and a float later; expected one kind")

    # expressions -> C and kind

    def _value(self, node: ast.expr) -> Expression:
        translate = _EXPRESSIONS.get(type(node))
        if translate is None:
            raise self._unknown(node)
        value: Expression = translate(self, node)
        return value

    def _constant(self, node: ast.Constant) -> Expression:
        if isinstance(node.value, int) and not isinstance(node.value, bool):
            return str(node.value), _INT
        if isinstance(node.value, float):
            return c_number(node.value), _REAL
        raise self._unknown(node)

    def _unary(self, node: ast.UnaryOp) -> Expression:
        text, kind = self._value(node.operand)
        if isinstance(node.op, ast.Not):
            return f"(!{text})", _INT
        if isinstance(node.op, ast.USub):
            return f"(-{text})", kind
        raise self._unknown(node)

    def _and_or(self, node: ast.BoolOp) -> Expression:
        word = " && " if isinstance(node.op, ast.And) else " || "
        return f"({word.join(self._value(each)[0] for each in node.values)})", _INT

    def _compare(self, node: ast.Compare) -> Expression:
        if len(node.ops) != 1 or type(node.ops[0]) not in _COMPARE:
            raise self._unknown(node)
        left, right = self._value(node.left)[0], self._value(node.comparators[0])[0]
        return f"({left} {_COMPARE[type(node.ops[0])]} {right})", _INT

    def _either(self, node: ast.IfExp) -> Expression:
        (one, first), (other, second) = self._value(node.body), self._value(node.orelse)
        return f"({self._value(node.test)[0]} ? {one} : {other})", first if first == second else _REAL

    def _attribute(self, node: ast.Attribute) -> Expression:
        if node.attr != "size":
            raise self._unknown(node)
        return self._length(node.value), _INT

    def _named(self, node: ast.Name) -> Expression:
        if node.id in self._kinds:
            return node.id, self._kinds[node.id]
        value = self._python.__globals__.get(node.id)
        if isinstance(value, int | float) and not isinstance(value, bool):
            return (str(value), _INT) if isinstance(value, int) else (c_number(value), _REAL)
        raise self._unknown(node)

    def _arithmetic(self, node: ast.BinOp) -> Expression:
        (left, one), (right, other) = self._value(node.left), self._value(node.right)
        both = _INT if (one, other) == (_INT, _INT) else _REAL
        if isinstance(node.op, ast.FloorDiv | ast.Mod) and both == _INT:
            name = self._library.pythons_own("quotient" if isinstance(node.op, ast.FloorDiv) else "remainder")
            return f"{name}({left}, {right})", _INT
        if isinstance(node.op, ast.Pow) and not isinstance(node.right, ast.Constant):
            return f"pow({left}, {right})", _REAL  # a constant power is unrolled by numba: write the product
        if isinstance(node.op, ast.Div):
            return f"((double){left} / (double){right})" if both == _INT else f"({left} / {right})", _REAL
        if type(node.op) not in _ARITHMETIC:
            raise self._unknown(node)
        return f"({left} {_ARITHMETIC[type(node.op)]} {right})", both

    def _element(self, node: ast.Subscript) -> Expression:
        if ast.unparse(node.value).endswith(".shape") and ast.unparse(node.slice) == "0":
            assert isinstance(node.value, ast.Attribute)
            return self._length(node.value.value), _INT
        if isinstance(node.slice, ast.Slice):
            return ", ".join(self._slice(node)), _ROW
        row, at = self._row(node.value), self._value(node.slice)[0]
        from_the_end = isinstance(node.slice, ast.UnaryOp)
        return f"{row}[{f'n_{row} + ' if from_the_end else ''}{at}]", _REAL

    def _slice(self, node: ast.Subscript) -> tuple[str, str]:
        """Where a part of a row begins, and its length."""
        assert isinstance(node.slice, ast.Slice)
        row = self._row(node.value)
        begin = self._value(node.slice.lower)[0] if node.slice.lower is not None else "0"
        end = self._value(node.slice.upper)[0] if node.slice.upper is not None else f"n_{row}"
        return f"{row} + {begin}", f"{end} - {begin}" if begin != "0" else end

    def _row(self, node: ast.expr) -> str:
        if isinstance(node, ast.Name) and self._kinds.get(node.id) == _ROW:
            return node.id
        raise self._unknown(node)

    def _length(self, node: ast.expr) -> str:
        return f"n_{self._row(node)}"

    def _call(self, node: ast.Call) -> Expression:
        said, given = ast.unparse(node.func), [self._value(each) for each in node.args]
        texts = [f"{text}, n_{text}" if kind == _ROW and "," not in text else text for text, kind in given]
        if said in ("min", "max"):
            name, (first, *rest) = self._library.pythons_own("smaller" if said == "min" else "larger"), texts
            for each in rest:
                first = f"{name}({first}, {each})"
            return first, _REAL
        if said == "abs" and given[0][1] == _REAL:
            return f"fabs({texts[0]})", _REAL
        if said == "int":
            return f"(long)({texts[0]})", _INT
        if said.startswith("math.") and said[5:] in _MATH:
            return f"{said[5:]}({', '.join(texts)})", _REAL
        function = self._python.__globals__.get(said)
        if not hasattr(function, "py_func"):
            raise self._unknown(node)
        returns = inspect.get_annotations(plain(function))["return"]
        kind = {int: _INT, float: _REAL}.get(returns, "void")
        return f"{self._library.add(function)}({', '.join(texts)})", kind


_EXPRESSIONS: dict[type[ast.expr], Callable[..., Expression]] = {
    ast.Constant: _Function._constant,
    ast.Name: _Function._named,
    ast.UnaryOp: _Function._unary,
    ast.BinOp: _Function._arithmetic,
    ast.BoolOp: _Function._and_or,
    ast.Compare: _Function._compare,
    ast.IfExp: _Function._either,
    ast.Attribute: _Function._attribute,
    ast.Subscript: _Function._element,
    ast.Call: _Function._call,
}


def c_number(value: float) -> str:
    """A double that C reads back to the bit."""
    text = repr(float(value))
    return {"inf": "HUGE_VAL", "-inf": "(-HUGE_VAL)", "nan": "(0.0 / 0.0)"}.get(text, text)


def _indented(lines: list[str]) -> list[str]:
    return [f"    {line}" for line in lines]
