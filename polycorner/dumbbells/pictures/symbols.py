"""Colours, words and symbols for chirality, kinds of edges and corners, and units."""

from polycorner.dumbbells.pair import DumbbellPair

HANDS = {"R": "#009E73", "L": "#CC79A7", "N": "0.55"}
WORDS = {"R": "right-handed", "L": "left-handed", "N": "without chirality"}
# Kinds of edges by their numbers of ball-ball, ball-rod and rod-rod contacts.
KINDS = {(2, 0, 0): "#0072B2", (1, 1, 0): "#E69F00", (0, 2, 0): "0.35"}
KIND_WORDS = {
    (2, 0, 0): "ball on ball twice",
    (1, 1, 0): "ball on ball, ball on rod",
    (0, 2, 0): "two balls on rods",
}
CONTACT = "#F0E442"
LETTERS = {"Delta": r"\Delta", "E": r"\mathcal{E}"}


def corner_symbol(kind: str, *, hand: bool = True) -> str:
    r"""Return a kind of corner as mathematical text, with its chirality as an index if wanted.

    Kinds are ``Delta_R``, ``E_L``, or ``C300_N`` with the numbers of contacts.

    Examples
    --------
    >>> corner_symbol("Delta_R"), corner_symbol("C320_N"), corner_symbol("E_L", hand=False)
    ('$\\Delta_R$', '$C^{320}$', '$\\mathcal{E}$')
    """
    letter, chirality = kind.split("_")
    symbol = LETTERS.get(letter, f"C^{{{letter[1:]}}}")
    return f"${symbol}_{chirality}$" if hand and chirality != "N" else f"${symbol}$"


def energy_unit(pair: DumbbellPair) -> str:
    """Return the unit of the energy of a pair."""
    return "mm²" if pair.is_plane else "mm"


def multiplier_unit(pair: DumbbellPair) -> str:
    """Return the unit of multipliers ``dE/dgap``: that of the energy, per millimetre of gap."""
    return "mm" if pair.is_plane else "mm/mm"


def sizes_in_words(pair: DumbbellPair) -> str:
    """Return length, ball radius and rod radius with their unit."""
    return f"l = {pair.length:g}, r = {pair.ball_radius:g}, t = {pair.rod_radius:g} mm"
