"""One thread for linear algebra: the matrices of an estimation are small, and threads that wait for each other cost
more than they compute (twenty times more on two busy cores)."""

from contextlib import AbstractContextManager

from threadpoolctl import threadpool_limits


def one_thread() -> AbstractContextManager[object]:
    """A context in which BLAS uses the calling thread alone."""
    limits: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limits
