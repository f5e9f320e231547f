"""Programs that are started take no modules from the working directory, and end with whoever started them."""

import os
import signal
import subprocess
import sys

import pytest
from signals import HUNG, LINUX, ends

HOSTILE = ("multiprocessing", "pneumorph", "numpy", "pickle", "random", "distributed", "pyvista", "netgen")

STARTS = {
    "drawing": """
        from pneumorph.output.render import Drawing
        with Drawing([]) as drawing:
            drawing._process.wait(60)
    """,
    "moulds": """
        from pathlib import Path
        from pneumorph.make.mould.drawing import draw_mould
        draw_mould(Path(sys.argv[1]), Path(sys.argv[1]) / "none.png")
    """,
    "states": """
        from pathlib import Path
        from pneumorph.serve.solver import Solver
        from pneumorph.serve.worker import RequestedState
        solver = Solver()
        print(solver.ask(RequestedState(Path("none"), 0, 0, ())).converged)
        solver.close()
    """,
    "studies": """
        from pneumorph.study.cluster import connected
        with connected(None, 1) as client:
            print(client.submit(int, 3).result())
    """,
    "meshes": """
        from pneumorph.errors import MeshError
        from pneumorph.cad.netgen_process import call
        try:
            call("fill", [], [], 1.0)
        except MeshError:
            pass
    """,
}


def script(path, text):
    lines = [line.removeprefix("        ") for line in text.splitlines()]
    guarded = "\n".join(f"    {line}" for line in lines)
    path.write_text(f"import sys\nif __name__ == '__main__':\n{guarded}\n")
    return path


@pytest.mark.parametrize("kind", STARTS)
def test_modules_of_the_working_directory_are_not_executed(tmp_path, kind):
    folder = tmp_path / "hostile"
    folder.mkdir()
    for name in HOSTILE:
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text(f"open({str(tmp_path / 'mark')!r}, 'w').close()")
    program = script(tmp_path / "program.py", STARTS[kind])
    ended = subprocess.run(
        [sys.executable, str(program), str(folder)], cwd=folder, capture_output=True, text=True, timeout=HUNG
    )
    assert ended.returncode == 0, ended.stderr
    assert not (tmp_path / "mark").exists()


ENDLESS = {
    # Of a cube, 200 times as fine as it is wide: Netgen works for longer than any test.
    "meshes": """
        import numpy as np
        from pneumorph.cad import netgen_process
        points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
        print(netgen_process._process().pid, flush=True)
        netgen_process.call("fill", points, triangles, 0.005)
    """,
    "drawing": """
        import time
        from pneumorph.processes import program, python
        child = "from pneumorph.processes import end_with_input as end; end(); import time; time.sleep(1e6)"
        with program(python("-c", child)) as process:
            print(process.pid, flush=True)
            time.sleep(1e6)
    """,
}


@LINUX
@pytest.mark.parametrize("kind", ENDLESS)
def test_a_killed_program_leaves_none_behind(tmp_path, kind):
    program = subprocess.Popen(
        [sys.executable, str(script(tmp_path / "program.py", ENDLESS[kind]))], stdout=subprocess.PIPE
    )
    try:
        assert program.stdout is not None
        child = os.pidfd_open(int(program.stdout.readline()))
    finally:
        program.send_signal(signal.SIGKILL)
        program.communicate()
    assert ends(child)
