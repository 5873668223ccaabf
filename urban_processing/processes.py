"""Processes that work side by side."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import Executor, ProcessPoolExecutor


def process_pool(processes: int) -> Executor:
    """Return a pool of worker processes that start afresh, whatever threads this one has."""
    return ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("spawn"))
