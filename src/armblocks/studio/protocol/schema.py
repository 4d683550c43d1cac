"""The JSON Schema of all messages, from which the page's TypeScript types are made."""

from __future__ import annotations

import json
from typing import Any

from pydantic.json_schema import models_json_schema

from armblocks.studio.protocol.messages import Envelope, ServerMessage


def message_schema() -> dict[str, Any]:
    """One schema with a definition for every message."""
    _, schema = models_json_schema([(Envelope, "validation"), (ServerMessage, "serialization")])
    definitions = schema["$defs"]
    for definition in definitions.values():
        for name, member in definition.get("properties", {}).items():
            member.pop("title", None)  # it would become a type of its own
            if "const" in member and name not in definition.setdefault("required", []):
                definition["required"].append(name)  # what tells the messages apart is always there
    return {
        "title": "Messages",
        "type": "object",
        "properties": {
            "envelope": {"$ref": "#/$defs/Envelope"},
            "server": {"$ref": "#/$defs/ServerMessage"},
        },
        "required": ["envelope", "server"],
        "additionalProperties": False,
        "$defs": definitions,
    }


if __name__ == "__main__":
    print(json.dumps(message_schema(), indent=1))
