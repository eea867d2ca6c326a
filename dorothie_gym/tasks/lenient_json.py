"""JSON as people write it: a comma after the last element and line breaks inside strings are accepted."""

from __future__ import annotations

import json
import re
from typing import Any

from dorothie_gym.tasks.errors import StoryboardError

# A string is matched as a whole, so that a comma inside it is left alone.
_STRING_OR_LAST_COMMA = re.compile(r'"(?:\\.|[^"\\])*"|(?<=[^\s\[{,:])(\s*),(?=\s*[\]}])', re.DOTALL)


def read_json(text: str, source: str) -> Any:
    """Parses a text.

    Args:
        text: JSON, but for trailing commas and raw line breaks in strings.
        source: what the text is called in errors.

    Raises:
        StoryboardError: not JSON even so (with line and column), or an object gives one field twice.
    """

    def one_of_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        for key, value in pairs:
            if key in fields:
                raise StoryboardError(source, key, "this field is given twice in one object; keep one of them")
            fields[key] = value
        return fields

    # The comma becomes a space, so that positions in errors stay those of the file.
    strict = _STRING_OR_LAST_COMMA.sub(lambda match: match[0] if match[1] is None else f"{match[1]} ", text)
    try:
        return json.loads(strict, strict=False, object_pairs_hook=one_of_each)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise StoryboardError(source, place, f"not JSON: {error.msg}; correct the file there") from error
    except RecursionError as error:
        raise StoryboardError(source, "text", "not a template: brackets are nested too deeply") from error
