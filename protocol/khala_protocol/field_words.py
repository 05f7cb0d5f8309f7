"""The sentence under each field of a class, read from its source when somebody asks for it.

pydantic reads them at import with `use_attribute_docstrings`: a sixth of the time that the host took to start. Only the
reference in the documentation and the schemas inside recordings need them.
"""

from __future__ import annotations

import ast
import inspect
import itertools
import textwrap


def field_words(model: type) -> dict[str, str]:
    """Return the docstring under each field of a class, inherited fields included; a field without one is left out."""
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if "__annotations__" in vars(base):
            found |= _own(base)
    return found


def _own(model: type) -> dict[str, str]:
    try:
        source = inspect.getsource(model)
    except (OSError, TypeError):  # made at run time, or installed without sources
        return {}
    (definition,) = (node for node in ast.parse(textwrap.dedent(source)).body if isinstance(node, ast.ClassDef))
    return {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in itertools.pairwise(definition.body)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant) and isinstance(text.value.value, str)
    }
