"""The analyses of the command ``stand`` as functions. Each releases the interpreter's lock; Ctrl-C ends it with KeyboardInterrupt.

Where an argument is a log, a path, a pandas or polars DataFrame, an Arrow table or a mapping of names to arrays will do; several logs are a list. Where it is a
model, a path or the text of a model file will do.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Union

from . import _convert, _native
from ._progress import Progress, reporting
from .answers import AllanDeviation, Calibration, Comparison, Drift, Explanation, Fit, ObserverBode, ObserverDesign, ObserverTrack, Simulation
from .log import Log
from .model import Model

#: What is accepted as a log, and as a model.
LogLike = Any
ModelLike = Union[Model, str, "os.PathLike[str]"]

#: Limit of the effort of a search, passes, as on the command line.
EFFORT_PASSES = 400_000


def _model(model: ModelLike) -> Model:
    if isinstance(model, Model):
        return model
    if isinstance(model, str) and "\n" in model:
        return Model.parse(model)
    if isinstance(model, (str, os.PathLike)):
        return Model.read(model)
    raise TypeError(f"a model must be a Model, a path or the text of a model file, not {type(model).__name__}")


def _log(log: LogLike, also: Sequence[str] = ()) -> _native.Log:
    if isinstance(log, Log):
        return log._native
    if isinstance(log, (str, os.PathLike)):
        return Log.read(log, also=tuple(also))._native
    return Log.of(log)._native


def _logs(logs: LogLike, also: Sequence[str] = ()) -> list[_native.Log]:
    if isinstance(logs, (list, tuple)):
        if not logs:
            raise ValueError("the list of logs is empty")
        return [_log(log, also) for log in logs]
    return [_log(logs, also)]


def _limit(time_limit_s: float | None) -> float | None:
    if time_limit_s is not None and not time_limit_s > 0:
        raise ValueError(f"time_limit_s {time_limit_s}: must be a positive number of seconds, or None")
    return time_limit_s


def _effort(effort: int | None) -> int | None:
    if effort is not None and not effort > 0:
        raise ValueError(f"effort {effort}: must be a positive number of passes, or None")
    return effort


def compare(log: LogLike, model: ModelLike, *, progress: Progress = False) -> Comparison:
    """Compares a model with a log or several; its parameters are kept, only the initial states are fitted.

    Raises LogError, ModelError, AnalysisError (the log lacks what the model needs), ImplausibleLogError (it is no record of a drive).
    """
    model = _model(model)
    with reporting(progress) as report:
        return Comparison(_native.compare(_logs(log, model.columns), model._native, False, False, None, report))


def simulate(model: ModelLike, log: LogLike, *, progress: Progress = False) -> Simulation:
    """Simulates a model along a log: modelled outputs, and their exact derivatives by each free parameter.

    The outputs are those that the log has measured; the initial states are fitted to them. Errors as of :func:`compare`.
    """
    model = _model(model)
    with reporting(progress) as report:
        return Simulation(_native.simulate(_logs(log, model.columns), model._native, report))


def fit(
    log: LogLike,
    model: ModelLike,
    *,
    all_rows: bool = False,
    time_limit_s: float | None = None,
    progress: Progress = False,
) -> Fit:
    """Fits the free parameters of a model to a log or several together, with standard uncertainties; the values of the model are the start.

    ``all_rows``: no blocks of rows are held out for validation. Errors as of :func:`compare`; AnalysisError after ``time_limit_s`` too.
    """
    model = _model(model)
    with reporting(progress) as report:
        return Fit(_native.compare(_logs(log, model.columns), model._native, True, all_rows, _limit(time_limit_s), report))


def explain(
    log: LogLike,
    model: ModelLike,
    *,
    effort: int | None = EFFORT_PASSES,
    state: str | None = None,
    time_limit_s: float | None = None,
    progress: Progress = False,
) -> Explanation:
    """Finds the physical effect that a model lacks in a log or in several together, with the evidence.

    ``effort``: rows simulated × (1 + derivatives), over the rows of the logs, after which the verdict is ``not-finished``; ``None``: no limit. ``state``: that of an
    answer which was not finished, :attr:`Explanation.state`, to go on from. ``time_limit_s``: a limit of time, s, with which the answer depends on the machine.
    Errors as of :func:`compare`; ValueError if the state is that of another model or log.
    """
    model = _model(model)
    with reporting(progress) as report:
        return Explanation(_native.explain(_logs(log, model.columns), model._native, _effort(effort), state, _limit(time_limit_s), report))


def allan(
    log: LogLike,
    column: str,
    *,
    from_s: float | None = None,
    to_s: float | None = None,
    taus: str = "octave",
    interpretation: str | None = None,
    units: str | None = None,
) -> AllanDeviation:
    """Noise coefficients of a sensor at rest by the Allan deviation of a column.

    ``from_s``, ``to_s``: the analysed range, s. ``taus``: ``octave``, ``decade`` or ``fine``. ``interpretation``: ``value`` or ``integral`` (an angle); default by the
    unit of the column. ``units``: as ``--units``. Of a path only this column is read. Raises LogError, AnalysisError (too few rows, a constant column).
    """
    if isinstance(log, (str, os.PathLike)):
        native, path = None, _convert.path_of(log)
    else:
        native = _log(log)
        path = native.path
    return AllanDeviation(_native.allan(native, path, column, from_s, to_s, taus, interpretation, units))


def drift(
    logs: LogLike,
    *,
    angle_gain_V_rad: float | None = None,
    torquer_gain_rad_s_A: float | None = None,
    pulse_s: float | None = None,
    angle_limit_V: float | None = None,
    latitude_deg: float | None = None,
    turn_error_rad: float | None = None,
    level_error_rad: float | None = None,
    gain_error: float | None = None,
    torquer_gain_error: float | None = None,
    latitude_error_rad: float | None = None,
    torquer_asymmetry: float | None = None,
    units: str | None = None,
) -> Drift:
    """Drift of a gyroscope from logs with ``angle_sensor_V`` and ``torquer_A`` under pulses of alternating sign (``stand drift compute``).

    Scales that are not given are taken from the notes of the log: K_k (V/rad), K_m/H (rad/s/A), duration of a pulse (s), end of the sensor's range (V), latitude
    (degrees). Standard uncertainties of the setup in rad, or as a ratio. Raises LogError, AnalysisError.
    """
    scales = {
        "angle_gain_V_rad": angle_gain_V_rad,
        "torquer_gain_rad_s_A": torquer_gain_rad_s_A,
        "pulse_s": pulse_s,
        "angle_limit_V": angle_limit_V,
        "latitude_deg": latitude_deg,
    }
    uncertainties = {
        "turn_error_rad": turn_error_rad,
        "level_error_rad": level_error_rad,
        "gain_error": gain_error,
        "torquer_gain_error": torquer_gain_error,
        "latitude_error_rad": latitude_error_rad,
        "torquer_asymmetry": torquer_asymmetry,
    }
    return Drift(_native.drift(_logs(logs, _native.DRIFT_COLUMNS), scales, uncertainties, units))


def drift_platform(log: LogLike, *, pulse_s: float | None = None, latitude_deg: float | None = None, units: str | None = None) -> Drift:
    """Bias and scale of a rate gyro from a log with ``theta_rad`` and ``gyro_rad_s``, the platform turning to and fro (``stand drift platform``).

    ``pulse_s``: time of the rotation in each direction, s. ``latitude_deg``: the Earth rate is subtracted. Raises LogError, AnalysisError.
    """
    return Drift(_native.drift_platform(_log(log), pulse_s, latitude_deg, units))


def calibrate(
    folder: str | os.PathLike[str],
    *,
    kind: str = "gyro",
    steps: str | os.PathLike[str] | None = None,
    known: str | None = None,
    units: str | None = None,
) -> Calibration:
    """The record of a calibration from the raw logs of a session in ``folder`` (``stand calibrate KIND --from FOLDER``).

    ``kind``: ``gyro``, ``accel`` or ``drive``. ``steps``: for logs of another program, the table of their steps (CSV). ``known``: the text of a TOML file of what is
    known of these logs. Raises LogError, AnalysisError (no session, a changed log, logs that give no calibration).
    """
    path = None if steps is None else _convert.path_of(steps)
    return Calibration(_native.calibrate(_convert.path_of(folder), kind, path, known, units))


def calibrate_simulated(
    folder: str | os.PathLike[str],
    *,
    kind: str = "gyro",
    seed: int = 1,
    session: str | None = None,
    serial: str | None = None,
    operator: str | None = None,
    units: str | None = None,
    progress: Progress = False,
) -> Calibration:
    """Runs a calibration session on the simulated stand in virtual time and returns its record (``stand calibrate KIND``).

    ``folder``: raw logs and journal. ``seed``: of the simulated device and of all noise. ``session``: the text of a session file; default: the default session.
    Raises StandError, AnalysisError.
    """
    path = _convert.path_of(folder)
    with reporting(progress) as report:
        _native.calibrate_simulated(kind, path, seed, session, serial, operator, report)
    return calibrate(path, kind=kind, units=units)


def observer_design(
    element: str,
    *,
    omega_1_s: float | None = None,
    poles: str | None = None,
    kind: str | None = None,
    row: int | None = None,
    integral_gain: float | None = None,
    vibration_Hz: float | None = None,
    step_s: float = 1e-3,
) -> ObserverDesign:
    """Gains of a state observer of a gyrotheodolite (``stand observer design``).

    ``element``: a preset (``astatic-identifier``, ``astatic-identifier-recovered``, ``rate-observer``) or a .toml file. ``omega_1_s``: all poles at −omega, 1/s; or
    ``poles``: ``"-50,-40+30i,…"``. ``kind``: ``static``, ``integral`` or ``augmented``. ``step_s``: step of the discrete form, s. Raises AnalysisError, ValueError.
    """
    return ObserverDesign(_native.observer_design(element, step_s, (omega_1_s, poles, kind, row, integral_gain, vibration_Hz)))


def observer_bode(element: str, *, kind: str = "static", omega_1_s: Sequence[float] = (), vibration_Hz: float | None = None) -> ObserverBode:
    """Frequency responses of an element and of observers with all poles at −omega (``stand observer bode``). Raises AnalysisError, ValueError."""
    return ObserverBode(_native.observer_bode(element, kind, list(omega_1_s), vibration_Hz))


def observer_track(
    log: LogLike,
    element: str = "astatic-identifier-recovered",
    *,
    omega_1_s: float | None = None,
    poles: str | None = None,
    kind: str | None = None,
    row: int | None = None,
    integral_gain: float | None = None,
    angle_gain_V_rad: float | None = None,
    torquer_N_m_A: float | None = None,
) -> ObserverTrack:
    """Runs an observer over a log with ``angle_sensor_V`` or ``alpha_rad``: states and learnt moment (``stand observer track``).

    Columns with the names of the states and ``moment_N_m`` are the truth. Raises LogError, AnalysisError, ValueError.
    """
    design = (omega_1_s, poles, kind, row, integral_gain, None)
    return ObserverTrack(_native.observer_track(_log(log, _native.OBSERVER_COLUMNS), element, design, angle_gain_V_rad, torquer_N_m_A))


def simulated_log(
    path: str | os.PathLike[str],
    *,
    profile: str = "multi-step",
    mode: str = "rate",
    seconds: float = 30.0,
    seed: int = 1,
    hidden: str | int | None = None,
    stand: str | None = None,
    parameters: Mapping[str, float] | None = None,
    progress: Progress = False,
) -> Log:
    """A log of the simulated stand with its firmware, in virtual time, written to ``path`` (.csv or .parquet) (``stand sim``).

    ``profile``: ``multi-step``, ``staircase``, ``prbs``, … with ``parameters`` by their names in the firmware (``amplitude``, ``dwell_s``, …). ``mode``: the profile is
    a ``rate`` setpoint (rad/s) or a ``voltage`` (V). ``hidden``: an effect of the catalogue that is added to the stand, or a seed that draws one. ``stand``: the text
    of a description of the stand (TOML). One seed gives one log. Raises ValueError, LogError, StandError.
    """
    target = _convert.path_of(path)
    effect = None if hidden is None else str(hidden)
    with reporting(progress) as report:
        _native.simulated_log(target, profile, mode, list((parameters or {}).items()), seconds, seed, effect, stand, report)
    return Log.read(target)
