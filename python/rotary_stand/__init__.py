"""Identification of drives, calibration of sensors, and the rotary stand, from Python.

>>> import rotary_stand as rs
>>> answer = rs.explain(frame, "drive.toml")     # frame: a pandas DataFrame with t_s, u_V, omega_rad_s
>>> answer.verdict, answer.missing
('effect-found', ['cogging'])

The package is a binding of the library of the command ``stand``; every answer is the one that the command gives. Documentation: docs/python.md.
"""

from . import fleet
from ._native import __version__
from .analyses import (
    allan,
    calibrate,
    calibrate_simulated,
    compare,
    drift,
    drift_platform,
    explain,
    fit,
    observer_bode,
    observer_design,
    observer_track,
    simulate,
    simulated_log,
)
from .answers import (
    AllanDeviation,
    Answer,
    Calibration,
    Candidate,
    Comparison,
    Drift,
    EffectCatalogue,
    Estimate,
    Explanation,
    Fit,
    FleetReport,
    FleetTable,
    Inspection,
    Misfit,
    ObserverBode,
    ObserverDesign,
    ObserverTrack,
    Output,
    Simulation,
)
from .errors import AnalysisError, ImplausibleLogError, LogError, ModelError, RotaryStandError, StandError
from .log import Log, inspect
from .model import Model, effects
from .stand import Stand

__all__ = [
    "AllanDeviation",
    "AnalysisError",
    "Answer",
    "Calibration",
    "Candidate",
    "Comparison",
    "Drift",
    "EffectCatalogue",
    "Estimate",
    "Explanation",
    "Fit",
    "FleetReport",
    "FleetTable",
    "ImplausibleLogError",
    "Inspection",
    "Log",
    "LogError",
    "Misfit",
    "Model",
    "ModelError",
    "ObserverBode",
    "ObserverDesign",
    "ObserverTrack",
    "Output",
    "RotaryStandError",
    "Simulation",
    "Stand",
    "StandError",
    "__version__",
    "allan",
    "calibrate",
    "calibrate_simulated",
    "compare",
    "drift",
    "drift_platform",
    "effects",
    "explain",
    "fit",
    "fleet",
    "inspect",
    "observer_bode",
    "observer_design",
    "observer_track",
    "simulate",
    "simulated_log",
]
