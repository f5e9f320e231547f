"""The text of a problem small and coarse enough to simulate in a second."""

from texts import problem_text

REST = """
[end_effector]
spring = { axial = "0 N/mm" }
[[task]]
name = "extend"
pressure = { A = "60 kPa" }
objective = { kind = "maximize", motion = "extension" }
[mesh]
size = "6 mm"
[optimizer]
iterations = 2
"""

TINY = problem_text(REST, body='control_density = "0.3 /mm"', head='title = "Tiny"')


def tiny(**changes: str) -> str:
    """The text with values put in place of others, by the key they follow: tiny(length='"34 mm"')."""
    lines = TINY.splitlines()
    for key, value in changes.items():
        places = [i for i, line in enumerate(lines) if line.startswith(f"{key} = ")]
        assert len(places) == 1, f"{key} stands in {len(places)} lines"
        lines[places[0]] = f"{key} = {value}"
    return "\n".join(lines) + "\n"
