"""What nothing could go below: noise, or what the bench left."""

from types import SimpleNamespace

from thrustd.diagnose.search.floor import at_floor, floor_of
UNEXPLAINED = 0.01


def test_the_floor_is_the_noise_or_what_the_bench_left_whichever_is_less():
    fit = SimpleNamespace(plateau=0.001, mse=(1.02 * UNEXPLAINED) ** 2, terms=("law",))
    cell = SimpleNamespace(promised=0.004)
    assert floor_of(fit, cell) == 0.001 and not at_floor(fit, cell)
    assert floor_of(fit, SimpleNamespace(promised=0.0005)) == 0.0005
    assert at_floor(SimpleNamespace(plateau=0.001, mse=0.00104**2, terms=("law",)), cell)
