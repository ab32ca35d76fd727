"""What is known of a rig before it is measured: priors of effects, from a TOML file (PH-LAB's is shipped).

An amplitude's sigma is `over_typical` times what its card calls typical, unless [sigma.EFFECT] says better.
"""

from functools import cache
from typing import Annotated

import msgspec
from msgspec import Meta

from thrustd.core.config import Section, read_toml
from thrustd.core.errors import ConfigError
from thrustd.installation.shipped import shipped
from thrustd.model.effects import shelf

SHIPPED = "deploy/ph-lab-rig.toml"
Positive = Annotated[float, Meta(gt=0, le=1e9)]


class RigPriors(Section, frozen=True):
    """One sigma of amplitudes, and effects that cannot be."""

    name: str = ""
    over_typical: Positive = 5.0
    friction_share: Positive = 0.02
    thermometer_k: Positive = 2.0
    without: tuple[str, ...] = ()
    sigma: dict[str, dict[str, Positive]] = msgspec.field(default_factory=dict)  # by effect, parameter

    @property
    def calibration(self) -> float:
        """One sigma of the transducer's scale, 0 where nothing is said of it."""
        return self.sigma.get("sensor_scale", {}).get("scale_error", 0.0)


def read_rig(text: str, where: str) -> RigPriors:
    """Parse and check; ConfigError, one line that begins with `where`."""
    found = read_toml(text, RigPriors, where)
    words: dict[str, set[str]] = {}
    for effect in shelf().values():
        words.setdefault(effect.word, set()).update(p.name for p in effect.parameters if p.amplitude)
    for word in (*found.without, *found.sigma):
        if word not in words:
            raise ConfigError(f"{where}: no effect '{word}', expected one of {', '.join(sorted(words))}")
    for word, told in found.sigma.items():
        for name in told:
            if name not in words[word]:
                known = ", ".join(sorted(words[word]))
                raise ConfigError(f"{where}: sigma.{word}.{name}: no such amplitude, expected one of {known}")
    return found


@cache
def shipped_rig() -> RigPriors:
    """PH-LAB's."""
    path = shipped(SHIPPED, "--rig")
    return read_rig(path.read_text(), str(path))
