"""Effects by a law that others of their word do not hold: made here from the physics, found by name to the floor."""

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnose.scene import DT_S, NOISE_N, mount, record
from thrustd.core.columns import Floats
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.model.compile import compile_model
from thrustd.records.recording import Recording

N = 24_000


def softened_for_good(x: Floats) -> Floats:
    """What was broken is missed on the way to a new maximum, too."""
    return -0.12 * (1.0 - np.exp(-((np.maximum.accumulate(x) / 0.75) ** 2)))


def softened_in_cycles(x: Floats) -> Floats:
    """Every way as long as the largest deformation breaks a fifth of what it breaks in the end and has not yet."""
    most = np.maximum.accumulate(np.abs(x)) + 1e-12
    kept, broken, found = 0.8 ** (np.abs(np.diff(x, prepend=0.0)) / most), 0.0, []
    for part, whole in zip(kept, 1.0 - np.exp(-most / 0.6), strict=True):
        broken = whole - part * (whole - broken)
        found.append(broken)
    return -0.2 * np.array(found)


def hardened(x: Floats) -> Floats:
    """By as much in every tenfold of time."""
    return 0.03 * np.log10(1.0 + np.arange(len(x)) * DT_S / 20.0)


def scaled(gain: Floats) -> Recording:
    def more(data):
        model = compile_model(mount(), 1 / DT_S)
        return gain(data["deformation_mm"]) * model.simulate(model.inputs(data))

    return record(added=more, n=N)


def relaxed(gain: Floats) -> Recording:
    """The spring in front of the relaxation is softened, not the force."""

    def more(data):
        x = data["deformation_mm"]
        w = total = gain(x) * (5000.0 * x + 1000.0 * x**3)
        for share, tau_s in ((0.05, 0.4), (0.04, 60.0)):
            keep = np.exp(-DT_S / tau_s)
            total = total + share * (w - lfilter([1.0 - keep], [1.0, -keep], w, zi=[keep * w[0]])[0])
        return total

    return record(added=more, n=N)


def crept() -> Recording:
    """Two retardation times, one after the other."""
    whole = record(n=N)
    elastic = reading = whole["deformation_mm"]
    for share, tau_s in ((0.04, 8.0), (0.05, 250.0)):
        keep = np.exp(-DT_S / tau_s)
        reading = reading + share * lfilter([1.0 - keep], [1.0, -keep], elastic)
    return whole.with_channels(deformation_mm=reading)


@pytest.mark.parametrize(
    ("measured", "word"),
    [
        (lambda: scaled(softened_for_good), "mullins_softening"),
        (lambda: relaxed(softened_in_cycles), "mullins_softening"),
        (lambda: scaled(hardened), "ageing"),
        (crept, "creep"),
    ],
    ids=["mullins", "mullins in cycles", "ageing", "creep"],
)
def test_it_is_named_and_nothing_is_left(measured, word):
    report = diagnose(mount(), [measured()])
    assert report.verdict == (word,)
    assert report.rmse_after_n < 1.05 * NOISE_N
