"""The missing effect of a drive, by this package and by three others, on the same logs: a table of what each named.

    STAND_DATA=FOLDER python python/benches/peers.py        # without STAND_DATA: own seeds only

Needs rotary_stand, pysindy, sysidentpy, scipy, pandas. The functions `*_names` are what a user writes; their lines are counted, with the functions that they call.
Each gets the log and the effects that the model has, and returns the effect that it misses: a set of names that its term does not distinguish, or nothing.
The set-ups of the peers were made on the own seeds and not on the cases. `docs/comparison.md` has the table and says what the set-ups leave out.
"""

from __future__ import annotations

import inspect
import json
import os
import platform
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

# The regressions are small: with threads of BLAS PySINDy takes eight times as long here.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pandas as pd

import rotary_stand as rs

warnings.filterwarnings("ignore")

Named = set[str]
MODEL = {
    "inertia_kg_m2": 2.2e-4,
    "motor_constant_N_m_A": 0.0234,
    "resistance_ohm": 2.32,
    "viscous_N_m_s": 1e-5,
    "coulomb_N_m": 8.6e-4,
    "inductance_H": 2.38e-4,
}
OWN = ["cogging", "stribeck", "quadratic-drag", "load", "unbalance", "torque-ripple", "cable-spring", "sensor-lag", "brush-drop", "encoder-eccentricity"]
NULL_SEEDS = range(101, 106)


# --- rotary_stand


def rotary_stand_names(frame: pd.DataFrame, model: rs.Model) -> Named:
    answer = rs.explain(frame, model)
    return {name for first in answer.missing[:1] for name in [first, *answer.not_distinguishable.get(first, [])]}


# --- what the three peers need: a library of terms, made by hand


ROWS = 20  # of a window, 20 ms


def smooth(x: np.ndarray) -> np.ndarray:
    """The weights with which a difference of window means sees its derivative; one value for each window."""
    weights = np.convolve(np.ones(ROWS), np.ones(2 * ROWS)) / (2 * ROWS**2)
    return np.apply_along_axis(np.convolve, 0, x, weights, "valid")[::ROWS]


def slope(x: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Differences of the means of windows that are one window apart: the weak form needs no derivative of noise."""
    mean = np.convolve(x, np.ones(ROWS) / ROWS, "valid")
    return ((mean[2 * ROWS :] - mean[: -2 * ROWS]) / (t[2 * ROWS] - t[0]))[::ROWS]


def prepared(frame: pd.DataFrame) -> dict[str, np.ndarray]:
    """The columns, the heat of the winding, and the slopes of rate, current and angle."""
    raw = {name: frame[name].to_numpy() for name in frame}
    # Angle and rate are readings at the time of a row, voltage and current are means of the interval after it: all are brought to its
    # middle.
    m = {name: (x[1:] + x[:-1]) / 2 if name in ("theta_rad", "omega_rad_s", "t_s") else x[:-1] for name, x in raw.items()}
    decay = np.exp(-m["t_s"] / 20)
    m["heat"] = np.cumsum(m["i_A"] ** 2 / decay) * decay
    for name, column in (("domega", "omega_rad_s"), ("di", "i_A"), ("dtheta", "theta_rad")):
        m[name] = slope(raw[column], raw["t_s"])
    # The rate has passed a low-pass of the sensor, where the notes state it.
    stated = dict(frame.attrs.get("notes", [])).get("omega_rad_s", "")
    m["lag_s"] = 1 / (2 * np.pi * float(stated.split("filter ")[1].split()[0])) if "filter " in stated else 0.0
    # Near rest dry friction holds, which no term of a sum describes.
    speed = abs(m["omega_rad_s"])
    m["moves"] = smooth((speed < 0.025 * speed.max()).astype(float)) == 0
    return m


def torque_terms(m: dict[str, np.ndarray]) -> dict[str, tuple[Named, np.ndarray]]:
    """Terms of the acceleration beside the current: name, the effects that have such a term, smoothed columns of shape (windows, k)."""
    w, th, i = m["omega_rad_s"], m["theta_rad"], m["i_A"]
    sign = np.tanh(w / 0.05)
    terms: dict[str, tuple[Named, list[np.ndarray]]] = {
        "viscous": ({"viscous"}, [w]),
        "coulomb": ({"coulomb"}, [sign]),
        "offset": ({"load", "asymmetric-friction"}, [np.ones_like(w)]),
        "w|w|": ({"quadratic-drag"}, [w * abs(w)]),
        "theta": ({"cable-spring"}, [th]),
        "w*heat": ({"viscous-temperature"}, [w * m["heat"]]),
        "sin theta": ({"unbalance"}, [np.sin(th), np.cos(th)]),
    }
    for v in (0.3, 1.0, 3.0):
        terms[f"stribeck {v}"] = ({"stribeck"}, [sign * np.exp(-abs(w) / v)])
    for n in range(2, 41):
        terms[f"sin {n} theta"] = ({"cogging"}, [np.sin(n * th), np.cos(n * th)])
    for n in range(1, 21):
        terms[f"i sin {n} theta"] = ({"torque-ripple"}, [i * np.sin(n * th), i * np.cos(n * th)])
    for k in range(1, 20):
        at = m["t_s"][len(w) * k // 20]
        terms[f"step {at:.1f}"] = ({"load-step", "timed-torque"}, [(m["t_s"] > at).astype(float)])
    return {name: (effects, smooth(np.column_stack(columns))[m["moves"]]) for name, (effects, columns) in terms.items()}


# --- PySINDy: sparse regression of the acceleration


def pysindy_names(frame: pd.DataFrame, model: rs.Model) -> Named:
    import pysindy as ps

    m = prepared(frame)
    terms = torque_terms(m)
    names = [name for name, (_, columns) in terms.items() for _ in range(columns.shape[1])]
    features = np.column_stack([smooth(m["i_A"])[m["moves"]], m["di"][m["moves"]], *(columns for _, columns in terms.values())])
    rate, slopes = smooth(m["omega_rad_s"])[m["moves"], None], m["domega"][m["moves"]]
    best, chosen = np.inf, {}
    for threshold in np.geomspace(0.01, 10, 13):
        sindy = ps.SINDy(optimizer=ps.STLSQ(threshold=threshold, normalize_columns=True), feature_library=ps.IdentityLibrary())
        sindy.fit(rate, t=0.001 * ROWS, x_dot=slopes[:, None], u=features)
        coefficients = sindy.coefficients()[0][1:]  # the first is that of the rate itself
        left = slopes - sindy.predict(rate, u=features)[:, 0]
        bic = len(left) * np.log(np.mean(left**2)) + np.count_nonzero(coefficients) * np.log(len(left))
        if bic < best:
            best = bic
            sizes = abs(coefficients[2:]) * features[:, 2:].std(axis=0)
            chosen = {name: max(size, 0.0) for name, size in zip(names, sizes) if size > 0}
    extra = {name: size for name, size in chosen.items() if not terms[name][0] & set(model.effects)}
    return terms[max(extra, key=extra.__getitem__)][0] if extra else set()


# --- SysIdentPy: NARX terms by forward regression (FROLS) and BIC


def sysidentpy_names(frame: pd.DataFrame, model: rs.Model) -> Named:
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    m = prepared(frame)
    terms = torque_terms(m)
    names = [name for name, (_, columns) in terms.items() for _ in range(columns.shape[1])]
    features = np.column_stack([smooth(m["i_A"])[m["moves"]], m["di"][m["moves"]], *(columns for _, columns in terms.values())])
    features = (features - features.mean(axis=0)) / np.maximum(features.std(axis=0), 1e-12)
    frols = FROLS(
        order_selection=True,
        n_info_values=8,
        ylag=1,
        xlag=[[1]] * features.shape[1],
        info_criteria="bic",
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=1),
    )
    frols.fit(X=features, y=smooth(m["omega_rad_s"])[m["moves"], None])
    inputs = [int(code) // 1000 - 2 for code in frols.final_model[:, 0] if code >= 2000]
    extra = [names[k - 2] for k in inputs if k > 1 and not terms[names[k - 2]][0] & set(model.effects)]
    return terms[extra[0]][0] if extra else set()


# --- SciPy: a grey box in three equations with an expert's library, forward selection by BIC


def scipy_names(frame: pd.DataFrame, model: rs.Model) -> Named:
    from scipy.linalg import lstsq
    from scipy.stats import f as f_distribution

    m = prepared(frame)
    w, i, th = m["omega_rad_s"], m["i_A"], m["theta_rad"]
    one = np.ones_like(w)
    electrical = {
        "inductance": ({"inductance"}, m["di"][:, None]),
        "brush": ({"brush-drop", "dead-time"}, smooth(np.tanh(i / 0.05)[:, None])),
        "i*heat": ({"resistance-temperature"}, smooth((i * m["heat"])[:, None])),
        "saturation": ({"magnetic-saturation"}, smooth(np.column_stack([i * abs(i), w * i**2]))),
        "offset": ({"current-offset"}, smooth(one[:, None])),
    }
    readings = {
        "lag": ({"sensor-lag", "time-skew"}, m["domega"][:, None]),
        "w^2": ({"rate-scale-nonlinearity"}, smooth(np.column_stack([w * abs(w), w**3]))),
        "w sin theta": ({"encoder-eccentricity"}, smooth(np.column_stack([w * np.sin(th), w * np.cos(th)]))),
        "offset": ({"rate-bias"}, smooth(one[:, None])),
    }
    equations = [
        (m["domega"][m["moves"]], [smooth(i)[m["moves"]], m["di"][m["moves"]]], torque_terms(m)),
        (smooth(m["u_V"]) if "u_V" in m else smooth(w), [smooth(i), smooth(w)], electrical if "u_V" in m else {}),
        (m["dtheta"] - m["lag_s"] * m["domega"], [smooth(w)], readings),
    ]
    best, found = 0.0, set()
    for target, base, candidates in equations:
        known = [columns for effects, columns in candidates.values() if effects & set(model.effects)]
        given = np.column_stack([*base, *known])
        left = np.sum((target - given @ lstsq(given, target)[0]) ** 2)
        for effects, columns in candidates.values():
            if effects & set(model.effects):
                continue
            wide = np.column_stack([given, columns])
            rest = np.sum((target - wide @ lstsq(wide, target)[0]) ** 2)
            k, n = columns.shape[1], len(target) / 3 - wide.shape[1]  # three neighbouring windows overlap
            statistic = (left - rest) / k / (rest / n)
            p = f_distribution.sf(statistic, k, n) * len(candidates)
            fraction = 1 - rest / left
            if p < 1e-6 and fraction > 0.02 and fraction > best:
                best, found = fraction, effects
    return found


PEERS: dict[str, tuple[str, Callable[[pd.DataFrame, rs.Model], Named], list[Callable[..., object]]]] = {
    "rotary_stand": ("rotary-stand", rotary_stand_names, []),
    "PySINDy": ("pysindy", pysindy_names, [smooth, slope, prepared, torque_terms]),
    "SysIdentPy": ("sysidentpy", sysidentpy_names, [smooth, slope, prepared, torque_terms]),
    "SciPy grey box": ("scipy", scipy_names, [smooth, slope, prepared, torque_terms]),
}


def lines(function: Callable[..., object]) -> int:
    """Lines of a function without blank lines, comments and its head."""
    source = [line.strip() for line in inspect.getsource(function).splitlines()[1:]]
    return sum(1 for line in source if line and not line.startswith(("#", '"""')))


def own_logs() -> list[tuple[str, pd.DataFrame, rs.Model, str | None]]:
    """Logs of the simulated stand: each hidden effect, and null seeds."""
    found = []
    model = rs.Model(["viscous", "coulomb", "inductance"], parameters=MODEL)
    with tempfile.TemporaryDirectory() as folder:
        for seed, hidden in [*enumerate(OWN, start=1), *((seed, None) for seed in NULL_SEEDS)]:
            log = rs.simulated_log(Path(folder) / "a.parquet", seconds=20, seed=seed, hidden=hidden)
            frame = log.to_pandas()[["t_s", "u_V", "i_A", "theta_rad", "omega_rad_s"]]
            found.append((f"{seed}-{hidden or 'none'}", frame, model, hidden))
    return found


def given_cases(data: Path) -> list[tuple[str, pd.DataFrame, rs.Model, str | None]]:
    """The logs of another simulator, each with at most one hidden effect; those outside the catalogue are left out."""
    found = []
    for folder in sorted((data / "cases").iterdir()):
        if not folder.is_dir():
            continue
        hidden = json.loads((folder / "truth.json").read_text())["hidden"]
        if "outside" in folder.name:
            continue
        log = rs.Log.read(folder / "log.parquet")
        frame = log.to_pandas()
        found.append((folder.name, frame, rs.Model.read(folder / "model.toml"), None if hidden in (None, "none") else hidden))
    return found


def emps(data: Path) -> tuple[pd.DataFrame, rs.Model]:
    """The training record of EMPS, with the rate that the peers need from the angle by a low-pass of 50 Hz."""
    from scipy.signal import butter, sosfiltfilt

    frame = rs.Log.read(data / "emps_train.csv").to_pandas()[["t_s", "torque_N_m", "theta_rad"]]
    smooth = sosfiltfilt(butter(4, 50, fs=1000, output="sos"), frame["theta_rad"])
    frame["omega_rad_s"] = np.gradient(smooth, frame["t_s"])
    model = rs.Model(["viscous", "coulomb"], input="torque_N_m", parameters={"inertia_kg_m2": 95.0, "viscous_N_m_s": 200.0, "coulomb_N_m": 20.0})
    return frame, model


def table(title: str, logs: list[tuple[str, pd.DataFrame, rs.Model, str | None]]) -> None:
    hidden = sum(1 for log in logs if log[3])
    print(f"\n{title}: {hidden} logs with a hidden effect, {len(logs) - hidden} without\n")
    print("| | named | named another | abstained | false on nulls | failed | seconds per log | lines to write |")
    print("|---|---|---|---|---|---|---|---|")
    for peer, (_, names, helpers) in PEERS.items():
        counts = dict.fromkeys(("named", "another", "abstained", "false", "failed"), 0)
        begin = time.perf_counter()
        details = []
        for log, frame, model, truth in logs:
            try:
                found = names(frame, model)
            except Exception as error:  # the table counts what a peer cannot do
                counts["failed"] += 1
                print(f"{peer}: {log}: {type(error).__name__}: {str(error)[:200]}", file=sys.stderr)
                continue
            if truth is None:
                counts["false"] += bool(found)
            else:
                counts["named" if truth in found else "another" if found else "abstained"] += 1
            details.append(f"{log}: {', '.join(sorted(found)) or '-'}")
        seconds = (time.perf_counter() - begin) / len(logs)
        count = sum(map(lines, [names, *helpers]))
        cells = (*(counts[name] for name in ("named", "another", "abstained", "false", "failed")), f"{seconds:.2f}", count)
        print(f"| {peer} | " + " | ".join(map(str, cells)) + " |", flush=True)
        print(f"{peer}: " + "; ".join(details), file=sys.stderr)


def main() -> None:
    print(f"Python {platform.python_version()}, {platform.machine()}, {os.cpu_count()} processors; " + ", ".join(
        f"{package} {version(package)}" for package, _, _ in PEERS.values()
    ))
    table("Own seeds", own_logs())
    data = os.environ.get("STAND_DATA")
    if not data:
        print("\nSTAND_DATA is not set: the given cases and EMPS are left out")
        return
    table("Given cases", given_cases(Path(data)))
    frame, model = emps(Path(data))
    print("\nEMPS, training record, beyond viscous and Coulomb friction (the authors: an offset, and an asymmetry of the friction)\n")
    for peer, (_, names, _) in PEERS.items():
        own = frame[["t_s", "torque_N_m", "theta_rad"]] if peer == "rotary_stand" else frame.rename(columns={"torque_N_m": "i_A"})
        begin = time.perf_counter()
        try:
            found = ", ".join(sorted(names(own, model))) or "nothing"
        except Exception as error:
            found = f"failed: {error}"
        print(f"- {peer}: {found} ({time.perf_counter() - begin:.1f} s)")


if __name__ == "__main__":
    main()
