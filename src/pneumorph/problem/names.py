"""Names of chambers, tasks, regions and obstacles."""

from typing import Annotated

from pydantic import StringConstraints

MOST_OF_A_NAME = 64
"""Characters of a name: results and files are called by it, and file systems take 255 bytes with all that is added."""

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]+$", max_length=MOST_OF_A_NAME)]
