"""Values that show themselves: in a line, and in a notebook with a picture."""

import html
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np

LIMIT = 399  # characters of a line that shows an object
_PART = 60  # characters of a value in it
_FEW = 6  # numbers or items that are shown one by one
_PLAIN = (bool, int, float, str, tuple)
_NO_PICTURE = (ArithmeticError, ValueError, RuntimeError)  # of a set that cannot be drawn, or a step that is past


class Picture(NamedTuple):
    """What draws on some axes, and the size of the figure for it [inches]."""

    draw: Callable[[Any], Any]
    width: float = 4.2
    height: float = 3.2


class Shown:
    """Base of what shows itself; subclasses may say more in `__repr__`, and draw themselves in `_picture`."""

    __slots__ = ()

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        # In the class itself, where a dataclass leaves it alone.
        cls.__repr__ = cls.__repr__  # type: ignore[method-assign]

    def __repr__(self) -> str:
        name = type(self).__name__
        if not is_dataclass(self):
            return f"<{name}>"
        parts = [f"{f.name}={brief(getattr(self, f.name))}" for f in fields(self) if _is_told(self, f)]
        return in_a_line(f"{name}({', '.join(parts)})")

    def _picture(self) -> Picture | None:
        """What draws it, if there is anything to draw."""
        return None

    def _repr_html_(self) -> str:
        """For notebooks: the line, above the picture where there is one."""
        said = f"<pre>{html.escape(str(self))}</pre>"
        try:
            picture = self._picture()
            return said if picture is None else said + _image(picture, repr(self))
        except _NO_PICTURE:
            return said


def in_a_line(text: str, limit: int = LIMIT) -> str:
    """A text in one line that is no longer than that of an object may be; control characters are shown."""
    shown = "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in text)
    return shown if len(shown) <= limit else f"{shown[: limit - 4]}...{shown[-1]}"


def counted(sizes: Mapping[str, int]) -> str:
    """Numbers of things by the name of one; what there is none of is left out."""
    return ", ".join(f"{count} {name if count == 1 else _plural(name)}" for name, count in sizes.items() if count)


def _plural(name: str) -> str:
    return f"{name[:-1]}ies" if name.endswith("y") else f"{name}s"


def brief(value: Any) -> str:
    """A value within the line of an object: large ones by what they are."""
    if isinstance(value, np.ndarray):
        return _brief_array(value)
    if isinstance(value, Mapping):
        names = ", ".join(str(key) for key in value)
        return f"{{{names}}}" if len(names) <= _PART else f"{{{len(value)} entries}}"
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        inner = ", ".join(brief(item) for item in value[:_FEW])
        return f"({inner})" if len(value) <= _FEW and len(inner) <= _PART else f"({len(value)} items)"
    if callable(value) and not isinstance(value, type) and hasattr(value, "__name__"):
        return f"function {value.__name__}"
    text = repr(value)
    if len(text) <= _PART:
        return text
    return f"{text[:_PART]}..." if isinstance(value, str) else f"{type(value).__name__}(...)"


def _brief_array(array: Any) -> str:
    if array.size <= _FEW and array.ndim <= 1 and array.dtype.kind in "fiub":
        return str(array.tolist()) if array.dtype.kind != "f" else f"[{', '.join(f'{v:.6g}' for v in array.ravel())}]"
    return f"array {array.shape}"


def _is_told(item: Any, field: Any) -> bool:
    """Fields that are shown: what is private, or has its default, is not."""
    if not field.repr or field.name.startswith("_"):
        return False
    value = getattr(item, field.name, field.default)
    if field.default is MISSING:
        return True
    is_default = value is field.default or (isinstance(value, _PLAIN) and value == field.default)
    return not is_default


def _image(picture: Picture, said: str) -> str:
    """A picture as part of a page; no window and no global state of pyplot has to do with it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(picture.width, picture.height), layout="constrained")
    picture.draw(figure.add_subplot())
    content = BytesIO()
    figure.savefig(content, format="png", dpi=110, metadata={"Software": None})
    data = b64encode(content.getvalue()).decode()
    return f'<img alt="{html.escape(said)}" width="{96 * picture.width:.0f}" src="data:image/png;base64,{data}">'
