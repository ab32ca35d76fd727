"""Errors in the words of whoever called: `rename=` in Python where the command line says `--rename`."""

import re
import shlex
from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import ParamSpec, TypeVar

from thrustd.core.errors import ThrustdError

P = ParamSpec("P")
R = TypeVar("R")
FLAG = re.compile(r"--([a-z][a-z-]*)(?: (?=[A-Z'\"]|\S+:))?")  # with the space before its value
_ONE = r"--rename (?:'[^']*'|\S+?(?=[\s,:]|$))"
RENAMES = re.compile(rf"{_ONE}(?: {_ONE})*")
REPLAY = "thrustd replay LOG -o OUT.mcap", 'td.replay(LOG, out="OUT.mcap")'
CALLED = {"rate": "rate_hz", "limit": "limits"}  # else as the flag, with underscores


def spoken(function: Callable[P, R]) -> Callable[P, R]:
    """The same function; a flag of its own parameters is said as the parameter, others stay the command line's."""
    own = signature(function).parameters

    def said(flag: re.Match[str]) -> str:
        name = CALLED.get(flag[1], flag[1].replace("-", "_"))
        return f"{name}{'=' if flag[0].endswith(' ') else ''}" if name in own else flag[0]

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return function(*args, **kwargs)
        except ThrustdError as problem:
            text = RENAMES.sub(listed, str(problem)) if "rename" in own else str(problem)
            raise type(problem)(FLAG.sub(said, text).replace(*REPLAY)) from None

    return call


def listed(flags: re.Match[str]) -> str:
    """`--rename 'Load [kN]=force_N*1000.0' --rename t=time_s` as the argument of `td.read`."""
    return f"rename={[word for word in shlex.split(flags[0]) if word != '--rename']!r}"
