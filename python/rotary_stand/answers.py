"""Answers of the analyses: typed views of the JSON of ``stand … --json`` (docs/json.md), with the text and the page of the command line.

Every answer has ``data`` (the JSON as dictionaries and lists), ``text``, ``html``, ``to_frame()`` (its main table as a pandas DataFrame) and ``plot()`` (a
matplotlib Figure). ``print(answer)`` shows the text; a notebook shows the page.
"""

from __future__ import annotations

import html
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from . import _native
from ._frames import needed

if TYPE_CHECKING:
    import os

    import pandas

    from .log import Log
    from .model import Model

#: Height of a page in a notebook, pixels.
_PAGE_HEIGHT = 640

T = TypeVar("T")


def _taken(kind: type[T], entry: Mapping[str, Any], **more: Any) -> T:
    """An object with the keys of a JSON entry that it has fields for."""
    names = {field.name for field in fields(kind)}  # type: ignore[arg-type]
    return kind(**{**{name: value for name, value in entry.items() if name in names}, **more})


@dataclass(frozen=True)
class Estimate:
    """An estimated parameter or quantity, in ``unit``. ``sigma``: standard uncertainty, None where it is not determined."""

    name: str
    value: float | None
    sigma: float | None = None
    unit: str = ""
    fixed: bool = False
    start: float | None = None
    at_bound: bool = False

    def __str__(self) -> str:
        sigma = "" if self.sigma is None else f" ± {self.sigma:.2g}"
        return f"{self.name} = {'none' if self.value is None else format(self.value, '.6g')}{sigma} {self.unit}".rstrip()


@dataclass(frozen=True)
class Output:
    """How well a model describes a column, in ``unit``. ``ratio``: rms over noise; 1 is noise only. ``fit_percent``: 100 is perfect."""

    name: str
    rms: float
    noise: float
    ratio: float
    fit_percent: float
    white: bool
    rows: int
    unit: str
    heldout_rms: float | None = None


@dataclass(frozen=True)
class Misfit:
    """A systematic residual: the fraction ``share`` of the variance of ``output`` depends on ``coordinate``."""

    output: str
    coordinate: str
    share: float
    p_value: float
    says: str


@dataclass(frozen=True)
class Candidate:
    """An effect that was tried. ``delta_bic``: evidence, negative is for it. ``fate``: what became of it; ``refused``: why."""

    effect: str
    parameters: dict[str, Estimate]
    delta_bic: float | None
    p_value: float | None
    ambiguous_with: list[str]
    fate: str
    refused: str | None
    strength: str | None


class Answer:
    """An answer of the library."""

    def __init__(self, native: _native.Answer) -> None:
        self._native = native
        #: The answer of ``--json``.
        self.data: dict[str, Any] = json.loads(native.json)

    @property
    def text(self) -> str:
        """The text that the command prints."""
        return self._native.text

    @property
    def html(self) -> str:
        """The page of ``--html``, a complete document; empty for an answer without one."""
        return self._native.html

    def save_html(self, path: str | os.PathLike[str]) -> None:
        """Writes the page into a file."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.html)

    @property
    def warnings(self) -> list[str]:
        """Warnings, one sentence each."""
        return list(self.data.get("warnings") or [])

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._summary()}>"

    def _summary(self) -> str:
        return next((line.strip() for line in self.text.splitlines() if line.strip()), "")

    def _repr_html_(self) -> str:
        if not self.html:
            return f"<pre>{html.escape(self.text)}</pre>"
        # The page has styles of its own, which must not reach the notebook.
        return f'<iframe srcdoc="{html.escape(self.html)}" width="100%" height="{_PAGE_HEIGHT}" frameborder="0" sandbox=""></iframe>'

    def to_frame(self) -> pandas.DataFrame:
        """The main table of the answer as a pandas DataFrame."""
        return _frame(self._rows())

    def _rows(self) -> list[dict[str, Any]]:
        return [{"quantity": name, "value": value} for name, value in self.data.items() if isinstance(value, (int, float, str, bool))]

    def plot(self, figure: Any = None) -> Any:
        """A matplotlib Figure of the answer; NotImplementedError where it has no curve."""
        raise NotImplementedError(f"{type(self).__name__} has no curve to plot; its page ({type(self).__name__}.html) may have figures")


def _frame(rows: list[dict[str, Any]]) -> pandas.DataFrame:
    frame: pandas.DataFrame = needed("pandas").DataFrame(rows)
    return frame


def _figure(figure: Any, height: float) -> Any:
    return figure or needed("matplotlib.pyplot", "matplotlib").figure(figsize=(8, height), layout="constrained")


def _estimates(entries: Mapping[str, Any]) -> dict[str, Estimate]:
    return {name: _taken(Estimate, entry, name=name) for name, entry in entries.items()}


class _WithSeries(Answer):
    """An answer with measured and modelled series."""

    @property
    def series(self) -> Log:
        """Rows in which every output is compared: ``t_s``, the input, each output and beside it ``…_model``; ``held_out`` is 1 in rows that a fit did not use."""
        from .log import Log

        series = self._native.series
        if series is None:
            raise AttributeError(f"{type(self).__name__} has no series")
        return Log(series)

    def plot(self, figure: Any = None) -> Any:
        """Measured and modelled outputs over time, and below each its residual. Returns the matplotlib Figure."""
        series = self.series
        modelled = [name for name in series.columns if name.endswith("_model")]
        figure = _figure(figure, 3.2 * len(modelled) + 0.4)
        axes = figure.subplots(2 * len(modelled), 1, sharex=True, squeeze=False, height_ratios=[2, 1] * len(modelled))[:, 0]
        for k, model in enumerate(modelled):
            name = model.removesuffix("_model")
            above, below = axes[2 * k], axes[2 * k + 1]
            above.plot(series["t_s"], series[name], linewidth=0.8, label="measured")
            above.plot(series["t_s"], series[model], linewidth=0.8, label="model")
            above.set_ylabel(name)
            above.legend(loc="upper right", fontsize="small")
            below.plot(series["t_s"], series[name] - series[model], linewidth=0.6, color="tab:red")
            below.set_ylabel("residual")
        axes[-1].set_xlabel("t_s")
        return figure


class Comparison(_WithSeries):
    """A model compared with a log (``stand compare``)."""

    @property
    def outputs(self) -> dict[str, Output]:
        """By column of the log."""
        return {name: _taken(Output, entry, name=name) for name, entry in self.data["outputs"].items()}

    @property
    def misfits(self) -> list[Misfit]:
        """Systematic residuals, the largest share first."""
        return [_taken(Misfit, entry) for entry in self.data["failures"]]

    @property
    def remarks(self) -> list[str]:
        """Remarks on how the comparison was done, one sentence each."""
        return list(self.data["remarks"])

    def _summary(self) -> str:
        return ", ".join(f"{output.name} {output.ratio:.3g} × noise" for output in self.outputs.values())

    def _rows(self) -> list[dict[str, Any]]:
        return [vars(output) for output in self.outputs.values()]


class Simulation(Comparison):
    """A model simulated along a log, with its sensitivities."""

    @property
    def parameters(self) -> list[str]:
        """The free parameters, by which there are sensitivities."""
        return list(dict.fromkeys(name.split("_d_", 1)[1] for name in self.series.columns if name.startswith("d_") and "_d_" in name))

    def sensitivity(self, output: str, parameter: str) -> npt.NDArray[np.float64]:
        """Derivative of an output by a parameter in every row of ``series``, shape (rows,), unit of the output per unit of the parameter. KeyError."""
        return self.series[f"d_{output}_d_{parameter}"]

    def to_frame(self) -> pandas.DataFrame:
        """The series with the sensitivities."""
        return self.series.to_pandas()


class Fit(Comparison):
    """A model fitted to a log (``stand fit``)."""

    @property
    def parameters(self) -> dict[str, Estimate]:
        """Fitted parameters by name."""
        return _estimates(self.data["parameters"])

    @property
    def not_identifiable(self) -> list[str]:
        """Parameters that this log does not determine."""
        return list(self.data["not_identifiable"])

    @property
    def converged(self) -> bool:
        """The fit reached its stopping criterion."""
        return bool(self.data["converged"])

    @property
    def sigma_is_lower_bound(self) -> bool:
        """The parameters may be off by more than ``sigma``: the model leaves more than noise, or ``sigma`` rests on an assumption about the voltage. A remark says which."""
        return bool(self.data["sigma_is_lower_bound"])

    @property
    def model(self) -> Model:
        """The model with the fitted values."""
        return _model(self)

    def _rows(self) -> list[dict[str, Any]]:
        return [vars(parameter) for parameter in self.parameters.values()]


class Explanation(_WithSeries):
    """The effect that a model lacks, with the evidence (``stand explain``)."""

    @property
    def verdict(self) -> str:
        """``adequate``, ``effect-found``, ``partly-explained``, ``unknown-structure`` or ``not-finished`` (docs/explaining.md)."""
        return str(self.data["verdict"])

    @property
    def state(self) -> str | None:
        """The state of a search that is ``not-finished``, for ``explain(…, state=…)``; None otherwise."""
        return self._native.state

    @property
    def missing(self) -> list[str]:
        """The missing effects, in the order in which they were added."""
        return list(self.data["missing"])

    @property
    def not_distinguishable(self) -> dict[str, list[str]]:
        """By missing effect: effects that this log does not distinguish from it."""
        return {name: list(others) for name, others in self.data["not_distinguishable"].items()}

    @property
    def says(self) -> str:
        """The verdict in words."""
        return str(self.data["says"])

    @property
    def candidates(self) -> list[Candidate]:
        """Every effect that was tried, the most probable first."""
        return [_taken(Candidate, entry, parameters=_estimates(entry["parameters"])) for entry in self.data["candidates"]]

    @property
    def parameters(self) -> dict[str, Estimate]:
        """Parameters of the last model."""
        return _estimates(self.data["parameters"])

    @property
    def steps(self) -> list[dict[str, Any]]:
        """The models of the search: ``effects``, ``added``, and by column ``rms``, ``ratio``, ``noise``."""
        return list(self.data["steps"])

    @property
    def next_experiment(self) -> str | None:
        """The command of an experiment that would decide what this log leaves open, or None."""
        following = self.data["next_experiment"]
        return None if following is None else str(following["command"])

    @property
    def model(self) -> Model:
        """The model with the missing effects and fitted values."""
        return _model(self)

    def _summary(self) -> str:
        return f"{self.verdict}{': ' if self.missing else ''}{', '.join(self.missing)}"

    def _rows(self) -> list[dict[str, Any]]:
        names = ("effect", "fate", "delta_bic", "p_value", "strength", "ambiguous_with", "refused")
        return [{name: entry[name] for name in names} for entry in self.data["candidates"]]


def _model(answer: Answer) -> Model:
    from .model import Model

    native = answer._native.model
    if native is None:
        raise AttributeError(f"{type(answer).__name__} has no model")
    return Model._of(native)


class Inspection(Answer):
    """What a file or table contains (``stand log inspect``)."""

    @property
    def questions(self) -> Any:
        """What must be stated before the data can be read as a log; None: nothing."""
        return self.data["open"]

    @property
    def columns(self) -> dict[str, str | None]:
        """By name in the data: the column of the project that it is believed to be."""
        return {entry["name"]: entry["is"] for entry in self.data["columns"]}

    def _rows(self) -> list[dict[str, Any]]:
        return list(self.data["columns"])


class AllanDeviation(Answer):
    """Noise of a sensor at rest by its Allan deviation (``stand allan``)."""

    @property
    def coefficients(self) -> dict[str, Estimate]:
        """Quantisation, white noise (angle random walk), bias instability, random walk and ramp in SI units; ``value`` is None where this record does not show one."""
        return _estimates(self.data["coefficients"])

    @property
    def quantities(self) -> dict[str, Estimate]:
        """The coefficients that this record shows, in the units of the answer."""
        return {entry["name"]: _taken(Estimate, entry) for entry in self.data["quantities"]}

    @property
    def tau_s(self) -> npt.NDArray[np.float64]:
        """Averaging times, s, shape (points,)."""
        return np.array(self.data["tau_s"], dtype=np.float64)

    @property
    def deviation(self) -> npt.NDArray[np.float64]:
        """Overlapping Allan deviation at ``tau_s`` in the unit of the column (of an angle: per second), shape (points,)."""
        return np.array(self.data["oadev"], dtype=np.float64)

    def _rows(self) -> list[dict[str, Any]]:
        names = ("tau_s", "oadev", "adev", "n", "degrees_of_freedom", "fitted")
        return [dict(zip(names, values)) for values in zip(*(self.data[name] for name in names))]

    def plot(self, figure: Any = None) -> Any:
        """The deviation over the averaging time, both logarithmic. Returns the matplotlib Figure."""
        figure = _figure(figure, 4.5)
        axis = figure.subplots()
        low, high = np.array(self.data["interval_68"], dtype=np.float64).T
        axis.fill_between(self.tau_s, low, high, alpha=0.25, label="68 % interval")
        axis.loglog(self.tau_s, self.deviation, marker="o", markersize=3, linewidth=1, label="measured")
        axis.loglog(self.tau_s, np.array(self.data["fitted"], dtype=np.float64), linestyle="--", linewidth=1, label="noise model")
        axis.legend()
        axis.set_xlabel("τ, s")
        axis.set_ylabel(f"Allan deviation of {self.data['column']}")
        axis.grid(visible=True, which="both", alpha=0.3)
        return figure


class _WithQuantities(Answer):
    """An answer with quantities and their uncertainties."""

    @property
    def quantities(self) -> dict[str, Estimate]:
        """By key of ``data``, which has degrees of freedom, coverage factors and budgets too; ``sigma`` is the standard uncertainty."""
        return {name: _taken(Estimate, entry, name=name) for name, entry in self.data.items() if isinstance(entry, dict) and "sigma" in entry}

    def _rows(self) -> list[dict[str, Any]]:
        return [{"name": q.name, "value": q.value, "sigma": q.sigma, "unit": q.unit} for q in self.quantities.values()]

    def plot(self, figure: Any = None) -> Any:
        """Relative standard uncertainty of each quantity, a bar each. Returns the matplotlib Figure."""
        known = [q for q in self.quantities.values() if q.value and q.sigma]
        figure = _figure(figure, 0.28 * len(known) + 1.2)
        axis = figure.subplots()
        axis.barh([q.name for q in known], [abs(q.sigma / q.value) for q in known])  # type: ignore[operator]
        axis.set_xscale("log")
        axis.invert_yaxis()
        axis.set_xlabel("relative standard uncertainty")
        return figure


class Drift(_WithQuantities):
    """Drift of a gyroscope, or bias and scale of a rate gyro on the platform (``stand drift``)."""

    @property
    def cycles(self) -> list[dict[str, Any]]:
        """The cycles that were evaluated."""
        return list(self.data["cycles"])


class Calibration(_WithQuantities):
    """The record of a calibration (``stand calibrate``)."""

    def budget(self, quantity: str) -> pandas.DataFrame:
        """The uncertainty budget of a quantity, one row for each contribution. KeyError."""
        return _frame(list(self.data[quantity]["budget"]))


class ObserverDesign(Answer):
    """Gains of a state observer (``stand observer design``)."""

    @property
    def gains(self) -> npt.NDArray[np.float64]:
        """Gains of the continuous observer, shape (states,)."""
        return np.array(self.data["gains"], dtype=np.float64)

    @property
    def poles(self) -> list[complex]:
        """Poles of the observer, 1/s."""
        return [complex(pole["re"], pole["im"]) for pole in self.data["poles"]]

    def _rows(self) -> list[dict[str, Any]]:
        return [{"row": k + 1, "gain": gain} for k, gain in enumerate(self.gains)]


class ObserverBode(Answer):
    """Frequency responses of an element and of observers (``stand observer bode``)."""

    @property
    def curves(self) -> dict[str, dict[str, npt.NDArray[np.float64]]]:
        """``element``, and each observer by its poles: ``rad_s``, ``gain_dB`` and ``phase_deg``, shape (points,) each."""
        named = {"element": self.data["object"]}
        named.update({f"observer, poles at -{entry['omega_rad_s']:g} 1/s": entry["curve"] for entry in self.data["observers"]})
        keys = ("rad_s", "gain_dB", "phase_deg")
        return {name: {key: np.array(curve[key], dtype=np.float64) for key in keys} for name, curve in named.items()}

    def _rows(self) -> list[dict[str, Any]]:
        return [{"curve": name, **dict(zip(curve, row))} for name, curve in self.curves.items() for row in zip(*curve.values())]

    def plot(self, figure: Any = None) -> Any:
        """Gain and phase over the frequency. Returns the matplotlib Figure."""
        figure = _figure(figure, 5.0)
        gain, phase = figure.subplots(2, 1, sharex=True)
        for name, curve in self.curves.items():
            gain.semilogx(curve["rad_s"], curve["gain_dB"], linewidth=1, label=name)
            phase.semilogx(curve["rad_s"], curve["phase_deg"], linewidth=1)
        gain.set_ylabel("gain, dB")
        gain.legend()
        phase.set_ylabel("phase, °")
        phase.set_xlabel("frequency, rad/s")
        return figure


class ObserverTrack(_WithSeries):
    """An observer run over a log (``stand observer track``); ``series`` are the estimates, and the truth where the log has it."""

    @property
    def states(self) -> list[dict[str, Any]]:
        """By state: ``name``, ``mean``, and where the log has the truth ``true_mean`` and ``rms_error``."""
        return list(self.data["states"])

    def _rows(self) -> list[dict[str, Any]]:
        return self.states

    def plot(self, figure: Any = None) -> Any:
        """The estimates over time. Returns the matplotlib Figure."""
        return self.series.plot(*(name for name in self.series.columns if name != "t_s"), figure=figure)


class FleetTable(Answer):
    """The computation of a table of many logs (``stand explain FOLDER --table``)."""

    @property
    def path(self) -> str:
        """The Parquet file."""
        return str(self.data["table"])

    @property
    def logs(self) -> int:
        """Number of logs."""
        return int(self.data["logs"])

    @property
    def computed(self) -> int:
        """Number of answers that this call has computed; the others were there already."""
        return int(self.data["computed"])

    @property
    def failed(self) -> int:
        """Number of logs without an explanation; the column ``error`` has the reasons."""
        return int(self.data["failed"])

    @property
    def verdicts(self) -> dict[str, int]:
        """Number of logs by verdict."""
        return dict(self.data["verdicts"])

    def _rows(self) -> list[dict[str, Any]]:
        return [{"verdict": verdict, "logs": count} for verdict, count in self.verdicts.items()]


class FleetReport(Answer):
    """Comparison of the stands of tables (``stand fleet report``)."""

    @property
    def parameter_changes(self) -> list[dict[str, Any]]:
        """Differences of parameters since the date, the most significant first."""
        return list(self.data["parameter_changes"])

    @property
    def finding_changes(self) -> list[dict[str, Any]]:
        """Effects and verdicts that are more frequent since the date."""
        return list(self.data["finding_changes"])

    @property
    def batch_effects(self) -> list[dict[str, Any]]:
        """Effects of batches against all other stands."""
        return list(self.data["batch_effects"])

    @property
    def outliers(self) -> list[dict[str, Any]]:
        """Stands that are outliers, with the parameter."""
        spreads = self.data["parameters"]
        return [{"parameter": spread["parameter"], **stand} for spread in spreads for stand in spread["stands"] if stand["significant"]]

    @property
    def limits(self) -> list[str]:
        """What the tables cannot show, in words."""
        return list(self.data["limits"])

    def _rows(self) -> list[dict[str, Any]]:
        return [
            {**change, "before": change["before"]["value"], "since": change["since"]["value"]} for change in self.parameter_changes
        ]


class EffectCatalogue(Answer):
    """The catalogue of effects, or one effect (``stand effects``)."""

    def _rows(self) -> list[dict[str, Any]]:
        return list(self.data.get("effects", [self.data]))
