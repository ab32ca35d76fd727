"""The twin's hidden cases, with the exact model of their mount."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import pytest

from tests.diagnose.scene import mount, record
from thrustd.identify.identify import identify
from thrustd.model.artifact import ModelSpec
from thrustd.records.recording import Recording
from thrustd.twin.hide import hidden_case


@dataclass(frozen=True)
class TwinCase:
    model: ModelSpec
    measured: Recording
    heldout: Recording
    truth: dict[str, Any]


@pytest.fixture(scope="session")
def twin_case():
    """Hidden cases of the twin by (effects, seed): 40 minutes at 20 Hz, the mount's exact model without the effect."""
    made = {}

    def case(effects, seed=1, strength=3.0):
        key = (effects, seed, strength)
        if key not in made:
            hidden = hidden_case(effects, seed, strength, seconds=2400.0)
            m = hidden.truth["mount"]
            model = mount(m["stiffness_n_mm"], m["cubic_n_mm3"], m["relaxation"], m["relaxation_s"])
            made[key] = TwinCase(model, hidden.measured, hidden.heldout, hidden.truth)
        return made[key]

    return case


@pytest.fixture(scope="session")
def identified():
    """The mount of the scene by its own bench, by the seed of that record: identified once for all who ask."""
    return cache(lambda seed: identify([record(seed=seed)]).spec)
