"""What is printed where the standard output is full, closed, or knows nothing but ASCII: no traceback."""

import os
import subprocess
import sys

import pytest
from tiny import tiny

COMMAND = [sys.executable, "-m", "pneumorph"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full here")
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_full(unbuffered):
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    with open("/dev/full", "w") as full:
        ended = subprocess.run(
            [*COMMAND, "--version"], stdout=full, stderr=subprocess.PIPE, text=True, env=environment, timeout=300
        )
    assert ended.returncode == 1
    assert ended.stderr == "pneumorph: standard output: cannot be written (No space left on device); make room\n"


def test_ascii(tmp_path):
    (tmp_path / "arm.toml").write_text(tiny(title='"Ärmel ≤ ½"'), encoding="utf-8")
    environment = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    ended = subprocess.run(
        [*COMMAND, "check", "--quick", str(tmp_path / "arm.toml")], capture_output=True, env=environment, timeout=300
    )
    assert ended.returncode == 0 and b"Traceback" not in ended.stderr
    assert b"\\xc4rmel \\u2264 \\xbd" in ended.stdout
