"""The JSON schema of the problem file, for editors; schema.json next to this module is part of the package.

Run ``python -m pneumorph.problem.schema`` to update it after the models have changed.
"""

import json
from pathlib import Path

from pneumorph.problem.whole import Problem

SHIPPED = Path(__file__).with_name("schema.json")


def json_schema() -> str:
    """The schema generated from the models, as the text of schema.json."""
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **Problem.model_json_schema()}
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    SHIPPED.write_text(json_schema(), encoding="utf-8")
