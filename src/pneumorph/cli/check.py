"""`pneumorph check`: describe a problem, measure a body against the limits, and test the gradient of its objective."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from pneumorph import atomic, compiling, doing
from pneumorph.analysis import AnalysedBody, analyse_body, collect_task_results, run_gradient_check
from pneumorph.cli.further import write_with_further
from pneumorph.cli.solid import found_in
from pneumorph.cli.trust import asking
from pneumorph.errors import ComputationError, Hopeless, ProblemError, printable, writing
from pneumorph.geometry import Body
from pneumorph.interface.design import Design, starting_design
from pneumorph.interface.runs import Run, open_run
from pneumorph.limits.kinds.states import beside
from pneumorph.limits.report import LimitReading, without_rounding
from pneumorph.limits.table import in_history
from pneumorph.mechanics import Rubber, breaking_loads, rubbers_of
from pneumorph.optimize.prospects import backwards, shortfalls
from pneumorph.optimize.setup import build_setup
from pneumorph.optimize.start import begin_within, begun_lower
from pneumorph.optimize.states import in_words, linear_states
from pneumorph.output.chambers import of_chambers
from pneumorph.output.format import format_pressures, part_note, warnings_of
from pneumorph.problem import Problem, Reinforcement, load, reinforcements, with_fewer_chambers
from pneumorph.problem.acting import words_of_gravity, words_of_own, words_of_plate
from pneumorph.problem.columns import adjusted_columns
from pneumorph.problem.doubts import doubts, unmoved
from pneumorph.problem.materials import materials
from pneumorph.problem.reinforcement import data_of
from pneumorph.problem.sources import told

BEGINS = "it is at its bound, and a design run begins just within it"


def check(
    problem: Path,
    quick: bool,
    trust: bool,
    fewer: Path | None = None,
    insert: Path | None = None,
    quiet: bool = False,
) -> None:
    """Check the problem of a file, on its starting body, or of a run, on its last design.

    Parameters
    ----------
    problem : Path
        The problem file, or the run directory.
    quick : bool
        Whether the test of the gradient is left out.
    trust : bool
        Whether code in the problem file is trusted.
    fewer, insert : Path or None
        Of a run, files to which its problem with fewer chambers is written, and with one more.
    quiet : bool
        Whether only what is wrong, and the verdict, is printed.

    Raises
    ------
    ProblemError
        If an option or the problem has a mistake.
    ComputationError
        If the gradient is not right to second order.
    """
    if quiet:
        compiling.announce(None)
        doing.announce(None)
    run = open_run(problem, asking(trust)) if problem.is_dir() else None
    asked = load(problem, asking(trust)) if run is None else run.problem
    for option, path in (("--fewer", fewer), ("--insert", insert)):
        if path is not None and run is None:
            raise ProblemError(f"{option}: is for a run, whose states tell what chambers do; give its directory")
        if path is not None and path.exists():
            raise ProblemError(f"{option} {path}: there is already a file of this name; give another name")
    console = Console()

    def conclude(text: str, style: str = "") -> None:
        console.print(Text(text, style=style), soft_wrap=True)

    def say(text: str, style: str = "") -> None:
        # What is wrong is red.
        if style or not quiet:
            conclude(text, style)

    design = starting_design(asked) if run is None or run.latest is None else run.best
    asked = design.problem
    with doing.doing("measuring the limits"):
        readings = design.limits
    if run is None and any(map(_violated, readings)):
        # Whether a run can begin at all; before anything that takes longer.
        begin_within(build_setup(asked))
    at = _analysed(asked, design.body, run is None)
    lower, asked = at.problem is not asked, at.problem
    for line, style in _description(at):
        say(line, style)
    if asked.solid is None:
        for sentence in adjusted_columns(asked.tubes):
            say(f"symmetry  {sentence}")
    for sentence in doubts(asked):
        say(f"warning   {sentence}", "red")
    if lower:
        say("warning   the start has no state at its pressures; a design run begins lower, as all below", "red")
    results = collect_task_results(at.disc, at.analysis)
    for task in asked.task:
        motion = task.objective.achieved(results[task.name])
        pressures = format_pressures(at.analysis.pressures[task.name])
        own = results[task.name]
        least = beside(asked, task, own)
        say(f"task      {task.name}: {motion.word} {motion.beside_target}{least} at {pressures}")
        for sentence in (*backwards(asked, task, own), *warnings_of(rubbers_of(asked), own)):
            say(f"warning   {task.name}: {sentence}", "red")
    violated = 0
    for reading in readings:
        # The certified bound holds for all points; the attained value is that of the worst sample.
        attained = without_rounding(reading.attained)
        at_bound = not reading.satisfied() and reading.touched()
        violated += _violated(reading)
        said = "" if reading.satisfied() else f"; {BEGINS if at_bound else 'violated'}"
        say(f"limit     {reading}, attained {attained:.3g}{said}", "" if reading.satisfied() or at_bound else "red")
    if run is not None:
        with doing.doing("finding what chambers do"):
            uses = design.chambers
        for sentence in of_chambers(uses):
            say(f"chambers  {sentence}")
        if fewer is not None:
            conclude(_write_fewer(run, design, fewer))
        if insert is not None:
            for line in write_with_further(run, design, insert):
                conclude(line)
    states = linear_states(asked, at.space, at.disc, at.analysis)
    values = states.values()
    for limit, key, bound in in_history(asked):
        value = values.get(key)
        if value is None:
            continue
        kept = limit.satisfied(value, bound)
        violated += not kept
        shown = f"{in_words(limit, value, bound)}, must be {limit.asked(bound)}"
        say(f"limit     {limit.word} is {shown}{'' if kept else '; violated'}", "" if kept else "red")
    if run is None and states.violated:
        setup = build_setup(asked)
        analysis = replace(at.analysis, phi=setup.space.start)
        shortfalls(setup, at.disc, analysis, linear_states(asked, setup.space, at.disc, analysis))
    if violated:
        limits = "1 limit is" if violated == 1 else f"{violated} limits are"
        say(f"{limits} violated by this body; a design run begins by bringing it within them.", "red")
    sound, still = "The problem is sound", unmoved(asked)
    if still:
        sound = f"Nothing moves in task {still[0]}, see the warning,"
    elif doubtful := [name for name, each in results.items() if each.self_intersecting or not each.stable]:
        sound = f"The start of task {doubtful[0]} is doubtful, see the warning,"
    if quick:
        conclude(f"{sound.rstrip(',')}; its gradient was not tested.")
        return
    with doing.doing("testing the gradient"):
        tested = run_gradient_check(at)
    if tested.elements < at.disc.model.elements:
        say(f"gradient  tested on a coarser mesh of {tested.elements} elements")
    for name in (*tested.tests, *tested.nothing):
        say(f"gradient  {tested.line(name)}", "" if name in tested.nothing or tested.is_right(name) else "red")
    if not tested.passed:
        raise ComputationError("the gradient is not right to second order; try a finer mesh")
    exact = "and its gradient is exact" if tested.tests else "but there is nothing to test its gradient on"
    conclude(f"{sound} {exact}.")


def _analysed(problem: Problem, body: Body, begins: bool) -> AnalysedBody:
    """A body with its states; that of a start at the lower pressures with which a run begins, where it must."""
    try:
        return analyse_body(problem, body)
    except Hopeless:
        lower = begun_lower(build_setup(problem)) if begins else None
        if lower is None:
            raise
        return analyse_body(lower, body)


def _write_fewer(run: Run, design: Design, path: Path) -> str:
    """Write a problem without what is not needed of the chambers of a run; what was done, as a line."""
    without = [name for name, use in design.chambers.items() if use.idle]
    shared = {name: use.same_as for name, use in design.chambers.items() if use.same_as}
    if not without and not shared:
        raise ProblemError("--fewer: every chamber has a use of its own; leave the option out")
    with writing(path):
        atomic.write_bytes(path, with_fewer_chambers(run.problem, without, shared).to_toml().encode())
    done = [f"without {', '.join(without)}"] if without else []
    done += [f"{name} on the supply of {first}" for name, first in shared.items()]
    return f"written   {path}: the problem {', '.join(done)}"


def _violated(reading: LimitReading) -> bool:
    """Whether a limit is violated by more than a start that is at its bound."""
    return not (reading.satisfied() or reading.touched())


def _section(tube: dict[str, Any]) -> str:
    """The cross-section in the table of a tube in words."""
    section, tapered = tube.get("section"), f" tapering to {tube['taper']:g} of it" if tube["taper"] != 1.0 else ""
    if section is None:
        return f"radius {tube['radius']}{tapered}"
    sizes = (
        f"{key.replace('_', ' ')} {value}"
        for key, value in section.items()
        if key not in ("kind", "points") and (key, value) != ("turn", "0 deg")
    )
    return f"section {section['kind']} ({', '.join(sizes)}){tapered}"


def _axis(body: dict[str, Any]) -> str:
    """The axis in the table of a body in words; none where it is straight."""
    arcs = [arc for arc in body.get("axis") or () if arc["bend"] != "0 deg"]
    bends = (f"{arc['bend']} towards {arc['towards']} over {arc['length']}" for arc in arcs)
    return f" along an axis that bends by {', '.join(bends)}" if arcs else ""


def _body(problem: Problem) -> Iterator[tuple[str, str]]:
    """What body it is, line by line, each with its style."""
    if problem.solid is not None:
        yield from found_in(problem.solid, problem.mesh.size)
        return
    body = problem.model_dump()["body"]
    along = "z" if body.get("axis") is None else "along the axis"
    dome = f", dome of {body['dome']['height']}" if body.get("dome") else ""
    chambers = "; ".join(
        f"{chamber['name']}, {_section(chamber)}, {along} from {chamber['span'][0]} to {chamber['span'][1]}"
        for chamber in body["chamber"]
    )
    yield f"body      length {body['length']}{_axis(body)}, {_section(body)}{dome}; chambers: {chambers}", ""


def _description(at: AnalysedBody) -> Iterator[tuple[str, str]]:
    yield f"problem   {printable(at.problem.title) or 'without a title'}", ""
    yield from _body(at.problem)
    for line in _numbers(at):
        yield line, ""


def _numbers(at: AnalysedBody) -> list[str]:
    problem, space = at.problem, at.space
    table, model = problem.model_dump(), at.disc.model
    broken = breaking_loads(problem)
    chosen = ""
    if problem.mesh.element == "auto" and model.mixed:
        most = max(rubber.bulk_modulus / rubber.shear_modulus for rubber in model.rubbers.values())
        chosen = f" (bulk modulus {most:.3g} times the shear modulus)"
    # The space of tests has all pressures.
    own = [task for task in problem.task if task.pressures_of is None]
    free = sum(each.free and each.same_as is None for task in own for each in task.pressure.values())
    data = f", {len(space.free_data)} for sheets and fibres" if space.free_data else ""
    return [
        f"variables {space.n_shape} for the shape, {free} for pressures{data}",
        f"mesh      {model.elements} {model.element} tetrahedra{chosen}, {model.size} degrees of freedom"
        + part_note(model.part),
        *_rubbers(table, list(model.rubbers.values())),
        *(f"          {sentence}" for each in materials(problem).values() for sentence in told(each)),
        *(f"{each.name:9} {each.words}{_ranges(each)}" for each in reinforcements(problem)),
        f"tip       {', '.join([problem.end_effector.kind, *words_of_plate(problem.end_effector)])}",
        f"gravity   {words_of_gravity(problem.gravity)}",
        *(
            f"gas       {each['name']} is sealed at {each['gas']['pressure']}, exponent {each['gas']['exponent']:g}"
            for each in table["body"]["chamber"]
            if each.get("gas")
        ),
        *(f"loads     of task {task.name}: {words}" for task in problem.task if (words := words_of_own(task))),
        *(
            f"symmetry  about {plane} keeps the walls on both sides alike, but halves nothing that is solved: "
            f"the {' and '.join(keys)} breaks it"
            for plane, keys in broken.items()
        ),
    ]


def _ranges(each: Reinforcement) -> str:
    """Between what values a sheet or fibres are designed, to be appended to its words."""
    free = {key: datum for key, datum in data_of(each).items() if datum.free}
    bounds = ((key, *map(datum.quantity.write, (datum.min, datum.max))) for key, datum in free.items())
    return "".join(f"; {key} from {low} to {high} is designed" for key, low, high in bounds)


def _rubbers(table: dict[str, Any], rubbers: list[Rubber]) -> Iterator[str]:
    """A line for the rubber of the body, and one for that of every region, with where it is."""
    places = ["", *(f"; {_shape(region)}" for region in table["region"])]
    materials = [table["material"], *(region["material"] for region in table["region"])]
    words = ["rubber", *(region["name"] for region in table["region"])]
    for word, named, rubber, where in zip(words, materials, rubbers, places, strict=True):
        valid = rubber.valid_stretch
        reach = "range of stretch not stated" if valid is None else f"valid up to a stretch of {valid:.3g}"
        yield (
            f"{word:9} {named['name']}: {named['model']}, initial shear modulus {rubber.shear_modulus:.4g} MPa, "
            f"bulk modulus {named['bulk_modulus']}, {reach}{where}"
        )
        if named["source"]:
            yield f"          its constants: {printable(named['source'])}"


def _shape(region: dict[str, Any]) -> str:
    if sleeve := region.get("sleeve"):
        return f"{sleeve['thickness']} around {', '.join(sleeve['chambers'])}"
    if inside := region.get("inside"):
        return f"the solid at {', '.join(inside)}"
    if beyond := region.get("beyond"):
        return f"beyond z = {beyond}"
    if within := region.get("within"):
        return f"within {within[0]} to {within[1]}"
    layer = region["layer"]
    parts = [f"{layer['thickness']} under the exterior"]
    if layer.get("span"):
        parts.append(f"z from {layer['span'][0]} to {layer['span'][1]}")
    if layer.get("angles"):
        parts.append(f"from {layer['angles'][0]} to {layer['angles'][1]}")
    return ", ".join(parts)
