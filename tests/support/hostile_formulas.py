"""Formulas in files that would keep a computer busy, and what becomes of them."""

import numpy as np

from polycorner.files.formulas import FUNCTIONS

ONE = sorted(FUNCTIONS - {"Add", "Mul", "Min", "Max", "Piecewise", "atan2"})


def nested(form, depth, inner="x"):
    """Return a form in itself."""
    for _ in range(depth):
        inner = form.format(inner)
    return inner


def several(form, count, between=", "):
    return between.join(form.format(k) for k in range(count))


TOWERS = {
    **{f"{name} in {name}": f"{name}({{}})" for name in ONE},
    **{f"{name} of a sum": f"{name}(1 + {{}})" for name in ONE},
    "Abs of sin": "Abs(sin({}))",
    "exp of -": "exp(-{})",
    "exp of log": "exp(log({} + 1))",
    "squares": "({} + y)**2",
    "roots": "({} + y)**(1/3)",
    "powers": "(x + {})**y",
    "powers above": "y**({})",
    "quotients": "1/(1 + {})",
    "Min": "Min({}, y)",
    "Min and Max": "Min(Max({}, x), y + 1)",
    "Piecewise": "Piecewise(({}, x < y), (y, True))",
    "minus": "-({})",
    "atan2": "atan2({}, y)",
    "atan2 of itself": "atan2(y, {})",
}
DOUBLED = {
    "Max": "Max({0} + 1, y*{0})",
    "Piecewise": "Piecewise(({0}, {0} < y), (y, True))",
    "products": "({0} + x)*({0} - y)",
    "sines": "sin({0})*cos({0})",
    "quotients": "{0}/(1 + exp({0}))",
}
WIDE = {
    "Min of lines": f"Min({several('x + {}', 400)})",
    "Min of powers": f"Min({several('(x - y)**{} + y', 400)})",
    "Max of functions": f"Max({several('sin({}*x)*exp(y)', 400)})",
    "Min of products": f"Min({several('x*y*(x + {0})*(y - {0})', 90)})",
    "Min of Max": f"Min({several('Max(x, y - {0}, Abs(x + {0}))', 90)})",
    "Piecewise": f"Piecewise({several('(x + {0}, x < {0})', 400)}, (y, True))",
    "Piecewise of functions": f"Piecewise({several('(x, sin(x + {0}) < y)', 90)}, (y, True))",
    "conditions": f"Piecewise((x, {several('(x < {0})', 90, ' & ')}), (y, True))",
    "functions": f"Add({several('sin({0} + x)*exp(y/({0} + 1))', 200)})",
    "roots of numbers": f"Mul({several('sqrt({} + 2)', 300)})",
    "product": f"Mul({several('(x + {})', 100)})",
}
NUMBERS = {
    "power": "(x + y)**100000",
    "negative power": "(x + y)**-100000",
    "even larger power": "(x + y)**10000000000",
    "power of a coefficient": "(3*x)**100000000",
    "tower": "9**9**9**9",
    "tower of small": "2**2**2**2**2**2",
    "tower of halves": "(1/2)**(1/2)**(1/2)",
    "power of ten": "10**400",
    "negative power of ten": "10**-400",
    "power of a double": "1.5**(10**3000)",
    "smaller power of a double": "1.5**(10**300)",
    "power of a double beyond doubles": "x + 1.5**(10**9)",
    "negative power of a double": "x + 1.5**(-10**18)",
    "doubles multiplied": "*".join(["1e300"] * 60),
    "large double": "x + 1e300**50",
    "double without end": "x + 1e999",
    "root of a long number": f"sqrt({'7' * 4000})",
    "root of a power": "(10**4000)**(1/3)",
    "whole number": "9" * 4000,
    "too long a number": "9" * 5000,
    "hexadecimal": "x + 0x" + "f" * 300_000,
    "product of powers": "*".join(["2**13999"] * 90),
    "coefficient": "*".join(["2**13999*x"] * 90),
    "sum of fractions": " + ".join(f"1/{10**300 + k}" for k in range(90)),
    "sine": "sin(10**4000)",
    "cosine of a part of pi": f"cos(pi/{2**60})",
    "cosine of pi": "cos(pi*10**4000)",
    "power of pi": "pi**10**300",
    "exponential": "exp(10**300)",
    "towers of exp": nested("exp({})", 9, "9"),
    "logarithm": "log(10**4000)",
    "division": "x/0",
    "division of nothing": "x/(y - y)",
    "zero to a negative power": "0**-1*x",
    "infinite": "log(0) + x",
    "complex": "sqrt(-1) + x",
}
TEXTS = {
    "nothing": "",
    "zero byte": "x\0",
    "half a character": "x + '\ud800'",
    "lines": "x\n+ y",
    "brackets": "(" * 100_000 + "x" + ")" * 100_000,
    "signs": "-" * 100_000 + "x",
    "sum": " + ".join(["x"] * 100_000),
    "megabytes": "x" * 5_000_000,
    "names": f"Add({several('a{}', 40_000)})",
    "list": "[" * 5000 + "]" * 5000,
    "arguments": "sin(x, y)",
    "no argument": "sin()",
    "no arguments": "Min()",
    "comparison as a number": "(x < y) + 1",
    "number as a condition": "Piecewise((x, y), (y, True))",
    "Piecewise as a condition": nested("Piecewise((x, {} < y), (y, True))", 12),
    "pair": "(x, y)",
    "pair as a number": "(x, y) + 1",
    "truth": "True",
    "several comparisons": "Piecewise((x, 0 < x < y), (y, True))",
}
FAMILY = {
    **{f"{n}, {d} deep": nested(f, d) for n, f in TOWERS.items() for d in (8, 40, 400, 3000)},
    **{f"{n}, {d} times doubled": nested(f, d) for n, f in DOUBLED.items() for d in (4, 7, 9)},
    **WIDE,
    **NUMBERS,
    **TEXTS,
}


def entry(text):
    """Return a polyhedron of one function as a file has it."""
    line = {"unit": "", "period": "inf", "scale": 1.0}
    function = {"name": "g", "family": 0, "member": "f", "reads": ["b", "a"], "parameters": []}
    family = {
        "variables": ["x", "y"],
        "parameters": [],
        "definitions": {},
        "formulas": {"f": text},
        "unit": "",
    }
    return {
        "coordinates": [{"name": name, **line} for name in "ab"],
        "families": [family],
        "functions": [function],
        "equations": [],
        "energy": None,
        "tree": {"all": [0]},
        "annotations": [],
    }


def outcome(text):
    """Return what becomes of a formula, in words."""
    from polycorner.files.polyhedra import read_polyhedron

    try:
        polyhedron, _ = read_polyhedron(entry(text))
    except ValueError as error:
        sentence = str(error)
        named = sentence.startswith(("formula 'f': expected ", "f: "))
        return "refused" if named and "\n" not in sentence else f"refused badly: {error}"
    values = polyhedron.evaluate(np.array([0.3, 0.4]), 2)
    return "read" if all(part.dtype == np.float64 for part in values) else "read badly"
