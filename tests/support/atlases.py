"""Atlases of pairs, each computed once in a process: several files look at the same ones."""

from functools import cache

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.skeleton import PairAtlas, pair_atlas


def kept_atlas(pair: DumbbellPair, heading: float = 0.0) -> PairAtlas:
    """Return the atlas of a pair."""
    return _computed(pair, heading)


@cache
def _computed(pair: DumbbellPair, heading: float) -> PairAtlas:
    return pair_atlas(pair, heading=heading)
