"""The JSON Schema of all messages and reply values; the types of the front end are generated from it."""

from __future__ import annotations

import json
from typing import Any, cast

from pydantic import TypeAdapter
from pydantic.json_schema import JsonSchemaMode

from armblocks.studio.protocol.envelope import Envelope, ServerMessage
from armblocks.studio.protocol.message import Request, messages_of, reply_type


def message_schema() -> dict[str, Any]:
    """Return one schema that defines every message, and the reply type of each request by its kind."""
    replies = {kind: reply_type(request) for kind, request in messages_of(Request).items()}
    inputs: list[tuple[str, JsonSchemaMode, TypeAdapter[Any]]] = [
        ("Envelope", "validation", TypeAdapter(Envelope)),
        ("ServerMessage", "serialization", TypeAdapter(ServerMessage)),
        *((kind, "serialization", TypeAdapter(reply)) for kind, reply in replies.items()),
    ]
    schemas, together = TypeAdapter.json_schemas(inputs)
    definitions: dict[str, Any] = together["$defs"]
    for definition in definitions.values():
        for name, member in definition.get("properties", {}).items():
            member.pop("title", None)  # a title would generate a separate type
            if "const" in member and name not in definition.setdefault("required", []):
                definition["required"].append(name)  # every message contains its kind
    members: dict[str, Any] = {
        "envelope": schemas["Envelope", "validation"],
        "server": schemas["ServerMessage", "serialization"],
        "replies": _object({kind: schemas[kind, "serialization"] for kind in replies}, "Replies"),
    }
    return _with_tuples({**_object(members, "Messages"), "$defs": definitions})


def _object(members: dict[str, Any], title: str) -> dict[str, Any]:
    return {
        "title": title,
        "type": "object",
        "properties": members,
        "required": list(members),
        "additionalProperties": False,
    }


def _with_tuples(schema: Any) -> Any:
    """Convert tuples to the form of JSON Schema before 2020, which the type generator supports."""
    match schema:
        case list():
            return [_with_tuples(value) for value in cast("list[Any]", schema)]
        case dict():
            members = {name: _with_tuples(value) for name, value in cast("dict[str, Any]", schema).items()}
            return {"items" if name == "prefixItems" else name: members[name] for name in members}
        case _:
            return schema


if __name__ == "__main__":
    print(json.dumps(message_schema(), indent=1))
