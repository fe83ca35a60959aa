"""Formulas as MathML, which a browser typesets by itself: no script and no font is fetched."""

import re
from html import escape
from typing import Any

from paper_checks.framework.typesetting import mathml

BOXED = re.compile(r"\\boxed\{(.*)\}", re.DOTALL)
APART = re.compile(r"\\qquad")


def setup(app: Any) -> dict[str, bool]:
    """Make ``mathml`` one of the renderers that ``html_math_renderer`` may name."""
    app.add_html_math_renderer("mathml", (inline, None), (displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def inline(translator: Any, node: Any) -> None:
    """Write a formula within a line."""
    _write(translator, f'<span class="formula">{typeset(node.astext())}</span>')


def displayed(translator: Any, node: Any) -> None:
    """Write a formula of its own; what stands apart in it goes to the next line if it must."""
    tex = node.astext().strip()
    box = BOXED.fullmatch(tex)
    parts = [typeset(part) for part in APART.split(box[1] if box else tex)]
    kind = "part box" if box else "part"
    spans = "\n".join(f'<span class="{kind}">{part}</span>' for part in parts)
    shown = re.sub(r"<math\b", r'<math displaystyle="true"', spans)
    _write(translator, f'<div class="formula">{shown}</div>\n')


def typeset(tex: str) -> str:
    """Return the MathML of a formula, which keeps its TeX as its alternative text."""
    label = escape(" ".join(tex.split()), quote=True)
    return mathml(tex).replace("<math>", f'<math alttext="{label}">', 1)


def _write(translator: Any, text: str) -> None:
    from docutils.nodes import SkipNode

    translator.body.append(text)
    raise SkipNode
