"""Trees of links: which joint comes after which, and how each places what it carries."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from polycorner import checks
from polycorner.bodies.chains import Chain, LinkStep, Pose, clean
from polycorner.bodies.frames import Frame
from polycorner.bodies.links import RobotJoint
from polycorner.checks import refuse
from polycorner.spaces.manifold import Array
from polycorner.values import Value, cached_property

WORLD = ""  # the carrier of what stands in space


@dataclass(frozen=True, eq=False)
class LinkTree(Value):
    """Links and the joints between them; each moving joint carries the links fixed to its child.

    Attributes
    ----------
    links : tuple of str
    joints : mapping from str to RobotJoint
    floats : bool
        Whether the base moves freely.
    loose : mapping from str to Frame
        What moves freely beside the links.
    """

    links: tuple[str, ...]
    joints: Mapping[str, RobotJoint]
    floats: bool
    loose: Mapping[str, Frame]

    def check(self) -> None:
        """Raise ValueError unless joints lead from one link to each other one in one way."""
        above: dict[str, str] = {}
        for name, joint in self.joints.items():
            about = f"joints: {name}"
            for role in ("parent", "child"):
                checks.names(f"{about}: {role}", [getattr(joint, role)], self.links)
            if joint.child in above:
                refuse(
                    about,
                    f"a child that no other joint has; {above[joint.child]!r} has it",
                    joint.child,
                )
            above[joint.child] = name
            if joint.follows is not None:
                other = self.joints.get(joint.follows[0])
                if other is None or not other.moves or other.follows is not None:
                    refuse(f"{about}: follows", "a joint that moves by itself", joint.follows[0])
        roots = [link for link in self.links if link not in above]
        if len(roots) != 1:
            expected = "joints that lead from one link, the base, to all others"
            refuse("joints", expected, roots or "a ring of links")
        if len(self.order) != len(self.joints):
            reached = {self.joints[name].child for name in self.order} | set(roots)
            refuse("joints", "no ring of links", sorted(set(self.links) - reached))

    @cached_property
    def root(self) -> str:
        """The base link."""
        children = {joint.child for joint in self.joints.values()}
        return next(link for link in self.links if link not in children)

    @cached_property
    def order(self) -> tuple[str, ...]:
        """The joints, each after those before it in the chain."""
        found: list[str] = []
        reached = [self.root]
        for link in reached:
            below = [name for name, joint in self.joints.items() if joint.parent == link]
            found += below
            reached += [self.joints[name].child for name in below]
        return tuple(found)

    @cached_property
    def rests(self) -> dict[str, tuple[str, Array, Array]]:
        """For each link its carrier, the first link that moves with it, and its place there."""
        start = self.root if self.floats else WORLD
        found = {self.root: (start, np.eye(3), np.zeros(3))}
        for name in self.order:
            joint = self.joints[name]
            if joint.moves:
                found[joint.child] = (joint.child, np.eye(3), np.zeros(3))
            else:
                carrier, matrix, origin = found[joint.parent]
                at = origin + matrix @ joint.origin
                found[joint.child] = (carrier, clean(matrix @ joint.turn), at)
        return found

    @cached_property
    def steps(self) -> dict[str, tuple[str, LinkStep]]:
        """For each carrier the one before it, and how it is placed there."""
        found: dict[str, tuple[str, LinkStep]] = {}
        if self.floats:
            found[self.root] = (WORLD, LinkStep("free", Frame.ROTATED.variables(self.root, 3)))
        for name in self.order:
            joint = self.joints[name]
            if not joint.moves:
                continue
            carrier, matrix, origin = self.rests[joint.parent]
            at, turn = origin + matrix @ joint.origin, clean(matrix @ joint.turn)
            other, rate, offset = joint.driven_by(name)
            step = LinkStep(
                "slide" if joint.kind == "prismatic" else "turn",
                (other,),
                tuple(at.tolist()),
                tuple(turn.ravel().tolist()),
                tuple(joint.axis.tolist()),
                rate,
                offset,
            )
            found[joint.child] = (carrier, step)
        for name, frame in self.loose.items():
            kind = "free" if frame is Frame.ROTATED else "shift"
            found[name] = (WORLD, LinkStep(kind, frame.variables(name, 3)))
        return found

    @cached_property
    def free(self) -> tuple[str, ...]:
        """The joints that are coordinates."""
        return tuple(
            name
            for name in self.joints
            if self.joints[name].moves and self.joints[name].follows is None
        )

    def path(self, carrier: str) -> list[str]:
        """Return the carriers from space to one of them."""
        found = []
        while carrier != WORLD:
            found.append(carrier)
            carrier = self.steps[carrier][0]
        return found[::-1]

    def chain(self, start: str, end: str) -> Chain:
        """Return how joints place one carrier in the axes of another."""
        one, two = self.path(start), self.path(end)
        shared = sum(1 for a, b in zip(one, two, strict=False) if a == b)
        back = [(self.steps[c][1], True) for c in reversed(one[shared:])]
        return Chain((*back, *((self.steps[c][1], False) for c in two[shared:])))

    def poses(self, values: Mapping[str, float]) -> dict[str, Pose]:
        """Return where the carriers are at values of the coordinates."""
        found: dict[str, Pose] = {WORLD: (np.eye(3), np.zeros(3))}
        for carrier, (before, step) in self.steps.items():
            matrix, origin = found[before]
            turned, at = step.pose(values)
            found[carrier] = matrix @ turned, origin + matrix @ at
        return found
