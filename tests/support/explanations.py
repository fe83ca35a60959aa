"""Numbers, names and directions read from the sentences of an explanation."""

import re

import numpy as np

NUMBER = r"(-?[\d.]+(?:e[-+]\d+)?)"


def sentence(text, words):
    """Return the one line that contains the words."""
    (found,) = [line for line in text.splitlines() if words in line]
    return found


def figures(text, words):
    """Return the numbers after each occurrence of the words."""
    return [float(found) for found in re.findall(re.escape(words) + " " + NUMBER, text)]


def direction(line, manifold):
    """Return a direction from a sentence, in the manifold's own coordinates."""
    components = dict(re.findall(rf"d(\w+) = {NUMBER}", line))
    return np.array([float(components.get(name, 0)) for name in manifold.names])


def opening_rates(text):
    """Return the contacts whose opening lowers the energy, with the rates."""
    found = re.findall(rf"^Opening (\w+).* at the rate {NUMBER} per", text, re.MULTILINE)
    return {name: float(rate) for name, rate in found}
