"""A straight-line program as LLVM instructions, for one point or for several lanes at once.

No instruction may be reordered or contracted, so one lane and eight lanes give the same bits.
"""

from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from math import factorial
from typing import Any

from llvmlite import ir

from polycorner.formulas.programs import Graph

LANES = 8
F64, I64 = ir.DoubleType(), ir.IntType(64)
LIBM_BINARY = ("atan2", "pow")

# Argument reduction by pi/2 in three parts (Cody and Waite): each of the first two has 33 bits, so
# that its product with a quadrant number below 2**20 is exact; the last carries the remainder.
HALF_PI = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)
REDUCTION_LIMIT = 1.0e6
ROUNDER = 1.5 * 2.0**52
SINE_TERMS = [(-1) ** k / factorial(2 * k + 1) for k in range(1, 8)]
COSINE_TERMS = [(-1) ** k / factorial(2 * k) for k in range(2, 9)]


@lru_cache(maxsize=8)
def lane_type(lanes: int) -> ir.Type:
    """Return the type of a number in every lane."""
    return F64 if lanes == 1 else ir.VectorType(F64, lanes)


def splat(value: float, lanes: int) -> ir.Constant:
    """Return one constant in every lane."""
    return _splat(float(value).hex(), lanes)  # as text, 0.0 and -0.0 are told apart


@lru_cache(maxsize=4096)
def _splat(text: str, lanes: int) -> ir.Constant:
    """Return a constant, whose text in intermediate code is long and is made once."""
    value = float.fromhex(text)
    return ir.Constant(lane_type(lanes), value if lanes == 1 else [value] * lanes)


class Emitter:
    """Translates the nodes of one graph, each at most once, into a block of instructions."""

    def __init__(
        self,
        builder: ir.IRBuilder,
        graph: Graph,
        leaves: Callable[[str, int], ir.Value],
        lanes: int,
    ) -> None:
        self.builder, self.graph, self.leaves, self.lanes = builder, graph, leaves, lanes
        self._done: dict[int, ir.Value] = {}
        self._circular: dict[int, tuple[ir.Value, ir.Value]] = {}

    def value(self, node: int) -> ir.Value:
        """Return the value of a node, emitting what it needs."""
        for a in self.graph.needed([node], known=self._done):
            self._done[a] = self._emit(*self.graph.nodes[a])
        return self._done[node]

    def _emit(self, op: str, args: tuple[Any, ...]) -> ir.Value:
        b = self.builder
        if op == "const":
            return splat(_float(args[0]), self.lanes)
        if op in {"var", "par"}:
            return self.leaves(op, args[0])
        values = [self._done[a] for a in args]
        arithmetic = {"add": b.fadd, "sub": b.fsub, "mul": b.fmul, "div": b.fdiv}
        if op in arithmetic:
            return arithmetic[op](*values)
        if op == "neg":
            return b.fneg(values[0])
        if op in {"lt", "le"}:
            return b.fcmp_ordered("<" if op == "lt" else "<=", *values)
        if op in {"and", "or", "not"}:
            return {"and": b.and_, "or": b.or_, "not": b.not_}[op](*values)
        if op == "select":
            return b.select(*values)
        if op == "sqrt":
            return b.call(intrinsic(b.module, "sqrt", self.lanes), values)
        if op in {"sin", "cos"}:
            return self._sine_cosine(args[0])[op == "cos"]
        return self._library(op, values)

    def _sine_cosine(self, argument: int) -> tuple[ir.Value, ir.Value]:
        if argument not in self._circular:
            routine = sine_cosine(self.builder.module, self.lanes)
            both = self.builder.call(routine, [self._done[argument]])
            extract = self.builder.extract_value
            self._circular[argument] = (extract(both, 0), extract(both, 1))
        return self._circular[argument]

    def _library(self, op: str, values: list[ir.Value]) -> ir.Value:
        return by_lane(self.builder, library(self.builder.module, op), values, self.lanes)


def intrinsic(module: ir.Module, name: str, lanes: int) -> ir.Function:
    """Declare one of LLVM's own functions of one number, in every lane."""
    suffix = "f64" if lanes == 1 else f"v{lanes}f64"
    full = f"llvm.{name}.{suffix}"
    if full not in module.globals:
        kind = lane_type(lanes)
        ir.Function(module, ir.FunctionType(kind, [kind]), full)
    return module.globals[full]


def library(module: ir.Module, name: str) -> ir.Function:
    """Declare a function of the C mathematics library."""
    if name not in module.globals:
        arguments = [F64] * (2 if name in LIBM_BINARY else 1)
        ir.Function(module, ir.FunctionType(F64, arguments), name)
    return module.globals[name]


def by_lane(
    builder: ir.IRBuilder, function: ir.Function, values: list[ir.Value], lanes: int
) -> ir.Value:
    """Call a scalar function in every lane."""
    if lanes == 1:
        return builder.call(function, values)
    result = ir.Constant(lane_type(lanes), ir.Undefined)
    for k in range(lanes):
        position = ir.Constant(I64, k)
        lane = builder.call(function, [builder.extract_element(v, position) for v in values])
        result = builder.insert_element(result, lane, position)
    return result


def sine_cosine(module: ir.Module, lanes: int) -> ir.Function:
    """Return the routine ``x -> (sin x, cos x)``, within two units in the last place.

    The argument is reduced to ``|r| <= pi/4``, where the Taylor sums up to ``r**15`` and
    ``r**16`` are truncated below ``5e-17``.  Beyond ``REDUCTION_LIMIT`` the C library takes over.
    """
    name = f"sine_cosine_{lanes}"
    if name in module.globals:
        return module.globals[name]
    kind = lane_type(lanes)
    pair = ir.LiteralStructType([kind, kind])
    routine = ir.Function(module, ir.FunctionType(pair, [kind]), name)
    routine.linkage = "internal"
    x = routine.args[0]
    entry, near, far = (routine.append_basic_block(label) for label in ("entry", "near", "far"))
    b = ir.IRBuilder(entry)
    size = b.call(intrinsic(module, "fabs", lanes), [x])
    outside = b.fcmp_unordered(">=", size, splat(REDUCTION_LIMIT, lanes))
    b.cbranch(_any(b, outside, lanes), far, near)
    b.position_at_end(near)
    _return_pair(b, pair, _reduced(b, x, lanes))
    b.position_at_end(far)
    # Lanes with small arguments keep the values they would have had alone.
    mixed = [
        b.select(outside, by_lane(b, library(module, name), [x], lanes), close)
        for name, close in zip(("sin", "cos"), _reduced(b, x, lanes), strict=True)
    ]
    _return_pair(b, pair, mixed)
    return routine


def _any(b: ir.IRBuilder, mask: ir.Value, lanes: int) -> ir.Value:
    if lanes == 1:
        return mask
    bits = b.bitcast(mask, ir.IntType(lanes))
    return b.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(lanes), 0))


def _return_pair(b: ir.IRBuilder, pair: ir.Type, values: list[ir.Value]) -> None:
    result = b.insert_value(ir.Constant(pair, ir.Undefined), values[0], 0)
    b.ret(b.insert_value(result, values[1], 1))


def _reduced(b: ir.IRBuilder, x: ir.Value, lanes: int) -> list[ir.Value]:
    def constant(value: float) -> ir.Constant:
        return splat(value, lanes)

    integers = I64 if lanes == 1 else ir.VectorType(I64, lanes)

    def bit(word: ir.Value, value: int) -> ir.Value:
        mask = ir.Constant(integers, value if lanes == 1 else [value] * lanes)
        zero = ir.Constant(integers, 0 if lanes == 1 else [0] * lanes)
        return b.icmp_unsigned("!=", b.and_(word, mask), zero)

    # Adding 1.5 * 2**52 rounds to a whole number and leaves it in the low bits of the word.
    shifted = b.fadd(b.fmul(x, constant(2 / 3.141592653589793)), constant(ROUNDER))
    quadrant = b.bitcast(shifted, integers)
    count = b.fsub(shifted, constant(ROUNDER))
    first, second, third = (b.fmul(count, constant(part)) for part in HALF_PI)
    # Only the last step rounds: the digits that the second one loses are carried over to it.
    exact = b.fsub(x, first)
    head = b.fsub(exact, second)
    lost = b.fsub(b.fsub(exact, head), second)
    r = b.fadd(head, b.fsub(lost, third))
    sine, cosine = _sine_sum(b, r, constant), _cosine_sum(b, r, constant)
    odd, upper = bit(quadrant, 1), bit(quadrant, 2)
    new_sine = b.select(odd, cosine, sine)
    new_cosine = b.select(odd, b.fneg(sine), cosine)
    return [b.select(upper, b.fneg(v), v) for v in (new_sine, new_cosine)]


def _horner(
    b: ir.IRBuilder, z: ir.Value, terms: list[float], constant: Callable[[float], ir.Constant]
) -> ir.Value:
    total: ir.Value = constant(terms[-1])
    for term in reversed(terms[:-1]):
        total = b.fadd(b.fmul(total, z), constant(term))
    return total


def _sine_sum(b: ir.IRBuilder, r: ir.Value, constant: Callable[[float], ir.Constant]) -> ir.Value:
    z = b.fmul(r, r)
    return b.fadd(r, b.fmul(b.fmul(r, z), _horner(b, z, SINE_TERMS, constant)))


def _cosine_sum(b: ir.IRBuilder, r: ir.Value, constant: Callable[[float], ir.Constant]) -> ir.Value:
    z = b.fmul(r, r)
    half = b.fmul(constant(0.5), z)
    head = b.fsub(constant(1.0), half)
    lost = b.fsub(b.fsub(constant(1.0), head), half)
    tail = b.fmul(b.fmul(z, z), _horner(b, z, COSINE_TERMS, constant))
    return b.fadd(head, b.fadd(lost, tail))


def _float(payload: object) -> float:
    if payload == "pi":
        return 3.141592653589793
    if payload == "e":
        return 2.718281828459045
    assert isinstance(payload, Fraction)
    return payload.numerator / payload.denominator
