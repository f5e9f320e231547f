"""Texts of problem files, one source for all tests: a body with its chambers, and what else a test is about."""

HEI_CAST = 'name = "Hei-Cast 8400"'

EXTEND = """\
[[task]]
name = "extend"
pressure = { A = "60 kPa" }
objective = { kind = "maximize", motion = "extension" }
"""

BEND_UNDER_LOADS = """
[end_effector]
spring = { axial = "0.5 N/mm" }
force = ["0.1 N", "0 N", "0 N"]
[gravity]
direction = [-1, 0, 0]
[[task]]
name = "bend"
pressure = { A = "12 kPa", B = "5 kPa" }
objective = { motion = "bending_y" }
"""
"""Of a body with the chambers of `TWO_BESIDE`."""

TWO_BESIDE = (("A", 3, "5 mm", "0 mm"), ("B", 3, "-5 mm", "0 mm"))


def problem_text(
    rest: str,
    length: float = 24,
    radius: float = 8,
    chambers: tuple = (("A", 4, "0 mm", "0 mm"),),
    body: str = "",
    material: str = HEI_CAST,
    head: str = "",
) -> str:
    """A tube in mm with chambers (name, radius, x, y) up to 3 mm from its ends; `rest` follows, `head` comes first."""
    lines = [head, "[material]", material, "[body]", f'length = "{length} mm"', f'radius = "{radius} mm"', body]
    for name, inner, x, y in chambers:
        lines += ["[[body.chamber]]", f'name = "{name}"', f'radius = "{inner} mm"', f'center = ["{x}", "{y}"]']
        lines += [f'span = ["3 mm", "{length - 3} mm"]']
    return "\n".join(line for line in lines if line) + "\n" + rest.lstrip("\n")
