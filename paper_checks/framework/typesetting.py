"""Sentences with TeX between dollars, as HTML with MathML and as plain text for a terminal.

Browsers typeset MathML themselves: neither scripts nor fonts have to be fetched.
"""

import re
from collections.abc import Iterator
from functools import cache
from html import escape
from xml.etree import ElementTree as ET

from polycorner.toolkit import checks

NAMESPACE = ' xmlns="http://www.w3.org/1998/Math/MathML"'
FORMULA = re.compile(r"\$([^$]+)\$")
CODE = re.compile(r"`([^`]+)`")
# Punctuation next to a formula stays on the same line as the formula.
CLINGING = re.compile(r"(\(?<math>(?:(?!<math>).)*?</math>[.,;:)?°]+)")
# Signs before which a line may be broken, so that long formulas fit on narrow screens.
RELATIONS = frozenset("=<>≤≥≠≈≃∼≡∈∉⊂⊆→↦⟹⇒⇔∪∩")
JOINTS = frozenset("+−/")
LONG = 20  # least number of characters, as plain text, of a formula that may be broken
SYMBOLS = {
    "cdot": "·", "times": "×", "le": "≤", "leq": "≤", "ge": "≥", "geq": "≥", "ne": "≠", "neq": "≠",
    "approx": "≈", "sim": "~", "simeq": "≃", "equiv": "≡", "pm": "±", "mp": "∓", "to": "→",
    "mapsto": "↦", "in": "∈", "ni": "∋",
    "notin": "∉", "subset": "⊂", "subseteq": "⊆", "cup": "∪", "cap": "∩",
    "bigcup": "⋃", "bigcap": "⋂", "setminus": "∖", "emptyset": "∅", "partial": "∂", "nabla": "∇",
    "infty": "∞", "circ": "°", "ell": "ℓ", "ldots": "…", "dots": "…", "cdots": "⋯", "sum": "Σ",
    "int": "∫", "sqrt": "√", "langle": "⟨", "rangle": "⟩", "lvert": "|", "rvert": "|", "vert": "|",
    "mid": "|", "lVert": "‖", "rVert": "‖", "Vert": "‖", "perp": "⊥", "parallel": "∥", "cong": "≅",
    "Rightarrow": "⇒", "implies": "⇒", "iff": "⇔", "ll": "≪", "gg": "≫", "ast": "*", "star": "⋆",
    "varphi": "φ", "phi": "φ", "vartheta": "ϑ", "varepsilon": "ε", "epsilon": "ε", "alpha": "α",
    "beta": "β", "gamma": "γ", "delta": "δ", "zeta": "ζ", "eta": "η", "theta": "θ", "kappa": "κ",
    "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "pi": "π", "rho": "ρ", "sigma": "σ", "tau": "τ",
    "chi": "χ", "psi": "ψ", "omega": "ω", "Gamma": "Γ", "Delta": "Δ", "Theta": "Θ", "Lambda": "Λ",
    "Pi": "Π", "Sigma": "Σ", "Phi": "Φ", "Psi": "Ψ", "Omega": "Ω", "wedge": "∧", "vee": "∨",
    "colon": ":", "quad": " ", "qquad": " ", "displaystyle": "",
    "textstyle": "", "bar": "", "dot": "", "hat": "", "tilde": "", "vec": "",
}  # fmt: skip
TIGHT = "/∂|"
STYLE = re.compile(r"\\(?:mathcal|math[a-z]+|text|operatorname|overline)\s*\{([^{}]*)\}")
FRACTION = re.compile(r"\\[dt]?frac\s*\{([^{}]*)\}\s*\{([^{}]*)\}")
COMMAND = re.compile(r"\\([A-Za-z]+)")
ROOT = re.compile(r"\\sqrt\s*\{([^{}]*)\}")
SCRIPT = re.compile(r"([_^])\{([^{}]*)\}")
TIDY = ((r"\^\(?°\)?", "°"), (r" +([_^)])", r"\1"), (r"([a-z]) +\(", r"\1("))
SIMPLE = re.compile(r"[\w.°]+|\\[A-Za-z]+")


def html(text: str) -> str:
    """Return a sentence as HTML, its formulas as MathML."""
    written = "".join(
        mathml(part) if is_formula else CODE.sub(r"<code>\1</code>", escape(part))
        for part, is_formula in pieces(text)
    )
    return CLINGING.sub(r'<span class="nb">\1</span>', written)


def sentence(text: str) -> str:
    """Return a text with an initial capital and a full stop at its end."""
    first = text[:1].upper() if text[1:2].islower() or text[1:2] == " " else text[:1]
    return first + text[1:] + ("" if text.endswith((".", "!", "?", ":")) else ".")


def plain(text: str) -> str:
    """Return a sentence for a terminal, its formulas in Unicode as far as possible."""
    return "".join(_unicode(part) if is_formula else part for part, is_formula in pieces(text))


def pieces(text: str) -> Iterator[tuple[str, bool]]:
    """Yield the parts of a sentence, and whether they are formulas."""
    for position, part in enumerate(FORMULA.split(text)):
        if part:
            yield part, position % 2 == 1


@cache
def mathml(tex: str) -> str:
    """Return a formula as MathML, in parts between which lines may be broken.

    Raises
    ------
    ValueError
        For a formula with a command that cannot be typeset.
    """
    from latex2mathml.converter import convert

    written = convert(tex)
    row = ET.fromstring(written.replace(NAMESPACE, "", 1))[0]
    unknown = [leaf.text for leaf in row.iter() if leaf.text and "\\" in leaf.text]
    if unknown:
        checks.refuse("formula", f"TeX without {unknown[0]}, which MathML lacks", tex)
    for inner in list(row.iter("mrow")):
        _join_letters(inner)
        _space_functions(inner)
    for sign in row.iter("mo"):
        if sign.text and sign.text in TIGHT:
            sign.attrib.update(lspace="0", rspace="0")
    parts = _broken(list(row)) if len(_unicode(tex)) > LONG else [list(row)]
    return "<wbr>".join(f"<math>{_written(part)}</math>" for part in parts)


def _broken(row: list[ET.Element]) -> Iterator[list[ET.Element]]:
    """Split a row before its relations, and parts that are still long before sums and slashes."""
    for part in _split(row, RELATIONS):
        if len(_letters(part)) <= LONG:
            yield part
        else:
            yield from _split(part, JOINTS)


def _letters(nodes: list[ET.Element]) -> str:
    return "".join(text for node in nodes for text in node.itertext())


def _split(nodes: list[ET.Element], signs: frozenset[str]) -> Iterator[list[ET.Element]]:
    """Split a row before some signs that stand in no parentheses."""
    part: list[ET.Element] = []
    depth = 0
    for node in nodes:
        mark = (node.text or " ") if node.tag == "mo" else " "
        depth += (mark in "([{") - (mark in ")]}")
        if part and depth == 0 and mark in signs and not (len(part) == 1 and part[0].tag == "mo"):
            if mark in "+−":  # at the start of a part it would be typeset as a unary sign
                node.attrib.update(form="infix")
            yield part
            part = []
        part.append(node)
    if part:
        yield part


def _join_letters(row: ET.Element) -> None:
    """Join consecutive upright letters into one word."""
    word: ET.Element | None = None
    for node in list(row):
        if node.tag != "mi" or node.get("mathvariant") != "normal":
            word = None
        elif word is None:
            word = node
        else:
            word.text = f"{word.text}{node.text}"
            row.remove(node)


def _space_functions(row: ET.Element) -> None:
    """Put thin spaces around the name of a function, but not before parentheses."""
    nodes = list(row)
    for position in range(len(nodes) - 1, 0, -1):
        before, after = nodes[position - 1], nodes[position]
        apart = "mo" not in (before.tag, after.tag) or before.text == ")"
        if apart and (_is_name(before) or _is_name(after)):
            row.insert(position, ET.Element("mspace", width="0.17em"))


def _is_name(node: ET.Element) -> bool:
    """Whether a node is a word, such as ``sin``, or a power of one."""
    letter = node[0] if node.tag in ("msup", "msub") else node
    return letter.tag == "mi" and len(letter.text or "") > 1


def _written(nodes: list[ET.Element]) -> str:
    text = "".join(ET.tostring(node, encoding="unicode") for node in nodes)
    return f"<mrow>{text}</mrow>"


def _unicode(tex: str) -> str:
    text = tex.replace(r"\{", "⦃").replace(r"\}", "⦄").replace(r"\left", "").replace(r"\right", "")
    while (shorter := _innermost(text)) != text:
        text = shorter
    text = COMMAND.sub(lambda found: SYMBOLS.get(found[1], f" {found[1]} "), text)
    text = re.sub(r"\\[,;:! ]", " ", text).replace("\\|", "‖").replace("\\", "")
    text = text.replace("{", "").replace("}", "")
    for pattern, replacement in TIDY:
        text = re.sub(pattern, replacement, text)
    return re.sub(r"\s+", " ", text.replace("⦃", "{").replace("⦄", "}")).strip()


def _innermost(text: str) -> str:
    """Write the innermost fractions, roots, styles, indices and powers without braces."""
    text = STYLE.sub(r"\1", text)
    text = FRACTION.sub(lambda found: "/".join(map(_grouped, found.groups())), text)
    text = ROOT.sub(lambda found: f"√{_grouped(found[1])}", text)
    return SCRIPT.sub(lambda found: found[1] + _grouped(found[2]), text)


def _grouped(part: str) -> str:
    return part if SIMPLE.fullmatch(part.strip()) else f"({part.strip()})"
