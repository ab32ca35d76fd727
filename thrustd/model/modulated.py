"""An effect whose strength follows a channel: `hysteresis by voltage_V` is friction that grows with a voltage.

    v_out = v + s (effect(v) - v),    s = r + (1 - r) max((late - absent_at) / (full_at - absent_at), 0)^n,
    channel_late_s late' + late = channel,    n = channel_exponent,    r = channel_rest

A damper with a coil, a joint whose preload is measured, a seal under pressure: the law is known, its size follows
something that was recorded. `full_at` below `absent_at` is one that fades as the channel grows. The effect keeps its
memory whatever s is, and its sign: what resists motion does so at every s. The channel acts late (the current of a coil
behind its voltage, a seal that fills), and not in proportion (a magnet that saturates: exponent below 1; a damper that
has some of it without current: a rest).

What grows with the channel may be the whole law, or its level alone: a fluid that yields at a higher stress flows no
stiffer below it. So a law of the motion that has a scale of its own (of travel, of rate) reads the motion in units of
s^channel_level: at 0 all of it is multiplied, at 1 its slope at small motions stays and the level that it turns over to
follows the channel (a slope below the yield that no field changes: Stanway, Sproston & El-Wahed, Smart Mater. Struct.
5 (1996) 464), between them both do.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial
from types import FunctionType
from typing import Any

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import DEFORMATION, Floats, jit

BY = " by "
LATE, POWER, REST, LEVEL = "channel_late_s", "channel_exponent", "channel_rest", "channel_level"
LEAST = 0.01  # of the law: from there down its motion is no further stretched
SCALES = "mm", "mm/s"  # units of a shape that is a scale of the motion
ENDS = "absent_at", "full_at"  # values of the channel where nothing of it is there, where the amplitudes hold


@jit
def _inner(x: Floats, c: Floats, u: Floats, v: float) -> float:
    """Stands for the effect's own step, and for a start that sets nothing."""
    return v


def _step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] = u[0] + c[2] * (x[0] - u[0])
    share = c[4] + (1.0 - c[4]) * max((x[0] - c[0]) * c[1], 0.0) ** c[3]
    return v + share * (_inner(x[1:], c[5:], u[1:], v) - v)


def _initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = u[0]
    _inner(x[1:], c[5:], u[1:], v)


def _level_step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] = u[0] + c[2] * (x[0] - u[0])
    share = c[4] + (1.0 - c[4]) * max((x[0] - c[0]) * c[1], 0.0) ** c[3]
    x[2] += (u[1] - x[1]) * (max(share, c[6]) ** c[5] - 1.0)
    x[1], x[3] = u[1], u[1] + x[2]
    return v + share * (_inner(x[4:], c[7:], x[3:], v) - v)


def _level_initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0], x[1], x[3] = u[0], u[1], u[1]
    _inner(x[4:], c[7:], u[1:], v)


LEVEL_ALONE = Parameter(
    LEVEL, "", 0.0, 0.0, 1.0, (0.0,), "1: the level alone follows the channel, 0: all of the law",
    amplitude=False, spread=0.5,
)  # fmt: skip


def modulated(effect: Effect, channel: str) -> Effect:
    """`effect` in proportion to a channel."""
    return _modulated(effect.name, channel, effect)


def levelled(effect: Effect) -> bool:
    """Whether it is a law of the motion alone that has a scale of its own."""
    scales = (p.unit in SCALES and p.estimate and not p.amplitude for p in effect.parameters)
    return effect.site == "force" and effect.channels == (DEFORMATION,) and any(scales)


@cache
def _modulated(name: str, channel: str, effect: Effect) -> Effect:
    level = levelled(effect)
    step, initial, own = (_level_step, _level_initial, 4) if level else (_step, _initial, 1)
    return replace(
        effect,
        name=f"{name}{BY}{channel}",
        title=f"{effect.title}, in proportion to {channel}",
        channels=(channel, *effect.channels),
        parameters=(
            *effect.parameters,
            _end(ENDS[0], 0.0, "channel at which nothing of it is there"),
            _end(ENDS[1], 1.0, "channel at which the amplitudes hold"),
            Parameter(LATE, "s", 0.0, 0.0, 100.0, (0.0,), "by which the channel acts late", amplitude=False),
            Parameter(POWER, "", 1.0, 0.1, 10.0, (1.0,), "power of the channel", amplitude=False, e_folds=1.0),
            Parameter(REST, "", 0.0, 0.0, 1.0, (0.0,), "share that is there without the channel", amplitude=False),
            *([LEVEL_ALONE] if level else []),
        ),
        step=jit(_around(step, effect.step)),
        prepare=partial(_prepare, effect),
        n_state=effect.n_state + own,
        initial=_around(initial, effect.initial if effect.initial is not None else _inner),
        variant_of=f"{effect.word}{BY}{channel}" if effect.variant_of else "",
        equation=f"{effect.equation}, times r + (1 - r) max(({channel} - a) / (b - a), 0)^n",
        lags=None,
        elements=None,
        ahead="",
    )


def _end(name: str, value: float, meaning: str) -> Parameter:
    return Parameter(name, "", value, -1e12, 1e12, (value,), meaning, amplitude=False, estimate=False)


def _around(outer: Any, inner: Any) -> Any:
    """`outer` with the effect's own inside: a function of which compiled code, its cache and C tell every effect."""
    python = getattr(inner, "py_func", inner)
    made = FunctionType(outer.__code__, {**globals(), "_inner": inner}, f"{python.__name__}_by")
    made.__annotations__, made.__module__ = outer.__annotations__, python.__module__
    made.__qualname__ = made.__name__
    return made


def _prepare(effect: Effect, p: Mapping[str, float], dt_s: float) -> Floats:
    absent, full = (p[end] for end in ENDS)
    slope = 1.0 / (full - absent) if full != absent else 0.0
    own = [absent, slope, late_decay(p[LATE], dt_s), p[POWER], p[REST]]
    own += [-p[LEVEL], LEAST] if levelled(effect) else []
    return np.concatenate((own, effect.constants(p, dt_s)))


def late_decay(late_s: float, dt_s: float) -> float:
    """Of the channel's low-pass, a sample: 0 where it acts at once."""
    return float(np.exp(-dt_s / late_s)) if late_s > 0.0 else 0.0
