"""The JSON schema of the problem file, for editors; shipped beside this module as schema.json.

``python -m pneumorph.problem.schema`` writes it again after a change of the models.
"""

import json
from pathlib import Path

from pneumorph.problem.whole import Problem

SHIPPED = Path(__file__).with_name("schema.json")


def json_schema() -> str:
    """The schema that the models generate, as it stands in the shipped file."""
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **Problem.model_json_schema()}
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    SHIPPED.write_text(json_schema(), encoding="utf-8")
