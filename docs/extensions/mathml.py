"""Formulas as MathML, typeset by the browser without scripts or fonts from elsewhere."""

import re
from html import escape
from typing import Any

from paper_checks.framework.typesetting import mathml

BOXED = re.compile(r"\\boxed\{(.*)\}", re.DOTALL)
APART = re.compile(r"\\qquad")
PUNCTUATION = re.compile(r"[,.;:!?)\]]+")


def setup(app: Any) -> dict[str, bool]:
    """Make ``mathml`` one of the renderers that ``html_math_renderer`` may name."""
    app.add_html_math_renderer("mathml", (inline, None), (displayed, None))
    app.connect("doctree-resolved", keep_punctuation)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def keep_punctuation(_app: Any, document: Any, _name: str) -> None:
    """Attach the punctuation after an inline formula to it, so that no line begins with a comma."""
    from docutils import nodes

    for node in document.findall(nodes.math):
        after = node.next_node(siblings=True, descend=False)
        found = PUNCTUATION.match(after.astext()) if isinstance(after, nodes.Text) else None
        if found:
            node["after"] = found[0]
            after.parent.replace(after, nodes.Text(after.astext()[found.end() :]))


def inline(translator: Any, node: Any) -> None:
    """Write a formula within a line, on one line with the punctuation that follows it."""
    formula = f'<span class="formula">{typeset(node.astext())}</span>'
    after = node.get("after", "")
    _write(translator, f'<span class="nb">{formula}{escape(after)}</span>' if after else formula)


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
