"""A mount's model is the same whichever process has made it."""

import numpy as np
import pytest

from thrustd.commission import mount_models
from thrustd.commission.one_mount import all_identified, identified
from thrustd.core.errors import RecordingError
from thrustd.twin.bench import step_bench
from thrustd.twin.mount import LOWER, UPPER


@pytest.fixture(scope="module")
def given():
    benches = [step_bench(0.3, seed, mount).resample(2.0) for seed, mount in ((61, UPPER), (62, LOWER))]
    return [(f"mount_{place}", [bench]) for place, bench in enumerate(benches)]


def test_to_the_byte(given):
    here = [identified(*one) for one in given]
    assert all_identified(given, int) == here
    assert here[0].model != here[1].model and here[0].unseen_n < 30.0


def test_a_bench_that_tells_nothing_is_one_line(given):
    """Here and there."""
    name, bench, rng = given[0][0], step_bench(0.3, 61, UPPER).resample(5.0), np.random.default_rng(0)
    noise = bench.with_channels(force_N=1e3 * rng.standard_normal(len(bench)))
    for ask in (lambda: identified(name, [noise]), lambda: all_identified([(name, [noise]), given[1]], int)):
        with pytest.raises(RecordingError, match="--bench mount_0: DO NOT USE THIS MODEL"):
            ask()


@pytest.mark.parametrize(("long", "processors", "where"), [(10, 2, "beside"), (10, 1, "here"), (10**9, 2, "here")])
def test_long_benches_go_side_by_side_where_there_are_processors(given, monkeypatch, long, processors, where):
    def beside(given, told):
        return ["beside" for _ in given]

    monkeypatch.setattr(mount_models, "all_identified", beside)
    monkeypatch.setattr(mount_models, "identified", lambda *_: "here")
    monkeypatch.setattr(mount_models, "_made", lambda answer, *_: answer)
    monkeypatch.setattr(mount_models, "LONG", long)
    monkeypatch.setattr(mount_models, "processors", lambda: processors)
    assert mount_models._all_identified(given, lambda *_: None) == [where, where]
