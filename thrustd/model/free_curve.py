"""What has no law yet, as an effect: `curve of hydraulic_pressure_bar` is any broken line of a channel, a force.

    F = F_core + h(q),    h: heights at 16 places of q, straight lines through them

q is a channel, or a difference or product of two: `curve of n2_pct - n1_pct`, `curve of voltage_V * n1_pct`. `bias
curve of` adds the same to the deformation, `gain curve of` multiplies the force by 1 + h. Which of the three it is,
and the heights, `extend` finds; the places are quantiles of the record that it is given. It says what the force
follows, and not why: beyond what that record has shown of the channel it goes straight on, for as far again and no
further.
"""

import re
from collections.abc import Mapping
from functools import cache

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.core.errors import ModelError
from thrustd.model.effect import Effect, Parameter, Site
from thrustd.model.stage import jit

CURVE_OF = "curve of "
KINDS: Mapping[str, Site] = {"": "force", "bias ": "deformation", "gain ": "gain"}  # in front of that
EQUATIONS: Mapping[Site, str] = {
    "force": "F = F_core + h(q)",
    "deformation": "d = d_read + h(q)",
    "gain": "F = F_core (1 + h(q))",
}
UNITS: Mapping[Site, str] = {"force": "N", "deformation": "mm", "gain": ""}
MINUS, TIMES = " - ", " * "
KNOTS = 16  # a bump of a tenth of a channel's way shows
LOW, HIGH = 0.005, 0.995  # quantiles: the first place and the last
LIMIT, FAR = 1e12, 1e100  # of heights, and of places: a clock may count nanoseconds
QUOTES = "\"'"
_ONE = r"""("[^"]+"|'[^']+'|.+?)"""
_WHAT = re.compile(rf"{_ONE}(?:( - | \* ){_ONE})?")


@jit
def followed(n: int, c: Floats, u: Floats) -> float:
    """What it follows, as far as it goes on."""
    q = u[0]
    if c[1] == 1.0:
        q = u[1] - u[0]
    elif c[1] == 2.0:
        q = u[0] * u[1]
    way = c[1 + n] - c[2]
    return min(max(q, c[2] - way), c[1 + n] + way)


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    n = c.size // 2 - 1  # c: whether a gain, sign between two channels, places (n,), heights (n,)
    at = followed(n, c, u)
    i = 2
    while i < n and at > c[i + 1]:
        i += 1
    share = (at - c[i]) / (c[i + 1] - c[i])
    height = (1.0 - share) * c[n + i] + share * c[n + i + 1]
    return v * (1.0 + height) if c[0] == 1.0 else v + height


@jit
def elements(x: Floats, c: Floats, u: Floats, wanted: Flags, out: Floats) -> None:
    """What each height adds by 1, to a gain in units of the force."""
    n, row = c.size // 2 - 1, 0
    for k in range(u.shape[0]):
        if wanted[k]:
            at, low, high = followed(n, c, u[k]), 2, n
            while low < high:
                middle = (low + high) // 2
                if at > c[middle + 1]:
                    low = middle + 1
                else:
                    high = middle
            share = (at - c[low]) / (c[low + 1] - c[low])
            out[row] = 0.0
            out[row, low - 2], out[row, low - 1] = 1.0 - share, share
            row += 1


def is_curve(name: str) -> bool:
    """Whether a name is that of such an effect."""
    kind, of, channel = name.partition(CURVE_OF)
    return bool(of) and kind in KINDS and bool(channel)


def free_curve(channel: str, site: Site = "force") -> Effect:
    """The effect of a channel, `b - a` or `a * b`."""
    kind = next(kind for kind, own in KINDS.items() if own == site)
    return curve_named(f"{kind}{CURVE_OF}{channel}")


def difference(one: str, other: str) -> str:
    """What a curve follows: `other - one`."""
    return f"{quoted(other)}{MINUS}{quoted(one)}"


def product(one: str, other: str) -> str:
    """What a curve follows: `one * other`."""
    return f"{quoted(one)}{TIMES}{quoted(other)}"


def quoted(name: str) -> str:
    """A channel alone; in quotes where its name would read as two, or as quoted."""
    if not any(sign in f" {name} " for sign in (MINUS, TIMES)) and name[0] not in QUOTES:
        return name
    mark = next((mark for mark in QUOTES if mark not in name), QUOTES[0])
    return f"{mark}{name}{mark}"


def nameable(name: str) -> bool:
    """Whether a curve of this channel has a name: none where it reads as two and has both kinds of quotes."""
    return name != "" and (quoted(name) == name or any(mark not in name for mark in QUOTES))


def _read(channel: str) -> tuple[str, tuple[str, ...]]:
    """The sign between two channels, none of one, and these: a and b of `b - a` and of `a * b`."""
    found = _WHAT.fullmatch(channel)
    if found is None:
        raise ModelError(f"{CURVE_OF}{channel}: expected a channel, or a difference or product of two")
    one, sign, other = found.groups()
    said = [part for part in (one, other) if part]
    if any(part[0] in QUOTES and (len(part) < 3 or part[-1] != part[0]) for part in said):
        raise ModelError(f"{CURVE_OF}{channel}: a quote without its end; expected a column in quotes")
    parts = tuple(part[1:-1] if part[0] in QUOTES else part for part in said)
    return sign or "", parts[::-1] if sign == MINUS else parts


def column_of(channel: str, channels: Mapping[str, Floats]) -> Floats:
    """What it follows (n,)."""
    sign, parts = _read(channel)
    first, *other = (channels[part] for part in parts)
    if not other:
        return first
    return other[0] - first if sign == MINUS else first * other[0]


def places(column: Floats, knots: int = KNOTS) -> Floats | None:
    """Where its heights stand (knots,), increasing; None where few values are met often: of two any law is a line."""
    found = np.unique(np.quantile(column, np.linspace(LOW, HIGH, knots)))
    if len(found) < 3:
        return None
    while len(found) < knots:
        widest = int(np.argmax(np.diff(found)))
        found = np.insert(found, widest + 1, (found[widest] + found[widest + 1]) / 2.0)
    return found


def at_places(found: Floats) -> dict[str, float]:
    """The same as parameters."""
    return {f"at_{i:02d}": float(place) for i, place in enumerate(found)}


@cache
def curve_named(name: str) -> Effect:
    """The effect of a name for which `is_curve` holds."""
    kind, _, channel = name.partition(CURVE_OF)
    site, (sign, parts) = KINDS[kind], _read(channel)
    combined = float(("", MINUS, TIMES).index(sign))
    names = [f"{what}_{i:02d}" for what in ("at", "height") for i in range(KNOTS)]
    evenly = [_place(one, i / (KNOTS - 1)) for i, one in enumerate(names[:KNOTS])]

    def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
        c = np.array([float(site == "gain"), combined, *(p[one] for one in names)])
        if not np.all(np.diff(c[2 : 2 + KNOTS]) > 0.0):
            raise ModelError(f"{name}: {names[0]} to {names[KNOTS - 1]} do not increase, expected places in order")
        return c

    return Effect(
        name=name,
        title=f"whatever follows {channel}",
        site=site,
        channels=parts,
        parameters=(*evenly, *(_height(one, UNITS[site]) for one in names[KNOTS:])),
        step=step,
        prepare=prepare,
        n_state=0,
        elements=elements,
        equation=f"{EQUATIONS[site]}, q = {channel}",
        source="a broken line through what the residual follows, no law",
        separating_test=f"move {' and '.join(parts)} at constant thrust",
        variant_of="" if site == "force" else f"{CURVE_OF}{channel}",
    )


def _place(name: str, start: float) -> Parameter:
    return Parameter(name, "", 0.0, -FAR, FAR, (start,), "place", amplitude=False, estimate=False)


def _height(name: str, unit: str) -> Parameter:
    return Parameter(name, unit, 0.0, -LIMIT, LIMIT, (1.0,), "height there")
