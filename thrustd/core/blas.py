"""One thread for linear algebra: the matrices of an estimation are small, and threads that wait for each other cost
more than they compute (twenty times more on two busy cores). Their number also decides the order of sums, so that the
same record would give another last digit on another computer."""

from collections.abc import Iterator
from contextlib import contextmanager

import scipy.linalg  # noqa: F401  scipy's BLAS is another library than numpy's: it has to be there to be limited
from threadpoolctl import threadpool_limits


@contextmanager
def one_thread() -> Iterator[None]:
    """A context, or a decorator: BLAS uses the calling thread alone."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield
