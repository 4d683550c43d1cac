"""The JSON Schema of all messages and of the values in replies: the front end's types are made from it."""

from __future__ import annotations

import json
from typing import Any, cast

from pydantic import TypeAdapter
from pydantic.json_schema import JsonSchemaMode

from armblocks.studio.protocol.envelope import Envelope, ServerMessage
from armblocks.studio.protocol.message import Request, messages_of, reply_type


def message_schema() -> dict[str, Any]:
    """One schema with a definition of every message, and the reply type of every request by its kind."""
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
            member.pop("title", None)  # it would become a type of its own
            if "const" in member and name not in definition.setdefault("required", []):
                definition["required"].append(name)  # the discriminator of a message is required
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
    """The schema with tuples as JSON Schema wrote them before 2020: the generator of types knows these."""
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
