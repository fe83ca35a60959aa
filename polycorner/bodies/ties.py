"""Joints and drives between bodies of repeated kinds, as ties of two bodies.

Bodies are named as in messages, ``"small 3"``; the only body of its kind also by the name of the
kind.  Formulas are those of listed bodies, for two bodies that are called after their kinds with 1
and 2, as in contacts; joints that are alike have one formula.
"""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from polycorner import checks
from polycorner.bodies.constraints import counts_turns, has_coordinate, orients
from polycorner.bodies.drives import Damper, Drive, Motor, Prescribed, driven
from polycorner.bodies.dynamics import renamed
from polycorner.bodies.frames import Frame
from polycorner.bodies.joints import WORLD, AnyJoint, Gear, Joint
from polycorner.bodies.laws import Coefficient, Meeting
from polycorner.bodies.mechanisms import Mechanism, check_joints
from polycorner.bodies.poses import Placement
from polycorner.bodies.shapes import Body
from polycorner.checks import about, refuse
from polycorner.motion.contacts import PAIR
from polycorner.motion.ties import Tie

if TYPE_CHECKING:
    import sympy

TURNED = "turn"  # the end of the name of the equation of a gear


def names_of(kinds: Sequence[Placement], count: Mapping[str, int]) -> dict[str, tuple[int, str]]:
    """Return the number of each body and its kind, by the names of the bodies."""
    found: dict[str, tuple[int, str]] = {}
    for p in kinds:
        n, first = count[p.name], len({number for number, _ in found.values()})
        # Numbers of bodies that have no names are their names.
        label = "" if p.name.isdigit() and len(kinds) == 1 else f"{p.name} "
        found |= {f"{label}{k + 1}": (first + k, p.name) for k in range(n)}
        if n == 1:
            found[p.name] = first, p.name
    return found


@dataclass(eq=False)
class Tied:
    """Joints and drives of bodies of repeated kinds.

    Attributes
    ----------
    kinds : mapping from str to Placement
        A body of each kind, by its name.
    bodies : mapping from str to (int, str)
        Number and kind of each body, by its names.
    fixed : mapping from str to Body
    joints : mapping from str to Joint or Gear
    periods : tuple of float
        Of the box, ``inf`` in directions without.
    """

    kinds: Mapping[str, Placement]
    bodies: Mapping[str, tuple[int, str]]
    fixed: Mapping[str, Body]
    joints: Mapping[str, AnyJoint]
    periods: tuple[float, ...]

    def __post_init__(self) -> None:
        self._known: dict[Hashable, dict[str, Any]] = {}
        every = {name: self.kinds[kind].body for name, (_, kind) in self.bodies.items()}
        check_joints(self.joints, every, self.fixed)
        for name, joint in self.joints.items():
            for one in joint.bodies:
                p = self.kinds[self.bodies[one][1]] if one in self.bodies else None
                bare = p is not None and p.frame in {Frame.SHIFTED, Frame.AXIAL}
                if p is not None and bare and orients(joint, one, p.body):
                    expected = f"coordinates of all rotations of {p.name!r} (orientations='all')"
                    refuse("joints", f"{expected}, which {name!r} holds", one)

    def joint(self, name: str, rubs: Coefficient) -> Tie:
        """Return a joint with its limits and friction; these do not bounce."""
        joint = self.joints[name]
        used = joint.joints if isinstance(joint, Gear) else (name,)
        ends, told = self._formulas(used, joint, rubs, name)
        return Tie(ends, name, **told, collide=isinstance(joint, Gear) or joint.collide)

    def drive(self, name: str, drive: Any) -> Tie:
        """Return what drives two bodies, or one."""
        if not isinstance(drive, Drive):
            refuse("drive", "a Spring, Damper, Motor or Prescribed", drive, TypeError)
        used: tuple[str, ...] = ()
        if isinstance(drive, Damper) and drive.child is not None:
            checks.names("parent", [drive.parent], [WORLD, *self.fixed, *self.bodies])
            checks.names("child", [drive.child], self.bodies)
        else:
            of, argument = _joint_of(drive)
            able = [n for n, joint in self.joints.items() if has_coordinate(joint)]
            checks.names(argument, [of], able)
            used = (of,)
        ends, told = self._formulas(used, drive, 0.0, name)
        return Tie(ends, name, **told, collide=True)

    def _formulas(
        self, used: Sequence[str], what: AnyJoint | Drive, rubs: Coefficient, name: str
    ) -> tuple[tuple[int, ...], dict[str, Any]]:
        """Return the bodies of a tie, and its formulas, which are made once for all alike."""
        counted = [n for n in used if counts_turns(self.joints[n])]
        if counted and next(iter(self.kinds.values())).body.dimension == 3:
            expected = "limits less than a turn apart of joints between repeated bodies in space"
            refuse("limits", f"{expected}, whose placements count no turns, for {name!r}", counted)
        named = [one for n in used for one in self.joints[n].bodies]
        if isinstance(what, Damper) and what.child is not None:
            named += [what.parent, what.child]
        moving = list(dict.fromkeys(one for one in named if one in self.bodies))
        numbers = tuple(self.bodies[one][0] for one in moving)
        if len({*numbers}) < len(numbers) or len(numbers) > len(PAIR):
            expected = f"joints of one body or of two different ones for {name!r}"
            why = "repeated bodies are tied two by two, listed ones as you like"
            refuse("joints", f"{expected}: {why}", moving)
        kinds = [self.kinds[self.bodies[one][1]] for one in moving]
        pair = [
            replace(p, name=f"{p.name}{k}", manifold=renamed(p, f"{p.name}{k}"))
            for p, k in zip(kinds, PAIR, strict=False)
        ]
        called = {one: p.name for one, p in zip(moving, pair, strict=True)}
        local = {f"j{k}": _renamed(self.joints[n], called) for k, n in enumerate(used)}
        own = _renamed(what, called | dict(zip(used, local, strict=True)))
        key = *(p.name for p in pair), *map(_plain, local.values()), _plain(own), _plain(rubs)
        if key not in self._known:
            self._known[key] = self._made(pair, local, own, rubs)
        return numbers, self._known[key]

    def _made(
        self,
        pair: Sequence[Placement],
        local: Mapping[str, AnyJoint],
        what: AnyJoint | Drive,
        rubs: Coefficient,
    ) -> dict[str, Any]:
        """Return the formulas of a joint or drive as arguments of a tie."""
        import sympy

        joints = {**local, "gear": what} if isinstance(what, Gear) else local
        one = Mechanism(joints, tuple(pair), unwound=True, periods=self.periods)
        space = pair[0].manifold if len(pair) == 1 else pair[0].manifold * pair[1].manifold
        is_joint = isinstance(what, Joint | Gear)
        (_, potential, forces), friction, timed = driven(
            one,
            space,
            [WORLD, *self.fixed, *(p.name for p in pair)],
            (sympy.S.Zero, sympy.S.Zero, {}),
            {} if is_joint else {"drive": what},
            None,
            {"j0": rubs} if is_joint else {},
        )
        told = {"potential": potential, "forces": forces, "friction": friction}
        if isinstance(what, Gear):
            told |= {"equations": {TURNED: one.equations["gear"]}, "limits": {}}
        elif is_joint:
            told |= {"equations": _ends(one.equations), "limits": _ends(one.limits)}
        else:
            told["equations"] = timed
        return told


def _ends(found: "Mapping[str, sympy.Expr]") -> "dict[str, sympy.Expr]":
    """Return formulas by the ends of their names."""
    return {name.partition(".")[2]: formula for name, formula in found.items()}


def _joint_of(drive: Drive) -> tuple[str, str]:
    """Return the joint that a drive is at, and the argument that names it."""
    if isinstance(drive, Motor):
        return drive.joint, "joint"
    return (drive.of, "of") if isinstance(drive, Prescribed) else (drive.parent, "parent")


def _renamed(one: Any, called: Mapping[str, str]) -> Any:
    """Return a joint or drive of bodies and joints of other names."""
    given: dict[str, Any] = {
        field.name: called[value]
        for field in fields(one)
        if isinstance(value := getattr(one, field.name), str) and value in called
    }
    if isinstance(one, Gear):
        given["further"] = {called[name]: ratio for name, ratio in one.further.items()}
    return replace(one, **given)


def _plain(value: Any) -> Hashable:
    """Return what is equal for joints and drives that are alike."""
    if isinstance(value, Rotation):
        return _plain(value.as_quat())
    if isinstance(value, np.ndarray | tuple | list):
        return tuple(np.ravel(value).tolist())
    if isinstance(value, Mapping):
        return tuple(value.items())
    if isinstance(value, AnyJoint | Drive):
        told = tuple((field.name, _plain(getattr(value, field.name))) for field in fields(value))
        return type(value).__name__, told
    return value  # type: ignore[no-any-return] # a number, a name, a formula


def ties_of(
    tied: Tied,
    held: Iterable[str],
    drives: Mapping[str, Any],
    rubbing: Mapping[str, Coefficient],
) -> list[Tie]:
    """Return the ties of joints that are named, and of drives, after checking them.

    Parameters
    ----------
    tied : Tied
    held : iterable of str
        Joints that become ties.
    drives : mapping from str to Spring, Damper, Motor or Prescribed
    rubbing : mapping from str to float, or to (float, float)
        Bounds of the forces of friction in these joints.
    """
    found = []
    for name in held:
        with about(f"joints[{name!r}]"):
            found.append(tied.joint(name, rubbing.get(name, 0.0)))
    for name, drive in drives.items():
        with about(f"drives[{name!r}]"):
            found.append(tied.drive(name, drive))
    return found


def met(ties: Iterable[Tie]) -> list[Meeting]:
    """Return the limits of joints as contacts that have a restitution."""
    return [Meeting(f"{tie.name}.{end}", tie.name, tie.name) for tie in ties for end in tie.limits]


def bouncing(ties: Iterable[Tie], restitution: Mapping[str, float]) -> tuple[Tie, ...]:
    """Return ties with the restitution of their limits."""
    return tuple(
        replace(
            tie,
            restitution={end: restitution.get(f"{tie.name}.{end}", 0.0) for end in tie.limits},
        )
        for tie in ties
    )


def owned(joints: Mapping[str, AnyJoint], name: str, fixed: Iterable[str]) -> dict[str, AnyJoint]:
    """Return the joints that each body of a kind has with what does not move, and their gears."""
    around = {WORLD, *fixed, name}
    own = {n: j for n, j in joints.items() if isinstance(j, Joint) and {*j.bodies} <= around}
    gears = {n: j for n, j in joints.items() if isinstance(j, Gear) and own.keys() >= {*j.joints}}
    return own | gears


def refers(drive: Any) -> set[str]:
    """Return the names of the joint, the coordinate or the bodies that a drive is about."""
    if isinstance(drive, Damper) and drive.child is not None:
        return {drive.parent, drive.child}
    return {_joint_of(drive)[0]} if isinstance(drive, Drive) else set()
