"""Function calls in a spawned process."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor


def called(function, *arguments):
    """Return ``function(*arguments)``, computed in a spawned process."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()
