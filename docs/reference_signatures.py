"""Signatures in the Python reference: short names of types, and the fields of dataclasses."""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

from sphinx.util.inspect import TypeAliasForwardRef

from armblocks.face import arm_functions
from armblocks.face.native_functions import NativeFunctions

SHORT = {
    r"NDArray\[np\.(float64|bool_)\]": "Array",
    r"NDArray\[np\.complex128\]": "ComplexArray",
    r"\b_Array\b": "Array",
    r"\bComplex\b": "ComplexArray",
    r"\bValues\b": "Mapping[str, ArrayLike]",
}
"""Regular expressions for type names in annotations, with the names that the reference shows."""
ALIASES = {"Array": "Array", "ArrayLike": "ArrayLike", "ComplexArray": "ComplexArray"}
"""Type aliases that the reference shows by name; its first page explains them."""


def shorten_annotations() -> None:
    """Replace the types of NumPy arrays by ``Array`` in the annotations of loaded armblocks modules."""
    TypeAliasForwardRef.__repr__ = lambda alias: (
        alias.name
    )  # Sphinx prints this inside Mapping[...]
    for function in _functions():
        for name, text in function.__annotations__.items():
            if isinstance(text, str):
                function.__annotations__[name] = short(text)


def short(annotation: str) -> str:
    """The annotation with the short names of types."""
    for pattern, name in SHORT.items():
        annotation = re.sub(pattern, name, annotation)
    return annotation


def _functions() -> Iterator[Callable[..., object]]:
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] == "armblocks":
            for value in list(vars(module).values()):
                members = vars(value).values() if inspect.isclass(value) else (value,)
                for member in members:
                    function = getattr(member, "fget", None) or getattr(
                        member, "func", None
                    )
                    function = function or getattr(member, "__func__", None) or member
                    if inspect.isfunction(function) and function.__module__.startswith(
                        "armblocks"
                    ):
                        yield function


def readable_signature(
    _app: object,
    kind: str,
    _name: str,
    value: Any,
    _options: object,
    *signature: str | None,
) -> tuple[str | None, ...]:
    """Signature of a class or function for the reference; that of a dataclass shows its fields.

    The signature of its ``__new__``, which checks names, accepts all arguments.
    """
    if kind == "class" and dataclasses.is_dataclass(value):
        return _fields(value), None
    # Defaults such as <the diagram's> are not Python; with them Sphinx would show the signature as one line.
    return tuple(text and re.sub(r"= <[^>]*>", "= ...", text) for text in signature)


def _fields(dataclass: Any) -> str:
    texts: list[str] = []
    for field in dataclasses.fields(dataclass):
        if field.init and not field.name.startswith("_"):
            text = f"{field.name}: {short(str(field.type))}"
            if field.default is not dataclasses.MISSING:
                text += f" = {_default(field.default)}"
            elif field.default_factory is not dataclasses.MISSING:
                text += " = ..."
            if field.kw_only and "*" not in texts:
                texts.append("*")
            texts.append(text)
    return f"({', '.join(texts)})"


def _default(value: object) -> str:
    """The default as Python code if it is short, else an ellipsis."""
    text = repr(value)
    return (
        text
        if len(text) <= 30 and not text.startswith("<") and "object at" not in text
        else "..."
    )


def arm_page() -> str:
    """The class Arm with the call signatures of its methods, which are created at their first access."""
    methods: dict[str, list[str]] = {}
    for name, member in vars(NativeFunctions).items():
        if isinstance(member, cached_property) and not name.startswith("_"):
            call = getattr(
                arm_functions, str(member.func.__annotations__["return"])
            ).__call__
            names = [
                part.replace(annotation=inspect.Parameter.empty)
                for part in _parameters(call)
            ]
            text = inspect.cleandoc(member.func.__doc__ or "")
            text = f"Returns {text.partition(' → ')[2]}"
            methods[name] = [
                f"   .. py:method:: {name}{inspect.Signature(names)}",
                "",
                *(f"      {line}".rstrip() for line in text.splitlines()),
                "",
            ]
    lines = ["```{eval-rst}", ".. currentmodule:: armblocks", "", ".. autoclass:: Arm"]
    lines += [f"   :exclude-members: {', '.join(methods)}", ""]
    for method in methods.values():
        lines += method
    return "\n".join([*lines, "```", ""])


def _parameters(call: Callable[..., object]) -> list[inspect.Parameter]:
    return [
        part
        for name, part in inspect.signature(call).parameters.items()
        if name != "self"
    ]
