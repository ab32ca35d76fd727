"""One thread for linear algebra: the number of processors changes no model."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from thrustd.core.blas import one_thread
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.identify.identify import identify
from thrustd.identify.regression.hypotheses import explained
from thrustd.identify.regression.regress import regress, with_branches

LONG = 20_000  # numbers: their sum is made in as many parts as there are threads, and rounds otherwise


def blas_threads():
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


class LookedAtError(Exception):
    """Somebody asked anything of an argument, with so many threads."""


class Argument:
    """Stands for any argument: tells the number of threads at the first look at it."""

    def _tell(self, *_):
        raise LookedAtError(blas_threads())

    __iter__ = __len__ = __getitem__ = __bool__ = __getattr__ = _tell


def test_a_sum_is_that_of_one_thread_on_any_number_of_processors():
    column = np.random.default_rng(0).normal(size=LONG)
    with threadpool_limits(1, user_api="blas"):
        alone = float(column @ column)
    with threadpool_limits(2, user_api="blas"), one_thread():
        assert float(column @ column) == alone and blas_threads() == {1}


@pytest.mark.parametrize(
    ("estimate", "arguments"),
    [(identify, 1), (regress, 1), (with_branches, 3), (explained, 1), (extend, 3), (diagnose, 2)],
)
def test_what_estimates_has_one_thread(estimate, arguments):
    """Two give other digits of the same record, and took 88 s for 5 where both processors were busy."""
    with threadpool_limits(2, user_api="blas"):
        assert blas_threads() == {2}
        with pytest.raises(LookedAtError) as seen:
            estimate(*[Argument()] * arguments)
    assert seen.value.args == ({1},)
