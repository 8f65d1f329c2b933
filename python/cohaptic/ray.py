"""Executor with the workers of Ray. The package ``ray`` must be installed."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

import ray


class RayExecutor(Executor):
    """A ``concurrent.futures.Executor`` over the cluster that ``ray.init`` has joined, for :func:`cohaptic.campaign` for example.

    ``options`` are the options of a remote function of Ray, such as ``num_cpus`` of each call and ``max_retries`` after the loss of a worker. Workers need
    the packages that define the called functions.
    """

    def __init__(self, **options: Any) -> None:
        remote = ray.remote(_call)
        self._call = remote.options(**options) if options else remote
        self._waiting: dict[Future[Any], Any] = {}
        self._is_shut = False

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Calls a function on a worker."""
        if self._is_shut:
            raise RuntimeError("this executor was shut down")
        reference = self._call.remote(fn, args, kwargs)
        future: Future[Any] = reference.future()
        self._waiting[future] = reference
        future.add_done_callback(lambda future: self._waiting.pop(future, None))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Refuses further calls. The cluster keeps running."""
        self._is_shut = True
        for future, reference in list(self._waiting.items()):
            if cancel_futures:
                ray.cancel(reference)
            elif wait:
                future.exception()


def _call(function: Callable[..., Any], arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
    return function(*arguments, **keywords)
