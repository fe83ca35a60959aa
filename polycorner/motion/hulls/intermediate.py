"""The compiled contacts of hulls, by address.

``python -m polycorner.motion.hulls.intermediate`` writes their intermediate code; ``make
intermediate`` does this after any of their sources was changed.
"""

from polycorner.formulas.shipped import Shipped

NAMES = ("values", "gradients", "finite", "slips", "all_slips")
# Kernels of formulas take five addresses, and return nothing; functions of Numba return where they
# are told to.
CALLED = """
define void @{name}_point(ptr %q, ptr %p, ptr %f, ptr %J, ptr %H) {{
  %result = alloca i64
  %failure = alloca ptr
  %1 = ptrtoint ptr %q to i64
  %2 = ptrtoint ptr %p to i64
  %3 = ptrtoint ptr %f to i64
  %4 = ptrtoint ptr %J to i64
  %5 = ptrtoint ptr %H to i64
  %6 = call i32 @{name}(ptr %result, ptr %failure, i64 %1, i64 %2, i64 %3, i64 %4, i64 %5)
  ret void
}}
"""


def _make() -> str:
    from polycorner.formulas.intermediate import intermediate_code
    from polycorner.motion.hulls import gaps

    functions = {name: getattr(gaps, name) for name in NAMES}
    return intermediate_code(functions, arguments=5) + "".join(
        CALLED.format(name=name) for name in NAMES
    )


SHIPPED = Shipped(
    package="polycorner.motion.hulls",
    file="hulls.ll.xz",
    make=_make,
    names=tuple(f"{name}_point" for name in NAMES),
    arguments=5,
    results=0,
    what="the contacts of sharp hulls",
    seconds=10,
    sources=("memory.py", "geometry.py", "planes.py", "gaps.py"),
)

if __name__ == "__main__":
    SHIPPED.write()
