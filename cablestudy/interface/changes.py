"""What changes a file, as texts KEY=VALUE."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence

Changes = Mapping[str, object] | Sequence[str]
Source = str | os.PathLike[str] | Mapping[str, object]  # a file, or what it would say


def texts_of(changes: Changes | None) -> tuple[str, ...]:
    """Changes of a file as texts KEY=VALUE: of a dict of key -> value, or these texts themselves; a tuple of str."""
    if isinstance(changes, Mapping):
        return tuple(f"{key}={json.dumps(value, ensure_ascii=False)}" for key, value in changes.items())
    return tuple(changes or ())


def case_text(name: str | None) -> tuple[str, ...]:
    """The change of a scene that chooses a load case; none without a name."""
    return texts_of({} if name is None else {"case": name})
