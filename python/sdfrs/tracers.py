"""The tracers as settings: frozen dataclasses, checked when made; a name stands for the defaults.

What each one computes is in docs/ and in the papers named here.
`guards=False` follows the printed listing to the letter, faults included.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, ClassVar, Literal, Union

from . import _check
from ._errors import SceneError


class Tracer:
    """Base of the six tracers.

    Examples:
        >>> import sdfrs
        >>> isinstance(sdfrs.Basic(), sdfrs.Tracer)
        True
    """

    name: ClassVar[str]
    guards: bool

    def _guards(self) -> None:
        if not isinstance(self.guards, bool):
            raise TypeError(f"{self.name}: guards must be True or False, got {_check.show(self.guards)}")

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _parts(self) -> dict[str, Any]:
        """What the compiled module takes."""
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]


@dataclass(frozen=True)
class Basic(Tracer):
    """Plain sphere tracing: step by the distance. Hart 1996.

    Examples:
        >>> import sdfrs
        >>> sdfrs.Basic()
        Basic(guards=True)
    """

    guards: bool = True
    name: ClassVar[str] = "basic"

    def __post_init__(self) -> None:
        self._guards()


@dataclass(frozen=True)
class Relaxed(Tracer):
    """Steps of `omega` in [1, 2) times the distance, with a fallback. Keinert et al. 2014.

    Forms: "2023" falls back at the next iteration, "2018" (Balint and Valasek) retries inside it.

    Examples:
        >>> import sdfrs
        >>> sdfrs.Relaxed(omega=1.2, form="2018").omega
        1.2
        >>> sdfrs.Relaxed(omega=2.5)
        Traceback (most recent call last):
        ...
        sdfrs.SceneError: relaxed: omega must be in [1, 2), got 2.5
    """

    omega: float = 1.5
    form: Literal["2023", "2018"] = "2023"
    guards: bool = True
    name: ClassVar[str] = "relaxed"

    def __post_init__(self) -> None:
        self._set("omega", _check.ranged("relaxed: omega", self.omega, "in [1, 2)", lambda v: 1 <= v < 2))
        _check.choice("relaxed: form", self.form, ("2023", "2018"))
        self._guards()


@dataclass(frozen=True)
class Enhanced(Tracer):
    """Steps that assume a locally planar surface, weighted by `omega` in (0, 1]. Balint and Valasek 2018.

    Examples:
        >>> import sdfrs
        >>> sdfrs.Enhanced()
        Enhanced(omega=0.88, form='2023', guards=True)
    """

    omega: float = 0.88
    form: Literal["2023", "2018"] = "2023"
    guards: bool = True
    name: ClassVar[str] = "enhanced"

    def __post_init__(self) -> None:
        self._set("omega", _check.ranged("enhanced: omega", self.omega, "in (0, 1]", lambda v: 0 < v <= 1))
        _check.choice("enhanced: form", self.form, ("2023", "2018"))
        self._guards()


@dataclass(frozen=True)
class AutoRelaxed(Tracer):
    """Steps from a running average of the slope, `beta` in (0, 1) its weight. Ban and Valasek 2023.

    Examples:
        >>> import sdfrs
        >>> sdfrs.AutoRelaxed()
        AutoRelaxed(beta=0.3, guards=True)
    """

    beta: float = 0.3
    guards: bool = True
    name: ClassVar[str] = "auto_relaxed"

    def __post_init__(self) -> None:
        self._set("beta", _check.ranged("auto_relaxed: beta", self.beta, "in (0, 1)", lambda v: 0 < v < 1))
        self._guards()


@dataclass(frozen=True)
class BinarySearch(Tracer):
    """Halves the ray's range and drops what is proven empty. Quilez; "split" after Klenert.

    `max_level` (1 to 30) bounds the depth of the "stackless" form with `guards=False`; guarded, eps does.

    Examples:
        >>> import sdfrs
        >>> sdfrs.BinarySearch(form="split").form
        'split'
    """

    form: Literal["stackless", "stack", "split"] = "stackless"
    max_level: int = 18
    guards: bool = True
    name: ClassVar[str] = "binary_search"

    def __post_init__(self) -> None:
        _check.choice("binary_search: form", self.form, ("stackless", "stack", "split"))
        self._set("max_level", _check.integer("binary_search: max_level", self.max_level, 1, 30))
        self._guards()


@dataclass(frozen=True)
class CoverageSearch(Tracer):
    """Clears the ray by spans about its samples, nearest gap first.

    The printed listing never reports a hit, so `guards=False` is refused.

    Examples:
        >>> import sdfrs
        >>> sdfrs.CoverageSearch()
        CoverageSearch(guards=True)
    """

    guards: bool = True
    name: ClassVar[str] = "coverage_search"

    def __post_init__(self) -> None:
        self._guards()
        if not self.guards:
            raise SceneError(
                "coverage_search: guards=False is refused: the printed listing's end marker has sign 0, "
                "so its last test is never true and it never hits (allowed: guards=True)"
            )


TRACERS: dict[str, type[Tracer]] = {
    cls.name: cls for cls in (Basic, Relaxed, Enhanced, AutoRelaxed, BinarySearch, CoverageSearch)
}
TracerLike = Union[Tracer, Literal["basic", "relaxed", "enhanced", "auto_relaxed", "binary_search", "coverage_search"]]


def as_tracer(value: Any) -> Tracer:
    """A tracer, or the name of one."""
    if isinstance(value, Tracer) and type(value) is not Tracer:
        return value
    if isinstance(value, str):
        if value in TRACERS:
            return TRACERS[value]()
        raise SceneError(f"tracer must be one of {', '.join(map(repr, TRACERS))}, got {value!r}")
    raise TypeError(f"tracer must be a name or a tracer such as sdfrs.Basic(), got {_check.show(value)}")
