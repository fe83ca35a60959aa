"""Calls with one argument replaced by a hostile value, and what is said of it."""

import dataclasses
import importlib
import inspect
import re
import signal
import traceback
import warnings
from contextlib import contextmanager
from pathlib import Path

from api_calls import CALLS, OTHERS, VALUES
from api_calls_dumbbells import DUMBBELLS
from hostile import HOSTILE, NEVER

import polycorner
from polycorner.errors import PolycornerError

RECIPES = CALLS | DUMBBELLS
ABSTRACT = "abstract; its subclasses are called"
CHECKED = "takes what the package has checked, where every microsecond counts"
ENUMERATION = "an enumeration"
ERROR = "an exception"
NOTHING = "takes no argument"
REASONS = {
    ABSTRACT: """ConvexSet ConvexSet.contains ConvexSet.covers ConvexSet.gauge ConvexSet.project
        ConvexSet.support ConvexSet.within MechanicalSystem MechanicalSystem.check_placement
        MechanicalSystem.largest_step MechanicalSystem.state""",
    CHECKED: """Arrangement.contacts Body.carried ContactFamily.compiled Cylinder.family
        Cylinder.numbers HalfSpace.family HalfSpace.numbers Manifold.canonical Manifold.image
        Manifold.moved System.sticks Manifold.onto Manifold.placed Part.moved Polyhedron.implicit_of
        Polyhedron.selections Polyhedron.signs_to_pieces Problem.check_energy
        Problem.check_parameters Problem.descend Problem.holds Problem.evaluate
        Problem.mask Problem.on_face Problem.restore Problem.stated
        Problem.with_independent_equations TorusDisks.distances UnevenFriction.numbers""",
    ENUMERATION: """BranchKind Completeness Consistency End Entrapment EventKind LocalType
        MeetingKind Mobility Status Verdict""",
    ERROR: "NonsmoothWarning PolycornerError PortTakenError SolverError SweepError",
    NOTHING: """dumbbells.plane_depth_formula dumbbells.plane_heading_formula
        motion.time_symbol""",
    "reads what described() or record() told": """CriticalSearch.restored OutOfRound.restored
        Shaking.restored UnevenFriction.restored Wobble.restored""",
    "runs until it is interrupted": "viewer.serve",
}
EXEMPT = {name: reason for reason, names in REASONS.items() for name in names.split()}
LEFT_OUT = ("polycorner/cli", "polycorner/models/wells")
OPEN = {
    ("Skeleton", "state"),  # what a search left to do, for resume alone
    ("Manifold.point", "argument"),  # the word by which an error calls the point
    ("Manifold.points", "argument"),
}
FUNCTIONS = {
    "parts": ("f1",),
    "equations": ("h1",),
    "expression": ("f", "quantity"),
    "expressions": ("f",),
    "budget": ("edges",),
    "points": ("q",),
    "names": ("periods", "rotations", "spheres"),  # as many of them as names
    "parameter": ("parameters",),
    "function": ("grid",),  # whose axes are its arguments
    "label": ("called",),
    "named": ("study",),
    "path": ("store", "read", "module"),  # a sentence about a file begins with its name
    "edges": ("budget",),
    "scale": ("path",),  # a mesh of which nothing is left
    "potential": ("V",),
    "kinetic": ("T",),
    "polyhedron": ("q", "load"),  # of another dimension than the other arguments
    "parameters": ("f",),  # the formula is named where a symbol has no value
}
PATHS = ("path", "folder", "store", "keep", "table")  # the system's own errors name files
SLOW = {
    name
    for name in RECIPES.keys() | VALUES.keys()
    if any(
        word in name
        for word in (
            *("pictures", "viewer", "studies", "tlas", "Map", "_map", "Disks", "Critical"),
            *("Pinball", "Packing", "plane_critical", "Film", "DrumView", "Surface", "Isosurface"),
            *("Descent", "RigidDumbbells", "stored", "open_results", "RestRegion.contains"),
        )
    )
}


class Hang(BaseException):
    """A call that takes too long."""


def packages():
    """Return the packages with public names, uppermost first."""
    root = Path(polycorner.__file__).parent
    folders = sorted(file.parent.relative_to(root.parent) for file in root.rglob("__init__.pyi"))
    # The functions of the first run inside a command; those of the second take minutes, or wells.
    folders = [f for f in folders if f.as_posix() not in LEFT_OUT]
    return [importlib.import_module(".".join(folder.parts)) for folder in folders]


def public():
    """Return everything that can be called, by a name: functions, classes, their methods."""
    found = {}
    for package in packages():
        for name in package.__all__:
            value = getattr(package, name)
            if any(value is known for known in found.values()):
                continue
            if inspect.isclass(value):
                found[name] = value
                found |= {f"{name}.{m}": value for m in methods(value)}
            elif callable(value):
                short = package.__name__.removeprefix("polycorner").removeprefix(".")
                short = (
                    short.removeprefix("dumbbells.")
                    if "studies" in short or "viewer" in short
                    else short
                )
                found[f"{short}.{name}" if short else name] = value
    return found


def methods(kind):
    """Return the names of public methods with arguments, declared in the package."""
    for name in dir(kind):
        member = inspect.getattr_static(kind, name)
        own = any(name in vars(b) and b.__module__.startswith("polycorner") for b in kind.__mro__)
        if (
            name.startswith("_")
            or not own
            or not (inspect.isfunction(member) or isinstance(member, classmethod | staticmethod))
        ):
            continue
        first = isinstance(member, classmethod | staticmethod)
        if len(inspect.signature(getattr(kind, name)).parameters) > (0 if first else 1):
            yield name


def target(name, value):
    """Return what is called and its valid arguments."""
    kind, _, method = name.partition(".")
    if inspect.isclass(value) and method:
        static = isinstance(inspect.getattr_static(value, method), classmethod | staticmethod)
        return getattr(value if static else OTHERS.get(name, VALUES[kind])(), method), RECIPES[
            name
        ]()
    if name in RECIPES:
        return value, RECIPES[name]()
    sample = VALUES[name]()
    return value, {f.name: getattr(sample, f.name) for f in dataclasses.fields(value) if f.init}


def arguments(function):
    return [
        p.name
        for p in inspect.signature(function).parameters.values()
        if p.kind is not p.VAR_KEYWORD
    ]


def call(function, given):
    """Call with arguments by name; several of one name one after the other."""
    parameters = inspect.signature(function).parameters.values()
    several = [given[p.name] for p in parameters if p.kind is p.VAR_POSITIONAL]
    named = {
        k: v
        for k, v in given.items()
        if not any(p.name == k and p.kind is p.VAR_POSITIONAL for p in parameters)
    }
    return function(*several, **named)


@contextmanager
def within(seconds):
    def stop(*_):
        raise Hang

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def outcome(name, value, argument, label, seconds=10.0):
    """Return what comes of a call: its class, and the details."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        function, given = target(name, value)
        if argument == "progress" and label in ("class", "lambda"):
            return "succeeded", ""  # functions that take what they like
        hostile = HOSTILE[label]()
        try:
            with within(seconds):
                call(function, given | {argument: hostile})
        except Hang:
            return "hangs", ""
        except (ValueError, TypeError, PolycornerError) as error:
            foreign = type(error).__module__ not in ("builtins",) and not isinstance(
                error, PolycornerError
            )
            named = re.search(rf"\b({'|'.join(names_of(argument))})\b", str(error))
            if foreign:
                return "foreign", where(error)
            return ("refused", "") if named else ("unnamed", where(error))
        except OSError as error:
            return ("refused", "") if argument in PATHS else ("foreign", where(error))
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            return "foreign", where(error)
    flag = isinstance(given.get(argument, default(function, argument)), bool)
    if flag and label == "True":
        return "succeeded", ""
    taken = label in NEVER or (flag and not isinstance(hostile, bool))
    return ("taken", "") if taken else ("succeeded", "")


def default(function, argument):
    return inspect.signature(function).parameters[argument].default


def where(error):
    ours = [f for f in traceback.extract_tb(error.__traceback__) if "/polycorner/" in f.filename]
    last = ours[-1] if ours else traceback.extract_tb(error.__traceback__)[-1]
    place = "/".join(Path(last.filename).parts[-2:])
    return f"{type(error).__name__}: {str(error)[:110]!r} {place}:{last.lineno}"


def names_of(argument):
    """Return the words that name an argument: a function is named by its own name as well."""
    return argument, *FUNCTIONS.get(argument, ())
