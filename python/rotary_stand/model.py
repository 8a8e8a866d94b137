"""Models of a drive: effects of the catalogue, parameters, expressions of the user's own."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from . import _convert, _native
from ._frames import needed
from ._native import Model as NativeModel
from .answers import EffectCatalogue


class Model:
    """A model of a drive, as a model file has it. Parameters are in the unit that their name ends with.

    ``model["cogging_N_m#2"]`` and, where the name is one of Python, ``model.inertia_kg_m2`` read and set a parameter. Invalid names, values and expressions raise
    :class:`~rotary_stand.ModelError` and leave the model as it was; comments and order of the file are kept.
    """

    __slots__ = ("_native",)
    _native: NativeModel

    def __init__(
        self,
        effects: Iterable[str] = (),
        *,
        input: str = "u_V",
        axis: str = "rotary",
        parameters: Mapping[str, float] | None = None,
        name: str = "model",
    ) -> None:
        """A new model with start values.

        ``effects``: effects of the catalogue (:func:`rotary_stand.effects`). ``input``: the column that drives it: ``u_V``, ``i_A``, ``torque_N_m``, ``theta_rad``
        (prescribed motion) or ``theta_cmd_rad`` (position servo). ``axis``: ``rotary`` or ``linear``. ``parameters``: values. ``name``: its name in messages.
        """
        if isinstance(effects, str):
            raise TypeError('effects must be a list of names, for example ["viscous", "coulomb"]')
        native = NativeModel.new(input, axis, name)
        for effect in effects:
            native.add(effect)
        object.__setattr__(self, "_native", native)
        self.update(parameters or {})

    @classmethod
    def _of(cls, native: NativeModel) -> Model:
        model = cls.__new__(cls)
        object.__setattr__(model, "_native", native)
        return model

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Model:
        """Reads a model file (.toml)."""
        return cls._of(NativeModel.read(_convert.path_of(path)))

    @classmethod
    def parse(cls, text: str, name: str = "model") -> Model:
        """Reads the text of a model file; ``name`` is its name in messages."""
        return cls._of(NativeModel.parse(text, name))

    def copy(self) -> Model:
        """The same model as another object."""
        return Model._of(self._native.clone())

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, Any]) -> Model:
        return self.copy()

    def __reduce__(self) -> tuple[Any, tuple[str, str]]:
        return Model.parse, (self.to_toml(), self.name)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the model file. An existing file is replaced."""
        self._native.write(_convert.path_of(path))

    def to_toml(self) -> str:
        """The text of the model file."""
        return self._native.to_toml()

    @property
    def data(self) -> dict[str, Any]:
        """The model as ``stand model show --json`` gives it."""
        data: dict[str, Any] = json.loads(self._native.json)
        return data

    @property
    def name(self) -> str:
        """Its name in messages: the file, or the name that was given."""
        return str(self.data["model"])

    @property
    def input(self) -> str:
        """The column that drives the model."""
        return str(self.data["input"])

    @property
    def axis(self) -> str:
        """``rotary`` or ``linear``."""
        return str(self.data["axis"])

    @property
    def effects(self) -> list[str]:
        """Names of its effects: those of the catalogue, then expressions."""
        return [*self.data["effects"], *(e["name"] if isinstance(e, dict) else e for e in self.data["expressions"])]

    @property
    def parameters(self) -> dict[str, float]:
        """Values by name: base parameters, then those of the effects. A copy; set them with ``model[name] = value``."""
        return {name: entry["value"] for name, entry in self.data["parameters"].items()}

    @property
    def fixed(self) -> set[str]:
        """Parameters that a fit does not change."""
        return {name for name, entry in self.data["parameters"].items() if entry["fixed"]}

    @property
    def remarks(self) -> list[str]:
        """Remarks: start values, effects without influence."""
        return list(self.data["remarks"])

    @property
    def columns(self) -> list[str]:
        """Columns of own names that a log must have for this model: pass them to ``Log.read(…, also=model.columns)``."""
        return self._native.columns

    def add(self, *effects: str) -> Model:
        """Adds effects of the catalogue; a second ``cogging`` becomes ``cogging#2``. Returns the model."""
        for effect in effects:
            self._native.add(effect)
        return self

    def add_expression(self, name: str, expression: str, *, adds_to: str = "torque_N_m", parameters: Mapping[str, float] | None = None) -> Model:
        """Adds an effect of the user's own, for example ``model.add_expression("seal", "-a*tanh(omega/b)", parameters={"a": 1e-4, "b": 1})``. Returns the model.

        ``adds_to``: ``torque_N_m``, ``dry_N_m`` (Coulomb friction), ``voltage_V``, ``omega_rad_s``, ``theta_rad`` or ``i_A``. ``parameters``: names and start values.
        The language of expressions: docs/logs-and-models.md.
        """
        self._native.add_expression(name, adds_to, expression, list((parameters or {}).items()))
        return self

    def remove(self, *effects: str) -> Model:
        """Removes effects with their parameters. Returns the model."""
        for effect in effects:
            self._native.remove(effect)
        return self

    def update(self, parameters: Mapping[str, float]) -> Model:
        """Sets parameters. Returns the model."""
        for parameter, value in parameters.items():
            self[parameter] = value
        return self

    def fix(self, *parameters: str) -> Model:
        """Fixes parameters at their values: a fit does not change them. Returns the model."""
        for parameter in parameters:
            self._native.fix(parameter, True)
        return self

    def free(self, *parameters: str) -> Model:
        """Frees parameters: a fit estimates them. Returns the model."""
        for parameter in parameters:
            self._native.fix(parameter, False)
        return self

    def __getitem__(self, parameter: str) -> float:
        return self.parameters[parameter]

    def __setitem__(self, parameter: str, value: float) -> None:
        self._native.set(parameter, float(value))

    def __contains__(self, parameter: object) -> bool:
        return parameter in self.parameters

    def __iter__(self) -> Iterator[str]:
        return iter(self.parameters)

    def __getattr__(self, name: str) -> float:
        if not name.startswith("_") and name in self:
            return self[name]
        raise AttributeError(f"the model has no parameter {name}; it has {', '.join(self.parameters)}" if not name.startswith("_") else name)

    def __setattr__(self, name: str, value: float) -> None:
        if name not in self:
            raise AttributeError(f"the model has no parameter {name}; it has {', '.join(self.parameters)}")
        self[name] = value

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in self.parameters if name.isidentifier())]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self.to_toml() == other.to_toml()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Model {self.name}: input {self.input}, effects {', '.join(self.effects) or 'none'}>"

    def __str__(self) -> str:
        return self._native.text

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{name}</td><td>{entry['value']:.6g}</td><td>{entry['unit']}</td><td>{'fixed' if entry['fixed'] else ''}</td><td>{entry['description']}</td></tr>"
            for name, entry in self.data["parameters"].items()
        )
        return f"<p>Input {self.input}, effects {', '.join(self.effects) or 'none'}</p><table>{rows}</table>"

    def to_frame(self) -> Any:
        """The parameters as a pandas DataFrame: name, value, unit, fixed, is_start, description."""
        return needed("pandas").DataFrame([{"name": name, **entry} for name, entry in self.data["parameters"].items()])


def effects(effect: str | None = None) -> EffectCatalogue:
    """The catalogue of physical effects, or the page of one effect (``stand effects``). ValueError for an unknown name."""
    return EffectCatalogue(_native.effects(effect))
