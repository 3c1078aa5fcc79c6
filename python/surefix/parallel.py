"""Independent pieces of work, some at a time."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import TypeVar

T = TypeVar("T")


def in_parallel(
    work: Sequence[Callable[[], T]], progress: Callable[[int, int], None], jobs: int | None = None
) -> list[T]:
    """Results in the order of ``work``, two at a time by default: the engine lets other threads
    run. ``progress`` is called with (done, total)."""
    pool = ThreadPoolExecutor(jobs or min(2, os.cpu_count() or 1))
    try:
        futures = [pool.submit(task) for task in work]
        for done, future in enumerate(as_completed(futures), start=1):
            future.result()
            progress(done, len(work))
        return [future.result() for future in futures]
    finally:
        pool.shutdown(cancel_futures=True)
